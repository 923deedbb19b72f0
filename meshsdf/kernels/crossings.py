"""Signs by counting how often lattice lines along z cross the mesh.

Where line (x, y) crosses a face is decided edge by edge: ``X(pq) = [p and q lie on both sides of
x] and [the edge passes above y]``, computed from the edge alone, its ends taken in one order. A
face is crossed when an odd number of its edges say so, or, with orientation, by the signed sum.
Summed over a mesh whose edges all cancel, every line therefore has an even number of crossings
(a signed sum of zero), whatever the rounding; no sign can leak. Pieces of edges that cancel only
geometrically, as at T-junctions, are measured along the ends of their common supporting line, so
that they round alike too.

A crossing at height z is counted at node ceil(z) of its line, which lies within a voxel of it.
"""

import numpy as np
from numba import njit

from .brick_lookup import find_brick, mark_inside


@njit(cache=True, nogil=True)
def edge_height(p, q, vp, vq, x):
    """Where edge pq passes line x, and 1 when it runs up, -1 down, 0 when it does not."""
    up = p[0] <= x < q[0]
    down = q[0] <= x < p[0]
    if not (up or down):
        return 0.0, 0
    if vp > vq:
        p, q = q, p
    y = p[1] + (x - p[0]) * ((q[1] - p[1]) / (q[0] - p[0]))
    return min(max(y, min(p[1], q[1])), max(p[1], q[1])), (1 if up else -1)


@njit(cache=True, nogil=True)
def count_crossings(
    points, faces, edge_line, line_ends, ids, x0, x1, root, pages, slot0, signed, crossings
):
    """Add the crossings of the faces ``ids`` with the lines of nodes x in [x0, x1).

    ``crossings`` (b, 512) int32 receives +-1 (``signed``) or 1 per crossing. ``edge_line`` (m, 3)
    int32 names the supporting line of an edge or is -1; it may be empty. Returns the number of
    crossings that found no brick (0 unless the bricks miss part of the surface).
    """
    lost = 0
    for n in range(len(ids)):
        f = ids[n]
        v = faces[f]
        a, b, c = points[v[0]], points[v[1]], points[v[2]]
        x_first = max(x0, np.int64(np.ceil(min(a[0], b[0], c[0]))))
        x_last = min(x1 - 1, np.int64(np.ceil(max(a[0], b[0], c[0]))) - 1)
        for x in range(x_first, x_last + 1):
            # A face has two edges that pass line x, one up and one down, or none
            y_up, y_down, z_up, z_down, n_up = 0.0, 0.0, 0.0, 0.0, 0
            for e in range(3):
                vp, vq = v[e], v[(e + 1) % 3]
                p, q = points[vp], points[vq]
                y, way = edge_height(p, q, vp, vq, x)
                if way == 0:
                    continue
                if len(edge_line) > 0 and edge_line[f, e] >= 0:
                    line = line_ends[edge_line[f, e]]
                    y, _ = edge_height(points[line[0]], points[line[1]], line[0], line[1], x)
                z = p[2] + (q[2] - p[2]) * ((x - p[0]) / (q[0] - p[0]))
                if way > 0:
                    y_up, z_up, n_up = y, z, 1
                else:
                    y_down, z_down = y, z
            if n_up == 0:
                continue
            # Seen along +z: upward edges below downward ones mean the face looks up
            step = -1 if y_up < y_down else 1
            if not signed:
                step = 1
            y_first = np.int64(np.ceil(min(y_up, y_down)))
            y_last = np.int64(np.ceil(max(y_up, y_down))) - 1
            for y in range(y_first, y_last + 1):
                # The face cuts the plane x in the segment between its two edges
                z = z_up + (z_down - z_up) * ((y - y_up) / (y_down - y_up))
                k = np.int64(np.ceil(min(max(z, min(z_up, z_down)), max(z_up, z_down))))
                slot = find_brick(root, pages, x >> 3, y >> 3, k >> 3)
                if slot >= 0:
                    node = ((x & 7) << 6) | ((y & 7) << 3) | (k & 7)
                    crossings[slot - slot0, node] += step
                else:
                    lost += 1
    return lost


@njit(cache=True, nogil=True)
def resolve_signs(coordinates, crossings, parity, root, pages, inside):
    """Sum crossings upwards along every line; fill ``inside`` (b, 8) uint64 masks.

    ``coordinates`` (b, 3) are the slab's bricks in lexicographic order, so every column of bricks
    is a run. Gaps between bricks of a column lie on one side as a whole; inner ones are coded in
    ``pages`` (or ``root``). Returns the number of lines whose crossings do not cancel or disagree
    within a gap, 0 for a mesh with the two-set property, and the largest magnitude of a sum.
    """
    leaks, largest = 0, 0
    carry = np.zeros(64, np.int32)
    for b in range(len(coordinates)):
        x, y, z = coordinates[b, 0], coordinates[b, 1], coordinates[b, 2]
        for line in range(64):
            total = carry[line]
            row = np.uint64(0)
            for k in range(8):
                total += crossings[b, 8 * line + k]
                largest = max(largest, abs(total))
                if (total & 1) if parity else total != 0:
                    row |= np.uint64(1) << np.uint64(k)
            carry[line] = total
            inside[b, line >> 3] |= row << np.uint64(8 * (line & 7))
        last = b + 1 == len(coordinates)
        if not last and coordinates[b + 1, 0] == x and coordinates[b + 1, 1] == y:
            gap = coordinates[b + 1, 2] - z - 1
            if gap > 0:
                state = (carry[0] & 1) if parity else carry[0] != 0
                for line in range(64):
                    if ((carry[line] & 1) if parity else carry[line] != 0) != state:
                        leaks += 1
                if state:
                    mark_inside(root, pages, x, y, z + 1, z + 1 + gap)
        else:
            for line in range(64):
                if (carry[line] & 1) if parity else carry[line] != 0:
                    leaks += 1
                carry[line] = 0
    return leaks, largest
