"""The edges of triangles, read off the star of every vertex.

The star of a vertex is the list of its corners. Sorted by their other ends, the half-edges of a
star fall into edges; how its corners hang together tells whether the vertex is manifold. Stars
share nothing, so ranges of vertices run on all cores, and all the sorting stays in the cache.
Corner i of face f, and the half-edge from it to the next corner, have the number ``3 f + i``.
"""

import numpy as np
from numba import njit

MANY = 8  # faces on one edge; whether two of them have the same corners is then left open
FEW = 32  # corners or half-edges; stars with fewer are searched plainly
LOW_WORD = 0xFFFFFFFF

ODD, UNBALANCED, CONFLICTS, NONMANIFOLD, TWINS, N_COUNTS = 0, 1, 2, 3, 4, 5
"""What is counted of edges: in an odd number of faces; used more often one way than the other;
the same but even; in more than two faces; shared by faces with the same three corners."""


@njit(cache=True, nogil=True)
def count_corners(faces, v0, v1, corners, lows):
    """Count corners, and half-edges by their lower ends, of the vertices in [v0, v1).

    corners, lows : (n + 1,) int32, entry v + 1 for vertex v. Faces that repeat a corner are left
    out: their edges cancel.
    """
    corners[v0 + 1 : v1 + 1] = 0
    lows[v0 + 1 : v1 + 1] = 0
    for f in range(len(faces)):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        if a == b or b == c or c == a:
            continue
        for v, w in ((a, b), (b, c), (c, a)):
            if v0 <= v < v1:
                corners[v + 1] += 1
            low = min(v, w)
            if v0 <= low < v1:
                lows[low + 1] += 1


@njit(cache=True, nogil=True)
def place_corners(faces, v0, v1, start, star):
    """List the corners of the vertices in [v0, v1) from ``star[start[v]]`` on; moves ``start``."""
    for f in range(len(faces)):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        if a == b or b == c or c == a:
            continue
        for i in range(3):
            v = faces[f, i]
            if v0 <= v < v1:
                star[start[v]] = 3 * f + i
                start[v] += 1


@njit(cache=True, nogil=True)
def _sort(keys, n):
    """Sort the first n keys by insertion; many with shrinking gaps."""
    gap = 1
    while n > FEW * gap:
        gap = 3 * gap + 1  # Knuth, The Art of Computer Programming, vol. 3, 5.2.1
    while gap > 0:
        for i in range(gap, n):
            key = keys[i]
            j = i
            while j >= gap and keys[j - gap] > key:
                keys[j] = keys[j - gap]
                j -= gap
            keys[j] = key
        gap //= 3


