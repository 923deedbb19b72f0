"""Cut faces into convex pieces along the lines in which other faces meet them.

Each face is laid out flat in its own frame (longest edge along x). What meets it becomes segments:
the part of the line of both planes that lies in both faces, or, of a coplanar face, its outline.
The segments cut the face one after the other, each the whole convex piece it lies in (a binary
space partition; the order is pseudo-random, which keeps the pieces few: Paterson and Yao 1990,
doi:10.1007/BF02187806). No segment is left in the interior of a piece.

Everything nearer than ``near`` counts as equal: ends of segments, corners of pieces, corners and
planes. Pieces narrower than `SLIVER` times that are left out.
"""

import numpy as np
from numba import njit

from .clip import clip_segment
from .point_triangle import triangle_frame
from .sheet_pairs import COPLANAR

SLIVER = 4.0
STEEP = 1e-3  # sine of the angle to the normal below which a needle only pricks a face
MULTIPLIER, INCREMENT, MASK = 1103515245, 12345, 0x7FFFFFFF  # the sample generator of ISO C


@njit(cache=True, nogil=True)
def cut_faces(
    points, faces, ids, begin, end, start, partners, near, stack_corners, stack_segments, stack,
    piece_face, piece_end, centers, corners,
):  # fmt: skip
    """Cut the faces ``ids[begin:end]``; return how many pieces there are, and corners of pieces.

    Face ``ids[i]`` meets the faces ``partners[start[i]:start[i + 1], 0]``, in the manner of column
    1. Piece n is a part of face ``piece_face[n]`` with the centroid ``centers[n]`` and the corners
    ``corners[piece_end[n - 1]:piece_end[n]]``, counter-clockwise: weights (n, 3) of the face's
    corners. What finds no room in these arrays is counted only.

    stack_corners : (w, 2), stack_segments : (w, 7), stack : (w, 2) int64, room to work in. Where
    it does not suffice, -1 is returned for the number of pieces.
    """
    n_pieces, n_corners = 0, 0
    layout = np.empty((3, 2))
    values = np.empty((4, 3))
    for i in range(begin, end):
        f = faces[ids[i]]
        if 3 * (start[i + 1] - start[i]) > len(stack_segments):
            return -1, 0
        first, n_s = _collect(
            points, faces, f, partners, start[i], start[i + 1], near, layout, values, stack_segments
        )
        # The stack holds pieces yet to be cut: where their corners and segments begin
        stack[0, 0], stack[0, 1] = 0, 0
        for k in range(3):
            stack_corners[k, 0], stack_corners[k, 1] = layout[k, 0], layout[k, 1]
        n_items, n_c = 1, 3
        state = np.int64(ids[i])
        while n_items > 0:
            c, s = stack[n_items - 1, 0], stack[n_items - 1, 1]
            if s == n_s:
                n_pieces, n_corners = _emit(
                    ids[i], first, layout, stack_corners[c:n_c], near, n_pieces, n_corners,
                    piece_face, piece_end, centers, corners,
                )  # fmt: skip
                n_items, n_c = n_items - 1, c
                continue
            if (
                n_c + 2 * (n_c - c + 1) > len(stack_corners)
                or n_s + 2 * (n_s - s) > len(stack_segments)
                or n_items == len(stack)
            ):
                return -1, 0
            state = (MULTIPLIER * state + INCREMENT) & MASK
            line = s + (state >> 8) % (n_s - s)
            # Both parts, written behind the piece
            c1 = _part_of_polygon(stack_corners, c, n_c, n_c, stack_segments, line, 1.0, near)
            c2 = _part_of_polygon(stack_corners, c, n_c, c1, stack_segments, line, -1.0, near)
            s1 = _part_of_segments(stack_segments, s, n_s, n_s, line, 1.0, near)
            s2 = _part_of_segments(stack_segments, s, n_s, s1, line, -1.0, near)
            if c1 == n_c:
                # Nothing lies beyond the line: the piece stays as it is
                n_s = _move(stack_segments, s1, s2, s)
            elif c2 == c1:
                n_s = _move(stack_segments, n_s, s1, s)
            else:
                stack[n_items, 0], stack[n_items, 1] = c + c1 - n_c, s + s1 - n_s
                n_items += 1
                n_c = _move(stack_corners, n_c, c2, c)
                n_s = _move(stack_segments, n_s, s2, s)
    return n_pieces, n_corners


@njit(cache=True, nogil=True)
def _move(rows, begin, end, to):
    """Move rows begin .. end - 1 down to row ``to``; return where they end."""
    for k in range(end - begin):
        for column in range(rows.shape[1]):
            rows[to + k, column] = rows[begin + k, column]
    return to + end - begin


