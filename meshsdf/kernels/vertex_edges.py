"""The edges that meet at every vertex."""

from numba import njit


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
