"""What the kernels of dual contouring pass along, gathered so that their signatures stay short.

Lengths are in voxels from the origin of ``Crossings.nodes``.
"""

from typing import NamedTuple

import numpy as np
from numba import njit


class Crossings(NamedTuple):
    """Crossed edges: lower node, way out (-x, +x, -y, ...), fraction of the edge, unit normal."""

    nodes: np.ndarray  # (c, 3) int32
    ways: np.ndarray  # (c,) uint8
    fractions: np.ndarray  # (c,) float64
    normals: np.ndarray  # (c, 3) float64; of length 0 where unknown


class Loops(NamedTuple):
    """Loop i has the crossings ``sides[start[i]:start[i + 1]]``, in order; see `dual_loops`."""

    start: np.ndarray  # (l + 1,) int32
    sides: np.ndarray  # (s,) int32
    cells: np.ndarray  # (l, 3) int32
    around: np.ndarray  # (c, 4) int32; -1 for none


class Surface(NamedTuple):
    """A mesh, and the face that every crossing lies on."""

    points: np.ndarray  # (u, 3) float64
    faces: np.ndarray  # (m, 3) int32
    beside: np.ndarray  # (m, 3) int32: the face across each edge, -1 for none or several
    hits: np.ndarray  # (c,) int32; -1 where unknown


class Tree(NamedTuple):
    """Boxes as of `bvh`."""

    order: np.ndarray  # int32
    children: np.ndarray  # (n, 2) int32
    boxes: np.ndarray  # (n, 12) float32


class Features(NamedTuple):
    """Creases with the regions on their sides, and corners with all their regions."""

    points: np.ndarray  # (u, 3) float64
    creases: np.ndarray  # (e, 2) int32
    sides: np.ndarray  # (e, 2) int32, the lower first
    crease_tree: Tree
    corners: np.ndarray  # (k,) int32
    corner_start: np.ndarray  # (k + 1,) int32
    corner_labels: np.ndarray  # (t,) int32
    corner_tree: Tree


@njit(cache=True, nogil=True)
def place_of(crossings, c, p):
    """Write where crossing c lies."""
    for x in range(3):
        p[x] = crossings.nodes[c, x]
    p[crossings.ways[c] >> 1] += crossings.fractions[c]


@njit(cache=True, nogil=True)
def other_end(loops, c, q):
    """Return (crossing, side) that name the arc ``(c, q)`` from its other end.

    One of the loops q and q + 1 around c may be missing.
    """
    loop, after = loops.around[c, q], loops.around[c, (q + 1) & 3]
    here = loop if loop >= 0 else after
    first, last = loops.start[here], loops.start[here + 1]
    s = first
    while loops.sides[s] != c:
        s += 1
    # The arc leads to c in the earlier loop, and from c in the later
    if loop >= 0:
        other = loops.sides[s - 1] if s > first else loops.sides[last - 1]
    else:
        other = loops.sides[s + 1] if s + 1 < last else loops.sides[first]
    side = 0
    while loops.around[other, side] != after or loops.around[other, (side + 1) & 3] != loop:
        side += 1
    return other, side
