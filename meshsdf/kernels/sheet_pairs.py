"""Pairs of triangles that meet elsewhere than in the corners they share.

Nothing that meets is left out; a pair is left out only where a plane certainly parts the two.
"Certainly" means that the sign of a determinant exceeds a bound on its rounding error. Faces that
touch, face rims that run along each other, and what rounding cannot tell from that are listed.

Two faces are coplanar when the corners of one lie within ``near`` of the plane of the other, and
the two overlap, or come within ``near`` of it, as seen along the normal.
"""

import numpy as np
from numba import njit

from .bvh import EMPTY, STACK_SIZE
from .triangle_pairs import _volume as certain_volume

APART, CROSSING, COPLANAR = 0, 1, 2
THIN = 2.0**-20  # altitude / longest edge: the plane of a thinner face is no reference for others


@njit(cache=True, nogil=True)
def list_meetings(points, faces, order, children, child_boxes, near, begin, end, pairs):
    """List the pairs of the faces in slots begin .. end - 1 with faces in later slots.

    ``pairs`` (c, 3) int32 receives (lower face, higher face, kind); ``faces`` are in the order of
    the tree's slots, ``order[s]`` is the face in slot s. Returns the number of pairs; those beyond
    c are counted only.
    """
    n_pairs = 0
    stack = np.empty(STACK_SIZE, np.int32)
    box = np.empty(6)
    turned = np.empty((2, 3), np.int32)
    for s in range(begin, end):
        f = faces[s]
        for axis in range(3):
            p, q, r = points[f[0], axis], points[f[1], axis], points[f[2], axis]
            box[axis], box[axis + 3] = min(p, q, r) - near, max(p, q, r) + near
        stack[0] = 0
        n_stack = 1
        while n_stack > 0:
            n_stack -= 1
            node = stack[n_stack]
            for side in range(2):
                child = children[node, side]
                if child == EMPTY or not _boxes_meet(box, child_boxes[node], 6 * side):
                    continue
                if child >= 0:
                    stack[n_stack] = child
                    n_stack += 1
                    continue
                first = (-2 - child) >> 3
                for t in range(max(first, s + 1), first + ((-2 - child) & 7) + 1):
                    if not _face_in_box(points, faces[t], box):
                        continue
                    kind = _meeting(points, f, faces[t], near, turned)
                    if kind == APART:
                        continue
                    if n_pairs < len(pairs):
                        pairs[n_pairs, 0] = min(order[s], order[t])
                        pairs[n_pairs, 1] = max(order[s], order[t])
                        pairs[n_pairs, 2] = kind
                    n_pairs += 1
    return n_pairs


@njit(cache=True, nogil=True)
def _boxes_meet(box, boxes, first):
    """``box`` and the box that begins at ``boxes[first]`` have a point in common."""
    for axis in range(3):
        if box[axis] > boxes[first + 3 + axis] or boxes[first + axis] > box[axis + 3]:
            return False
    return True


@njit(cache=True, nogil=True)
def _face_in_box(points, g, box):
    """The box of face g meets ``box``."""
    for axis in range(3):
        p, q, r = points[g[0], axis], points[g[1], axis], points[g[2], axis]
        if min(p, q, r) > box[axis + 3] or max(p, q, r) < box[axis]:
            return False
    return True


@njit(cache=True, nogil=True)
def _meeting(points, f, g, near, turned):
    """How faces f and g meet beyond the corners they share: APART, CROSSING or COPLANAR.

    turned : (2, 3) int32, room to work in.
    """
    # Turn both so that common corners come first
    n_common, i, j, is_f, is_g = 0, 0, 0, 0, 0
    for a in range(3):
        for b in range(3):
            if f[a] == g[b]:
                n_common += 1
                i, j, is_f, is_g = a, b, is_f + a, is_g + b
    if n_common == 3:
        return COPLANAR
    if n_common == 2:
        i, j = (4 - is_f) % 3, (4 - is_g) % 3  # behind the corners that are not common
    for k in range(3):
        turned[0, k], turned[1, k] = f[(i + k) % 3], g[(j + k) % 3]
    # Sides of the corners of one of the plane of the other
    nx, ny, nz, is_flat = 0.0, 0.0, 0.0, False
    for own in range(2):
        a, b, c = turned[own, 0], turned[own, 1], turned[own, 2]
        x, y, z, is_thick = _normal(points, a, b, c)
        limit = near * near * (x * x + y * y + z * z)
        low, high = 2.0, -2.0
        for k in range(n_common, 3):
            side = _side(points, a, b, c, turned[1 - own, k], limit)
            low, high = min(low, side), max(high, side)
        if low > 0.0 or high < 0.0:
            return APART
        if is_thick and low == high == 0.0 and not is_flat:
            nx, ny, nz, is_flat = x, y, z, True
    if n_common == 2:
        return COPLANAR if _is_folded(points, turned) else APART
    if is_flat:
        u, v = _flat_axes(nx, ny, nz)
        for own in range(2):
            if _part_flat(points, u, v, turned[own], turned[1 - own], n_common, near):
                return APART
        return COPLANAR
    if n_common == 1:
        return APART if _part_corner(points, turned) else CROSSING
    for own in range(2):
        if _touches(points, turned[own], turned[1 - own], near):
            return CROSSING
    return APART


