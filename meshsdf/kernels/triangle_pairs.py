"""Pairs of triangles that certainly cross, by a tree of boxes over triangles in Morton order.

The tree is implicit: node n has children 2 n and 2 n + 1, leaves hold LEAF consecutive triangles.
"""

import numpy as np
from numba import njit

LEAF = 4

# The 3x3 determinant of differences, computed in float64 with unit roundoff u = 2**-53, is off by
# less than (7 u + 56 u**2) times the same sum of absolute values (Shewchuk 1997,
# doi:10.1007/PL00009321, the bound A of orient3d); 8 u leaves room for the bound's own rounding.
ERROR = 8 * 2.0**-53
BESIDE = 1e-9  # of an edge's length: far above the rounding of a place that can be told


@njit(cache=True, nogil=True)
def fill_boxes(points, faces, first_leaf, boxes, nodes):
    """Fill ``boxes`` (m, 6) of the triangles and ``nodes`` (2 first_leaf, 6) of the tree.

    A box is lower x, y, z, upper x, y, z. nodes is filled with +inf, -inf (empty boxes) before.
    """
    for f in range(len(faces)):
        leaf = first_leaf + f // LEAF
        for axis in range(3):
            a, b = points[faces[f, 0], axis], points[faces[f, 1], axis]
            c = points[faces[f, 2], axis]
            boxes[f, axis] = min(a, b, c)
            boxes[f, axis + 3] = max(a, b, c)
            nodes[leaf, axis] = min(nodes[leaf, axis], boxes[f, axis])
            nodes[leaf, axis + 3] = max(nodes[leaf, axis + 3], boxes[f, axis + 3])
    for n in range(first_leaf - 1, 0, -1):
        for axis in range(3):
            nodes[n, axis] = min(nodes[2 * n, axis], nodes[2 * n + 1, axis])
            nodes[n, axis + 3] = max(nodes[2 * n, axis + 3], nodes[2 * n + 1, axis + 3])


@njit(cache=True, nogil=True)
def _overlap(a, i, b, j):
    """Closed boxes a[i] and b[j] have a point in common."""
    return (
        a[i, 0] <= b[j, 3]
        and b[j, 0] <= a[i, 3]
        and a[i, 1] <= b[j, 4]
        and b[j, 1] <= a[i, 4]
        and a[i, 2] <= b[j, 5]
        and b[j, 2] <= a[i, 5]
    )


@njit(cache=True, nogil=True)
def _volume(points, a, b, c, d):
    """Six times the signed volume of a tetrahedron; 0 unless its sign is certain."""
    dx, dy, dz = points[d, 0], points[d, 1], points[d, 2]
    ax, ay, az = points[a, 0] - dx, points[a, 1] - dy, points[a, 2] - dz
    bx, by, bz = points[b, 0] - dx, points[b, 1] - dy, points[b, 2] - dz
    cx, cy, cz = points[c, 0] - dx, points[c, 1] - dy, points[c, 2] - dz
    bc, cb = bx * cy, cx * by
    ca, ac = cx * ay, ax * cy
    ab, ba = ax * by, bx * ay
    volume = az * (bc - cb) + bz * (ca - ac) + cz * (ab - ba)
    size = (
        abs(az) * (abs(bc) + abs(cb))
        + abs(bz) * (abs(ca) + abs(ac))
        + abs(cz) * (abs(ab) + abs(ba))
    )
    return volume if abs(volume) > ERROR * size else 0.0


@njit(cache=True, nogil=True)
def _passes(points, face, p, q, has_common):
    """The line through p and q passes the closed triangle, seen from p or from q.

    With a corner common to both faces it must pass certainly: near that corner all lines do.
    """
    u = _volume(points, p, q, face[0], face[1])
    v = _volume(points, p, q, face[1], face[2])
    w = _volume(points, p, q, face[2], face[0])
    if has_common:
        return min(u, v, w) > 0 or max(u, v, w) < 0
    return min(u, v, w) >= 0 < max(u, v, w) or max(u, v, w) <= 0 > min(u, v, w)


@njit(cache=True, nogil=True)
def _pierces(points, edges_of, face, place):
    """Some edge of one face goes from one side of the other's plane to its other side, through it.

    A corner common to both lies in the plane exactly, so edges at it are passed over.
    """
    s0 = _volume(points, face[0], face[1], face[2], edges_of[0])
    s1 = _volume(points, face[0], face[1], face[2], edges_of[1])
    s2 = _volume(points, face[0], face[1], face[2], edges_of[2])
    if min(s0, s1, s2) >= 0 or max(s0, s1, s2) <= 0:
        return False
    sides = (s0, s1, s2)
    has_common = False
    for e in range(9):
        has_common |= edges_of[e // 3] == face[e % 3]
    for e in range(3):
        s, t = sides[e], sides[(e + 1) % 3]
        if (s > 0 > t) or (s < 0 < t):
            p, q = edges_of[e], edges_of[(e + 1) % 3]
            if _passes(points, face, p, q, has_common):
                share, within = s / (s - t), True
                for axis in range(3):
                    a, b = points[p, axis], points[q, axis]
                    place[axis] = (1 - share) * a + share * b
                    # An edge in the plane but for rounding, beside the face, passes it nowhere
                    x, y, z = points[face[0], axis], points[face[1], axis], points[face[2], axis]
                    slack = BESIDE * abs(b - a)
                    within &= min(x, y, z) - slack <= place[axis] <= max(x, y, z) + slack
                if within:
                    return True
    return False


@njit(cache=True, nogil=True)
def count_crossing_pairs(
    points, faces, number, first_leaf, boxes, nodes, leaf_begin, leaf_end, first_pair, first_place
):
    """Count pairs (f, g) that cross, f in leaves leaf_begin .. leaf_end - 1, g later in the order.

    number : (m,) the caller's number of each face. first_pair : (2,) int64 and first_place : (3,)
    receive the pair that is first in the caller's numbers, if it precedes what they hold.
    """
    n_crossing = 0
    place = np.empty(3)
    stack = np.empty(64, dtype=np.int64)
    for leaf in range(leaf_begin, leaf_end):
        stack[0] = 1
        top = 1
        while top > 0:
            top -= 1
            n = stack[top]
            if not _overlap(nodes, first_leaf + leaf, nodes, n):
                continue
            if n < first_leaf:
                stack[top], stack[top + 1] = 2 * n + 1, 2 * n
                top += 2
                continue
            other = n - first_leaf
            if other < leaf:
                continue
            for f in range(leaf * LEAF, min((leaf + 1) * LEAF, len(faces))):
                for g in range(max(f + 1, other * LEAF), min((other + 1) * LEAF, len(faces))):
                    if not _overlap(boxes, f, boxes, g):
                        continue
                    if not (
                        _pierces(points, faces[f], faces[g], place)
                        or _pierces(points, faces[g], faces[f], place)
                    ):
                        continue
                    n_crossing += 1
                    low, high = min(number[f], number[g]), max(number[f], number[g])
                    if low < first_pair[0] or (low == first_pair[0] and high < first_pair[1]):
                        first_pair[0], first_pair[1] = low, high
                        first_place[:] = place
    return n_crossing
