"""meshsdf.report heat maps and close-ups: colours stand for exact distances, marks for places."""

import io
import re
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from meshsdf.mesh import Mesh
from meshsdf.mesh.primitives import box_mesh
from meshsdf.report.close_up import HEIGHT, WIDTH, close_ups, line_of_sight
from meshsdf.report.color_bar import LEAST_TOP, Scale
from meshsdf.report.heat_maps import CLIPPED_AT, common_scales, painter
from meshsdf.report.pair_words import ROUND_TRIP
from meshsdf.spatial.closest_point import ClosestPoint
from meshsdf.spatial.ray_hits import RayHits

from .trips import facts

SMALL, LARGE = box_mesh((1, 1, 1)), box_mesh((1.2, 1.2, 1.2))


@given(st.floats(LEAST_TOP, 1e4))
def test_the_scale_rises_from_zero_to_its_top(top):
    scale = Scale(top)
    places = scale.place(np.linspace(0, top, 50))
    assert (np.diff(places) > 0).all()
    assert (places[0], places[-1]) == (0, 1)
    assert scale.place(np.array([2 * top])) == 1
    assert 3 <= len(scale.ticks) <= 10
    assert scale.ticks[0] == 0
    assert (np.diff(scale.ticks) > 0).all()
    assert scale.ticks[-1] < top


def test_the_bar_names_what_its_colours_stand_for():
    bar = ElementTree.fromstring(Scale(0.8713).bar("x"))
    texts = [element.text for element in bar.iter("text")]
    assert texts[0] == "0"
    assert texts[-1] == "0.872 voxels"
    x = [float(element.attrib["x"]) for element in bar.iter("text")]
    # Colours follow the square root of the distance
    places = (np.array(x) - x[0]) / (x[-1] - x[0])
    assert places[1:-1] ** 2 * 0.8713 == pytest.approx([float(t) for t in texts[1:-1]], rel=0.03)


def test_paint_is_the_colour_of_the_distance_to_the_other_surface():
    scale = Scale(4.0)
    paint = painter(ClosestPoint(LARGE), 0.05, scale)
    points = np.array([[0.5, 0.0, 0.0], [0.6, 0.1, 0.2], [0.5, 0.3, 0.5]])
    assert (paint(points, np.zeros(3, np.int32)) == scale.colors(np.array([2.0, 0.0, 2.0]))).all()


def test_one_scale_serves_all_rows_and_never_ends_too_low():
    rows = facts("box")[0].rows
    largest = max(row.comparison.distance.upper / row.voxel_size for row in rows)
    whole, near = common_scales(list(rows))
    assert near.top == pytest.approx(largest)
    assert not near.goes_on
    # The whole views end where 99 % of the area does, and say that there is more
    within = max(
        side.percentiles[CLIPPED_AT].upper / row.voxel_size
        for row in rows
        for side in (row.details.forward_statistics, row.details.backward_statistics)
        if side is not None
    )
    assert LEAST_TOP <= whole.top == pytest.approx(within)
    assert whole.goes_on
    assert "≥ " in whole.bar("x")


def test_the_eye_looks_where_nothing_blocks():
    floor = np.array([[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]], float)
    roof = floor * [1, 1, 0] + [8.5, 0, 1]  # leaves the side of -x open
    faces = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    hall = Mesh(np.concatenate([floor, roof]), np.concatenate([faces, faces + np.int32(4)]))
    witness, nearest, up = np.zeros(3), np.array([0.0, 0.0, 0.5]), np.array([0.0, 0.0, 1.0])
    back = line_of_sight(RayHits(hall), witness, nearest, up, 1.0)
    assert np.linalg.norm(back) == pytest.approx(1)
    assert back[2] > 0
    # Under the roof's edge, half a unit to the left and one up
    assert back[0] / back[2] < -0.5


def test_both_pictures_of_a_close_up_mark_the_same_two_places():
    trip, mesh, *_ = facts("box")
    row = trip.rows[1]
    _, scale = common_scales([row])
    paints = [painter(ClosestPoint(m), row.voxel_size, scale) for m in (row.surface, mesh)]
    found = close_ups((mesh, row.surface), row.comparison, paints, ROUND_TRIP)
    assert [close_up.at for close_up in found] == ["forward", "backward"]
    for close_up in found:
        first, second = ([float(x) for x in numbers(p.marker, "circle")] for p in close_up.pictures)
        lines = [[float(x) for x in numbers(p.marker, "line")] for p in close_up.pictures]
        assert lines == [first + second, second + first]
        assert np.add(first, second) / 2 == pytest.approx([WIDTH / 2, HEIGHT / 2], abs=0.1)
        # The camera sees the place: a surface is drawn there, but beyond the outline it is not
        for picture, (x, y) in zip(close_up.pictures, (first, second), strict=True):
            image = Image.open(io.BytesIO(picture.data))
            assert image.size == (WIDTH, HEIGHT)
            around = image.crop((int(x) - 4, int(y) - 4, int(x) + 5, int(y) + 5))
            assert np.asarray(around)[..., 3].max() == 255
            assert np.asarray(image)[..., 3].min() == 0


def numbers(svg: str, tag: str) -> list[str]:
    """The coordinates of the first element of a kind."""
    element = re.search(rf"<{tag} ([^>]*)/>", svg)[1]
    return re.findall(r'(?:c?x1?|c?y1?|x2|y2)="([^"]*)"', element)