@njit(cache=True, nogil=True)
def _is_folded(points, turned):
    """Two faces in one plane lie on the same side of their common edge."""
    p, q, r, s = (
        points[turned[0, 0]],
        points[turned[0, 1]],
        points[turned[0, 2]],
        points[turned[1, 2]],
    )
    dx, dy, dz = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    rx, ry, rz = r[0] - p[0], r[1] - p[1], r[2] - p[2]
    sx, sy, sz = s[0] - p[0], s[1] - p[1], s[2] - p[2]
    square = dx * dx + dy * dy + dz * dz
    along, across = rx * dx + ry * dy + rz * dz, sx * dx + sy * dy + sz * dz
    return (rx * sx + ry * sy + rz * sz) * square >= along * across


@njit(cache=True, nogil=True)
def _normal(points, a, b, c):
    """Normal of a face, and whether it is thick enough for its plane to be a reference."""
    p, q, r = points[a], points[b], points[c]
    ux, uy, uz = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    vx, vy, vz = r[0] - p[0], r[1] - p[1], r[2] - p[2]
    wx, wy, wz = vx - ux, vy - uy, vz - uz
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    longest = max(ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz)
    longest = max(longest, wx * wx + wy * wy + wz * wz)
    return nx, ny, nz, nx * nx + ny * ny + nz * nz > (THIN * longest) ** 2


@njit(cache=True, nogil=True)
def _side(points, a, b, c, p, limit):
    """Side of p of the plane of abc, 1 or -1; 0 unless certain, and the squared volume > limit."""
    volume = certain_volume(points, a, b, c, p)
    if volume * volume <= limit:
        return 0.0
    return 1.0 if volume > 0.0 else -1.0


@njit(cache=True, nogil=True)
def _flat_axes(nx, ny, nz):
    """The two coordinates to keep when looking along the axis nearest to a normal."""
    if abs(nx) >= abs(ny) and abs(nx) >= abs(nz):
        return 1, 2
    if abs(ny) >= abs(nz):
        return 2, 0
    return 0, 1


@njit(cache=True, nogil=True)
def _turn(points, u, v, a, b, c):
    """How far c is left of the line ab, seen along an axis."""
    dx, dy = points[b, u] - points[a, u], points[b, v] - points[a, v]
    turn = dx * (points[c, v] - points[a, v]) - dy * (points[c, u] - points[a, u])
    length = np.sqrt(dx * dx + dy * dy)
    return turn / length if length > 0.0 else 0.0


@njit(cache=True, nogil=True)
def _part_flat(points, u, v, f, g, n_common, near):
    """Seen flat, a line along an edge of f has f on one side, and g on the other but for the
    corner that both begin with (n_common = 1) or farther than near (0)."""
    for e in range(3):
        p, q, r = f[e], f[(e + 1) % 3], f[(e + 2) % 3]
        if n_common == 1 and e == 1:
            continue
        own = _turn(points, u, v, p, q, r)
        if abs(own) <= near:
            continue
        way = -1.0 if own > 0.0 else 1.0
        parted = True
        for k in range(n_common, 3):
            off = way * _turn(points, u, v, p, q, g[k])
            if off > near:
                continue
            # On the line, but behind the common corner
            o, end = (p, q) if e == 0 else (q, p)
            ahead = (points[end, u] - points[o, u]) * (points[g[k], u] - points[o, u])
            ahead += (points[end, v] - points[o, v]) * (points[g[k], v] - points[o, v])
            if n_common == 0 or off < -near or ahead >= 0.0:
                parted = False
                break
        if parted:
            return True
    return False


@njit(cache=True, nogil=True)
def _part_corner(points, turned):
    """A plane through the common corner o, an edge oa of one face and oc of the other has the
    third corners on different sides; so the faces meet in o alone."""
    o = turned[0, 0]
    for i in range(1, 3):
        for j in range(1, 3):
            a, b, c, d = turned[0, i], turned[0, 3 - i], turned[1, j], turned[1, 3 - j]
            volume = certain_volume(points, o, a, c, b)
            if volume != 0.0:
                other = certain_volume(points, o, a, c, d)
                if (volume > 0.0 > other) or (volume < 0.0 < other):
                    return True
    return False


@njit(cache=True, nogil=True)
def _part_edge(points, f, p, q, near):
    """Seen along an axis, both ends of pq lie beyond one side of face f."""
    nx, ny, nz, _ = _normal(points, f[0], f[1], f[2])
    u, v = _flat_axes(nx, ny, nz)
    for e in range(3):
        a, b = f[e], f[(e + 1) % 3]
        own = _turn(points, u, v, a, b, f[(e + 2) % 3])
        way = -1.0 if own > 0.0 else 1.0
        off = min(way * _turn(points, u, v, a, b, p), way * _turn(points, u, v, a, b, q))
        if abs(own) > near and off > near:
            return True
    return False


@njit(cache=True, nogil=True)
def _touches(points, f, g, near):
    """An edge of g passes through face f or its rim, as far as rounding can tell."""
    s = certain_volume(points, f[0], f[1], f[2], g[0])
    for e in range(3):
        p, q = g[e], g[(e + 1) % 3]
        before = s
        s = certain_volume(points, f[0], f[1], f[2], q)
        if (before > 0.0 and s > 0.0) or (before < 0.0 and s < 0.0):
            continue
        if _part_edge(points, f, p, q, near):
            continue
        low, high = np.inf, -np.inf
        for k in range(3):
            volume = certain_volume(points, p, q, f[k], f[(k + 1) % 3])
            low, high = min(low, volume), max(high, volume)
        if not low < 0.0 < high:
            return True
    return False
