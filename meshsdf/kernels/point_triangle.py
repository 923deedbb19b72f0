"""Closest point of a triangle, in the triangle's own frame.

Each triangle is stored once as a frame of 16 numbers: its longest edge is laid on the x axis from
the origin to (l, 0), its third corner is (m, h) with 0 <= m <= l and h >= 0. A query is then three
dot products and a case distinction between seven regions (face, three edges, three corners) in
the plane, which is simple because both angles at the longest edge are acute (Jones 1995).

The frame is orthonormal to a few ulps even for slivers, because its second axis is projected twice
(Gram-Schmidt with one re-orthogonalisation; Giraud, Langou, Rozloznik 2005,
doi:10.1016/j.camwa.2005.08.009). The answer is therefore the exact answer for a triangle whose
corners moved by a few ulps of its longest edge L, and as the distance cannot change by more than
the corners move,

    |computed - true| <= 50 u (|p - a| + L),    u = 2**-53,

whatever the shape: 2 u for the coordinates, 5.2 u for three dot products, 10 u for the axes, 8 u
for (l, m, h) and 6 u for the foot on an edge (both times L), 4 u for the root, added and rounded
up. No region test can spoil it: a wrong region next to a border has a foot as good as the right.
Corners that coincide or lie on a line are triangles with h = 0 or l = 0 and need no other path.

Squares must neither underflow nor overflow: lengths between 1e-150 and 1e150.

References: M. W. Jones, "3D distance from a point to a triangle", report CSR-5-95, Swansea 1995;
C. Ericson, "Real-Time Collision Detection", 2005, section 5.1.5.
"""

import numpy as np
from numba import njit

FRAME_SIZE = 16
# Slots of a frame: a (0:3), x axis (3:6), y axis (6:9), normal (9:12), then:
L, M, H, FIRST_CORNER = 12, 13, 14, 15

FACE, BASE, LEFT, RIGHT = 0, 1, 2, 3
FLAT = 4 * 2.0**-52  # a height below 4 eps L is rounding of a height of zero


@njit(cache=True, nogil=True)
def triangle_frame(a, b, c):
    """Axes and sizes of a triangle's frame: (first corner, x axis, y axis, l, m, h)."""
    # The longest edge is the base; of two equal ones, the one not followed by length zero
    ab, bc, ca = _square(a, b), _square(b, c), _square(c, a)
    first, base, before = 0, ab, ca
    if bc > base:
        first, base, before = 1, bc, ab
    if ca > base:
        first, base, before = 2, ca, bc
    if before == 0.0:
        first = (first + 1) % 3
    if first == 1:
        a, b, c = b, c, a
    elif first == 2:
        a, b, c = c, a, b
    # x axis along the base
    l = np.sqrt(base)  # noqa: E741
    xx, xy, xz = 1.0, 0.0, 0.0
    if l > 0.0:
        xx, xy, xz = (b[0] - a[0]) / l, (b[1] - a[1]) / l, (b[2] - a[2]) / l
    # y axis towards the third corner, projected twice
    yx, yy, yz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    m = yx * xx + yy * xy + yz * xz
    yx, yy, yz = yx - m * xx, yy - m * xy, yz - m * xz
    rest = yx * xx + yy * xy + yz * xz
    yx, yy, yz = yx - rest * xx, yy - rest * xy, yz - rest * xz
    h = np.sqrt(yx * yx + yy * yy + yz * yz)
    if h > FLAT * l:
        yx, yy, yz = yx / h, yy / h, yz / h
    elif abs(xx) < 0.9:
        # Flat: any direction across the base will do
        h, across = 0.0, np.sqrt(xy * xy + xz * xz)
        yx, yy, yz = 0.0, -xz / across, xy / across
    else:
        h, across = 0.0, np.sqrt(xx * xx + xy * xy)
        yx, yy, yz = -xy / across, xx / across, 0.0
    return first, xx, xy, xz, yx, yy, yz, l, min(max(m + rest, 0.0), l), h


@njit(cache=True, nogil=True)
def _square(p, q):
    return (q[0] - p[0]) ** 2 + (q[1] - p[1]) ** 2 + (q[2] - p[2]) ** 2


