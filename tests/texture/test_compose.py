"""meshsdf.texture.compose: mixtures, ramps and maps of textures and of plain functions."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from meshsdf.errors import TextureError
from meshsdf.texture.compose import mix, moved, placed, ramp, scaled, turned
from meshsdf.texture.noise import fbm
from meshsdf.texture.patterns import Checker
from meshsdf.texture.wood import Wood

POINTS = np.random.default_rng(0).uniform(-2, 2, (300, 3))


def coordinates(points):
    """A plain function: the point as a colour."""
    return np.concatenate([points, np.ones((len(points), 1))], axis=1)


def test_a_mixture_of_alpha_is_of_what_is_seen():
    def clear_red(points):
        return np.tile([1.0, 0, 0, 0.0], (len(points), 1))

    def green(points):
        return np.tile([0.0, 1, 0, 1.0], (len(points), 1))

    assert_allclose(mix(clear_red, green, 0.25)(POINTS), np.tile([0, 1, 0, 0.25], (300, 1)))


def test_a_weight_may_be_a_function_of_points_and_footprint():
    seen = []

    def weight(points, footprint):
        seen.append(footprint)
        return np.full(len(points), 2.0)

    both = mix(Wood(), Checker(), weight)
    assert_allclose(both(POINTS, 0.1), Checker()(POINTS, 0.1), atol=1e-7)
    assert seen == [0.1]


def test_a_ramp_is_linear_between_its_stops():
    texture = ramp([(-1, (0, 0, 0)), (1, (1, 0.5, 0))], values=lambda p: p[:, 2] / 2)
    share = (POINTS[:, 2] / 2 + 1) / 2
    assert_allclose(texture(POINTS)[:, :2], np.stack([share, share / 2], axis=1), atol=1e-6)
    assert ramp([(0, "#000000"), (1, "#ffffff")], values=fbm)(POINTS, 0.1).shape == (300, 4)


def test_maps_move_the_texture_and_not_the_points():
    assert_allclose(
        moved(coordinates, (1, 2, 3))(POINTS)[:, :3], POINTS - [1, 2, 3], rtol=1e-6, atol=1e-6
    )
    assert_allclose(scaled(coordinates, 2)(POINTS)[:, :3], POINTS / 2, rtol=1e-6)
    assert_allclose(scaled(coordinates, (1, 2, 4))(POINTS)[:, :3], POINTS / [1, 2, 4], rtol=1e-6)
    quarter = turned(coordinates, (0, 0, 5), 90)(np.array([[0.0, 1.0, 3.0]]))
    assert_allclose(quarter[0, :3], [1, 0, 3], atol=1e-7)  # what was on x is on y


def test_a_footprint_shrinks_as_its_texture_grows():
    assert_allclose(
        scaled(Checker(side=0.25), 2)(POINTS, 0.2), Checker(side=0.5)(POINTS, 0.2), atol=1e-6
    )


def test_refusals_say_what_is_wrong():
    with pytest.raises(TextureError, match="singular values run from 1 to 0"):
        placed(coordinates, np.diag([1.0, 1, 0, 1]))
    with pytest.raises(TextureError, match=r"shape \(300, 3\) for 300 points"):
        mix(lambda p: p, coordinates, 0.5)(POINTS)
    with pytest.raises(TextureError, match="weight is 2"):
        mix(coordinates, coordinates, 2)
    with pytest.raises(TextureError, match=r"stops are \[1.0, 0.0\]"):
        ramp([(1, "#000000"), (0, "#ffffff")])
    with pytest.raises(TextureError, match="this ramp has no values"):
        ramp([(0, "#000000")])(POINTS)
    with pytest.raises(TextureError, match="a stop's colour is none"):
        ramp([(0, "red")])
