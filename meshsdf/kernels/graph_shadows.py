"""The faces of a mesh around a triangle P, in P's frame: their shadows on it, and the proof that
the mesh is a graph above it (see `graph_distance`)."""

import numpy as np
from numba import njit

STACK_SIZE = 128
MAX_SIDES = 8  # a triangle cut by three lines has at most six
MAX_SLOPE = 2.0
MARGIN = 2.0**-40  # of the coordinates' size: shadows and heights are compared with this margin
CRUMB = 2.0**-8  # of the margin: 32 u S, rounding of one coordinate

CLOSED, OPEN, SHRUNK, LONE = 0, 1, 2, 3  # of an edge; LONE: of a shrunk face whose edge is its own


@njit(cache=True, nogil=True)
def gather_slots(box, children, child_boxes, slots):
    """List the leaves' triangles whose boxes meet ``box``; their number, -1 if too many."""
    stack = np.empty(STACK_SIZE, np.int32)
    n_found, n_stack = 0, 1
    stack[0] = 0
    while n_stack > 0:
        n_stack -= 1
        node = stack[n_stack]
        boxes = child_boxes[node]
        for side in range(2):
            code = children[node, side]
            at = 6 * side
            if (
                code == -1
                or boxes[at] > box[3]
                or boxes[at + 1] > box[4]
                or boxes[at + 2] > box[5]
                or boxes[at + 3] < box[0]
                or boxes[at + 4] < box[1]
                or boxes[at + 5] < box[2]
            ):
                continue
            if code >= 0:
                stack[n_stack] = code
                n_stack += 1
                continue
            leaf = -2 - code
            first = leaf >> 3
            for s in range(first, first + (leaf & 7) + 1):
                if n_found == len(slots):
                    return -1
                slots[n_found] = s
                n_found += 1
    return n_found


@njit(cache=True, nogil=True)
def place_faces(n_slots, slots, order, corners, edges, origin, axes, shape, around, solid):
    """Put faces into P's frame, leave out those apart from it; their number;
    -1 if one is lone, or if there are too many."""
    n_near = 0
    for k in range(n_slots):
        face = order[slots[k]]
        if edges[face, 0] == SHRUNK:
            continue
        triangle = solid[n_near]
        for i in range(3):
            x = corners[face, i, 0] - origin[0]
            y = corners[face, i, 1] - origin[1]
            z = corners[face, i, 2] - origin[2]
            for axis in range(3):
                triangle[i, axis] = x * axes[axis, 0] + y * axes[axis, 1] + z * axes[axis, 2]
        if _is_apart(triangle, shape, around, around):
            continue
        if edges[face, 0] == LONE or n_near + 1 == len(solid):
            return -1
        slots[n_near] = slots[k]
        n_near += 1
    return n_near


@njit(cache=True, nogil=True)
def _is_apart(triangle, shape, aside, height):
    """Whether a triangle is certainly outside P grown by ``aside``, or beyond ``height``."""
    low = min(triangle[0, 2], triangle[1, 2], triangle[2, 2])
    high = max(triangle[0, 2], triangle[1, 2], triangle[2, 2])
    if low > height or high < -height:
        return True
    l, m, h = shape[0], shape[1], shape[2]  # noqa: E741
    # Beyond a side of P
    base = right = left = -np.inf
    for i in range(3):
        x, y = triangle[i, 0], triangle[i, 1]
        base = max(base, y)
        right = max(right, (l - x) * h - y * (l - m))
        left = max(left, x * h - y * m)
    if base < -aside or right < -aside * shape[3] or left < -aside * shape[4]:
        return True
    # P beyond a side of the triangle's shadow
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        x, y = triangle[i, 0], triangle[i, 1]
        ex, ey = triangle[j, 0] - x, triangle[j, 1] - y
        length = np.sqrt(ex * ex + ey * ey)
        own = ex * (triangle[k, 1] - y) - ey * (triangle[k, 0] - x)
        a = ex * (0.0 - y) - ey * (0.0 - x)
        b = ex * (0.0 - y) - ey * (l - x)
        c = ex * (h - y) - ey * (m - x)
        if min(a, b, c) > aside * length + max(own, 0.0):
            return True
        if max(a, b, c) < -aside * length + min(own, 0.0):
            return True
    return False


