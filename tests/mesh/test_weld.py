"""meshsdf.mesh.weld: one number for one position."""

import numpy as np
from numpy.testing import assert_array_equal

from meshsdf.mesh import weld


def test_numbers_come_in_order_of_first_appearance():
    vertices = np.array([[3.0, 0, 0], [1, 0, 0], [3, 0, 0], [2, 0, 0], [1, 0, 0]])
    labels, points = weld(vertices)
    assert_array_equal(labels, [0, 1, 0, 2, 1])
    assert_array_equal(points[:, 0], [3, 1, 2])


def test_minus_zero_is_zero_and_one_ulp_is_not():
    vertices = np.array([[0.0, 1, 2], [-0.0, 1, 2], [5e-324, 1, 2], [0.0, np.nextafter(1, 2), 2]])
    labels, points = weld(vertices)
    assert_array_equal(labels, [0, 0, 1, 2])
    assert not np.signbit(points).any()


def test_welding_agrees_with_sorting_on_random_lattice_points():
    rng = np.random.default_rng(4)
    vertices = rng.integers(-6, 7, (5000, 3)) * 0.1
    labels, points = weld(vertices)
    unique, first, inverse = np.unique(vertices, axis=0, return_index=True, return_inverse=True)
    assert len(points) == len(unique)
    assert_array_equal(points[labels], vertices)
    rank = np.empty(len(first), dtype=int)
    rank[np.argsort(first)] = np.arange(len(first))
    assert_array_equal(labels, rank[inverse.ravel()])


def test_many_points_on_one_axis_do_not_collide():
    vertices = np.zeros((200_000, 3))
    vertices[:, 0] = np.arange(200_000)
    labels, _ = weld(vertices)
    assert_array_equal(labels, np.arange(200_000))


def test_no_points_at_all_are_welded_to_none():
    labels, points = weld(np.empty((0, 3)))
    assert labels.shape == (0,)
    assert points.shape == (0, 3)
