"""The winding number on both sides of a sheet, at points on the sheet itself.

The line along z through a point p of a face crosses that face at p. Leaving it out, the crossings
above p give the winding number just above the face; with its own crossing added, the number just
below. Nothing has to be moved off the face, so nothing can lie in between: sheets in which p lies
too, to within ``near``, are crossed together with the face and add to its jump.

As in `point_crossings`, the heights of an edge are computed from that edge alone, so the counts
are exact wherever p is farther than their rounding, 40 u S, from the rims of its face and from
sheets not counted with it. Faces must not be parallel to z; the caller turns the axes.
"""

import numpy as np
from numba import njit

from .bvh import EMPTY, STACK_SIZE
from .point_crossings import face_crossing


@njit(cache=True, nogil=True)
def wind_sheets(
    samples, owners, begin, end, points, faces, edge_line, line_ends, order, children, child_boxes,
    start, partners, near, above, below, leaders,
):  # fmt: skip
    """Winding numbers above and below sample q of face ``owners[q]``, for begin <= q < end.

    ``faces`` and ``edge_line`` (or none) are in the order of the tree's slots. ``partners[start[f]:
    start[f + 1]]`` are the faces coplanar with f, ascending. ``leaders[q]`` receives, of the
    face and those of them it shares q with, the first that is turned as the jump is.
    """
    stack = np.empty(STACK_SIZE, np.int32)
    no_lines = np.empty(0, np.int32)
    none = np.int64(1) << 60
    for q in range(begin, end):
        px, py, pz = samples[q, 0], samples[q, 1], samples[q, 2]
        own = owners[q]
        total, jump = 0, 0
        first_up, first_down = none, none
        stack[0] = 0
        n_stack = 1
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
                    f = order[s]
                    if f == own and step == 0:
                        step = _facing(points, faces[s])
                    listed = f == own or (
                        abs(step) > 0 and _holds(partners, start[own], start[own + 1], f)
                    )
                    if listed or abs(height - pz) <= near:
                        jump += step
                    elif height > pz:
                        total += step
                    if listed and step > 0:
                        first_up = min(first_up, f)
                    elif listed and step < 0:
                        first_down = min(first_down, f)
        above[q], below[q] = total, total + jump
        leaders[q] = first_up if jump > 0 else first_down


@njit(cache=True, nogil=True)
def _facing(points, v):
    """1 for a face that looks up, else -1."""
    a, b, c = points[v[0]], points[v[1]], points[v[2]]
    return 1 if (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0.0 else -1


@njit(cache=True, nogil=True)
def _holds(partners, begin, end, f):
    """Whether f is among ``partners[begin:end]``, ascending."""
    while begin < end:
        middle = (begin + end) >> 1
        if partners[middle] == f:
            return True
        if partners[middle] < f:
            begin = middle + 1
        else:
            end = middle
    return False
