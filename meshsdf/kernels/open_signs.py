"""Decide for the nodes of bricks whether the winding number exceeds 1/2 in magnitude.

Within a block of nodes away from the boundary the boundary term is linear up to a known bound, so
one evaluation at its centre does for all nodes at which the winding number is not that close to
1/2. Where a curtain passes the term jumps from one vertical line to the next, so each line of
nodes is evaluated once. Blocks have 8, 4, 2 nodes a side. A node is evaluated
with expansions; if their bound leaves the answer open, with finer ones, and in the end exactly.
"""

import numpy as np
from numba import njit

from .boundary_change import change
from .boundary_winding import boundary_term

COARSE = 2e-4  # error allowed per expansion, in units of W
FINE = 1e-8
# A hole's membrane may lie in a plane of nodes; all of them are then outside, rounding or not
HALF = 0.5 + 1e-9
# Along a line through the cube the slope at the centre is off by the derivative's bound times the
# half diagonal; over half a side that is 2 / sqrt(3) of the bound for points and centre
ALONG_LINE = 1.16
QUICK = 0.3, 0.05  # change up to which a block is tried as a whole; that of one tree node
ONE = np.uint64(1)
SMALL = 2e-4  # change of W below which a tree node is not looked into, for the linear model
BENT = (0.06, 0.15, 0.25)  # change beyond the linear model for which 8^3, 4^3, 2^3 are cut


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
def _is_clear(wound, error, membrane):
    """An error of W does not change on which side of 1/2 and of 1/2 +- membrane |W| lies."""
    off = abs(abs(wound) - HALF)
    return off > error and abs(off - membrane) > error


@njit(cache=True, nogil=True)
def _winding(boundary, p, count, membrane):
    """W at p, exact enough to compare its magnitude with 1/2 and with 1/2 +- membrane."""
    value = 0.0
    for tolerance in (COARSE, FINE, 0.0):
        value, error = boundary_term(boundary, p, tolerance)
        if _is_clear(count + value, error, membrane):
            break
    return count + value


@njit(cache=True, nogil=True)
def _settle_evenly(counts, first, side, value, error, membrane, inside):
    """Decide a block whose term is value +- error, if its counts leave all nodes clear."""
    low = high = counts[64 * first[0] + 8 * first[1] + first[2]]
    for i in range(first[0], first[0] + side):
        for j in range(first[1], first[1] + side):
            for k in range(first[2], first[2] + side):
                count = counts[64 * i + 8 * j + k]
                low, high = min(low, count), max(high, count)
    for count in range(low, high + 1):
        if abs(abs(count + value) - HALF) <= error + membrane:
            return False
    for i in range(first[0], first[0] + side):
        for j in range(first[1], first[1] + side):
            for k in range(first[2], first[2] + side):
                node = 64 * i + 8 * j + k
                inside[node] = abs(counts[node] + value) > HALF
    return True


@njit(cache=True, nogil=True)
def _settle_block(boundary, corner, first, side, counts, membrane, inside, uncertain):
    """Decide a block of side^3 nodes, unless it must be cut first: then return False."""
    half = 0.5 * (side - 1)
    x, y = float(corner[0] + first[0]), float(corner[1] + first[1])
    z = float(corner[2] + first[2]) + half
    center = (x + half, y + half, z)
    limit = BENT[0] if side == 8 else BENT[1] if side == 4 else BENT[2]
    value, error = 0.0, np.inf
    for is_quick in (True, False):
        most, small = QUICK if is_quick else (limit, SMALL)
        slope, bent, linear, is_cut = change(boundary, center, half, most, small)
        if is_quick and (is_cut or bent + linear >= 0.5 - membrane):
            continue
        if bent == np.inf:
            return False
        if is_cut:
            bent *= ALONG_LINE
            continue
        if error == np.inf:
            value, error = boundary_term(boundary, center, COARSE)
        spread = bent + linear + error
        if _settle_evenly(counts, first, side, value, spread, membrane, inside):
            return True
    for i in range(side):
        for j in range(side):
            at = value + slope[0] * (i - half) + slope[1] * (j - half)
            if is_cut:
                at, error = boundary_term(boundary, (x + i, y + j, z), COARSE)
            for k in range(side):
                node = 64 * (first[0] + i) + 8 * (first[1] + j) + first[2] + k
                wound = counts[node] + at + slope[2] * (k - half)
                if not _is_clear(wound, bent + error, membrane):
                    p = (x + i, y + j, z + (k - half))
                    wound = _winding(boundary, p, counts[node], membrane)
                inside[node] = abs(wound) > HALF
                if abs(abs(wound) - HALF) < membrane:
                    uncertain[node >> 6] |= ONE << np.uint64(node & 63)
    return True


@njit(cache=True, nogil=True)
def wind_bricks(boundary, coordinates, counts, membrane, only_whole, inside, uncertain, is_hard):
    """Fill ``inside`` (b, 512) bool; set bits of nodes with ||W| - 1/2| < membrane.

    ``coordinates`` (b, 3) int64 are local bricks, ``counts`` (b, 512) int32 their N,
    ``uncertain`` (b, 8) uint64 the bits, of zeros. ``is_hard`` (b,) bool: with ``only_whole``,
    bricks that cannot be decided at once, and are not.
    """
    cubes = np.empty((32, 4), np.int64)  # first node and side of cubes: 1 + 3 levels of 7 more
    for b in range(len(coordinates)):
        corner = (8 * coordinates[b, 0], 8 * coordinates[b, 1], 8 * coordinates[b, 2])
        is_hard[b] = False
        cubes[0] = 0
        cubes[0, 3] = 8
        n_left = 1
        while n_left > 0:
            n_left -= 1
            first, side = (
                (cubes[n_left, 0], cubes[n_left, 1], cubes[n_left, 2]),
                cubes[n_left, 3],
            )
            if side == 1:
                node = 64 * first[0] + 8 * first[1] + first[2]
                x, y, z = corner[0] + first[0], corner[1] + first[1], corner[2] + first[2]
                p = (float(x), float(y), float(z))
                wound = abs(_winding(boundary, p, counts[b, node], membrane))
                inside[b, node] = wound > HALF
                if abs(wound - HALF) < membrane:
                    uncertain[b, node >> 6] |= ONE << np.uint64(node & 63)
                continue
            states = inside[b], uncertain[b]
            if _settle_block(boundary, corner, first, side, counts[b], membrane, *states):
                continue
            if only_whole:
                is_hard[b] = True
                break
            side //= 2
            for part in range(8):
                cubes[n_left, 0] = first[0] + side * (part >> 2)
                cubes[n_left, 1] = first[1] + side * ((part >> 1) & 1)
                cubes[n_left, 2] = first[2] + side * (part & 1)
                cubes[n_left, 3] = side
                n_left += 1


@njit(cache=True, nogil=True)
def wind_points(boundary, points, counts, wound):
    """``wound[n]`` = W at local point n, whose count N is ``counts[n]``; every edge exactly."""
    for n in range(len(points)):
        p = (points[n, 0], points[n, 1], points[n, 2])
        value, _ = boundary_term(boundary, p, 0.0)
        wound[n] = counts[n] + value
