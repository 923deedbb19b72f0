"""Undirected edges of triangles: number them, count their uses, join what they connect."""

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def sort_half_edges(faces, n_vertices, order):
    """Sort half-edges 3 f + e by lower end, then upper end, then number; return how many.

    Two passes of counting sort. Faces that repeat a corner are left out: their edges cancel.
    order : (3 m,) int32
    """
    # Count by upper end
    start = np.zeros(n_vertices + 1, dtype=np.int32)
    n_used = 0
    for f in range(len(faces)):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        if a == b or b == c or c == a:
            continue
        start[max(a, b) + 1] += 1
        start[max(b, c) + 1] += 1
        start[max(c, a) + 1] += 1
        n_used += 3
    for v in range(n_vertices):
        start[v + 1] += start[v]
    # Place by upper end, and count by lower end
    by_upper = np.empty(n_used, dtype=np.int32)
    lower_start = np.zeros(n_vertices + 1, dtype=np.int32)
    for f in range(len(faces)):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        if a == b or b == c or c == a:
            continue
        for e in range(3):
            p, q = faces[f, e], faces[f, (e + 1) % 3]
            by_upper[start[max(p, q)]] = 3 * f + e
            start[max(p, q)] += 1
            lower_start[min(p, q) + 1] += 1
    for v in range(n_vertices):
        lower_start[v + 1] += lower_start[v]
    # Place by lower end, keeping the order of upper ends
    for i in range(n_used):
        h = by_upper[i]
        f, e = h // 3, h % 3
        low = min(faces[f, e], faces[f, (e + 1) % 3])
        order[lower_start[low]] = h
        lower_start[low] += 1
    return n_used


@njit(cache=True, nogil=True)
def number_edges(faces, order, edge_of_corner, edges, n_uses, net_uses):
    """Number runs of equal half-edges; return the number of edges.

    edge_of_corner : (m, 3) int32 filled with -1; edges : (>= n, 2); n_uses, net_uses : (>= n,)
    """
    n_edges = 0
    last_low, last_high = -1, -1
    for i in range(len(order)):
        f, e = order[i] // 3, order[i] % 3
        p, q = faces[f, e], faces[f, (e + 1) % 3]
        low, high = min(p, q), max(p, q)
        if low != last_low or high != last_high:
            edges[n_edges, 0], edges[n_edges, 1] = low, high
            n_uses[n_edges], net_uses[n_edges] = 0, 0
            last_low, last_high = low, high
            n_edges += 1
        edge_of_corner[f, e] = n_edges - 1
        n_uses[n_edges - 1] += 1
        net_uses[n_edges - 1] += 1 if p < q else -1
    return n_edges


@njit(cache=True, nogil=True)
def _root(parent, i):
    """The smallest member known of the set that holds i; halves the path on the way."""
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i


@njit(cache=True, nogil=True)
def _join(parent, i, j):
    """Make one set of two; the smaller root stays."""
    i, j = _root(parent, i), _root(parent, j)
    if i < j:
        parent[j] = i
    elif j < i:
        parent[i] = j


@njit(cache=True, nogil=True)
def connect_faces(edge_of_corner, n_edges, component):
    """Number the sets of faces that hang together by edges, in order of their first faces.

    component : (m,) int32, -1 for faces without edges. Returns the number of components.
    """
    n_faces = len(edge_of_corner)
    parent = np.arange(n_faces, dtype=np.int32)
    last_face = np.full(n_edges, -1, dtype=np.int32)
    for f in range(n_faces):
        for e in range(3):
            edge = edge_of_corner[f, e]
            if edge < 0:
                continue
            if last_face[edge] >= 0:
                _join(parent, f, last_face[edge])
            last_face[edge] = f
    n_components = 0
    for f in range(n_faces):
        if edge_of_corner[f, 0] < 0:
            component[f] = -1
        elif parent[f] == f:
            component[f] = n_components
            n_components += 1
        else:
            component[f] = component[_root(parent, f)]
    return n_components


@njit(cache=True, nogil=True)
def mark_branching_vertices(faces, edge_of_corner, n_uses, n_fans, is_branching):
    """Mark vertices whose link is neither one cycle nor one path.

    Such a vertex lies on an edge with more than two faces, or its corners fall into several fans
    that no edge at the vertex connects. n_fans : (n,) int32 of zeros; is_branching : (n,) of False
    """
    n_faces = len(faces)
    parent = np.arange(3 * n_faces, dtype=np.int32)
    last_half_edge = np.full(len(n_uses), -1, dtype=np.int32)
    for f in range(n_faces):
        for e in range(3):
            edge = edge_of_corner[f, e]
            if edge < 0:
                continue
            after = (e + 1) % 3
            if n_uses[edge] > 2:
                is_branching[faces[f, e]] = True
                is_branching[faces[f, after]] = True
            last = last_half_edge[edge]
            last_half_edge[edge] = 3 * f + e
            if last < 0:
                continue
            g, d = last // 3, last % 3
            if faces[g, d] == faces[f, e]:
                _join(parent, 3 * f + e, last)
                _join(parent, 3 * f + after, 3 * g + (d + 1) % 3)
            else:
                _join(parent, 3 * f + after, last)
                _join(parent, 3 * f + e, 3 * g + (d + 1) % 3)
    for h in range(3 * n_faces):
        if edge_of_corner[h // 3, 0] >= 0 and parent[h] == h:
            v = faces[h // 3, h % 3]
            n_fans[v] += 1
            if n_fans[v] > 1:
                is_branching[v] = True
