"""Marching squares, row after row, as chains of vertices that grow and join.

Every piece runs from the edge where the walk around its square (a, b, c, d, counter-clockwise)
leaves the inside to an edge where it enters it again, so that the inside lies on the left. An edge
is left in one of its squares and entered in the other: a vertex has at most one piece before it and
one after it.

The vertices of unfinished chains live in a pool. ``after[v]`` is the next vertex of the chain or
-1, ``is_entered[v]`` tells whether there is one before; ``end[v]`` of a chain's first vertex is its
last and the other way round (of other vertices it means nothing). ``edge[v]`` is the vertex's
name, ``2 * (i * n + j) + axis`` for the edge that leaves node (i, j) along +axis in rows of n
nodes. ``free`` is the stack of unused vertices, ``counts[FREE]`` its height.
"""

import numpy as np
from numba import njit

from .marching_cubes import crossing

OUTSIDE, INSIDE, NO_DATA = 0, 1, 2
FREE, FINISHED = 0, 1  # what `counts` counts
NUDGE = 2.0**-10  # "a small part of the neighbour's value"; a power of two, so that it is exact


@njit(cache=True, nogil=True)
def _nudged(source, level):
    """A value near the level, on the side of ``source``, which is not at the level."""
    step = NUDGE * (source - level)
    if np.isinf(step):
        return source  # an end so far away that it says nothing of the place
    return level + step


@njit(cache=True, nogil=True)
def classify_nodes(values, level, nudge, start, sides, at_level):
    """Fill ``sides`` and ``at_level`` of the rows from ``start`` on.

    With ``nudge`` a node at the level moves, in ``values`` too, a little toward the node before its
    run of such nodes in the row; else toward the one after; else toward the row before; else
    it stays outside.
    """
    n = values.shape[1]
    for i in range(start, values.shape[0]):
        for j in range(n):
            value = values[i, j]
            at_level[i, j] = value == level
            sides[i, j] = NO_DATA if value != value else (INSIDE if value < level else OUTSIDE)
        if not nudge:
            continue
        first = 0
        while first < n:
            if not at_level[i, first]:
                first += 1
                continue
            last = first
            while last + 1 < n and at_level[i, last + 1]:
                last += 1
            source = first - 1
            if source < 0 or sides[i, source] == NO_DATA:
                source = last + 1
            if source < n and sides[i, source] != NO_DATA:
                for j in range(first, last + 1):
                    values[i, j] = _nudged(values[i, source], level)
                    sides[i, j] = sides[i, source]
            elif i > 0:
                for j in range(first, last + 1):
                    if sides[i - 1, j] != NO_DATA:
                        above = values[i - 1, j]
                        values[i, j] = above if at_level[i - 1, j] else _nudged(above, level)
                        sides[i, j] = sides[i - 1, j]
            first = last + 1


@njit(cache=True, nogil=True, inline="always")
def _share(values, at_level, row, j, axis, snap, level):
    """Where the edge that leaves node (row, j) along +axis is crossed, as a fraction of it."""
    row_b, j_b = row + (1 - axis), j + axis
    if snap and at_level[row, j]:
        return 0.5 if at_level[row_b, j_b] else 0.0
    if snap and at_level[row_b, j_b]:
        return 1.0
    return crossing(values[row, j], values[row_b, j_b], level, 0.5)


@njit(cache=True, nogil=True, inline="always")
def _new_vertex(
    e, row, j, values, at_level, snap, first_row, place,
    after, is_entered, end, edge, points, free, counts,
):  # fmt: skip
    """Take a vertex from the pool for edge e (0 ab, 1 bc, 2 cd, 3 da) of square (row, j)."""
    counts[FREE] -= 1
    v = free[counts[FREE]]
    after[v] = -1
    is_entered[v] = False
    end[v] = v
    row, j, axis = row + (e == 1), j + (e == 2), e & 1
    edge[v] = 2 * ((first_row + row) * values.shape[1] + j) + axis
    share = _share(values, at_level, row, j, axis, snap, place[0])
    points[v, 0] = place[1] * (first_row + row + (share if axis == 0 else 0.0)) + place[2]
    points[v, 1] = place[1] * (j + (share if axis == 1 else 0.0)) + place[3]
    return v


@njit(cache=True, nogil=True, inline="always")
def _finish(first, is_closed, finished, counts):
    finished[counts[FINISHED], 0] = first
    finished[counts[FINISHED], 1] = is_closed
    counts[FINISHED] += 1


@njit(cache=True, nogil=True, inline="always")
def _link(v, w, alive_from, after, is_entered, end, edge, finished, counts):
    """Join the chain that ends in v to the one that begins in w, and list it if it is finished.

    Ends on edges below the name ``alive_from`` cannot grow.
    """
    first, last = end[v], end[w]
    after[v] = w
    is_entered[w] = True
    if first == w:
        _finish(w, 1, finished, counts)
        return
    end[first] = last
    end[last] = first
    if edge[first] < alive_from and edge[last] < alive_from:
        _finish(first, 0, finished, counts)


@njit(cache=True, nogil=True, inline="always")
def _retire(v, alive_from, after, is_entered, end, edge, finished, counts):
    """List the chain of v as finished if v is a loose end and so is its other end.

    Ends on edges below the name ``alive_from`` cannot grow.
    """
    if (after[v] >= 0 and is_entered[v]) or end[v] < 0:
        return
    other = end[v]
    if edge[other] < alive_from:
        _finish(other if after[v] < 0 else v, 0, finished, counts)
        end[v] = -1
        end[other] = -1


