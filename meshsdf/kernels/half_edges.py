"""Group the half-edges of triangles into edges, and list the edges of every vertex.

Two stable counting sorts, by the higher and then by the lower vertex: linear time, and the same
order on every machine. Half-edge ``3 f + e`` runs from corner e to corner e + 1 of face f.
"""

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def sort_half_edges(faces, n_vertices, order):
    """Fill ``order`` (3 m,) int32 with half-edges sorted by (lower vertex, higher vertex, id)."""
    n = 3 * len(faces)
    by_higher = np.empty(n, np.int32)
    for key in range(2):
        start = np.zeros(n_vertices + 1, np.int32)
        for f in range(len(faces)):
            for e in range(3):
                p, q = faces[f, e], faces[f, (e + 1) % 3]
                start[(max(p, q) if key == 0 else min(p, q)) + 1] += 1
        for v in range(n_vertices):
            start[v + 1] += start[v]
        for i in range(n):
            h = i if key == 0 else by_higher[i]
            p, q = faces[h // 3, h % 3], faces[h // 3, (h % 3 + 1) % 3]
            v = max(p, q) if key == 0 else min(p, q)
            if key == 0:
                by_higher[start[v]] = h
            else:
                order[start[v]] = h
            start[v] += 1


@njit(cache=True, nogil=True)
def group_edges(faces, order, ends, first):
    """Name the edges: vertices ``ends[e]`` and half-edges ``order[first[e]:first[e + 1]]``.

    ``ends`` (3 m, 2) int32 and ``first`` (3 m + 1,) int32 are filled as far as there are edges;
    returns their number.
    """
    n = 0
    for i in range(len(order)):
        h = order[i]
        p, q = faces[h // 3, h % 3], faces[h // 3, (h % 3 + 1) % 3]
        low, high = min(p, q), max(p, q)
        if n == 0 or ends[n - 1, 0] != low or ends[n - 1, 1] != high:
            ends[n, 0], ends[n, 1] = low, high
            first[n] = i
            n += 1
    first[n] = len(order)
    return n


@njit(cache=True, nogil=True)
def edges_of_vertices(ends, n_vertices, start, edges):
    """CSR lists: vertex v touches ``edges[start[v]:start[v + 1]]``."""
    start[:] = 0
    for e in range(len(ends)):
        start[ends[e, 0] + 1] += 1
        start[ends[e, 1] + 1] += 1
    for v in range(n_vertices):
        start[v + 1] += start[v]
    place = start.copy()
    for e in range(len(ends)):
        for side in range(2):
            v = ends[e, side]
            edges[place[v]] = e
            place[v] += 1
