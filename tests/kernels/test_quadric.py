"""meshsdf.kernels.quadric: the point in all planes, beside numpy's least squares."""

import numpy as np
import pytest

from meshsdf.kernels.dual_arrays import Crossings, Loops
from meshsdf.kernels.quadric import fit_points


def fitted(places, normals, truncation=0.03, reach=1.0):
    """The point for one loop in the unit cell, with crossings on its edges at ``places``."""
    places = np.asarray(places, float)
    nodes, ways = np.floor(places).astype(np.int32), np.empty(len(places), np.uint8)
    fractions = np.empty(len(places))
    for i, place in enumerate(places):
        axis = int(np.argmax(place - nodes[i]))
        ways[i], fractions[i] = 2 * axis + 1, place[axis] - nodes[i, axis]
    crossings = Crossings(nodes, ways, fractions, np.asarray(normals, float))
    n = len(places)
    loops = Loops(
        np.array([0, n], np.int32), np.arange(n, dtype=np.int32), np.zeros((1, 3), np.int32),
        np.zeros((n, 4), np.int32),
    )  # fmt: skip
    points, is_curved = np.empty((1, 3)), np.empty(1, np.bool_)
    fit_points(loops, crossings, truncation, reach, 0, 1, points, is_curved)
    return points[0], bool(is_curved[0])


def plane_crossings(planes):
    """Where planes, (normal, point in it), meet the edges of the unit cell from the origin."""
    places, normals = [], []
    for axis, (normal, point) in enumerate(planes):
        normal = np.asarray(normal, float) / np.linalg.norm(normal)
        place = np.zeros(3)
        place[axis] = normal @ point / normal[axis]
        assert 0 < place[axis] < 1
        places.append(place)
        normals.append(normal)
    return places, normals


def test_three_planes_meet_in_their_corner():
    corner = np.array([0.3, 0.4, 0.2])
    planes = [((1, 0.2, 0.1), corner), ((0.1, 1, -0.2), corner), ((0.2, 0.1, 1), corner)]
    point, is_curved = fitted(*plane_crossings(planes))
    np.testing.assert_allclose(point, corner, atol=1e-13)
    assert is_curved


def test_one_plane_takes_the_mean_of_its_crossings():
    places, normals = [[0.5, 0, 0], [0, 0.5, 0], [0, 0, 0.5]], np.full((3, 3), 3**-0.5)
    point, is_curved = fitted(places, normals)
    np.testing.assert_allclose(point, [1 / 6] * 3, atol=1e-14)
    assert not is_curved


def test_two_planes_give_the_point_of_their_line_nearest_to_the_mean():
    places = np.array([[0.4, 0, 0], [0.4, 0, 1.0], [0, 0.6, 0]])
    normals = np.array([[1, 0, 0], [1, 0, 0], [0, 1, 0]], float)
    point, _ = fitted(places, normals)
    np.testing.assert_allclose(point, [0.4, 0.6, places[:, 2].mean()], atol=1e-13)


@pytest.mark.parametrize("seed", range(20))
def test_random_planes_agree_with_least_squares_where_the_point_stays_near(seed):
    rng = np.random.default_rng(seed)
    corner = rng.uniform(0.25, 0.4, 3)
    planes = [(np.eye(3)[k] + 0.3 * rng.uniform(-1, 1, 3), corner) for k in range(3)]
    places, normals = plane_crossings(planes)
    offsets = np.einsum("ij,ij->i", normals, places)
    best = np.linalg.lstsq(np.array(normals), offsets, rcond=None)[0]
    np.testing.assert_allclose(fitted(places, normals)[0], best, atol=1e-12)


def test_a_corner_far_outside_the_cell_is_not_followed():
    # Two planes that meet in a line 5 voxels away, at about 11 degrees
    places, normals = [[0.5, 0, 0], [0.5, 1, 0]], [[1, 0.1, 0], [1, -0.1, 0]]
    normals = np.array(normals) / np.hypot(1, 0.1)
    point, _ = fitted(places, normals)
    assert np.all(point >= -1)
    assert np.all(point <= 2)


def test_unknown_normals_count_for_the_mean_alone():
    places = [[0.5, 0, 0], [0, 0.5, 0], [0, 0, 0.5]]
    point, is_curved = fitted(places, np.zeros((3, 3)))
    np.testing.assert_allclose(point, [1 / 6] * 3)
    assert not is_curved
