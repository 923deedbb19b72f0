"""The winding number or parity of any point, by counting the faces straight above it.

Whether the upward ray of p crosses a face is decided as in `crossings`: edge by edge, each height
computed from the edge alone with its ends in one order. In the plane x = px the edges' crossings
are therefore corners of closed polygons, moved by rounding only, and the count is their winding
number around p. Moving the corners cannot change it unless one passes over p; so the answer is
exact for every p farther from the surface than the rounding of a corner, which is at most

    40 u S,    u = 2**-53, S the largest |coordinate| of mesh and point,

12 u S for each of y and z on an edge, and 12 u S for the height between two edges. Nothing else is
needed: no face is too steep, too thin or too well aligned with the ray.
"""

import numpy as np
from numba import njit

from .bvh import EMPTY, STACK_SIZE
from .crossings import edge_height


@njit(cache=True, nogil=True)
def _edge_depth(p, q, vp, vq, x):
    """z of edge pq where it passes x; the twin of `edge_height`."""
    if vp > vq:
        p, q = q, p
    z = p[2] + (x - p[0]) * ((q[2] - p[2]) / (q[0] - p[0]))
    return min(max(z, min(p[2], q[2])), max(p[2], q[2]))


@njit(cache=True, nogil=True)
def face_crossing(points, v, lines, line_ends, px, py):
    """Where the line along z at (px, py) crosses a face: 1 if it leaves upwards, -1 if it enters,
    0 if it misses, and the height."""
    y_up, y_down, z_up, z_down, n_up = 0.0, 0.0, 0.0, 0.0, 0
    for e in range(3):
        vp, vq = v[e], v[(e + 1) % 3]
        y, way = edge_height(points[vp], points[vq], vp, vq, px)
        if way == 0:
            continue
        if len(lines) > 0 and lines[e] >= 0:
            vp, vq = line_ends[lines[e], 0], line_ends[lines[e], 1]
            y, _ = edge_height(points[vp], points[vq], vp, vq, px)
        z = _edge_depth(points[vp], points[vq], vp, vq, px)
        if way > 0:
            y_up, z_up, n_up = y, z, n_up + 1
        else:
            y_down, z_down = y, z
    if n_up == 0 or not min(y_up, y_down) <= py < max(y_up, y_down):
        return 0, 0.0
    share = (py - y_up) / (y_down - y_up)
    # Seen along +z: upward edges below downward ones mean the face looks up
    return (1 if y_up < y_down else -1), z_up + share * (z_down - z_up)


@njit(cache=True, nogil=True)
def count_above(
    centered, sequence, begin, end, points, faces, edge_line, line_ends, children, child_boxes,
    counts,
):  # fmt: skip
    """``counts[q]`` = signed number of faces above point q, for q in ``sequence[begin:end]``.

    ``faces`` and ``edge_line`` (or none) are in the order of the tree's slots.
    """
    stack = np.empty(STACK_SIZE, np.int32)
    no_lines = np.empty(0, np.int32)
    for n in range(begin, end):
        q = sequence[n]
        px, py, pz = centered[q, 0], centered[q, 1], centered[q, 2]
        stack[0] = 0
        n_stack, total = 1, 0
        while n_stack > 0:
            n_stack -= 1
            node = stack[n_stack]
            for side in range(2):
                child = children[node, side]
                box = child_boxes[node, 6 * side : 6 * side + 6]
                if child == EMPTY or px < box[0] or px > box[3] or py < box[1] or py > box[4]:
                    continue
                if pz > box[5]:
                    continue
                if child >= 0:
                    stack[n_stack] = child
                    n_stack += 1
                    continue
                first = (-2 - child) >> 3
                for s in range(first, first + ((-2 - child) & 7) + 1):
                    lines = edge_line[s] if len(edge_line) > 0 else no_lines
                    step, height = face_crossing(points, faces[s], lines, line_ends, px, py)
                    if height > pz:
                        total += step
        counts[q] = total