@njit(cache=True, nogil=True)
def describe_planes(n_near, solid, plane, margin):
    """``plane[k]`` = start and direction of the shadow's longest side, rise along it and across,
    start's height, twice the shadow's area (0 where its orientation is not sure), slope, cos."""
    for k in range(n_near):
        t, p = solid[k], plane[k]
        start, longest = 0, -1.0
        for i in range(3):
            j = (i + 1) % 3
            square = (t[j, 0] - t[i, 0]) ** 2 + (t[j, 1] - t[i, 1]) ** 2
            if square > longest:
                start, longest = i, square
        j, o = (start + 1) % 3, (start + 2) % 3
        ex, ey = t[j, 0] - t[start, 0], t[j, 1] - t[start, 1]
        ox, oy = t[o, 0] - t[start, 0], t[o, 1] - t[start, 1]
        shadow = ex * oy - ey * ox
        p[0], p[1], p[2], p[3], p[6] = t[start, 0], t[start, 1], ex, ey, t[start, 2]
        if abs(shadow) <= CRUMB * margin * np.sqrt(longest):
            p[4], p[5], p[7], p[8] = 0.0, 0.0, 0.0, np.inf
            continue
        # z = height + along * (e . r) + across * (e x r): well conditioned for needles too
        p[4] = (t[j, 2] - t[start, 2]) / longest
        p[5] = (t[o, 2] - t[start, 2] - p[4] * (ex * ox + ey * oy)) / shadow
        p[7] = shadow
        p[8] = np.sqrt((p[4] * p[4] + p[5] * p[5]) * longest)


@njit(cache=True, nogil=True)
def plane_height(p, x, y):
    """Height of a face's plane above (x, y)."""
    dx, dy = x - p[0], y - p[1]
    return p[6] + p[4] * (p[2] * dx + p[3] * dy) + p[5] * (p[2] * dy - p[3] * dx)


@njit(cache=True, nogil=True)
def _holds(triangle, shadow, x, y, margin):
    """Whether a shadow may hold a point."""
    turn = 1.0 if shadow > 0.0 else -1.0
    for i in range(3):
        j = (i + 1) % 3
        ex, ey = triangle[j, 0] - triangle[i, 0], triangle[j, 1] - triangle[i, 1]
        across = turn * (ex * (y - triangle[i, 1]) - ey * (x - triangle[i, 0]))
        if across < -margin * (abs(ex) + abs(ey)):
            return False
    return True


@njit(cache=True, nogil=True)
def cut_cells(n_near, solid, plane, shape, margin, cells, n_sides, face_of_cell, hold):
    """Cut P by the shadows of the faces on the side of the one nearest above P's centroid.

    Returns the largest |height| (-1: P is not covered once), that side, the largest slope, and the
    number of cells.
    """
    turn, nearest = 0.0, np.inf
    for k in range(n_near):
        shadow = plane[k, 7]
        if shadow != 0.0 and _holds(solid[k], shadow, shape[5], shape[6], margin):
            z = abs(plane_height(plane[k], shape[5], shape[6]))
            if z < nearest:
                turn, nearest = 1.0 if shadow > 0.0 else -1.0, z
    n_cells, covered, largest, steep = 0, 0.0, 0.0, 0.0
    for k in range(n_near):
        if turn * plane[k, 7] <= 0.0 or _misses(solid[k], shape):
            continue
        n = _clip(solid[k], turn, shape, cells[n_cells], hold)
        if n < 3:
            continue
        cell, double = cells[n_cells], 0.0
        for i in range(2, n):
            double += (cell[i - 1, 0] - cell[0, 0]) * (cell[i, 1] - cell[0, 1]) - (
                cell[i - 1, 1] - cell[0, 1]
            ) * (cell[i, 0] - cell[0, 0])
        for i in range(n):
            cell[i, 2] = plane_height(plane[k], cell[i, 0], cell[i, 1])
            largest = max(largest, abs(cell[i, 2]))
        covered += 0.5 * double
        steep = max(steep, plane[k, 8])
        n_sides[n_cells], face_of_cell[n_cells] = n, k
        n_cells += 1
    area = 0.5 * shape[0] * shape[2]
    if abs(covered - area) > margin * shape[0] * (n_cells + 1) or steep > MAX_SLOPE:
        return -1.0, turn, steep, n_cells
    return largest, turn, steep, n_cells


