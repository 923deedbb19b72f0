"""Do two sets of triangles come within a small gap of each other, inside a cube?

Triangles are clipped by the cube (Sutherland and Hodgman 1974, doi:10.1145/360767.360802). Two
convex polygons are nearest to each other at a corner of one, at an edge of each, or where an edge
of one goes through the other.
"""

import numpy as np
from numba import njit

from .point_triangle import closest_on_triangle

MOST_CORNERS = 10  # of a triangle cut by six planes, and one to spare


@njit(cache=True, nogil=True)
def sets_touch(triangles, low, high, one, other, box_low, box_high, gap):
    """Whether some triangle ``one[i]`` comes within ``gap`` of some ``other[j]`` in a cube.

    ``low`` and ``high`` (n, 3) are the boxes of the triangles (n, 3, 3), cut by the cube.
    """
    order = other[np.argsort(low[other, 0])]
    starts = low[order, 0].copy()
    widest = 0.0
    for f in order:
        widest = max(widest, high[f, 0] - low[f, 0])
    p, q = np.empty((2, MOST_CORNERS, 3)), np.empty((2, MOST_CORNERS, 3))
    for f in one:
        n = -1
        at = np.searchsorted(starts, low[f, 0] - gap - widest)
        while at < len(order) and starts[at] <= high[f, 0] + gap:
            g = order[at]
            at += 1
            if not _boxes_meet(low, high, f, g, gap):
                continue
            if n < 0:
                n = _clipped(triangles[f], box_low, box_high, p)
            if n == 0:
                break
            m = _clipped(triangles[g], box_low, box_high, q)
            if m > 0 and _polygons_touch(p[0], n, q[0], m, gap * gap):
                return True
    return False


@njit(cache=True, nogil=True, inline="always")
def _boxes_meet(low, high, f, g, gap):
    for axis in range(3):
        if low[g, axis] > high[f, axis] + gap or low[f, axis] > high[g, axis] + gap:
            return False
    return True


@njit(cache=True, nogil=True)
def _clipped(triangle, low, high, rows):
    """Corners of the part of a triangle in the cube, to ``rows[0]``; returns how many."""
    for corner in range(3):
        for axis in range(3):
            rows[0, corner, axis] = triangle[corner, axis]
    n = 3
    for side in range(6):
        axis = side >> 1
        sign, bound = (1.0, high) if side & 1 else (-1.0, -low)
        m = 0
        for i in range(n):
            j = i + 1 if i + 1 < n else 0
            a, b = bound - sign * rows[0, i, axis], bound - sign * rows[0, j, axis]
            if a >= 0.0:
                rows[1, m] = rows[0, i]
                m += 1
            if (a < 0.0) != (b < 0.0):
                t = a / (a - b)
                for k in range(3):
                    rows[1, m, k] = rows[0, i, k] + t * (rows[0, j, k] - rows[0, i, k])
                m += 1
        n = m
        for i in range(n):
            rows[0, i] = rows[1, i]
    return n


@njit(cache=True, nogil=True)
def _polygons_touch(p, n, q, m, gap2):
    """Whether two convex polygons come within a (squared) gap."""
    if _is_near_corners(p, n, q, m, gap2) or _is_near_corners(q, m, p, n, gap2):
        return True
    for i in range(n):
        a, b = p[i], p[i + 1 if i + 1 < n else 0]
        for j in range(m):
            if _segments2(a, b, q[j], q[j + 1 if j + 1 < m else 0]) < gap2:
                return True
    return _is_pierced(p, n, q, m, gap2) or _is_pierced(q, m, p, n, gap2)


@njit(cache=True, nogil=True)
def _is_near_corners(p, n, q, m, gap2):
    """Whether a corner of p is near q."""
    least = np.inf
    for i in range(n):
        least = min(least, _to_polygon2(p[i, 0], p[i, 1], p[i, 2], q, m))
    return least < gap2


@njit(cache=True, nogil=True)
def _to_polygon2(x, y, z, q, m):
    """Squared distance of a point to a convex polygon."""
    best = np.inf
    if m < 3:
        for j in range(m):
            best = min(best, (q[j, 0] - x) ** 2 + (q[j, 1] - y) ** 2 + (q[j, 2] - z) ** 2)
    for j in range(1, m - 1):
        best = min(best, closest_on_triangle(x, y, z, q[0], q[j], q[j + 1])[0])
    return best


@njit(cache=True, nogil=True)
def _is_pierced(p, n, q, m, gap2):
    """Whether an edge of p goes through q."""
    nx, ny, nz = 0.0, 0.0, 0.0
    for j in range(1, m - 1):
        ux, uy, uz = q[j, 0] - q[0, 0], q[j, 1] - q[0, 1], q[j, 2] - q[0, 2]
        vx, vy, vz = q[j + 1, 0] - q[0, 0], q[j + 1, 1] - q[0, 1], q[j + 1, 2] - q[0, 2]
        nx, ny, nz = nx + uy * vz - uz * vy, ny + uz * vx - ux * vz, nz + ux * vy - uy * vx
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        a = nx * (p[i, 0] - q[0, 0]) + ny * (p[i, 1] - q[0, 1]) + nz * (p[i, 2] - q[0, 2])
        b = nx * (p[j, 0] - q[0, 0]) + ny * (p[j, 1] - q[0, 1]) + nz * (p[j, 2] - q[0, 2])
        if a * b >= 0.0:
            continue
        t = a / (a - b)
        x = p[i, 0] + t * (p[j, 0] - p[i, 0])
        y = p[i, 1] + t * (p[j, 1] - p[i, 1])
        z = p[i, 2] + t * (p[j, 2] - p[i, 2])
        if _to_polygon2(x, y, z, q, m) < gap2:
            return True
    return False


@njit(cache=True, nogil=True)
def _segments2(a, b, c, d):
    """Squared distance of two segments (Ericson, "Real-Time Collision Detection", 2005, 5.1.9)."""
    u2 = uv = v2 = uw = vw = 0.0
    for k in range(3):
        u, v, w = b[k] - a[k], d[k] - c[k], a[k] - c[k]
        u2, uv, v2 = u2 + u * u, uv + u * v, v2 + v * v
        uw, vw = uw + u * w, vw + v * w
    s, t = 0.0, 0.0
    if u2 > 0.0:
        slant = u2 * v2 - uv * uv
        if slant > 1e-14 * u2 * v2:
            s = min(max((uv * vw - uw * v2) / slant, 0.0), 1.0)
        if v2 > 0.0:
            t = (uv * s + vw) / v2
        if not 0.0 <= t <= 1.0 or v2 == 0.0:
            t = min(max(t, 0.0), 1.0)
            s = min(max((uv * t - uw) / u2, 0.0), 1.0)
    elif v2 > 0.0:
        t = min(max(vw / v2, 0.0), 1.0)
    far2 = 0.0
    for k in range(3):
        far2 += (a[k] + s * (b[k] - a[k]) - c[k] - t * (d[k] - c[k])) ** 2
    return far2
