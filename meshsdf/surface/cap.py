"""Close a surface flush with the border of a grid.

Surrounded by infinitely large values, a grid's surface closes in the border planes: an edge that
leaves the grid from an inside node is crossed at that node. A node on a border line has two such
edges and a corner three, with degenerate triangles between. Here they become one vertex.
"""

import numpy as np

from ..grid.brick_index import BRICK


def weld_border_nodes(
    vertices: np.ndarray,
    faces: np.ndarray,
    crossings: np.ndarray,
    corners: np.ndarray,
    shape: tuple[int, ...],
) -> tuple[np.ndarray, np.ndarray]:
    """Merge the vertices that edges leaving the grid have at one node; drop what collapses.

    ``crossings`` and ``corners`` are those the vertices were made from, brick by brick, and
    ``shape`` is that of the grid. The order of what remains does not change.
    """
    number, axis, node = _vertices_near_border(crossings, corners, shape)
    n_along = np.array(shape)[axis]
    along = np.take_along_axis(node, axis[:, None], axis=1)[:, 0]
    leaving = (along == -1) | (along == n_along - 1)
    node[along == -1, axis[along == -1]] = 0  # the end that lies in the grid
    number, key = number[leaving], np.ravel_multi_index(tuple(node[leaving].T), shape)
    _, one, group = np.unique(key, return_index=True, return_inverse=True)
    target = np.arange(len(vertices))
    target[number] = number[one][group]
    keep = target == np.arange(len(vertices))
    faces = (np.cumsum(keep, dtype=np.int32) - np.int32(1))[target][faces]
    a, b, c = faces.T
    return vertices[keep], faces[(a != b) & (b != c) & (c != a)]


def _vertices_near_border(
    crossings: np.ndarray, corners: np.ndarray, shape: tuple[int, ...]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Number, axis and lower node of the vertices of bricks that reach the border."""
    count = np.bitwise_count(crossings).sum(axis=1, dtype=np.int64)
    first = np.cumsum(count) - count
    at_border = ((corners < 0) | (corners + BRICK >= shape)).any(axis=1)
    rows = np.flatnonzero(at_border & (count > 0))
    bits = np.unpackbits(
        crossings[rows].astype("<u8", copy=False).view(np.uint8), axis=1, bitorder="little"
    )
    row, edge = np.nonzero(bits)  # in the order of the vertices
    start = np.cumsum(count[rows]) - count[rows]
    number = (first[rows] - start)[row] + np.arange(len(row))
    local = np.stack(np.unravel_index(edge, (3, BRICK, BRICK, BRICK)), axis=1)
    return number, local[:, 0], corners[rows][row] + local[:, 1:]