@njit(cache=True, nogil=True)
def build_frames(corners, order, begin, end, frames):
    """``frames[s]`` = frame of triangle ``corners[order[s]]`` (3, 3), for begin <= s < end."""
    for s in range(begin, end):
        face = order[s]
        first, xx, xy, xz, yx, yy, yz, l, m, h = triangle_frame(  # noqa: E741
            corners[face, 0], corners[face, 1], corners[face, 2]
        )
        for axis in range(3):
            frames[s, axis] = corners[face, first, axis]
        frames[s, 3], frames[s, 4], frames[s, 5] = xx, xy, xz
        frames[s, 6], frames[s, 7], frames[s, 8] = yx, yy, yz
        frames[s, 9] = xy * yz - xz * yy
        frames[s, 10] = xz * yx - xx * yz
        frames[s, 11] = xx * yy - xy * yx
        frames[s, L], frames[s, M], frames[s, H], frames[s, FIRST_CORNER] = l, m, h, first


@njit(cache=True, nogil=True)
def planar_foot(x, y, l, m, h):  # noqa: E741 (the paper's letter)
    """Point of the triangle (0,0), (l,0), (m,h) nearest to (x, y), and its region."""
    if y <= 0.0:
        return min(max(x, 0.0), l), 0.0, BASE
    outside_right = (l - x) * h - y * (l - m) <= 0.0
    if x * h - y * m <= 0.0:
        square = m * m + h * h
        along = x * m + y * h
        if along < square:
            share = max(along, 0.0) / square
            return share * m, share * h, LEFT
        if not outside_right:
            return m, h, LEFT
    if outside_right:
        square = (l - m) * (l - m) + h * h
        along = (l - x) * (l - m) + y * h
        if along < square:
            share = max(along, 0.0) / square
            return l - share * (l - m), share * h, RIGHT
        return m, h, RIGHT
    return x, y, FACE


@njit(cache=True, nogil=True)
def squared_distance(frame, px, py, pz, best):
    """Squared distance of p to the triangle; exact if below ``best``, else any value >= it."""
    dx, dy, dz = px - frame[0], py - frame[1], pz - frame[2]
    z = dx * frame[9] + dy * frame[10] + dz * frame[11]
    square = z * z
    if square > best:
        return square
    x = dx * frame[3] + dy * frame[4] + dz * frame[5]
    y = dx * frame[6] + dy * frame[7] + dz * frame[8]
    qx, qy, _ = planar_foot(x, y, frame[L], frame[M], frame[H])
    return (x - qx) * (x - qx) + (y - qy) * (y - qy) + square


@njit(cache=True, nogil=True)
def barycentric_foot(frame, px, py, pz):
    """Barycentrics of the closest point, by corner; none is negative, and they add to one."""
    dx, dy, dz = px - frame[0], py - frame[1], pz - frame[2]
    x = dx * frame[3] + dy * frame[4] + dz * frame[5]
    y = dx * frame[6] + dy * frame[7] + dz * frame[8]
    return _weights(x, y, frame[L], frame[M], frame[H], int(frame[FIRST_CORNER]))[:3]


@njit(cache=True, nogil=True)
def closest_on_triangle(px, py, pz, a, b, c):
    """(squared distance, weight of a, weight of b, weight of c) of the closest point to p."""
    first, xx, xy, xz, yx, yy, yz, l, m, h = triangle_frame(a, b, c)  # noqa: E741
    origin = a if first == 0 else (b if first == 1 else c)
    dx, dy, dz = px - origin[0], py - origin[1], pz - origin[2]
    x, y = dx * xx + dy * xy + dz * xz, dx * yx + dy * yy + dz * yz
    z = dx * (xy * yz - xz * yy) + dy * (xz * yx - xx * yz) + dz * (xx * yy - xy * yx)
    of_a, of_b, of_c, planar = _weights(x, y, l, m, h, first)
    return planar + z * z, of_a, of_b, of_c


@njit(cache=True, nogil=True)
def _weights(x, y, l, m, h, first):  # noqa: E741
    """Barycentrics, by corner, of the foot of (x, y), and the squared distance to it."""
    qx, qy, region = planar_foot(x, y, l, m, h)
    v = w = 0.0
    if region == BASE:
        v = qx / l if l > 0.0 else 0.0
    elif region == LEFT:
        square = m * m + h * h
        w = min((qx * m + qy * h) / square, 1.0) if square > 0.0 else 0.0
    elif region == RIGHT:
        square = (l - m) * (l - m) + h * h
        w = min(((l - qx) * (l - m) + qy * h) / square, 1.0) if square > 0.0 else 0.0
        v = 1.0 - w
    else:
        w = min(qy / h, 1.0)
        v = min(max((qx - w * m) / l, 0.0), 1.0 - w)
    u = max(1.0 - v - w, 0.0)
    planar = (x - qx) * (x - qx) + (y - qy) * (y - qy)
    if first == 0:
        return u, v, w, planar
    if first == 1:
        return w, u, v, planar
    return v, w, u, planar
