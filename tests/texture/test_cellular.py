"""meshsdf.texture.cellular: distances to strewn points, against a search of every cell."""

import numpy as np
from numpy.testing import assert_allclose

from meshsdf.texture.cellular import Cellular, Spots, nearest_cells
from tests.texture import noise_twins


def some_points(n, seed=0):
    return np.random.default_rng(seed).uniform(-30, 30, (n, 3))


def test_distances_are_those_of_the_plain_search():
    points = some_points(60)
    for reach, exact in ((1, False), (2, True)):
        twins = [noise_twins.features(point, reach, 0.8, 3) for point in points.tolist()]
        found, _ = nearest_cells(points, seed=3, jitter=0.8, exact=exact)
        assert_allclose(found, twins, rtol=1e-14)


def test_no_cell_beyond_the_exact_search_holds_a_nearer_point():
    points = some_points(40, seed=1)
    twins = [noise_twins.features(point, 3, 1.0, 0) for point in points.tolist()]
    assert_allclose(nearest_cells(points, exact=True)[0], twins, rtol=1e-14)


def test_the_short_search_errs_seldom_and_never_below():
    points = some_points(100_000, seed=2)
    short, exact = nearest_cells(points)[0], nearest_cells(points, exact=True)[0]
    assert (short >= exact).all()
    assert 0 < (short != exact).any(axis=1).mean() < 0.01
    assert exact.max() <= np.sqrt(3)


def test_without_jitter_the_points_are_the_middles_of_cells():
    points = some_points(500, seed=3)
    found, _ = nearest_cells(points, jitter=0.0)
    assert_allclose(found[:, 0], np.linalg.norm(points - np.floor(points) - 0.5, axis=1))


def test_marks_are_uniform_and_one_to_a_cell():
    middles = np.floor(some_points(20_000, seed=4)) + 0.5
    _, marks = nearest_cells(middles, jitter=0.0)
    _, beside = nearest_cells(middles + 0.2, jitter=0.0)
    assert (marks == beside).all()
    unique = np.unique(marks, axis=0)
    assert_allclose(unique.mean(axis=0), 0.5, atol=0.01)
    assert_allclose(unique.std(axis=0), np.sqrt(1 / 12), atol=0.01)


def test_distance_shades_are_the_distances():
    points = 0.3 * some_points(300, seed=5)
    found, _ = nearest_cells(points / 0.3)
    for feature, value in (("f1", found[:, 0]), ("f2-f1", found[:, 1] - found[:, 0])):
        shades = Cellular(feature=feature, cell=0.3, low=(0, 0, 0), high=(1, 1, 1))(points)
        assert_allclose(shades[:, 1], np.minimum(value, 1), atol=1e-7)


def test_spots_cover_the_volume_of_their_balls():
    texture = Spots(distance=1.0, radius=0.2, variation=0.0, ground=(0, 0, 0), spot=(1, 1, 1))
    points = some_points(200_000, seed=6)
    # With a jitter of 0.6 the middles are 0.4 apart at least, so balls of 0.2 do not meet
    expected = 4 / 3 * np.pi * 0.2**3
    assert abs(texture(points)[:, 0].mean() - expected) < 4 * np.sqrt(expected / 200_000)
