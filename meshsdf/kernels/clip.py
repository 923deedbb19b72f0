"""Clip a lattice line by half-spaces, and a segment or triangle by a slab: the inner steps of
every scan over voxels or bricks."""

import numpy as np
from numba import njit

FLAT = 1e-14  # a slope this small changes nothing over 1e5 voxels that a slack of 1e-9 would miss


@njit(cache=True, nogil=True)
def clip_line(low, high, offset, slope, bound):
    """Keep the z in [low, high] with ``offset + slope * z <= bound``; low > high when none."""
    room = bound - offset
    if slope > FLAT:
        high = min(high, room / slope)
    elif slope < -FLAT:
        low = max(low, room / slope)
    elif room < 0.0:
        high = -np.inf
    return low, high


@njit(cache=True, nogil=True)
def add_half_space(planes, k, x, y, z, bound):
    """Write ``x * px + y * py + z * pz <= bound`` as row k of ``planes``; return k + 1.

    A row holds (kind, c, cx, cy): the line at (px, py) is cut at ``c - cx px - cy py`` from
    above (kind 1) or below (-1), or is out where that is negative (0, planes along the line).
    """
    row = planes[k]
    if abs(z) > FLAT:
        scale = 1.0 / z
        row[0] = 1.0 if z > 0.0 else -1.0
        row[1], row[2], row[3] = bound * scale, x * scale, y * scale
    else:
        row[0], row[1], row[2], row[3] = 0.0, bound, x, y
    return k + 1


@njit(cache=True, nogil=True)
def clip_row(planes, k, px, py, low, high):
    """Clip the line at (px, py) to [low, high] and to k half-spaces; low > high if nothing is left.

    Rounding is below 4 u |p| / |pz| per plane, where the slack of the bound moves the cut by
    slack / |pz|; slacks of 1e-8 cover |p| up to 1e7.
    """
    for i in range(k):
        cut = planes[i, 1] - planes[i, 2] * px - planes[i, 3] * py
        if planes[i, 0] > 0.0:
            high = min(high, cut)
        elif planes[i, 0] < 0.0:
            low = max(low, cut)
        elif cut < 0.0:
            return 1.0, 0.0
        if low > high:
            break
    return low, high


@njit(cache=True, nogil=True)
def clip_rows(planes, k, px, py, lows, highs):
    """`clip_row` for the lines at (px, py + j), j = 0 ... 7, at once: fills (8,) lows, highs."""
    for i in range(k):
        kind, cut, step = planes[i, 0], planes[i, 1] - planes[i, 2] * px, planes[i, 3]
        cut -= step * py
        if kind > 0.0:
            for j in range(8):
                bound = cut - step * j
                highs[j] = bound if bound < highs[j] else highs[j]
        elif kind < 0.0:
            for j in range(8):
                bound = cut - step * j
                lows[j] = bound if bound > lows[j] else lows[j]
        else:
            for j in range(8):
                highs[j] = -np.inf if cut - step * j < 0.0 else highs[j]


@njit(cache=True, nogil=True)
def clip_segment(t0, t1, start, extent, low, high):
    """Keep the t in [t0, t1] with ``low <= start + t * extent <= high``; t0 > t1 when none."""
    if extent == 0.0:
        if start < low or start > high:
            return 1.0, 0.0
        return t0, t1
    ta, tb = (low - start) / extent, (high - start) / extent
    return max(t0, min(ta, tb)), min(t1, max(ta, tb))


@njit(cache=True, nogil=True)
def triangle_range(px, py, qx, qy, rx, ry, low, high):
    """Least and greatest y of the part of triangle pqr with ``low <= x <= high``."""
    y0, y1 = np.inf, -np.inf
    for side in range(3):
        if side == 0:
            ax, ay, bx, by = px, py, qx, qy
        elif side == 1:
            ax, ay, bx, by = qx, qy, rx, ry
        else:
            ax, ay, bx, by = rx, ry, px, py
        t0, t1 = clip_segment(0.0, 1.0, ax, bx - ax, low, high)
        if t0 <= t1:
            ya, yb = ay + t0 * (by - ay), ay + t1 * (by - ay)
            y0, y1 = min(y0, ya, yb), max(y1, ya, yb)
    return y0, y1
