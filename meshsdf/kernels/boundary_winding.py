"""Generalised winding numbers of lattice nodes from crossings and from the boundary alone.

Let N(p) be the signed number of faces below p on its vertical line, a face that looks down
counting +1, and u = +z. Hang a curtain from every boundary edge ab up to infinity. Mesh and
curtains together bound, so their solid angles around p sum to 4 pi times an integer, which is
N(p): the ray down from p meets no curtain, as these begin at edges and go up. Seen from p, the
curtain of ab is the spherical triangle (u, b, a). Hence

    W(p) = N(p) + 1 / (4 pi) sum over boundary half-edges of Omega(u, a, b; p).

In stereographic coordinates from -u, z = Q / P with Q = (x, y) and P = r + z (computed as
(x^2 + y^2) / (r - z) where z < 0), Omega / 2 = arg(P_a P_b + conj(Q_a) Q_b). Of these numbers none
suffers cancellation, and the argument is wrong by a few units of rounding over
cos(angle(a, b) / 2), that is, over the distance to the edge.

Omega jumps by 4 pi where p passes over the edge, and so does N, by the rule of `crossings` that
decides on which side of an edge a line passes. Where that rule and the sign of Q_a x Q_b differ,
which happens within rounding only, the argument is moved by a whole turn; so W never slips. A
line through a vertex is taken for one moved by (+0, 0+) in x and y, the latter being far larger:
that is what the half-open rules of `crossings` mean.
"""

import numpy as np
from numba import njit

from .boundary_tree import (
    AREA,
    FAN_AREA,
    HIGH,
    HUB,
    LENGTH,
    LOW,
    MOMENT,
    RADIUS,
    SECOND,
)
from .crossings import edge_height

NEAR_LINE = 1e-6  # voxels; far above the rounding of local coordinates, far below a voxel
BESIDE = 1e-150  # stands for an infinitely small step; its square is still a float
TURN = 2.0 * np.pi


@njit(cache=True, nogil=True)
def _seen(points, v, p):
    """Vertex v from p: x, y, z, and the stereographic coordinates qx, qy, P."""
    x, y, z = points[v, 0] - p[0], points[v, 1] - p[1], points[v, 2] - p[2]
    flat = x * x + y * y
    r = np.sqrt(flat + z * z)
    if z >= 0.0:
        return x, y, z, x, y, r + z
    if flat == 0.0:
        return x, y, z, -BESIDE * BESIDE, -BESIDE, 0.0
    return x, y, z, x, y, flat / (r - z)


@njit(cache=True, nogil=True)
def _rule_turn(points, v, w, line, line_ends, a, b, cross, dot, p):
    """Whole turns that make the argument of edge vw agree with the crossing rule."""
    in_range = (a[0] <= 0.0) != (b[0] <= 0.0)
    if not in_range:
        if cross != 0.0 or a[1] * b[1] >= 0.0 or dot >= 0.0:
            return 0
        # The line meets an edge seen end on, at x = 0: it is taken to pass beyond it
        return -1 if (b[1] > a[1]) == (b[0] <= 0.0) else 0
    y, way = edge_height(points[v], points[w], v, w, p[0])
    if line >= 0:
        s, t = line_ends[line, 0], line_ends[line, 1]
        y, _ = edge_height(points[s], points[t], s, t, p[0])
    rule = way if y <= p[1] else -way
    seen = 1 if cross >= 0.0 else -1
    if rule == seen or a[2] - a[0] / (b[0] - a[0]) * (b[2] - a[2]) > 0.0:
        return 0
    return rule


@njit(cache=True, nogil=True)
def _sum_edges(points, chain, chain_line, line_ends, first, last, p):
    """Turns of W due to the edges first ... last - 1, near the vertical line through p or not."""
    angle, turns = 0.0, 0
    before = -1
    b = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for e in range(first, last):
        v, w = chain[e, 0], chain[e, 1]
        a = b if v == before else _seen(points, v, p)
        b = _seen(points, w, p)
        before = w
        cross = a[3] * b[4] - a[4] * b[3]
        dot = a[5] * b[5] + a[3] * b[3] + a[4] * b[4]
        angle += np.arctan2(cross, dot) if cross != 0.0 else (np.pi if dot < 0.0 else 0.0)
        if (
            min(a[0], b[0]) <= 0.0 <= max(a[0], b[0])
            and min(a[1], b[1]) <= NEAR_LINE
            and max(a[1], b[1]) >= -NEAR_LINE
        ):
            turns += _rule_turn(points, v, w, chain_line[e], line_ends, a, b, cross, dot, p)
    return angle / TURN + turns


