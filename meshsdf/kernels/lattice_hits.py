"""Where the crossed edges of a lattice meet the faces of a mesh.

Lattice lines along z are followed as in `crossings`, by the same arithmetic, so that a line meets
a closed mesh an even number of times and the edge between nodes k and k + 1 is met at heights in
(k, k + 1] as often as its signs demand. Lines along x and y are those along z of a mesh whose
coordinates have been exchanged.

Where a line meets an edge, or a face a node, ties are broken as if all nodes were moved a little up
along x, less than along y, less than along z: that is what the rules for z amount to. The other two
coordinates of a line come in this order, and so on a node the slope of the face decides.
"""

import numpy as np
from numba import njit

from .bits import count_bits
from .brick_lookup import find_brick
from .crossings import edge_height
from .marching_cubes import NONE, ONE


@njit(cache=True, nogil=True)
def _number_of(axis, x, y, k, root, pages, words, first):
    """Number of the crossing on the edge above node k of line (x, y) along the axis, or -1."""
    # The two coordinates across the axis come first, in order
    i = k if axis == 0 else x
    j = k if axis == 1 else (x if axis == 0 else y)
    l = k if axis == 2 else y  # noqa: E741
    w = find_brick(root, pages, i >> 3, j >> 3, l >> 3)
    if w < 0:
        return -1
    word = 8 * axis + (i & 7)
    bit = np.uint64(8 * (j & 7) + (l & 7))
    if (words[w, word] >> bit) & ONE == NONE:
        return -1
    return first[w, word] + count_bits(words[w, word] & ((ONE << bit) - ONE))


@njit(cache=True, nogil=True)
def _rises(a, b, c, axis):
    """Tell whether a face that passes a node of a line lies above it, by how ties are broken."""
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    if axis == 2:
        return False  # the node's own way up outweighs any slope
    if ny != 0.0:
        return (ny > 0.0) != (nz > 0.0)
    if axis == 1 or nx == 0.0:
        return False
    return (nx > 0.0) != (nz > 0.0)


@njit(cache=True, nogil=True)
def scan_lines(
    points, faces, edge_line, line_ends, axis, root, pages, words, first, begin, end,
    numbers, heights, hit_faces, steps,
):  # fmt: skip
    """Find the hits of faces begin <= f < end with crossed edges along an axis; return how many.

    ``points`` are those whose axis comes last, in voxels from the first node of ``root``.
    The number of the crossing, the height above its lower node, the face and -1 or 1 (the face
    looks up or down) are written as far as the arrays reach: empty ones make this a count.
    """
    n_hits = 0
    for f in range(begin, end):
        v = faces[f]
        a, b, c = points[v[0]], points[v[1]], points[v[2]]
        x_first = np.int64(np.ceil(min(a[0], b[0], c[0])))
        x_last = np.int64(np.ceil(max(a[0], b[0], c[0]))) - 1
        if np.ceil(min(a[1], b[1], c[1])) >= np.ceil(max(a[1], b[1], c[1])):
            continue
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
            y_first = np.int64(np.ceil(min(y_up, y_down)))
            y_last = np.int64(np.ceil(max(y_up, y_down))) - 1
            for y in range(y_first, y_last + 1):
                z = z_up + (z_down - z_up) * ((y - y_up) / (y_down - y_up))
                z = min(max(z, min(z_up, z_down)), max(z_up, z_down))
                k = np.int64(np.ceil(z)) - 1
                if z == k + 1 and _rises(a, b, c, axis):
                    k += 1
                number = _number_of(axis, x, y, k, root, pages, words, first)
                if number < 0:
                    continue
                if n_hits < len(numbers):
                    numbers[n_hits] = number
                    heights[n_hits] = z - k
                    hit_faces[n_hits] = f
                    steps[n_hits] = -1 if y_up < y_down else 1
                n_hits += 1
    return n_hits


@njit(cache=True, nogil=True)
def sort_hits(numbers, n_crossings, start, order):
    """List the hits of every crossing: ``order[start[c]:start[c + 1]]``."""
    for c in range(n_crossings + 1):
        start[c] = 0
    for h in range(len(numbers)):
        start[numbers[h] + 1] += 1
    for c in range(n_crossings):
        start[c + 1] += start[c]
    for h in range(len(numbers)):
        c = numbers[h]
        order[start[c]] = h
        start[c] += 1
    for c in range(n_crossings, 0, -1):
        start[c] = start[c - 1]
    start[0] = 0


@njit(cache=True, nogil=True)
def pick_hits(
    start, order, heights, hit_faces, steps, face_normals, is_parity, ways, begin, end,
    fractions, faces, normals,
):  # fmt: skip
    """Choose one hit of every crossing begin <= c < end; those without one keep face -1.

    Walking from the outer end in, the side changes at every hit (``is_parity``) or where the sum
    of the steps leaves or reaches 0. Of these hits the middle one is taken.
    """
    changes = np.empty(64, np.int64)
    for c in range(begin, end):
        first, last = start[c], start[c + 1]
        n = last - first
        if n == 0:
            continue
        axis, goes_up = ways[c] >> 1, ways[c] & 1
        taken = order[first]
        if n > 1:
            # By height, from the outer end on: insertion, for there are few
            for s in range(first + 1, last):
                h, t = order[s], s
                while t > first and (heights[order[t - 1]] > heights[h]) != (goes_up == 1):
                    order[t] = order[t - 1]
                    t -= 1
                order[t] = h
            total, n_changes = 0, 0
            for s in range(first, last):
                before = total
                total += steps[order[s]]
                if (is_parity or (before == 0) != (total == 0)) and n_changes < len(changes):
                    changes[n_changes] = order[s]
                    n_changes += 1
            taken = changes[n_changes // 2]
        fractions[c] = min(max(heights[taken], 0.0), 1.0)
        f = hit_faces[taken]
        faces[c] = f
        turn = 1.0 if (face_normals[f, axis] > 0.0) == (goes_up == 1) else -1.0
        for x in range(3):
            normals[c, x] = turn * face_normals[f, x]
