"""Decide for the nodes of bricks whether the winding number exceeds 1/2 in magnitude.

A block of nodes that no curtain meets shares one evaluation of the boundary term: where its value
at the centre is farther from every half that matters than the term may vary in the block, all
nodes are decided. Blocks are bricks, then eighths of bricks, then nodes. A node is evaluated with
expansions; if their bound leaves the answer open, with finer ones, and in the end exactly.
"""

import numpy as np
from numba import njit

from .boundary_winding import boundary_term, variation

COARSE = 2e-4  # error allowed per expansion, in units of W
FINE = 1e-8


@njit(cache=True, nogil=True)
def sum_upwards(coordinates, crossings, top):
    """Turn crossings (b, 512) into the counts N of nodes, summed upwards along every line.

    ``coordinates`` (b, 3) are in lexicographic order and hold whole columns of bricks; ``top``
    (b, 64) int32 receives the counts above each brick.
    """
    for b in range(len(coordinates)):
        below = b - 1
        same = (
            b > 0
            and coordinates[b, 0] == coordinates[below, 0]
            and coordinates[b, 1] == coordinates[below, 1]
        )
        for line in range(64):
            total = top[below, line] if same else 0
            for k in range(8):
                total += crossings[b, 8 * line + k]
                crossings[b, 8 * line + k] = total
            top[b, line] = total


@njit(cache=True, nogil=True)
def _winding(boundary, p, count, membrane):
    """W at p, exact enough to compare its magnitude with 1/2 and with 1/2 +- membrane."""
    value, error = boundary_term(boundary, p, COARSE)
    off = abs(abs(count + value) - 0.5)
    if off <= error or abs(off - membrane) <= error:
        value, error = boundary_term(boundary, p, FINE)
        off = abs(abs(count + value) - 0.5)
        if off <= error or abs(off - membrane) <= error:
            value, error = boundary_term(boundary, p, 0.0)
    return count + value


@njit(cache=True, nogil=True)
def _settle_block(boundary, corner, first, side, counts, membrane, inside):
    """Decide a block of side^3 nodes at once; False where that cannot be done."""
    half = 0.5 * (side - 1)
    p = (
        float(corner[0] + first[0]) + half,
        float(corner[1] + first[1]) + half,
        float(corner[2] + first[2]) + half,
    )
    low, high = counts[0], counts[0]
    low = counts[64 * first[0] + 8 * first[1] + first[2]]
    high = low
    for i in range(first[0], first[0] + side):
        for j in range(first[1], first[1] + side):
            for k in range(first[2], first[2] + side):
                count = counts[64 * i + 8 * j + k]
                low, high = min(low, count), max(high, count)
    spread = variation(boundary, p, half, 0.5 - membrane)
    if spread == np.inf:
        return False
    value, error = boundary_term(boundary, p, COARSE)
    spread += error
    for count in range(low, high + 1):
        if abs(abs(count + value) - 0.5) <= spread + membrane:
            return False
    for i in range(first[0], first[0] + side):
        for j in range(first[1], first[1] + side):
            for k in range(first[2], first[2] + side):
                node = 64 * i + 8 * j + k
                inside[node] = abs(counts[node] + value) > 0.5
    return True


@njit(cache=True, nogil=True)
def wind_bricks(boundary, coordinates, counts, membrane, inside, uncertain):
    """Fill ``inside`` (b, 512) bool; ``uncertain[b]`` counts nodes with ||W| - 1/2| < membrane.

    ``coordinates`` (b, 3) int64 are local bricks, ``counts`` (b, 512) int32 their N.
    """
    for b in range(len(coordinates)):
        corner = (8 * coordinates[b, 0], 8 * coordinates[b, 1], 8 * coordinates[b, 2])
        uncertain[b] = 0
        if _settle_block(boundary, corner, (0, 0, 0), 8, counts[b], membrane, inside[b]):
            continue
        for eighth in range(8):
            first = (4 * (eighth >> 2), 4 * ((eighth >> 1) & 1), 4 * (eighth & 1))
            if _settle_block(boundary, corner, first, 4, counts[b], membrane, inside[b]):
                continue
            for n in range(64):
                i, j, k = first[0] + (n >> 4), first[1] + ((n >> 2) & 3), first[2] + (n & 3)
                node = 64 * i + 8 * j + k
                p = (float(corner[0] + i), float(corner[1] + j), float(corner[2] + k))
                wound = abs(_winding(boundary, p, counts[b, node], membrane))
                inside[b, node] = wound > 0.5
                uncertain[b] += abs(wound - 0.5) < membrane


@njit(cache=True, nogil=True)
def wind_points(boundary, points, counts, wound):
    """``wound[n]`` = W at local point n, whose count N is ``counts[n]``; every edge exactly."""
    for n in range(len(points)):
        p = (points[n, 0], points[n, 1], points[n, 2])
        value, _ = boundary_term(boundary, p, 0.0)
        wound[n] = counts[n] + value
