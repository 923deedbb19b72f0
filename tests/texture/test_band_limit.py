"""Every procedural texture, seen through a wide filter, is the mean of what is under it."""

import numpy as np
import pytest

from meshsdf.texture.procedural import PROCEDURALS, procedural

ROWS = 13  # fine places along an axis of a cube
POINTS = 32
LEVELS = (1, 3, 5, 7)
FINEST = 0.012  # texel of level 0; level l has cubes of FINEST * 2**l: 0.024 to 1.5
RMS = 2 / 255  # linear light


def mean_of_fine(texture, points, width, seed):
    """Mean of unfiltered colours at places strewn over the cube, one to each of ROWS^3 parts."""
    corners = np.stack(np.meshgrid(*[np.arange(ROWS)] * 3), axis=-1).reshape(-1, 3)
    rng = np.random.default_rng(seed)
    means = []
    for point in points:
        places = (corners + rng.random(corners.shape)) / ROWS - 0.5
        means.append(texture(point + width * places).mean(axis=0, dtype=np.float64))
    return np.array(means)


@pytest.mark.parametrize("kind", PROCEDURALS)
def test_a_coarse_level_is_the_box_filtered_fine_one(kind):
    texture = procedural(kind, seed=3)
    points = np.random.default_rng(1).uniform(-1, 1, (POINTS, 3))
    for level in LEVELS:
        width = FINEST * 2**level
        error = texture(points, width) - mean_of_fine(texture, points, width, level)
        # The mean of 2197 strewn places is right to 0.5 / sqrt(2197) = 2.7 / 255 at worst, of
        # black and white; of what is here, to 1 / 255
        assert np.sqrt((error[:, :3] ** 2).mean()) <= RMS, level


@pytest.mark.parametrize("kind", ["brick", "cellular", "checker", "clouds", "granite", "spots"])
def test_a_filter_of_many_features_sees_the_mean_of_all_space(kind):
    texture = procedural(kind)
    rng = np.random.default_rng(2)
    mean = texture(rng.uniform(-300, 300, (60_000, 3))).mean(axis=0, dtype=np.float64)
    wide = texture(rng.uniform(-3, 3, (20, 3)), 12.0)
    # 60 000 places: right to 0.5 / 245
    assert np.abs(wide - mean).max() < 0.01


def test_a_width_for_each_point_is_that_width():
    points = np.random.default_rng(4).uniform(-1, 1, (15, 3))
    widths = np.repeat([0.0, 0.05, 0.4], 5)
    for kind in PROCEDURALS:
        texture = procedural(kind)
        each = np.concatenate([texture(points[w == widths], w) for w in (0.0, 0.05, 0.4)])
        np.testing.assert_allclose(texture(points, widths), each, atol=1e-6)
