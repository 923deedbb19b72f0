"""How far a triangle may be from a mesh: upper bounds from the distances at its corners.

A piece is a triangle T whose corners have computed squared distances d² to the mesh and slots of
their closest faces. Five bounds on max over p in T of d(p), cheapest first; each stands alone, and
the least one is kept:

1. Lipschitz: d grows at most as fast as p moves, and every point of T is within the covering
   radius of one of its corners.
2. One face F: distance to one convex set is convex, so max over T = max over corners of d(v, F).
   Tried for the closest faces of all corners.
3. Two faces F, G: cut T by a line across two sides, so that corners nearer to F are on one part and
   corners nearer to G on the other. Each part is convex, so d is at most the largest distance of
   its corners to its face; a cut counts for both. The cuts are placed where F and G are equally
   far, which makes the bound tight if no other face is nearer.
4. A strip: the closest faces of the corners share a vertex w of the mesh. Cut T along the edges
   passed on the way around w from one corner's face to the next. Map the corners to their feet,
   and each cut to a point of its edge, where both are nearest. Every part of T is then mapped into
   one convex face, linearly on triangles, and |p - map(p)| is convex on each: the largest
   displacement of a corner or a cut bounds d on T.
5. A fan: as 4, but the three sides of T lead once around w: the point y of T nearest to w is
   mapped to w, and T is cut into three from there.

Bounds 2 to 5 see that a flat piece over several coplanar faces has distance zero, which no
sampling and no Lipschitz argument can.

Rounding: a distance to a face is off as `point_triangle` says; what is added to it here, a radius
or the length of a displacement, by at most 27 u (R + r), u = 2**-53, for corners of T within R
and faces within r of the origin. The cuts of 3 to 5 may be misplaced along their segments, which
leaves a bound a bound.

References: D. Zheng et al. 2022, doi:10.1111/cgf.14612 (bound 2); L. Sacht, A. Jacobson 2024,
doi:10.1111/cgf.15129 (cascades); Y. Kang et al. 2018 (splitting between two faces).
"""

import numpy as np
from numba import njit

from .point_triangle import closest_on_triangle, squared_distance

TINY = 1e-300  # keeps a zero length out of a denominator; its numerator is zero too
MAX_STEPS = 8  # of a search along a side; where it stops, the cut is
CLOSE = 1e-20  # squared: a gap of this share of the distance is closed
MAX_FAN = 16  # faces around a vertex, each way; what lies beyond is left to cutting
FACE, EDGE_FACE, EDGE_END = 0, 1, 2  # rows of a ring


@njit(cache=True, nogil=True)
def upper_bounds(
    points, squares, slots, pieces, begin, end, enough, last, frames, corners, order, around, upper
):
    """``upper[n]`` >= max of d over the piece with corners ``pieces[n]`` (3,), begin <= n < end.

    Cheaper bounds alone decide where they fall to ``enough``, and none after bound ``last`` is
    tried. ``around`` (m, 6) holds for every face its vertices and its neighbours over the edges
    after them; needed for bounds 4 and 5.
    """
    candidates = np.empty(3, np.int32)
    ring = np.empty((3, 2 * MAX_FAN), np.int32)
    near = np.empty((3, 3))  # squared distance of each candidate face to each corner
    for n in range(begin, end):
        piece = pieces[n]
        bound = lipschitz_bound(points, squares, piece)
        if bound > enough:
            n_candidates = _candidates(piece, slots, candidates)
            least, enough2 = bound * bound, enough * enough
            for c in range(n_candidates):
                frame = frames[candidates[c]]
                for i in range(3):
                    v = points[piece[i]]
                    near[c, i] = squared_distance(frame, v[0], v[1], v[2], np.inf)
                least = min(least, max(near[c, 0], near[c, 1], near[c, 2]))
            if least > enough2 and last >= 3:
                for c in range(n_candidates):
                    for e in range(c + 1, n_candidates):
                        f, g = frames[candidates[c]], frames[candidates[e]]
                        found = _two_faces(points, piece, near[c], near[e], f, g, least, enough2)
                        least = min(least, found)
            if least > enough2 and last >= 5:
                least = _fan(points, squares, slots, piece, corners, order, around, ring, least)
            bound = np.sqrt(least)
        upper[n] = bound


