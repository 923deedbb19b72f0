"""The sound solids of this set that the package itself does not offer as primitives."""

from itertools import permutations

import numpy as np

from meshsdf.mesh import Mesh


def gear(*, n_teeth: int, outer: float, root: float, bore: float, thickness: float) -> Mesh:
    """A spur gear with straight flanks and a round bore: genus 1, sharp edges."""
    angle = 2 * np.pi * np.arange(4 * n_teeth) / (4 * n_teeth)
    direction = np.column_stack([np.cos(angle), np.sin(angle)])
    profile = np.tile([root, outer, outer, root], n_teeth)[:, None] * direction
    hole = bore * direction
    half = np.full(len(angle), 0.5 * thickness)
    # Once around the cross-section: up the flanks, in over the top, down the bore, and back.
    layers = [(profile, -half), (profile, half), (hole, half), (hole, -half)]
    vertices = np.vstack([np.column_stack([xy, z]) for xy, z in layers])
    here = np.arange(len(vertices)).reshape(4, -1)
    ahead, above = np.roll(here, -1, axis=1), np.roll(here, -1, axis=0)
    quads = np.stack([here, ahead, np.roll(ahead, -1, axis=0), above], axis=-1)
    return Mesh(vertices, _two_triangles(quads.reshape(-1, 4)))


def lattice(*, n_nodes: int, period: int) -> Mesh:
    """A frame of bars, one unit thick, between n_nodes³ nodes: all edges along the axes.

    The solid shrinks to the graph of its bars, so its genus is that graph's number of loops,
    ``3 n² (n - 1) - n³ + 1``.
    """
    size = (n_nodes - 1) * period + 1
    n_on_node_planes = (np.indices((size, size, size)) % period == 0).sum(axis=0)
    filled = np.pad(n_on_node_planes >= 2, 1)
    unit, quads = np.eye(3, dtype=np.int64), []
    for axis in range(3):
        a, b = unit[(axis + 1) % 3], unit[(axis + 2) % 3]
        corners = np.stack([0 * a, a, a + b, b])
        for side in (1, -1):
            bare = np.argwhere(filled & ~np.roll(filled, -side, axis=axis))
            base = bare + unit[axis] if side == 1 else bare
            quads.append(base[:, None] + corners[::side])
    corners, which = np.unique(np.vstack(quads).reshape(-1, 3), axis=0, return_inverse=True)
    return Mesh(corners - 0.5 * (size + 2), _two_triangles(which.reshape(-1, 4)))


def gyroid_slab(
    *, n: int, n_high: int, n_waves: float, phase: float, half_thickness: float
) -> Mesh:
    """A plate of 1 x 1 x n_high/n cut from a thickened gyroid sheet, closed where it is cut."""
    ijk = np.indices((n + 3, n + 3, n_high + 3)) - 1.0
    x, y, z = 2 * np.pi * n_waves / n * ijk + phase
    sheet = np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)
    lower, upper = ijk, np.array([n, n, n_high])[:, None, None, None] - ijk
    # The box stops a quarter cell beyond its last nodes, so no node lies on it.
    box = -np.minimum(lower, upper).min(axis=0) - 0.25
    field = np.maximum(np.abs(sheet) - half_thickness, 2 * np.pi * n_waves / n * box)
    return _marching_tetrahedra(field, spacing=1 / n)


def _marching_tetrahedra(field: np.ndarray, *, spacing: float) -> Mesh:
    """The surface between negative (inside) and other nodes; closed if the rim is positive.

    Method: every cell is cut in six tetrahedra around its main diagonal, one per order of the
    axes, which fit together from cell to cell (Kuhn 1960).
    """
    # Values off zero keep cuts off the nodes, so no face is a sliver and no last bit decides.
    field = np.where(field < 0, np.minimum(field, -0.02), np.maximum(field, 0.02)).round(6)
    node = np.arange(field.size).reshape(field.shape)
    cuts = []
    for order in permutations(range(3)):
        path = np.vstack([[0, 0, 0], np.cumsum(np.eye(3, dtype=np.int64)[list(order)], axis=0)])
        shifted = [_window(node, offset) for offset in path]
        if not _is_even(order):
            shifted[1], shifted[2] = shifted[2], shifted[1]
        cuts.append(_cut(np.column_stack(shifted), field.ravel()))
    edges, which = np.unique(np.sort(np.vstack(cuts), axis=1), axis=0, return_inverse=True)
    value = field.ravel()[edges]
    along = (value[:, 0] / (value[:, 0] - value[:, 1]))[:, None]
    start, end = (np.column_stack(np.unravel_index(ends, field.shape)) for ends in edges.T)
    vertices = spacing * (start + along * (end - start))
    return Mesh(vertices, which.reshape(-1, 3).astype(np.int32))


def _cut(corners: np.ndarray, field: np.ndarray) -> np.ndarray:
    """(3 t, 2) cut edges, three per face, of positively oriented (n, 4) tetrahedra."""
    code = (field[corners] < 0) @ [1, 2, 4, 8]
    pieces = []
    for order in filter(_is_even, permutations(range(4))):
        # Keep one order per set of inside corners, with these first: the smallest.
        for n_inside in (1, 2, 3):
            inside = set(order[:n_inside])
            same = [
                o for o in permutations(range(4)) if _is_even(o) and set(o[:n_inside]) == inside
            ]
            if order != min(same):
                continue
            a, b, c, d = corners[code == sum(1 << i for i in inside)][:, list(order)].T
            polygon = {
                1: [(a, b), (a, c), (a, d)],
                2: [(a, c), (a, d), (b, d), (b, c)],
                3: [(a, d), (b, d), (c, d)],
            }[n_inside]
            for i in range(1, len(polygon) - 1):
                corner_edges = [polygon[0], polygon[i], polygon[i + 1]]
                pieces.append(np.stack(corner_edges, axis=0).transpose(2, 0, 1).reshape(-1, 2))
    return np.vstack(pieces)


def _window(node: np.ndarray, offset: np.ndarray) -> np.ndarray:
    """The nodes at that corner of every cell."""
    i, j, k = offset
    ni, nj, nk = node.shape
    return node[i : ni - 1 + i, j : nj - 1 + j, k : nk - 1 + k].ravel()


def _is_even(order: tuple[int, ...]) -> bool:
    return np.linalg.det(np.eye(len(order))[list(order)]) > 0


def _two_triangles(quads: np.ndarray) -> np.ndarray:
    return quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3).astype(np.int32)
