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
