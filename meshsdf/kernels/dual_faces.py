"""Polygons around the crossings, and their triangles.

The polygon of a crossing has the vertices of the four loops around it, and between loop q and the
next the vertex on their arc, if the arc has one: bit q of ``inserts[c]``. Vertices are numbered
loops first, then arcs in the order of their keys, then hubs: crossings that are vertices of their
own, with triangles all around. Where a cell is missing the polygon ends at the hub, and runs from
it along the straight arc in the last face to the next hub.
"""

import numpy as np
from numba import njit

from .dual_arrays import other_end, place_of

NO_AREA = 1e-9
"""In square voxels: a smaller triangle has no plane to speak of."""

CLEARLY = 0.02
"""In voxels: a difference that decides between two diagonals."""


@njit(cache=True, nogil=True)
def set_inserts(keys, loops, inserts):
    """Set the bits of the arcs with a vertex, at both of their ends."""
    for n in range(len(keys)):
        c, q = keys[n] >> 2, keys[n] & 3
        inserts[c] |= 1 << q
        other, side = other_end(loops, c, q)
        inserts[other] |= 1 << side


@njit(cache=True, nogil=True)
def _arc_vertex(c, q, loops, keys):
    """Number of the vertex on an arc."""
    other, side = other_end(loops, c, q)
    key = min(4 * np.int64(c) + q, 4 * np.int64(other) + side)
    low, high = 0, len(keys)
    while low < high:
        middle = (low + high) >> 1
        if keys[middle] < key:
            low = middle + 1
        else:
            high = middle
    return len(loops.cells) + low


@njit(cache=True, nogil=True)
def _polygon(c, loops, inserts, keys, corner):
    """Write the vertices of a whole polygon; return how many, and the first on an arc or 0."""
    n, on_arc = 0, 0
    for q in range(4):
        corner[n] = loops.around[c, q]
        n += 1
        if (inserts[c] >> q) & 1:
            corner[n] = _arc_vertex(c, q, loops, keys)
            on_arc = n if on_arc == 0 else on_arc
            n += 1
    return n, on_arc


@njit(cache=True, nogil=True)
def _is_whole(c, loops):
    """Tell whether all four cells around a crossing have a loop."""
    around = loops.around[c]
    return min(min(around[0], around[1]), min(around[2], around[3])) >= 0


@njit(cache=True, nogil=True)
def _judge(points, corner, n, pivot, p, normal, verdict):
    """Judge the triangles that diagonals from one corner cut a polygon into.

    Writes the least distance of p from their planes; the least cosine between their normals and
    that of the surface, 1 where one of these is unknown; and the distance of p from the diagonal
    of a quad.
    """
    verdict[0], verdict[1] = np.inf, 1.0
    a = corner[pivot]
    px, py, pz = p[0] - points[a, 0], p[1] - points[a, 1], p[2] - points[a, 2]
    for m in range(pivot, pivot + n - 2):
        b, c = corner[(m + 1) % n], corner[(m + 2) % n]
        ux, uy, uz = (
            points[b, 0] - points[a, 0],
            points[b, 1] - points[a, 1],
            points[b, 2] - points[a, 2],
        )
        vx, vy, vz = (
            points[c, 0] - points[a, 0],
            points[c, 1] - points[a, 1],
            points[c, 2] - points[a, 2],
        )
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        length = np.sqrt(nx * nx + ny * ny + nz * nz)
        if length > NO_AREA:
            verdict[0] = min(verdict[0], abs(nx * px + ny * py + nz * pz) / length)
            if normal[0] != 0.0 or normal[1] != 0.0 or normal[2] != 0.0:
                along = nx * normal[0] + ny * normal[1] + nz * normal[2]
                verdict[1] = min(verdict[1], along / length)
        if m == pivot:
            # The first triangle ends with the first diagonal
            square = vx * vx + vy * vy + vz * vz
            t = (vx * px + vy * py + vz * pz) / square if square > 0.0 else 0.0
            t = min(max(t, 0.0), 1.0)
            verdict[2] = (px - t * vx) ** 2 + (py - t * vy) ** 2 + (pz - t * vz) ** 2


@njit(cache=True, nogil=True)
def choose_pivots(loops, crossings, inserts, keys, points, allowed, begin, end, pivots):
    """Write the corner that all diagonals of a polygon start from, or -1 for a hub.

    The corner on an arc, if there is one: a diagonal between two loops could run twice. Of the two
    diagonals of a quad one whose triangles come clearly nearer to the crossing p, for the surface
    passes there; else triangles turned away from the surface are avoided; else p is to be near
    the diagonal. Hubs are the crossings farther than ``allowed`` from all planes of these
    triangles, and those whose polygon is not whole; all if ``allowed`` is negative.
    """
    corner = np.empty(8, np.int64)
    p, verdicts = np.empty(3), np.empty((2, 3))
    for c in range(begin, end):
        pivots[c] = -1
        if allowed < 0.0 or not _is_whole(c, loops):
            continue
        place_of(crossings, c, p)
        n, pivot = _polygon(c, loops, inserts, keys, corner)
        best = 0
        for turn in range(1 if n > 4 else 2):
            if n == 4:
                pivot = turn
            _judge(points, corner, n, pivot, p, crossings.normals[c], verdicts[turn])
        if n == 4:
            here, there = verdicts[0], verdicts[1]
            if abs(here[0] - there[0]) > CLEARLY:
                best = 1 if there[0] < here[0] else 0
            elif min(here[1], there[1]) < 0.0:
                best = 1 if there[1] > here[1] else 0
            else:
                best = 1 if there[2] < here[2] else 0
            pivot = best
        if not allowed < verdicts[best, 0] < np.inf:
            pivots[c] = pivot


@njit(cache=True, nogil=True)
def count_triangles(loops, inserts, pivots, begin, end, counts):
    """Write how many triangles the crossings begin <= c < end have."""
    for c in range(begin, end):
        whole = _is_whole(c, loops)
        n = (4 if pivots[c] < 0 else 2) if whole else 0
        for q in range(4):
            here, after = loops.around[c, q], loops.around[c, (q + 1) & 3]
            if here >= 0 and after >= 0:
                n += (0 if whole else 1) + ((inserts[c] >> q) & 1)
            elif here >= 0:
                n += 1
        counts[c] = n


@njit(cache=True, nogil=True)
def fill_triangles(loops, inserts, keys, hub_of, pivots, first_face, begin, end, faces):
    """Write the triangles of crossings begin <= c < end; ``hub_of[c]`` is a vertex or -1."""
    corner = np.empty(9, np.int64)
    for c in range(begin, end):
        f, hub, pivot = first_face[c], hub_of[c], np.int64(pivots[c])
        if hub < 0:
            n, _ = _polygon(c, loops, inserts, keys, corner)
            for m in range(pivot, pivot + n - 2):
                faces[f, 0] = corner[pivot]
                faces[f, 1], faces[f, 2] = corner[(m + 1) % n], corner[(m + 2) % n]
                f += 1
            continue
        for q in range(4):
            here, after = loops.around[c, q], loops.around[c, (q + 1) & 3]
            if here < 0:
                continue
            # From this loop to the next, over the arc's vertex; or along the arc to the next hub
            n = 2
            corner[0], corner[1] = here, after
            if after < 0:
                corner[1] = hub_of[other_end(loops, c, q)[0]]
            elif (inserts[c] >> q) & 1:
                corner[1], corner[2] = _arc_vertex(c, q, loops, keys), after
                n = 3
            for m in range(n - 1):
                faces[f, 0], faces[f, 1], faces[f, 2] = hub, corner[m], corner[m + 1]
                f += 1