@njit(cache=True, nogil=True)
def edges_of_stars(faces, start, star, low_start, v0, v1, half_edges, first, is_branching, counts):
    """List the edges whose lower ends are in [v0, v1); return how many there are.

    ``half_edges`` from ``low_start[v0]`` on: sorted by lower end, upper end, number; ``first`` from
    the same place on: where each edge begins in it. is_branching : (n,) bool, set for vertices
    whose link is neither one cycle nor one path; counts : (N_COUNTS,) int64, added to.
    """
    widest = 1
    for v in range(v0, v1):
        widest = max(widest, start[v + 1] - start[v])
    keys = np.empty(2 * widest, np.int64)
    link = np.empty((2, widest), np.int32)
    n_edges = 0
    place = low_start[v0]
    begin = place
    for v in range(v0, v1):
        degree = start[v + 1] - start[v]
        for i in range(degree):
            h = star[start[v] + i]
            f, e = h // 3, h % 3
            after, before = (e + 1) % 3, (e + 2) % 3
            link[0, i], link[1, i] = faces[f, after], faces[f, before]
            keys[2 * i] = np.int64(link[0, i]) << 32 | h
            keys[2 * i + 1] = np.int64(link[1, i]) << 32 | (3 * f + before)
        _sort(keys, 2 * degree)
        i = 0
        while i < 2 * degree:
            other = keys[i] >> 32
            j = i + 1
            while j < 2 * degree and keys[j] >> 32 == other:
                j += 1
            if j - i > 2:
                is_branching[v] = True
            if other > v:
                first[begin + n_edges] = place
                n_edges += 1
                net = 0
                for k in range(i, j):
                    h = np.int32(keys[k] & LOW_WORD)
                    half_edges[place] = h
                    place += 1
                    net += 1 if faces[h // 3, h % 3] == v else -1
                _count_edge(faces, half_edges, place - (j - i), place, net, counts)
            i = j
        if not _is_cycle(link, degree) and _count_fans(link, degree, keys) > 1:
            is_branching[v] = True
    return n_edges


@njit(cache=True, nogil=True)
def _is_cycle(link, degree):
    """Tell whether few corners follow each other around a vertex and close; False if many."""
    if degree > FEW:
        return False
    i = 0
    for step in range(degree):
        j = 0
        while j < degree and link[1, j] != link[0, i]:
            j += 1
        if j == degree:
            return False
        if j == 0:
            return step == degree - 1
        i = j
    return degree == 0


@njit(cache=True, nogil=True)
def _count_fans(link, degree, keys):
    """How many sets of corners hang together by edges at their vertex; ``keys`` is scratch."""
    parent = np.arange(degree)
    for i in range(degree):
        for side in range(2):
            keys[2 * i + side] = np.int64(link[side, i]) << 32 | i
    _sort(keys, 2 * degree)
    n_fans = degree
    for k in range(1, 2 * degree):
        if keys[k] >> 32 == keys[k - 1] >> 32:
            n_fans -= _join(parent, keys[k] & LOW_WORD, keys[k - 1] & LOW_WORD)
    return n_fans


@njit(cache=True, nogil=True)
def _count_edge(faces, half_edges, begin, end, net, counts):
    """Add an edge to the counts it belongs to."""
    n = end - begin
    counts[ODD] += n & 1
    if net != 0:
        counts[UNBALANCED] += 1
        counts[CONFLICTS] += 1 - (n & 1)
    if n > 2:
        counts[NONMANIFOLD] += 1
    if n > MANY:
        counts[TWINS] += 1
        return
    for i in range(begin, end):
        p = faces[half_edges[i] // 3, (half_edges[i] % 3 + 2) % 3]
        for j in range(begin, i):
            if faces[half_edges[j] // 3, (half_edges[j] % 3 + 2) % 3] == p:
                counts[TWINS] += 1


@njit(cache=True, nogil=True)
def read_edges(faces, half_edges, first, edges, net_uses, edge_of_corner):
    """Fill what is asked for of an edge table; empty arrays are left alone.

    edges : (k, 2), lower end first; net_uses : (k,); edge_of_corner : (3 m,) filled with -1.
    """
    for edge in range(len(first) - 1):
        h = half_edges[first[edge]]
        p, q = faces[h // 3, h % 3], faces[h // 3, (h % 3 + 1) % 3]
        low = min(p, q)
        if len(edges) > 0:
            edges[edge, 0], edges[edge, 1] = low, max(p, q)
        for i in range(first[edge], first[edge + 1]):
            h = half_edges[i]
            if len(net_uses) > 0:
                net_uses[edge] += 1 if faces[h // 3, h % 3] == low else -1
            if len(edge_of_corner) > 0:
                edge_of_corner[h] = edge


@njit(cache=True, nogil=True)
def _root(parent, i):
    """The smallest member known of the set that holds i; halves the path on the way."""
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i


@njit(cache=True, nogil=True)
def _join(parent, i, j):
    """Make one set of two; the smaller root stays. Returns 1 if they were two, else 0."""
    i, j = _root(parent, i), _root(parent, j)
    if i == j:
        return 0
    if i < j:
        parent[j] = i
    else:
        parent[i] = j
    return 1


@njit(cache=True, nogil=True)
def join_corners(faces, f0, f1, parent):
    """Join the vertices of each face in [f0, f1); ``parent`` (n,) int32 is a forest of vertices."""
    for f in range(f0, f1):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        if a != b and b != c and c != a:
            _join(parent, a, b)
            _join(parent, b, c)


@njit(cache=True, nogil=True)
def join_forests(parent, other):
    """Join in ``parent`` what is joined in ``other``."""
    for v in range(len(parent)):
        if other[v] != v:
            _join(parent, v, other[v])


@njit(cache=True, nogil=True)
def join_faces(half_edges, first, ties, parent):
    """Join the faces of each edge, and those of edges tied to each other, (t, 2) int32."""
    for edge in range(len(first) - 1):
        f = half_edges[first[edge]] // 3
        for i in range(first[edge] + 1, first[edge + 1]):
            _join(parent, f, half_edges[i] // 3)
    for t in range(len(ties)):
        _join(parent, half_edges[first[ties[t, 0]]] // 3, half_edges[first[ties[t, 1]]] // 3)


@njit(cache=True, nogil=True)
def number_components(faces, parent, by_vertex, name, component):
    """Number the components in order of their first faces; return how many there are.

    parent : forest of vertices or of faces; name : (len(parent),) int32 filled with -1;
    component : (m,) int32, -1 for faces that repeat a corner.
    """
    n_components = 0
    for f in range(len(faces)):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        if a == b or b == c or c == a:
            component[f] = -1
            continue
        root = _root(parent, a if by_vertex else f)
        if name[root] < 0:
            name[root] = n_components
            n_components += 1
        component[f] = name[root]
    return n_components
