"""meshsdf.texture.procedural_layer: bricks that a function fills when they are looked at."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf.errors import TextureError
from meshsdf.mesh import icosphere
from meshsdf.texture.layers import flatten, merge_down, shown
from meshsdf.texture.octree import Octree
from meshsdf.texture.procedural_layer import ProceduralLayer, add_procedural
from meshsdf.texture.volume_texture import VolumeTexture

BALL = Octree.around(icosphere(subdivisions=3), resolution=60)
POINTS = icosphere(subdivisions=4).vertices * 0.99  # between the faces and the sphere
SRGB = 1.0 / 255


def ramp(points, footprint):
    """Red goes with x, green tells the footprint in finest texels."""
    out = np.ones((len(points), 4), np.float32)
    out[:, 0] = 0.5 + 0.4 * points[:, 0]
    out[:, 1] = footprint / BALL.texel / 64
    return out


def with_ramp():
    texture = VolumeTexture(BALL, base="half")
    return texture, add_procedural(texture, "ramp", ramp)


def test_every_level_shows_the_function_with_its_own_spacing():
    for level in range(BALL.n_levels):
        texture, _ = with_ramp()
        seen = texture.colors(POINTS, footprint=BALL.spacing(level))
        # Trilinear interpolation keeps a linear function, where the eight corners exist
        assert_allclose(np.median(np.abs(seen[:, 0] - 0.5 - 0.4 * POINTS[:, 0])), 0, atol=2e-3)
        assert_allclose(seen[:, 1], 2.0**level / 64, rtol=1e-3)


def test_only_bricks_that_are_looked_at_are_evaluated_and_only_once():
    calls = []

    def counted(points, footprint):
        calls.append(len(points))
        return ramp(points, footprint)

    texture = VolumeTexture(BALL)
    layer = add_procedural(texture, "counted", counted)
    assert len(layer.stored) == BALL.level_first[-1] - BALL.level_first[-2]
    north = POINTS[POINTS[:, 2] > 0.9]
    seen = texture.colors(north)
    stored = layer.stored
    finest = stored[stored < BALL.level_first[1]]
    assert 0 < len(finest) < 0.2 * BALL.level_first[1]
    assert (BALL.tables.bricks[finest, 2] > 0).all()
    n_calls = len(calls)
    assert_array_equal(texture.colors(north), seen)
    assert len(calls) == n_calls


def test_what_is_seen_does_not_depend_on_what_was_looked_at_before():
    one, _ = with_ramp()
    whole = one.colors(POINTS, POINTS)
    other, _ = with_ramp()
    other.colors(POINTS, footprint=4 * BALL.texel)
    parts = [other.colors(part, part) for part in np.array_split(POINTS, 7)]
    assert_array_equal(np.concatenate(parts), whole)


def test_it_takes_part_in_the_picture_of_several_layers():
    texture, _ = with_ramp()
    alone = texture.colors(POINTS, POINTS)
    cover = texture.add_layer("glaze", color=(1.0, 1.0, 1.0, 0.5))
    assert_allclose(texture.colors(POINTS, POINTS)[:, 0], 0.5 + 0.5 * alone[:, 0], atol=2e-3)
    merged = merge_down(texture, cover)
    assert_allclose(texture.colors(POINTS, POINTS)[:, 0], 0.5 + 0.5 * alone[:, 0], atol=2e-3)
    assert isinstance(merged, ProceduralLayer)
    assert merged.function is None


def test_flattening_evaluates_all_of_it():
    texture, layer = with_ramp()
    flatten(texture)
    assert shown(texture) is not layer
    assert len(shown(texture).stored) == BALL.n_entries


def test_points_that_make_no_sense_show_nothing_or_nan():
    texture, _ = with_ramp()
    found = texture.colors(np.array([[np.nan, 0, 0], [1e300, 0, 0], [0, 0, np.inf], [5.0, 0, 0]]))
    assert np.isnan(found[:3]).all()
    assert_array_equal(found[3], 0)


def test_a_function_of_another_shape_is_refused():
    texture = VolumeTexture(BALL)
    with pytest.raises(TextureError, match="shape"):
        add_procedural(texture, "flat", lambda points: points)
    assert texture.layers == []
