"""Normals at the crossings of a field of which only node values are known.

The gradient of the trilinear interpolant differs from cell to cell; here it is the mean over the
four cells around the edge: the difference of the edge's ends along it, and across it the central
differences at its ends, interpolated. Where a neighbour is unknown or infinite the difference is
one-sided, or 0.
"""

import numpy as np
from numba import njit

from .brick_lookup import INSIDE, find_brick


@njit(cache=True, nogil=True)
def _value(values, root, pages, background, i, j, k):
    """Value at a node, or NaN."""
    slot = find_brick(root, pages, i >> 3, j >> 3, k >> 3)
    value = np.nan
    if slot >= 0:
        value = np.float64(values[slot, i & 7, j & 7, k & 7])
    elif background < np.inf:
        value = -background if slot == INSIDE else background
    return value if abs(value) < np.inf else np.nan


@njit(cache=True, nogil=True)
def _slope(values, root, pages, background, i, j, k, axis, here):
    """Difference quotient across a node, per voxel."""
    di, dj, dk = np.int64(axis == 0), np.int64(axis == 1), np.int64(axis == 2)
    after = _value(values, root, pages, background, i + di, j + dj, k + dk)
    before = _value(values, root, pages, background, i - di, j - dj, k - dk)
    if np.isnan(after):
        return 0.0 if np.isnan(before) else here - before
    return after - here if np.isnan(before) else 0.5 * (after - before)


@njit(cache=True, nogil=True)
def gradient_normals(
    values, root, pages, background, shift, nodes, ways, fractions, begin, end, normals
):
    """Write the unit normals of crossings begin <= c < end.

    Node ``nodes[c] + shift`` is counted from the first node of ``root``, whose slots are rows of
    ``values``. Edges with an end unknown get their own direction.
    """
    for c in range(begin, end):
        axis = np.int64(ways[c] >> 1)
        i, j, k = nodes[c, 0] + shift[0], nodes[c, 1] + shift[1], nodes[c, 2] + shift[2]
        i1, j1, k1 = i + (axis == 0), j + (axis == 1), k + (axis == 2)
        a = _value(values, root, pages, background, i, j, k)
        b = _value(values, root, pages, background, i1, j1, k1)
        for x in range(3):
            normals[c, x] = 0.0
        normals[c, axis] = 1.0 if ways[c] & 1 else -1.0
        if np.isnan(a) or np.isnan(b):
            continue
        normals[c, axis] = b - a
        t = fractions[c]
        for turn in range(1, 3):
            across = (axis + turn) % 3
            lower = _slope(values, root, pages, background, i, j, k, across, a)
            upper = _slope(values, root, pages, background, i1, j1, k1, across, b)
            normals[c, across] = (1.0 - t) * lower + t * upper
        length = np.sqrt(normals[c, 0] ** 2 + normals[c, 1] ** 2 + normals[c, 2] ** 2)
        if length > 0.0:
            for x in range(3):
                normals[c, x] /= length
