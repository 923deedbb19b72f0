"""How much the boundary term of `boundary_winding` can change within a cube of nodes.

Where no curtain passes, its gradient is the field of a current along the boundary (Biot, Savart):

    4 pi grad W = - sum over edges of the integral of dl x r / |r|^3,     r from p to the edge,

in closed form (a x b) (|a| + |b|) / (|a| |b| (|a| |b| + a.b)) for an edge ab. At distance d an edge
of length L adds at most min(L / d, 2) / d to it and min(2 L / d, 4) / d^2 to its derivative; a
closed chain with a fan of area S at most 2 S / d^3 to the gradient.
"""

import numpy as np
from numba import njit

from .boundary_tree import FAN_AREA, HIGH, HUB, LENGTH, LOW, RADIUS
from .boundary_winding import NEAR_LINE


@njit(cache=True, nogil=True)
def _segment_distance(a, b, p):
    """Distance from p to segment ab."""
    wx, wy, wz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    x, y, z = p[0] - a[0], p[1] - a[1], p[2] - a[2]
    squared = wx * wx + wy * wy + wz * wz
    t = (x * wx + y * wy + z * wz) / squared if squared > 0.0 else 0.0
    t = min(max(t, 0.0), 1.0)
    x, y, z = x - t * wx, y - t * wy, z - t * wz
    return np.sqrt(x * x + y * y + z * z)


@njit(cache=True, nogil=True)
def _field(a, b, p):
    """Integral of dl x r / |r|^3 along edge ab."""
    ax, ay, az = a[0] - p[0], a[1] - p[1], a[2] - p[2]
    bx, by, bz = b[0] - p[0], b[1] - p[1], b[2] - p[2]
    ra, rb = np.sqrt(ax * ax + ay * ay + az * az), np.sqrt(bx * bx + by * by + bz * bz)
    dot = ax * bx + ay * by + az * bz
    scale = (ra + rb) / (ra * rb * (ra * rb + dot))
    return (
        scale * (by * az - bz * ay),
        scale * (bz * ax - bx * az),
        scale * (bx * ay - by * ax),
    )


@njit(cache=True, nogil=True)
def change(boundary, p, half, limit, small):
    """Linear model of the boundary term in the cube p +- half.

    Returns the gradient of W, a bound on its change beyond the linear model, how large the linear
    part can be, and whether a curtain passes, at which the term jumps by a whole number. The
    bound is infinite where it exceeds ``limit`` or where an edge may meet the cube. Tree nodes
    that change W by less than ``small`` are bounded as a whole and left out of the gradient.
    """
    points, chain, _, _, nodes, data = boundary
    reach = half * np.sqrt(3.0)
    scale = 0.25 / np.pi
    bound = 0.0
    x, y, z = 0.0, 0.0, 0.0
    is_cut = False
    wide = half + NEAR_LINE
    n = 0
    while n < len(nodes):
        node = data[n]
        hx, hy, hz = node[HUB] - p[0], node[HUB + 1] - p[1], node[HUB + 2] - p[2]
        curtain = (
            abs(hx) <= 0.5 * (node[HIGH] - node[LOW]) + wide
            and abs(hy) <= 0.5 * (node[HIGH + 1] - node[LOW + 1]) + wide
            and node[LOW + 2] <= p[2] + wide
        )
        bounded = False
        if not curtain or is_cut:
            d = np.sqrt(hx * hx + hy * hy + hz * hz) - node[RADIUS] - reach
            if d > 0.0:
                slope = node[LENGTH] / (d * d)
                if nodes[n, 4] == 0:
                    slope = min(slope, 2.0 * node[FAN_AREA] / (d * d * d))
                part = scale * reach * slope
                bounded = part < small
        if bounded:
            bound += part
            n = nodes[n, 2]
        elif nodes[n, 3] == 1:
            for e in range(nodes[n, 0], nodes[n, 1]):
                a, b = points[chain[e, 0]], points[chain[e, 1]]
                is_cut = is_cut or (
                    min(a[0], b[0]) <= p[0] + wide
                    and max(a[0], b[0]) >= p[0] - wide
                    and min(a[1], b[1]) <= p[1] + wide
                    and max(a[1], b[1]) >= p[1] - wide
                    and min(a[2], b[2]) <= p[2] + wide
                )
                d = _segment_distance(a, b, p) - reach
                if d <= 0.0:
                    return (0.0, 0.0, 0.0), np.inf, 0.0, True
                wx, wy, wz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
                length = np.sqrt(wx * wx + wy * wy + wz * wz)
                bound += scale * reach * reach * min(length / d, 2.0) / (d * d)
                fx, fy, fz = _field(a, b, p)
                x, y, z = x + fx, y + fy, z + fz
            n = nodes[n, 2]
        else:
            n += 1
        if bound > limit:
            return (0.0, 0.0, 0.0), np.inf, 0.0, True
    x, y, z = -scale * x, -scale * y, -scale * z
    return (x, y, z), bound, half * (abs(x) + abs(y) + abs(z)), is_cut