@njit(cache=True, nogil=True)
def lipschitz_bound(points, squares, piece):
    """Bound 1: the largest distance of a corner, and the covering radius of the triangle."""
    a, b, c = points[piece[0]], points[piece[1]], points[piece[2]]
    ab, bc, ca = _distance2(a, b), _distance2(b, c), _distance2(c, a)
    longest, shortest = max(ab, bc, ca), min(ab, bc, ca)
    middle = max(min(ab, bc), min(max(ab, bc), ca))
    if middle + shortest <= longest:
        # Obtuse: the farthest point is where the bisector of the middle side meets the longest
        radius = middle / max(longest + middle - shortest, TINY) * np.sqrt(longest)
    else:
        radius = np.sqrt(longest / 3.0)  # acute: the circumradius is at most that (Jung)
    d = max(squares[piece[0]], squares[piece[1]], squares[piece[2]])
    return np.sqrt(d) + radius


@njit(cache=True, nogil=True)
def _candidates(piece, slots, faces):
    """Slots of the different closest faces of the piece's corners, at most three; their number."""
    n = 0
    for i in range(3):
        slot = slots[piece[i]]
        known = False
        for c in range(n):
            known = known or faces[c] == slot
        if not known:
            faces[n] = slot
            n += 1
    return n


@njit(cache=True, nogil=True)
def _two_faces(points, piece, near_f, near_g, f, g, least, enough):
    """Bound 3, squared, for the frames f and g; infinite where it does not apply or help."""
    largest, n_f, side = 0.0, 0, 0
    for i in range(3):
        largest = max(largest, min(near_f[i], near_g[i]))
        if near_f[i] <= near_g[i]:
            n_f += 1
            side += i
    if largest >= least or n_f == 0 or n_f == 3:
        return np.inf
    alone = side if n_f == 1 else 3 - side
    if n_f == 2:
        near_f, near_g, f, g = near_g, near_f, g, f
    v = piece[alone]
    for i in range(1, 3):
        k = (alone + i) % 3
        begin, end = (near_f[alone], near_g[alone]), (near_f[k], near_g[k])
        found = _balance2(points[v], points[piece[k]], begin, end, f, g, max(largest, enough))
        largest = max(largest, found)
        if largest >= least:
            return np.inf
    return largest


@njit(cache=True, nogil=True)
def _balance2(p, q, at_p, at_q, f, g, enough):
    """Least squared distance found of a point of pq to the farther of f and g.

    ``at_p`` and ``at_q`` are the squared distances of the ends to f and g; p is nearer to f, q to
    g, so somewhere between both are equal: there by the rule of false position, Illinois variant.
    """
    least = min(max(at_p[0], at_p[1]), max(at_q[0], at_q[1]))
    low, gap_low = 0.0, np.sqrt(at_p[0]) - np.sqrt(at_p[1])
    high, gap_high = 1.0, np.sqrt(at_q[0]) - np.sqrt(at_q[1])
    last = 0
    for _ in range(MAX_STEPS):
        if least <= enough or gap_high <= gap_low:
            break
        share = min(max((low * gap_high - high * gap_low) / (gap_high - gap_low), low), high)
        x = p[0] + share * (q[0] - p[0])
        y = p[1] + share * (q[1] - p[1])
        z = p[2] + share * (q[2] - p[2])
        to_f = squared_distance(f, x, y, z, np.inf)
        to_g = squared_distance(g, x, y, z, np.inf)
        least = min(least, max(to_f, to_g))
        gap = np.sqrt(to_f) - np.sqrt(to_g)
        if gap * gap <= CLOSE * least:
            break
        if gap < 0.0:
            low, gap_low = share, gap
            gap_high *= 0.5 if last < 0 else 1.0
            last = -1
        else:
            high, gap_high = share, gap
            gap_low *= 0.5 if last > 0 else 1.0
            last = 1
    return least


@njit(cache=True, nogil=True)
def _fan(points, squares, slots, piece, corners, order, around, ring, least):
    """Bounds 4 and 5, squared, or ``least`` if it is less or the faces have no common vertex."""
    f, g, h = order[slots[piece[0]]], order[slots[piece[1]]], order[slots[piece[2]]]
    a, b, c = points[piece[0]], points[piece[1]], points[piece[2]]
    feet = max(squares[piece[0]], squares[piece[1]], squares[piece[2]])
    for k in range(3):
        w = around[f, k]
        if feet >= least or _place(around, g, w) < 0 or _place(around, h, w) < 0:
            continue
        # Places on the ring around w, face f at 0; on a closed ring also a period further
        n_before, n_after, period = _list_ring(around, f, w, ring)
        at_g = at_h = MAX_FAN
        for place in range(-n_before, n_after):
            at_g = place if ring[FACE, MAX_FAN + place] == g else at_g
            at_h = place if ring[FACE, MAX_FAN + place] == h else at_h
        if at_g == MAX_FAN or at_h == MAX_FAN:
            continue
        # Strips leave one of the gaps of a closed ring out; the last try is the fan
        for turn in range(5 if period > 0 else 1):
            p, q, end = at_g - period * (turn & 1), at_h - period * ((turn >> 1) & 1), 0
            found = feet
            if turn == 4:
                p, q, end = at_g, at_h, period
                if at_g > at_h:
                    p, q, end = at_g - period, at_h - period, -period
                v = corners[f, k]
                found = max(feet, closest_on_triangle(v[0], v[1], v[2], a, b, c)[0])
            elif period > 0 and max(0, p, q) - min(0, p, q) >= period:
                continue
            for side in range(3):
                start, stop = points[piece[side]], points[piece[(side + 1) % 3]]
                first = 0 if side == 0 else (p if side == 1 else q)
                last = p if side == 0 else (q if side == 1 else end)
                found = max(
                    found, _cuts(start, stop, first, last, ring, period, w, corners, around)
                )
            least = min(least, found)
    return least


