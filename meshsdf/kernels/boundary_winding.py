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
    HIGH,
    HUB,
    LOW,
    MOMENT,
    RADIUS,
    SECOND,
)
from .crossings import edge_height

NEAR_LINE = 1e-6  # voxels; far above the rounding of local coordinates, far below a voxel
BESIDE = 1e-150  # stands for an infinitely small step; its square is still a float
TURN = 2.0 * np.pi
TINY, HUGE = 1e-30, 1e30  # LEAF_EDGES numbers between these have a product that is a float


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
def _angle(cross, dot):
    """Argument of dot + i cross in (-pi, pi]."""
    if cross == 0.0:
        return np.pi if dot < 0.0 else 0.0
    return np.arctan2(cross, dot)


@njit(cache=True, nogil=True)
def _sum_edges(points, chain, chain_line, line_ends, first, last, p):
    """Turns of W due to the edges first ... last - 1, near the vertical line through p or not.

    Numbers are multiplied rather than arguments added; a turn is counted whenever the product
    passes the negative real axis.
    """
    angle, turns = 0.0, 0
    re, im = 1.0, 0.0
    before = -1
    b = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for e in range(first, last):
        v, w = chain[e, 0], chain[e, 1]
        a = b if v == before else _seen(points, v, p)
        b = _seen(points, w, p)
        before = w
        cross = a[3] * b[4] - a[4] * b[3]
        dot = a[5] * b[5] + a[3] * b[3] + a[4] * b[4]
        if TINY < abs(cross) + abs(dot) < HUGE:
            new_re, new_im = re * dot - im * cross, re * cross + im * dot
            if im >= 0.0 and cross >= 0.0:
                turns += (re < 0.0 and dot < 0.0) or new_im < 0.0
            elif im < 0.0 and cross < 0.0:
                turns -= (re < 0.0 and dot < 0.0) or new_im > 0.0 or (new_im == 0.0 > new_re)
            re, im = new_re, new_im
        else:
            angle += _angle(cross, dot)
        if (
            min(a[0], b[0]) <= 0.0 <= max(a[0], b[0])
            and min(a[1], b[1]) <= NEAR_LINE
            and max(a[1], b[1]) >= -NEAR_LINE
        ):
            turns += _rule_turn(points, v, w, chain_line[e], line_ends, a, b, cross, dot, p)
    return (angle + _angle(im, re)) / TURN + turns


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