@njit(cache=True, nogil=True, inline="always")
def _join_square(case, used, alive_from, after, is_entered, end, edge, finished, counts):
    """Add the pieces of a square, whose edges have the vertices ``used``.

    A piece runs from an edge that leaves the inside to one that enters it: back around the inside
    corners (turn -1), or on around the outside corners (turn 1) where these are apart.
    """
    turn = 1 if case >> 4 == 1 else -1
    for e in range(4):
        if (case >> e) & 1 and not (case >> ((e + 1) & 3)) & 1:
            f = (e + turn) & 3
            while not ((case >> ((f + 1) & 3)) & 1 and not (case >> f) & 1):
                f = (f + turn) & 3
            _link(used[e], used[f], alive_from, after, is_entered, end, edge, finished, counts)


@njit(cache=True, nogil=True)
def retire_row(on_row, alive_from, after, is_entered, end, edge, finished, counts):
    """List the chains that end on edges of a row, and now cannot grow there."""
    for j in range(len(on_row)):
        if on_row[j] >= 0:
            _retire(on_row[j], alive_from, after, is_entered, end, edge, finished, counts)


@njit(cache=True, nogil=True)
def trace_rows(
    cases, values, at_level, snap, first_row, place, on_row, on_next, on_side,
    after, is_entered, end, edge, points, free, finished, counts,
):  # fmt: skip
    """Add the pieces of the squares between the rows of ``values``.

    ``place`` holds level, voxel_size and the two numbers of the origin. ``on_row`` (n - 1,) holds
    the vertices on the edges along row ``first_row``, -1 for none, and receives those of the last;
    ``on_next`` (n - 1,) and ``on_side`` (n,) are scratch.
    """
    n = values.shape[1]
    used = np.empty(4, np.int64)  # vertices on the edges ab, bc, cd, da of one square
    for row in range(cases.shape[0]):
        on_next[:] = -1
        on_side[:] = -1
        alive_from = 2 * (first_row + row) * n
        for j in range(n - 1):
            case = cases[row, j]
            if case & 15 == 0 or case & 15 == 15:
                continue
            used[0], used[1], used[2], used[3] = on_side[j], on_next[j], on_side[j + 1], on_row[j]
            for e in range(4):
                if ((case >> e) ^ (case >> ((e + 1) & 3))) & 1 and used[e] < 0:
                    used[e] = _new_vertex(
                        e, row, j, values, at_level, snap, first_row, place,
                        after, is_entered, end, edge, points, free, counts,
                    )  # fmt: skip
            on_side[j], on_next[j], on_side[j + 1], on_row[j] = used[0], used[1], used[2], used[3]
            _join_square(case, used, alive_from, after, is_entered, end, edge, finished, counts)
        alive_from += 2 * n
        retire_row(on_side, alive_from, after, is_entered, end, edge, finished, counts)
        retire_row(on_row, alive_from, after, is_entered, end, edge, finished, counts)
        on_row[:] = on_next


@njit(cache=True, nogil=True, inline="always")
def _least_named(first, after, edge):
    """Return the vertex with the least name of a closed chain."""
    least = first
    v = after[first]
    while v != first:
        if edge[v] < edge[least]:
            least = v
        v = after[v]
    return least


@njit(cache=True, nogil=True, inline="always")
def _same_place(a, n, b, m):
    return a[n, 0] == b[m, 0] and a[n, 1] == b[m, 1]


@njit(cache=True, nogil=True, inline="always")
def _write_chain(first, is_closed, start, after, edge, points, free, counts, places, names):
    """Write a chain from ``start`` on, give its vertices back, and return where it stops.

    Vertices that follow each other at one place become one, with the least of their names, or with
    that of an open chain's end: neighbouring grids then agree on it.
    """
    stop = start
    v = first
    while True:
        last = stop - 1
        if stop > start and _same_place(points, v, places, last):
            if after[v] < 0:
                names[last] = edge[v]
            elif is_closed or last > start:
                names[last] = min(names[last], edge[v])
        else:
            places[stop] = points[v]
            names[stop] = edge[v]
            stop += 1
        free[counts[FREE]] = v
        counts[FREE] += 1
        v = after[v]
        if v < 0 or v == first:
            break
    if is_closed and stop > start + 1 and _same_place(places, start, places, stop - 1):
        stop -= 1  # the name of the first is the least of all
    return stop


@njit(cache=True, nogil=True)
def collect(after, edge, points, free, finished, counts, places, names, offsets, is_closed):
    """Write the finished chains, closed ones from their least name on; return how many curves.

    A chain of one place only is no curve.
    """
    n_curves = 0
    offsets[0] = 0
    for c in range(counts[FINISHED]):
        first, closed = finished[c, 0], finished[c, 1] == 1
        if closed:
            first = _least_named(first, after, edge)
        start = offsets[n_curves]
        stop = _write_chain(first, closed, start, after, edge, points, free, counts, places, names)
        if stop > start + 1:
            is_closed[n_curves] = closed
            n_curves += 1
            offsets[n_curves] = stop
    counts[FINISHED] = 0
    return n_curves