@njit(cache=True, nogil=True)
def _misses(t, shape):
    """Whether the box of a shadow misses that of P, which saves the cutting."""
    return (
        max(t[0, 0], t[1, 0], t[2, 0]) <= 0.0
        or min(t[0, 0], t[1, 0], t[2, 0]) >= shape[0]
        or max(t[0, 1], t[1, 1], t[2, 1]) <= 0.0
        or min(t[0, 1], t[1, 1], t[2, 1]) >= shape[2]
    )


@njit(cache=True, nogil=True)
def _clip(triangle, turn, shape, cell, hold):
    """The part of P in a shadow as a polygon in ``cell``; number of its corners."""
    cell[0, 0], cell[0, 1] = 0.0, 0.0
    cell[1, 0], cell[1, 1] = shape[0], 0.0
    cell[2, 0], cell[2, 1] = shape[1], shape[2]
    n = 3
    for i in range(3):
        j = (i + 1) % 3
        x, y = triangle[i, 0], triangle[i, 1]
        ex, ey = turn * (triangle[j, 0] - x), turn * (triangle[j, 1] - y)
        # Keep what is to the left; a convex polygon is entered once and left once
        last_x, last_y = cell[n - 1, 0], cell[n - 1, 1]
        last = ex * (last_y - y) - ey * (last_x - x)
        count, kept = n, 0
        for v in range(count):
            next_x, next_y = cell[v, 0], cell[v, 1]
            side = ex * (next_y - y) - ey * (next_x - x)
            if (last < 0.0) != (side < 0.0) and kept < MAX_SIDES:
                share = last / (last - side)
                hold[kept, 0] = last_x + share * (next_x - last_x)
                hold[kept, 1] = last_y + share * (next_y - last_y)
                kept += 1
            if side >= 0.0 and kept < MAX_SIDES:
                hold[kept, 0], hold[kept, 1] = next_x, next_y
                kept += 1
            last_x, last_y, last = next_x, next_y, side
        if kept < 3:
            return 0
        for v in range(kept):
            cell[v, 0], cell[v, 1] = hold[v, 0], hold[v, 1]
        n = kept
    return n


@njit(cache=True, nogil=True)
def prove_graph(
    n_near, slots, order, edges, solid, plane, shape, turn, steep, largest, around, margin, edge
):
    """Show that T is a graph over D (see above): (0 if so, -1 if not, or the height to look at;
    the largest slope)."""
    aside = largest + margin
    for _ in range(4):
        height = aside + steep * (shape[0] + aside) + margin
        if height > around:
            return height, steep
        found = steep
        for k in range(n_near):
            if _is_apart(solid[k], shape, aside, height):
                continue
            if turn * plane[k, 7] <= 0.0 or plane[k, 8] > MAX_SLOPE:
                return -1.0, steep
            found = max(found, plane[k, 8])
            face = order[slots[k]]
            for i in range(3):
                if edges[face, i] == CLOSED:
                    continue
                j = (i + 1) % 3
                for axis in range(3):
                    edge[0, axis] = solid[k, i, axis]
                    edge[1, axis] = edge[2, axis] = solid[k, j, axis]
                if not _is_apart(edge, shape, aside, height):
                    return -1.0, steep
        if found == steep:
            break
        steep = found
    if found != steep:
        return -1.0, steep
    # Faces apart from D play no part any more
    for k in range(n_near):
        if _is_apart(solid[k], shape, aside, height):
            plane[k, 7] = 0.0
    # One face above one point; next to an edge two may seem to be, so there are several tries
    for trial in range(4):
        u, v = 1.0 / 3.0, 1.0 / 3.0
        if trial > 0:
            u, v = (0.19 * trial) % 1.0, 0.17 + 0.03 * trial
        x, y = u * shape[0] + v * shape[1], v * shape[2]
        count = 0
        for k in range(n_near):
            if plane[k, 7] != 0.0 and _holds(solid[k], plane[k, 7], x, y, margin):
                count += 1
        if count == 1:
            return 0.0, steep
    return -1.0, steep