@njit(cache=True, nogil=True)
def _list_ring(around, start, w, ring):
    """List the faces around w, ``start`` at MAX_FAN; (n before it, n from it on, n if closed or 0).

    ``ring[:, i]`` = face i, and the edge from w that it shares with face i + 1: as a face, and the
    corner of it at the edge's far end.
    """
    n_before, n_after = 0, 1
    ring[FACE, MAX_FAN] = start
    for turn in range(1, 3):
        face, came_from = start, np.int32(-1)
        for i in range(1, MAX_FAN):
            k = _place(around, face, w)
            far = (k + turn) % 3
            if around[face, far] == came_from:
                far = 3 - k - far
            came_from = around[face, far]
            # The edge from corner k to the next is number k, from the one before number far
            other = around[face, 3 + (k if far == (k + 1) % 3 else far)]
            at = MAX_FAN + i - 1 if turn == 1 else MAX_FAN - i
            ring[EDGE_FACE, at], ring[EDGE_END, at] = face, far
            if turn == 1 and other == start:
                return 0, n_after, n_after
            if other < 0 or _place(around, other, w) < 0:
                break
            face = other
            if turn == 1:
                ring[FACE, MAX_FAN + i] = face
                n_after += 1
            else:
                ring[FACE, MAX_FAN - i] = face
                n_before += 1
    return n_before, n_after, 0


@njit(cache=True, nogil=True)
def _cuts(p, q, first, last, ring, period, w, corners, around):
    """Cut pq at every edge between two places of the ring; largest squared distance to the edge."""
    largest, share = 0.0, 0.0
    step = 1 if last > first else -1
    while first != last:
        at = first if step > 0 else first - 1
        at = MAX_FAN + (at % period if period > 0 else at)
        face, far = ring[EDGE_FACE, at], ring[EDGE_END, at]
        k = _place(around, face, w)
        square, share = _segments2(p, q, corners[face, k], corners[face, far], share)
        largest = max(largest, square)
        first += step
    return largest


@njit(cache=True, nogil=True)
def _place(around, face, vertex):
    """Which corner of the face the vertex is, or -1."""
    for k in range(3):
        if around[face, k] == vertex:
            return k
    return -1


@njit(cache=True, nogil=True)
def _segments2(p, q, a, b, first_share):
    """Squared distance from a point of pq to one of ab, near the least possible, and its place.

    The point of pq is ``p + share * (q - p)`` with share >= first_share. Both are found in closed
    form (Ericson 2005, section 5.1.9); rounding may misplace them along the segments, which
    leaves a bound a bound.
    """
    ux, uy, uz = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    vx, vy, vz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    rx, ry, rz = p[0] - a[0], p[1] - a[1], p[2] - a[2]
    uu = max(ux * ux + uy * uy + uz * uz, TINY)
    vv = max(vx * vx + vy * vy + vz * vz, TINY)
    uv = ux * vx + uy * vy + uz * vz
    ur = ux * rx + uy * ry + uz * rz
    vr = vx * rx + vy * ry + vz * rz
    s = min(max((uv * vr - ur * vv) / max(uu * vv - uv * uv, TINY), first_share), 1.0)
    t = (uv * s + vr) / vv
    if t < 0.0 or t > 1.0:
        t = min(max(t, 0.0), 1.0)
        s = min(max((uv * t - ur) / uu, first_share), 1.0)
    dx, dy, dz = rx + s * ux - t * vx, ry + s * uy - t * vy, rz + s * uz - t * vz
    return dx * dx + dy * dy + dz * dz, s


@njit(cache=True, nogil=True)
def _distance2(p, q):
    return (p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2 + (p[2] - q[2]) ** 2