@njit(cache=True, nogil=True)
def _collect(points, faces, f, partners, begin, end, near, layout, values, segments):
    """Place face f flat, its longest edge along x, and list the segments in which partners meet it.

    Fills ``layout`` (3, 2) and ``segments``; returns the corner of f that comes first in the
    layout, and the number of segments.
    """
    first, ax, ay, az, bx, by, bz, l, m, h = triangle_frame(  # noqa: E741
        points[f[0]], points[f[1]], points[f[2]]
    )
    layout[0, 0], layout[1, 0], layout[2, 0] = 0.0, l, m
    layout[0, 1], layout[1, 1], layout[2, 1] = 0.0, 0.0, h
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    n = 0
    for k in range(begin, end):
        g = faces[partners[k, 0]]
        is_needle = _measure(points, f, first, nx, ny, nz, g, near, values)
        height = max(abs(values[3, 0]), abs(values[3, 1]), abs(values[3, 2]))
        cuts_once = is_needle or (partners[k, 1] != COPLANAR and height > near)
        for side in range(3 if cuts_once else 0, 4 if cuts_once else 3):
            n = _add_segment(layout, values, side, near, segments, n)
    return first, n


@njit(cache=True, nogil=True)
def _measure(points, f, first, nx, ny, nz, g, near, values):
    """What face g is to the corners of f: ``values[side]`` how far each lies inside that side of
    g, ``values[3]`` how far above its plane. Returns True where g is a needle, which cuts along
    its plane only. (nx, ny, nz) is the normal of f."""
    turn, ax, ay, az, bx, by, bz, l, m, h = triangle_frame(  # noqa: E741
        points[g[0]], points[g[1]], points[g[2]]
    )
    o = points[g[turn]]
    if h <= SLIVER * near:
        _measure_needle(points, f, first, nx, ny, nz, o, ax, ay, az, l, near, values)
        return True
    left = 1.0 / np.sqrt(m * m + h * h)
    right = 1.0 / np.sqrt((l - m) * (l - m) + h * h)
    cx, cy, cz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    for k in range(3):
        p = points[f[(first + k) % 3]]
        dx, dy, dz = p[0] - o[0], p[1] - o[1], p[2] - o[2]
        x = dx * ax + dy * ay + dz * az
        y = dx * bx + dy * by + dz * bz
        values[0, k] = y
        values[1, k] = ((l - x) * h - y * (l - m)) * right
        values[2, k] = (x * h - y * m) * left
        values[3, k] = dx * cx + dy * cy + dz * cz
    return False


@njit(cache=True, nogil=True)
def _measure_needle(points, f, first, nx, ny, nz, o, ax, ay, az, l, near, values):  # noqa: E741
    """A face as thin as rounding cuts along its longest edge, where that runs within f's plane."""
    values[:] = 0.0
    cx, cy, cz = ay * nz - az * ny, az * nx - ax * nz, ax * ny - ay * nx
    sine = np.sqrt(cx * cx + cy * cy + cz * cz)
    if sine < STEEP:
        return
    a = points[f[first]]
    height = (o[0] - a[0]) * nx + (o[1] - a[1]) * ny + (o[2] - a[2]) * nz
    climb = l * (ax * nx + ay * ny + az * nz)
    low, high = clip_segment(0.0, 1.0, height, climb, -2.0 * SLIVER * near, 2.0 * SLIVER * near)
    if low > high:
        return
    for k in range(3):
        p = points[f[(first + k) % 3]]
        dx, dy, dz = p[0] - o[0], p[1] - o[1], p[2] - o[2]
        x = dx * ax + dy * ay + dz * az
        values[0, k] = x - low * l
        values[1, k] = high * l - x
        values[3, k] = (dx * cx + dy * cy + dz * cz) / sine


@njit(cache=True, nogil=True)
def _add_segment(layout, values, row, near, segments, n):
    """Add where ``values[row]`` vanishes on the face, within the sides of the other; return how
    many segments there are. A segment is its line's unit normal and offset, and both ends."""
    ends = np.empty((2, 5))  # x, y, and how far inside the three sides
    n_ends, n_positive, n_negative = 0, 0, 0
    for k in range(3):
        d, e = values[row, k], values[row, (k + 1) % 3]
        if d > near:
            n_positive += 1
        elif d < -near:
            n_negative += 1
        crossed = (d > near and e < -near) or (d < -near and e > near)
        if (not crossed and abs(d) > near) or n_ends == 2:
            continue
        t = d / (d - e) if crossed else 0.0
        after = (k + 1) % 3
        for axis in range(2):
            ends[n_ends, axis] = layout[k, axis] + t * (layout[after, axis] - layout[k, axis])
        for side in range(3):
            step = values[side, after] - values[side, k]
            ends[n_ends, 2 + side] = values[side, k] + t * step
        n_ends += 1
    if n_positive == 0 or n_negative == 0:
        return n  # it touches the rim at most
    a, b = ends[0], ends[1]
    dx, dy = b[0] - a[0], b[1] - a[1]
    length = np.sqrt(dx * dx + dy * dy)
    t0, t1 = 0.0, 1.0
    for side in range(3):
        if side != row:
            t0, t1 = clip_segment(t0, t1, a[2 + side], b[2 + side] - a[2 + side], -near, np.inf)
    if (t1 - t0) * length <= near:
        return n
    s = segments[n]
    s[0], s[1] = -dy / length, dx / length
    s[2] = s[0] * a[0] + s[1] * a[1]
    s[3], s[4] = a[0] + t0 * dx, a[1] + t0 * dy
    s[5], s[6] = a[0] + t1 * dx, a[1] + t1 * dy
    return n + 1


