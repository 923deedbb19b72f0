"""Vertices that stay in their cells, so that no two triangles can cross.

Every loop is filled by the triangles between a point c within the cell and its polygon on the
cell's border. Seen from c the border is met once in every direction, so triangles of one loop do
not cross; loops of one cell stay on their sides of parting planes, with their points and polygons;
and on a face between two cells both sides draw the same line. That line leads from crossing to
crossing, straight to where the edge between the two loops' points passes the face, if that place
suits both cells, and else to a vertex at the middle of the straight arc, which always does (after
Ju and Udeshi 2006, "Intersection-free contouring on an octree grid").
"""

import numpy as np
from numba import njit

from .dual_arrays import other_end, place_of

MARGIN = 2.0**-20
"""In voxels: how far within its cell a vertex is kept."""

ENOUGH = 2.0**-21
"""In voxels: how far within a face, and on their side of planes, its lines are kept."""

SHARE = 0.125
"""At least so much stays of the room that the mean of a loop's crossings has to a parting plane."""


@njit(cache=True, nogil=True)
def _room(planes, kind, m, cell, x):
    """Distance (times the normal's length) to parting plane m of a loop's cell."""
    plane = planes[kind & 255, kind >> 8, m]
    room = plane[3]
    for k in range(3):
        room -= plane[k] * (x[k] - cell[k])
    return room


@njit(cache=True, nogil=True)
def clamp_points(loops, crossings, kinds, planes, begin, end, points):
    """Move the points of loops begin <= l < end into their cells, and between parting planes."""
    mean, p = np.empty(3), np.empty(3)
    for l in range(begin, end):  # noqa: E741
        sides, cell, x = loops.sides[loops.start[l] : loops.start[l + 1]], loops.cells[l], points[l]
        for k in range(3):
            mean[k] = 0.0
        for s in range(len(sides)):
            place_of(crossings, sides[s], p)
            for k in range(3):
                mean[k] += p[k] / len(sides)
        for k in range(3):
            x[k] = min(max(x[k], cell[k] + MARGIN), cell[k] + 1.0 - MARGIN)
        t = 1.0
        for m in range(planes.shape[2]):
            most = _room(planes, kinds[l], m, cell, mean)
            room = _room(planes, kinds[l], m, cell, x)
            if room < SHARE * most:
                t = min(t, (1.0 - SHARE) * most / (most - room))
        for k in range(3):
            x[k] = mean[k] + t * (x[k] - mean[k]) if t < 1.0 else x[k]


@njit(cache=True, nogil=True)
def _suits(loops, crossings, kinds, planes, points, a, b, c, other, x):
    """Tell whether the edge between two loops' points passes their common face at a good place."""
    axis = 0
    for k in range(3):
        if loops.cells[a, k] != loops.cells[b, k]:
            axis = k
    height = max(loops.cells[a, axis], loops.cells[b, axis])
    t = (height - points[a, axis]) / (points[b, axis] - points[a, axis])
    for k in range(3):
        x[k] = points[a, k] + t * (points[b, k] - points[a, k])
    x[axis] = height
    # On the face; and on its side of the diagonal, where the arc is one of two
    is_one_of_two, off, opposite = True, 0.0, 0
    for k in range(3):
        here = crossings.nodes[c, k] + (crossings.ways[c] == 2 * k)
        there = crossings.nodes[other, k] + (crossings.ways[other] == 2 * k)
        is_one_of_two &= here == there
        off += abs(x[k] - here)
        upper = here > loops.cells[a, k]
        opposite = 2 * opposite + (upper if k == axis else not upper)
        low = loops.cells[a, k]
        if k != axis and not low + ENOUGH <= x[k] <= low + 1.0 - ENOUGH:
            return False
    is_one_of_two &= (kinds[a] >> opposite) & 1 == 1
    if is_one_of_two and off > 1.0 - ENOUGH:
        return False
    for m in range(planes.shape[2]):
        for l in (a, b):  # noqa: E741
            if _room(planes, kinds[l], m, loops.cells[l], x) < ENOUGH:
                return False
    return True


@njit(cache=True, nogil=True)
def mark_bad_arcs(loops, crossings, kinds, planes, points, begin, end, is_marked):
    """Mark the keys ``4 c + q`` of arcs that need a vertex on their face."""
    x = np.empty(3)
    for c in range(begin, end):
        for q in range(4):
            a, b = loops.around[c, q], loops.around[c, (q + 1) & 3]
            if a < 0 or b < 0:
                continue
            other, _ = other_end(loops, c, q)
            if other > c:
                is_marked[4 * c + q] = not _suits(
                    loops, crossings, kinds, planes, points, a, b, c, other, x
                )
