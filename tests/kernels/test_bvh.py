"""meshsdf.kernels.bvh: the tree holds every triangle, and the search misses none."""

import numpy as np
import pytest

from meshsdf.kernels.bvh import LEAF_SIZE, build_tree, triangle_boxes
from meshsdf.kernels.point_triangle import squared_distance
from meshsdf.mesh import Mesh
from meshsdf.spatial import ClosestPoint


def soup(corners):
    corners = np.asarray(corners, dtype=float)
    faces = np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3)
    return Mesh(corners.reshape(-1, 3), faces)


def random_corners(rng, m, size=0.3):
    return rng.normal(size=(m, 1, 3)) + size * rng.normal(size=(m, 3, 3))


def growing_corners(rng, m):
    """Triangles at distances 2**i: every cut of equal bins leaves one triangle on its own."""
    return random_corners(rng, m, 0.01) * 1.5 ** np.arange(m)[:, None, None]


SHAPES = {
    "one": lambda rng: random_corners(rng, 1),
    "few": lambda rng: random_corners(rng, LEAF_SIZE + 1),
    "random": lambda rng: random_corners(rng, 400),
    "copies of one": lambda rng: np.repeat(random_corners(rng, 1), 300, axis=0),
    "growing": lambda rng: growing_corners(rng, 100),
    "points": lambda rng: np.repeat(rng.normal(size=(300, 1, 3)), 3, axis=1),
    "in a plane": lambda rng: random_corners(rng, 300) * [1.0, 1.0, 0.0],
}


@pytest.mark.parametrize("shape", SHAPES)
def test_every_triangle_is_in_one_leaf_and_in_the_boxes_above_it(shape):
    corners = SHAPES[shape](np.random.default_rng(0))
    m = len(corners)
    boxes = np.empty((m, 6), np.float32)
    triangle_boxes(corners, 0.0, boxes)
    own = boxes.copy()
    order, children = np.empty(m, np.int32), np.empty((m + 1, 2), np.int32)
    child_boxes = np.empty((m + 1, 12), np.float32)
    n_nodes = build_tree(boxes, order, children, child_boxes)
    assert sorted(order) == list(range(m))
    found = []

    def descend(code, above):
        if code >= 0:
            for side in range(2):
                box = child_boxes[code, 6 * side : 6 * side + 6]
                descend(children[code, side], [*above, box])
        elif code <= -2:
            first, count = (-2 - code) >> 3, ((-2 - code) & 7) + 1
            assert count <= LEAF_SIZE
            for s in range(first, first + count):
                found.append(order[s])
                for box in above:
                    assert (box[:3] <= own[order[s], :3]).all()
                    assert (box[3:] >= own[order[s], 3:]).all()

    descend(0, [])
    assert sorted(found) == list(range(m))
    assert n_nodes <= m + 1


@pytest.mark.parametrize("shape", SHAPES)
def test_the_search_finds_the_least_over_all_triangles_bit_for_bit(shape):
    rng = np.random.default_rng(1)
    mesh = soup(SHAPES[shape](rng))
    closest = ClosestPoint(mesh)
    corners = mesh.vertices
    points = np.concatenate([corners[:20], 0.5 * (corners[:20] + corners[-20:])])
    points = np.concatenate([points, rng.normal(size=(20, 3)), 1e3 * rng.normal(size=(10, 3))])
    centered = points - closest.center
    squares, slots = closest.search(centered, np.empty(0, np.int32))
    for n, p in enumerate(centered):
        all_squares = np.array([squared_distance(f, *p, np.inf) for f in closest.frames])
        assert squares[n] == all_squares.min()
        ties = closest.face_of_slot[all_squares == all_squares.min()]
        assert closest.face_of_slot[slots[n]] == ties.min()
