"""meshsdf.kernels.point_triangle: one triangle, against rational arithmetic."""

import numpy as np
import pytest

from meshsdf.kernels.point_triangle import (
    FRAME_SIZE,
    barycentric_foot,
    build_frames,
    closest_on_triangle,
    squared_distance,
)
from tests.oracles import distance_to_triangle

U = 2.0**-53


def frame_of(triangle):
    frames = np.empty((1, FRAME_SIZE))
    build_frames(triangle[None], np.zeros(1, np.int32), 0, 1, frames)
    return frames[0]


def bound(point, triangle):
    """The bound the module derives: 50 u (|p - a| + L), a any corner, L the longest edge."""
    sides = np.linalg.norm(triangle - np.roll(triangle, 1, axis=0), axis=1)
    return 50 * U * (np.linalg.norm(triangle - point, axis=1).min() + 2 * sides.max())


def triangles_of_every_shape(rng):
    """Fat, thin down to rounding, collinear, with two equal corners, and a point."""
    for height in (1.0, 1e-3, 1e-7, 1e-11, 1e-14, 1e-16, 0.0):
        rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        flat = np.array([[0.0, 0, 0], [1.0, 0, 0], [rng.uniform(-0.3, 1.3), height, 0]])
        yield np.roll(flat @ rotation, rng.integers(3), axis=0)
    a, b = rng.normal(size=(2, 3))
    yield from (np.array(corners) for corners in ([a, a, b], [a, b, a], [b, a, a], [a, a, a]))
    yield np.array([a, 0.5 * (a + b), b])


@pytest.mark.parametrize("scale", [1.0, 1e-9, 1e9])
def test_no_shape_of_triangle_is_off_by_more_than_the_bound(scale):
    rng = np.random.default_rng(0)
    for _ in range(8):
        for triangle in triangles_of_every_shape(rng):
            triangle = scale * triangle
            weights = rng.dirichlet(np.ones(3), 6)
            reach = np.array([0, 1e-12, 1e-3, 0.1, 1.0, 10.0])[:, None]
            for p in weights @ triangle + scale * reach * rng.normal(size=(6, 3)):
                truth = distance_to_triangle(p, triangle)
                frame = frame_of(triangle)
                assert abs(np.sqrt(squared_distance(frame, *p, np.inf)) - truth) <= bound(
                    p, triangle
                )
                square, u, v, w = closest_on_triangle(*p, *triangle)
                assert abs(np.sqrt(square) - truth) <= bound(p, triangle)
                assert min(u, v, w) >= 0
                assert abs(u + v + w - 1) <= 4 * U
                foot = np.array([u, v, w]) @ triangle
                assert abs(np.linalg.norm(foot - p) - truth) <= 2 * bound(p, triangle)
                assert barycentric_foot(frame, *p) == (u, v, w)


def test_all_seven_regions_are_told_apart():
    triangle = np.array([[0.0, 0, 0], [4, 0, 0], [1, 3, 0]])
    expected = {
        (1.5, 1.0, 2.0): (1, 1, 1),  # face
        (2.0, -1.0, 1.0): (1, 1, 0),  # edges
        (5.0, 3.0, 1.0): (0, 1, 1),
        (-1.0, 1.5, 1.0): (1, 0, 1),
        (-1.0, -1.0, 1.0): (1, 0, 0),  # corners
        (6.0, -1.0, 1.0): (0, 1, 0),
        (1.0, 9.0, 1.0): (0, 0, 1),
    }
    for turn in range(3):
        turned = np.roll(triangle, turn, axis=0)
        for p, region in expected.items():
            weights = closest_on_triangle(*p, *turned)[1:]
            assert tuple(int(x > 0) for x in weights) == tuple(np.roll(region, turn))


def test_a_point_beside_an_obtuse_corner_goes_to_the_edge_and_not_to_the_corner():
    triangle = np.array([[0.0, 0, 0], [10, 0, 0], [5, 0.5, 0]])
    p = (4.6, 3.0, 0.0)  # beyond both upper edges, but over the left one
    square, u, v, w = closest_on_triangle(*p, *triangle)
    assert np.sqrt(square) == pytest.approx(distance_to_triangle(p, triangle), abs=1e-14)
    assert u > 0
    assert v == 0
    assert w > 0.9


def test_a_bound_to_beat_cuts_the_work_short_but_never_lies():
    rng = np.random.default_rng(1)
    for _ in range(200):
        frame, p = frame_of(rng.normal(size=(3, 3))), rng.normal(size=3)
        truth = squared_distance(frame, *p, np.inf)
        best = truth * rng.uniform(0.2, 2.0)
        found = squared_distance(frame, *p, best)
        assert found == truth if truth < best else found >= best