@njit(cache=True, nogil=True)
def boundary_term(boundary, p, tolerance):
    """Return sum Omega / (4 pi) at p and a bound on its error.

    ``boundary`` holds points, chain, chain_line, line_ends, nodes, data (`boundary_tree`). A tree
    node is expanded where its error is at most ``tolerance`` and p does not lie above its box, so
    that the fan is not met by the line down from p.
    """
    points, chain, chain_line, line_ends, nodes, data = boundary
    total, error = 0.0, 0.0
    n = 0
    while n < len(nodes):
        node = data[n]
        x, y, z = node[HUB] - p[0], node[HUB + 1] - p[1], node[HUB + 2] - p[2]
        squared = x * x + y * y + z * z
        radius = node[RADIUS]
        expand = False
        if tolerance > 0.0 and squared > 1.5625 * radius * radius:
            above = (
                node[LOW] - NEAR_LINE <= p[0] <= node[HIGH] + NEAR_LINE
                and node[LOW + 1] - NEAR_LINE <= p[1] <= node[HIGH + 1] + NEAR_LINE
                and node[LOW + 2] - NEAR_LINE <= p[2]
            )
            if not above:
                r = np.sqrt(squared)
                q = radius / r
                left = node[SECOND] * (3.0 - 2.0 * q)
                left /= 2.0 * TURN * squared * squared * (1.0 - q) ** 2
                expand = left <= tolerance
        if expand:
            cube = squared * r
            flux = (node[AREA] * x + node[AREA + 1] * y + node[AREA + 2] * z) / cube
            bend = node[MOMENT] * x * x + node[MOMENT + 1] * y * y + node[MOMENT + 2] * z * z
            bend += 2.0 * (node[MOMENT + 3] * x * y + node[MOMENT + 4] * x * z)
            bend += 2.0 * node[MOMENT + 5] * y * z
            total += (flux - 3.0 * bend / (cube * squared)) / (2.0 * TURN)
            error += left
            if nodes[n, 4] == 1:
                # The chord takes the place of the chain
                a = _seen(points, chain[nodes[n, 0], 0], p)
                b = _seen(points, chain[nodes[n, 1] - 1, 1], p)
                cross = a[3] * b[4] - a[4] * b[3]
                dot = a[5] * b[5] + a[3] * b[3] + a[4] * b[4]
                total += np.arctan2(cross, dot) / TURN
            n = nodes[n, 2]
        elif nodes[n, 3] == 1:
            first, last = nodes[n, 0], nodes[n, 1]
            total += _sum_edges(points, chain, chain_line, line_ends, first, last, p)
            n = nodes[n, 2]
        else:
            n += 1
    return total, error


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
def variation(boundary, p, half, limit):
    """Bound how far the boundary term may be from its value at p in the cube p +- half.

    Returns infinity once the bound exceeds ``limit`` or where the cube meets a curtain: the term
    jumps there. Elsewhere its gradient is that of the magnetic potential of a current along the
    boundary (Biot, Savart): at distance d an edge of length L adds at most min(L / d, 2) / d to
    4 pi |grad W|; a closed chain whose fan has the area S, at most 2 S / d^3.
    """
    points, chain, _, _, nodes, data = boundary
    reach = half * np.sqrt(3.0)
    scale = reach / (2.0 * TURN)
    total = 0.0
    n = 0
    while n < len(nodes):
        node = data[n]
        curtain = (
            abs(node[HUB] - p[0]) <= 0.5 * (node[HIGH] - node[LOW]) + half + NEAR_LINE
            and abs(node[HUB + 1] - p[1])
            <= 0.5 * (node[HIGH + 1] - node[LOW + 1]) + half + NEAR_LINE
            and node[LOW + 2] <= p[2] + half + NEAR_LINE
        )
        x, y, z = node[HUB] - p[0], node[HUB + 1] - p[1], node[HUB + 2] - p[2]
        d = np.sqrt(x * x + y * y + z * z) - node[RADIUS] - reach
        if not curtain and d > node[RADIUS]:
            slope = node[LENGTH] / (d * d)
            if nodes[n, 4] == 0:
                slope = min(slope, 2.0 * node[FAN_AREA] / (d * d * d))
            total += scale * slope
            n = nodes[n, 2]
        elif nodes[n, 3] == 1:
            for e in range(nodes[n, 0], nodes[n, 1]):
                a, b = points[chain[e, 0]], points[chain[e, 1]]
                if (
                    min(a[0], b[0]) <= p[0] + half + NEAR_LINE
                    and max(a[0], b[0]) >= p[0] - half - NEAR_LINE
                    and min(a[1], b[1]) <= p[1] + half + NEAR_LINE
                    and max(a[1], b[1]) >= p[1] - half - NEAR_LINE
                    and min(a[2], b[2]) <= p[2] + half + NEAR_LINE
                ):
                    return np.inf
                d = _segment_distance(a, b, p) - reach
                if d <= 0.0:
                    return np.inf
                length = np.sqrt((b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2 + (b[2] - a[2]) ** 2)
                total += scale * min(length / d, 2.0) / d
            n = nodes[n, 2]
        else:
            n += 1
        if total > limit:
            return np.inf
    return total
