"""meshsdf.ray.distance_paint and legend: errors as colours, and the bar that explains them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf.errors import RayError, SpatialError
from meshsdf.mesh import Mesh
from meshsdf.mesh.primitives import box_mesh, icosphere
from meshsdf.ray import DistancePaint, color_map, frame, legend_width, render_mesh, with_legend

BOX = box_mesh((2.0, 2.0, 2.0))
PICTURE = np.zeros((240, 320, 4), np.float32)


def test_colours_are_those_of_the_exact_distances():
    paint = DistancePaint(BOX, largest=2.0, colors="magma")
    points = np.array([[1.5, 0, 0], [2, 0, 0], [0, 0, 0], [9, 0, 0]])
    colors = paint(points, np.zeros(4, np.int32))
    assert_array_equal(colors, color_map("magma")(np.array([0.25, 0.5, 0.5, 1.0])))
    assert paint.max_seen == pytest.approx(8)
    assert paint.mean_seen == pytest.approx((0.5 + 1 + 1 + 8) / 4)


def test_the_scale_ends_at_the_largest_distance_of_the_first_call():
    paint = DistancePaint(BOX)
    assert paint.largest is None
    paint(np.array([[1.5, 0, 0], [1.2, 0, 0]]), np.zeros(2, np.int32))
    assert paint.largest == paint.max_seen == pytest.approx(0.5, abs=1e-15)
    colors = paint(np.array([[3.0, 0, 0]]), np.zeros(1, np.int32))
    assert_array_equal(colors, color_map("magma_r")(np.array([1.0])))
    assert paint.largest == paint.max_seen == pytest.approx(0.5, abs=1e-15)


def test_a_ball_around_a_ball_is_as_far_as_their_radii_differ():
    inner, outer = icosphere(1.0, subdivisions=4), icosphere(1.1, subdivisions=4)
    paint = DistancePaint(inner)
    render_mesh(outer, frame(outer), width=160, height=120, paint=paint)
    # Both lie inside their spheres by at most 0.3 r / 4**4
    assert 0.1 - 0.0013 <= paint.mean_seen <= paint.max_seen <= 0.1 + 0.0012


def test_equal_meshes_have_the_colour_of_zero():
    paint = DistancePaint(BOX)
    render_mesh(BOX, frame(BOX), width=80, height=60, paint=paint)
    # Points of a face are rounded, so they lie beside it by an ulp of their coordinates
    assert paint.max_seen <= 4 * 2.0**-53
    nothing = DistancePaint(BOX)
    assert_array_equal(
        nothing(np.array([[1.0, 0, 0]]), np.zeros(1, np.int32)), color_map("magma_r")(np.zeros(1))
    )
    assert nothing.largest == 0


def test_what_cannot_be_a_scale_is_refused():
    for largest in (0, -1.0, float("inf"), float("nan")):
        with pytest.raises(RayError, match="the scale ends at"):
            DistancePaint(BOX, largest=largest)
    with pytest.raises(SpatialError, match="no faces"):
        DistancePaint(Mesh(np.zeros((1, 3)), np.empty((0, 3), np.int32)))
    with pytest.raises(RayError, match="no colour map"):
        DistancePaint(BOX, colors="rainbow")


@pytest.mark.parametrize("background", [None, (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)])
def test_the_bar_shows_all_colours_from_zero_at_the_bottom(background):
    colors = color_map("viridis")
    both = with_legend(PICTURE, colors, 0.125, title="distance", background=background)
    assert both.shape == (240, 320 + legend_width(240), 4)
    assert_array_equal(both[:, :320], PICTURE)
    column = both[:, 320 + 12]
    table = np.array([colors(np.array([x]))[0] for x in np.linspace(0, 1, 400)])
    rows = np.flatnonzero(np.abs(column[:, None, :3] - table).max(axis=2).min(axis=1) < 0.02)
    rows = rows[column[rows, 3] == 1]
    assert len(rows) > 150
    place = np.abs(column[rows][:, None, :3] - table).sum(axis=2).argmin(axis=1)
    assert (np.diff(place) < 0).mean() > 0.95
    assert_allclose([place[0], place[-1]], [399, 0], atol=4)


def test_letters_stand_out_from_any_background():
    colors = color_map()
    right = np.s_[:, 320 + 30 :]
    for background, is_letter in ((1.0, np.less), (0.0, np.greater)):
        strip = with_legend(PICTURE, colors, 3, title="mm", background=(background,) * 3)[right]
        assert is_letter(strip[..., 1], 0.5).sum() > 100
        assert (strip[..., 1] == background).mean() > 0.7
    clear = with_legend(PICTURE, colors, 3, title="mm")[right]
    assert (clear[..., 3] == 0).mean() > 0.7
    other = with_legend(PICTURE, colors, 4, title="mm")[right]
    assert (clear != other).any()


def test_a_small_picture_and_a_long_title_still_make_a_legend():
    tiny = with_legend(np.zeros((5, 9, 4), np.float32), color_map(), 1, title="far too long " * 9)
    assert tiny.shape == (5, 9 + legend_width(5), 4)
