"""meshsdf.kernels.touching: do triangles come near each other within a cube?"""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from meshsdf.kernels.touching import sets_touch

LOW, HIGH = -1.0, 8.0
STEPS = 80


def lattice(triangle):
    """Points all over the part of a triangle in the cube."""
    i, j = np.indices((STEPS + 1, STEPS + 1)).reshape(2, -1) / STEPS
    kept = i + j <= 1 + 1e-9
    points = triangle[0] + np.outer(i, triangle[1] - triangle[0])[:, :]
    points = (points + np.outer(j, triangle[2] - triangle[0]))[kept]
    return points[((points >= LOW) & (points <= HIGH)).all(axis=1)]


def touch(one, other, gap):
    """What the kernel says of two triangles."""
    both = np.stack([one, other])
    low, high = np.maximum(both.min(axis=1), LOW), np.minimum(both.max(axis=1), HIGH)
    first, second = np.array([0]), np.array([1])
    return sets_touch(both, low, high, first, second, LOW, HIGH, gap)


@pytest.mark.parametrize("seed", range(3))
def test_two_triangles_touch_where_points_of_both_in_the_cube_are_near(seed):
    random = np.random.default_rng(seed)
    n_touching = n_apart = 0
    for _ in range(150):
        one, other = random.uniform(-3, 10, (2, 3, 3)) if seed else random.uniform(2, 5, (2, 3, 3))
        a, b = lattice(one), lattice(other)
        gap = 0.5
        if len(a) == 0 or len(b) == 0:
            continue
        least = cKDTree(a).query(b)[0].min()
        # A point of a triangle is within a lattice's cell of one that is looked at
        slack = 1.2 * np.abs(np.diff(one[[0, 1, 2, 0]], axis=0)).max() / STEPS * 2
        slack += 1.2 * np.abs(np.diff(other[[0, 1, 2, 0]], axis=0)).max() / STEPS * 2
        if least < gap:
            assert touch(one, other, gap)
            n_touching += 1
        elif least > gap + slack:
            assert not touch(one, other, gap)
            n_apart += 1
    assert min(n_touching, n_apart) > 10


def test_triangles_that_cross_or_share_an_edge_touch_and_what_meets_outside_does_not():
    flat = np.array([[0.0, 0, 3], [7, 0, 3], [0, 7, 3]])
    through = np.array([[1.0, 1, 0], [1, 1, 7], [2, 1, 7]])
    assert touch(flat, through, 1e-6)
    assert touch(through, flat, 1e-6)
    assert touch(flat, flat[[1, 2, 0]] + np.array([0, 0, 1e-7]), 1e-6)
    # A wedge whose edge lies outside the cube, 9 long
    wedge = [np.array([[-50.0, 0, 3], [8, 0, 3 + s], [8, 7, 3 + s]]) for s in (-2, 2)]
    assert not touch(*wedge, 1.0)
    assert touch(*wedge, 4.0)