@njit(cache=True, nogil=True)
def _off(line, x, y, way, near):
    """How far (x, y) lies on the side ``way`` of a line; 0 where it is near."""
    d = way * (line[0] * x + line[1] * y - line[2])
    return d if abs(d) > near else 0.0


@njit(cache=True, nogil=True)
def _part_of_polygon(corners, begin, end, to, segments, line, way, near):
    """Write the part of a convex polygon on the side ``way`` of a line; return its end, or ``to``
    where there is none."""
    n = to
    is_some = False
    for k in range(begin, end):
        after = k + 1 if k + 1 < end else begin
        x, y, u, v = corners[k, 0], corners[k, 1], corners[after, 0], corners[after, 1]
        d, e = _off(segments[line], x, y, way, near), _off(segments[line], u, v, way, near)
        is_some |= d > 0.0
        if d >= 0.0:
            corners[n, 0], corners[n, 1] = x, y
            n += 1
        if (d < 0.0 < e) or (e < 0.0 < d):
            # From one and the same end, so that both parts get the same corner
            if way * d < 0.0:
                x, y, u, v, d, e = u, v, x, y, e, d
            t = d / (d - e)
            corners[n, 0], corners[n, 1] = x + t * (u - x), y + t * (v - y)
            n += 1
    return n if is_some else to


@njit(cache=True, nogil=True)
def _part_of_segments(segments, begin, end, to, line, way, near):
    """Write the parts of segments on the side ``way`` of a line; return where they end."""
    n = to
    for k in range(begin, end):
        s = segments[k]
        d = _off(segments[line], s[3], s[4], way, near)
        e = _off(segments[line], s[5], s[6], way, near)
        if d <= 0.0 and e <= 0.0:
            continue
        for column in range(7):
            segments[n, column] = s[column]
        if d < 0.0 or e < 0.0:
            t = d / (d - e)
            x, y = s[3] + t * (s[5] - s[3]), s[4] + t * (s[6] - s[4])
            at = 3 if d < 0.0 else 5
            segments[n, at], segments[n, at + 1] = x, y
        n += 1
    return n


@njit(cache=True, nogil=True)
def _emit(
    face, first, layout, polygon, near, n_pieces, n_corners, piece_face, piece_end, centers, corners
):
    """Write a piece, unless it is a sliver; return how many pieces and corners there are."""
    m = len(polygon)
    area = around = x = y = 0.0
    for k in range(1, m + 1):
        p, q = polygon[k - 1], polygon[k % m]
        around += np.sqrt((q[0] - p[0]) ** 2 + (q[1] - p[1]) ** 2)
        # Triangles with the first corner, which keeps small pieces exact
        px, py, qx, qy = (
            p[0] - polygon[0, 0],
            p[1] - polygon[0, 1],
            q[0] - polygon[0, 0],
            q[1] - polygon[0, 1],
        )
        part = px * qy - py * qx
        area += part
        x += part * (px + qx) / 3.0
        y += part * (py + qy) / 3.0
    if area <= SLIVER * near * around:
        return n_pieces, n_corners
    if n_pieces < len(piece_face) and n_corners + m <= len(corners):
        piece_face[n_pieces] = face
        piece_end[n_pieces] = n_corners + m
        x, y = polygon[0, 0] + x / area, polygon[0, 1] + y / area
        _weigh(layout, x, y, first, centers[n_pieces])
        for k in range(m):
            _weigh(layout, polygon[k, 0], polygon[k, 1], first, corners[n_corners + k])
    return n_pieces + 1, n_corners + m


@njit(cache=True, nogil=True)
def _weigh(layout, x, y, first, weights):
    """Barycentric weights of a point of the face, by the face's own order of corners."""
    third = min(max(y / layout[2, 1], 0.0), 1.0)
    second = min(max((x - third * layout[2, 0]) / layout[1, 0], 0.0), 1.0 - third)
    weights[first % 3] = 1.0 - third - second
    weights[(first + 1) % 3] = second
    weights[(first + 2) % 3] = third
