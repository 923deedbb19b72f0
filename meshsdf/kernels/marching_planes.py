"""Marching cubes on a dense grid, one plane of nodes after another, 64 nodes at a time.

Lorensen and Cline 1987 (doi:10.1145/37401.37422); edges are numbered row by row before anything
is written, as in flying edges (Schroeder, Maynard and Geveci 2015, doi:10.1109/LDAV.2015.7348069).

Planes are counted with what surrounds the grid: with ``shift`` 1 there is a layer of infinitely
large values on all sides, and node (p, j, k) has the value ``values[p - 1, j - 1, k - 1]``. Bit b
of word w of row j stands for node k = 64 w + b, for the cell whose lowest node that is, and for
the edge that leaves the node along an axis. Step p holds the edges that leave the nodes of plane p
and the cells between planes p and p + 1.

Only four planes of words are held; those of plane p are at p & 3:
nodes = (inside, valid, whole), each (4, rows, words) uint64: nodes below the level; nodes with
data; cells of which all corners are valid.
edges = (used, twice), each (4, 3, rows, words) uint64: crossed edges of at least one whole cell;
those of two whole cells that do not touch elsewhere, which get two vertices.
first (4, 3, rows, words) int32: number of a word's first vertex, counted from the step's first.
Of ``twice`` and ``first`` only entries whose ``used`` is not 0 are set.
"""

import numpy as np
from numba import njit

from .bits import count_bits, lowest_bit
from .marching_cubes import ALL, NONE, ONE, crossing, pattern_of

SIXTY_THREE = np.uint64(63)


@njit(cache=True, nogil=True)
def empty_plane(p, width, nodes):
    """Fill plane p with outside nodes, ``width`` in a row; 0 where there is no plane."""
    for j in range(nodes[0].shape[1]):
        for w in range(nodes[0].shape[2]):
            n = width - 64 * w
            nodes[0][p & 3, j, w] = NONE
            nodes[1][p & 3, j, w] = ALL if n >= 64 else (ONE << np.uint64(max(n, 0))) - ONE


@njit(cache=True, nogil=True)
def classify_plane(plane, threshold, shift, p, nodes):
    """Set the words of plane p: bits of nodes below the threshold, and of nodes that are no NaN."""
    n_j, n_k = plane.shape
    empty_plane(p, n_k + 2 * shift, nodes)
    for j in range(n_j):
        for w in range(nodes[0].shape[2]):
            low = 64 * w - shift
            skipped = max(0, -low)
            part = plane[j, low + skipped : min(low + 64, n_k)]
            inside, missing = NONE, NONE
            if len(part) == 64:  # of known length, so that it becomes vector instructions
                for b in range(64):
                    inside |= np.uint64(part[b] < threshold) << np.uint64(b)
                    missing |= np.uint64(part[b] != part[b]) << np.uint64(b)
            else:
                for b in range(len(part)):
                    inside |= np.uint64(part[b] < threshold) << np.uint64(b + skipped)
                    missing |= np.uint64(part[b] != part[b]) << np.uint64(b + skipped)
            nodes[0][p & 3, j + shift, w] = inside
            nodes[1][p & 3, j + shift, w] &= ~missing


@njit(cache=True, nogil=True)
def _next(words, r, j, w):
    """Bits of the nodes one step along k, each where its node is."""
    beyond = words[r, j, w + 1] << SIXTY_THREE if w + 1 < words.shape[2] else NONE
    return (words[r, j, w] >> ONE) | beyond


@njit(cache=True, nogil=True)
def _last(words, r, j, w):
    """Bits one step back along k, each where its node is."""
    return (words[r, j, w] << ONE) | (words[r, j, w - 1] >> SIXTY_THREE if w > 0 else NONE)


@njit(cache=True, nogil=True)
def join_planes(p, nodes):
    """Find the whole cells between planes p and p + 1."""
    _, rows, words = nodes[1].shape
    lower, upper, whole = nodes[1][p & 3], nodes[1][(p + 1) & 3], nodes[2][p & 3]
    for j in range(rows - 1):
        for w in range(words):
            whole[j, w] = lower[j, w] & lower[j + 1, w] & upper[j, w] & upper[j + 1, w]
        for w in range(words):
            beyond = whole[j, w + 1] << SIXTY_THREE if w + 1 < words else NONE
            whole[j, w] &= (whole[j, w] >> ONE) | beyond
    whole[rows - 1] = NONE


@njit(cache=True, nogil=True)
def _cells_around(axis, p, j, w, whole):
    """Whole cells around the edges of a word: at their lower and upper sides on both other axes."""
    r, before = p & 3, (p - 1) & 3
    if axis == 0:
        if j == 0:
            return NONE, NONE, _last(whole, r, j, w), whole[r, j, w]
        return _last(whole, r, j - 1, w), whole[r, j - 1, w], _last(whole, r, j, w), whole[r, j, w]
    if axis == 1:
        lower = _last(whole, before, j, w), whole[before, j, w]
        return lower[0], lower[1], _last(whole, r, j, w), whole[r, j, w]
    if j == 0:
        return NONE, whole[before, j, w], NONE, whole[r, j, w]
    return whole[before, j - 1, w], whole[before, j, w], whole[r, j - 1, w], whole[r, j, w]


@njit(cache=True, nogil=True)
def number_edges(p, nodes, edges, first):
    """Number the vertices of step p; return how many there are.

    The words of planes p and p + 1 and the whole cells of steps p - 1 and p must be there.
    """
    inside, valid, whole = nodes
    used, twice = edges
    r, upper = p & 3, (p + 1) & 3
    n = 0
    for j in range(inside.shape[1]):
        has_next_row = j + 1 < inside.shape[1]
        next_row = j + 1 if has_next_row else j
        for w in range(inside.shape[2]):
            here, known = inside[r, j, w], valid[r, j, w]
            crossed_x = (here ^ inside[upper, j, w]) & known & valid[upper, j, w]
            crossed_y = (here ^ inside[r, next_row, w]) & known & valid[r, next_row, w]
            crossed_z = (here ^ _next(inside, r, j, w)) & known & _next(valid, r, j, w)
            used[r, 0, j, w], used[r, 1, j, w], used[r, 2, j, w] = NONE, NONE, NONE
            if crossed_x | crossed_y | crossed_z == NONE:
                continue
            for axis, crossed in enumerate((crossed_x, crossed_y, crossed_z)):
                if crossed == NONE:
                    continue
                a, b, c, d = _cells_around(axis, p, j, w, whole)
                crossed &= a | b | c | d
                again = crossed & ((a & d & ~b & ~c) | (b & c & ~a & ~d))
                used[r, axis, j, w] = crossed
                twice[r, axis, j, w] = again
                first[r, axis, j, w] = n
                n += count_bits(crossed) + count_bits(again)
    return n


@njit(cache=True, nogil=True)
def _corner_words(p, j, w, inside, signs):
    """``signs[4 x + 2 y + z]``: bits of the nodes (p + x, j + y, k + z), each where k is."""
    for x in range(2):
        for y in range(2):
            signs[4 * x + 2 * y] = inside[(p + x) & 3, j + y, w]
            signs[4 * x + 2 * y + 1] = _next(inside, (p + x) & 3, j + y, w)


@njit(cache=True, nogil=True)
def _mixed_cells(p, j, nodes, mixed):
    """Find the whole cells of row j of step p with corners of both signs."""
    lower, upper, whole = nodes[0][p & 3], nodes[0][(p + 1) & 3], nodes[2][p & 3]
    beyond_some, beyond_every = NONE, NONE
    for w in range(len(mixed) - 1, -1, -1):
        a, b, c, d = lower[j, w], lower[j + 1, w], upper[j, w], upper[j + 1, w]
        some, every = a | b | c | d, a & b & c & d
        some_next = (some >> ONE) | (beyond_some << SIXTY_THREE)
        every_next = (every >> ONE) | (beyond_every << SIXTY_THREE)
        mixed[w] = (some | some_next) & ~(every & every_next) & whole[j, w]
        beyond_some, beyond_every = some, every


@njit(cache=True, nogil=True)
def count_cells(p, nodes, sizes, signs, mixed):
    """Faces of step p, and its special cells, whose faces are not among them."""
    n_faces, n_special = 0, 0
    for j in range(nodes[0].shape[1] - 1):
        _mixed_cells(p, j, nodes, mixed)
        for w in range(nodes[0].shape[2]):
            cells = mixed[w]
            if cells != NONE:
                _corner_words(p, j, w, nodes[0], signs)
            while cells != NONE:
                pattern = pattern_of(signs, np.uint64(lowest_bit(cells)))
                cells &= cells - ONE
                n_faces += sizes[pattern, 0]
                n_special += sizes[pattern, 1]
    return n_faces, n_special


@njit(cache=True, nogil=True)
def _value(plane, is_real, j, k):
    """Return the value of a node, infinite around the grid."""
    if is_real and 0 <= j < plane.shape[0] and 0 <= k < plane.shape[1]:
        return np.float64(plane[j, k])
    return np.inf


@njit(cache=True, nogil=True)
def collect_cells(
    lower, upper, are_real, shift, p, nodes, is_special, s, cells, values, signs, mixed
):
    """Write place and corner values of the special cells of step p, from number s on."""
    for j in range(nodes[0].shape[1] - 1):
        _mixed_cells(p, j, nodes, mixed)
        for w in range(nodes[0].shape[2]):
            found = mixed[w]
            if found != NONE:
                _corner_words(p, j, w, nodes[0], signs)
            while found != NONE:
                bit = lowest_bit(found)
                found &= found - ONE
                if not is_special[pattern_of(signs, np.uint64(bit))]:
                    continue
                cells[s, 0], cells[s, 1], cells[s, 2] = p - shift, j - shift, 64 * w + bit - shift
                for c in range(4):
                    at_j, at_k = j - shift + (c >> 1), 64 * w + bit - shift + (c & 1)
                    values[s, c] = _value(lower, are_real[0], at_j, at_k)
                    values[s, 4 + c] = _value(upper, are_real[1], at_j, at_k)
                s += 1
    return s


@njit(cache=True, nogil=True)
def write_vertices(lower, upper, are_real, shift, p, edges, place, v, vertices, keys):
    """Write the vertices of step p, from number v on; return the number after the last.

    ``place`` holds level, toward_infinity, voxel_size and the three numbers of the origin.
    ``keys``, unless it is empty, receives ``3 * (node, in C order) + axis`` of every vertex's edge,
    where nodes around the grid count.
    """
    used, twice = edges
    node = np.empty(3)
    _, _, rows, words = used.shape
    width = lower.shape[1] + 2 * shift
    for j in range(rows):
        for w in range(words):
            for axis in range(3):
                bits = used[p & 3, axis, j, w]
                while bits != NONE:
                    bit = lowest_bit(bits)
                    bits &= bits - ONE
                    k = 64 * w + bit
                    at_j, at_k = j - shift, k - shift
                    a = _value(lower, are_real[0], at_j, at_k)
                    if axis == 0:
                        b = _value(upper, are_real[1], at_j, at_k)
                    else:
                        b = _value(lower, are_real[0], at_j + 2 - axis, at_k + axis - 1)
                    node[0], node[1], node[2] = p - shift, at_j, at_k
                    node[axis] += crossing(a, b, place[0], place[1])
                    copies = 1 + ((twice[p & 3, axis, j, w] >> np.uint64(bit)) & ONE)
                    for _ in range(copies):
                        for x in range(3):
                            vertices[v, x] = place[2] * node[x] + place[3 + x]
                        if len(keys):
                            keys[v] = 3 * ((np.int64(p) * rows + j) * width + k) + axis
                        v += 1
    return v


@njit(cache=True, nogil=True)
def _number(e, p, j, k, edges, first, base, next_base):
    """Number of the vertex that the cell with lowest node (p, j, k) finds on its edge e."""
    axis, u, v = e >> 2, (e >> 1) & 1, e & 1
    on_upper = axis > 0 and u == 1
    r = (p + 1) & 3 if on_upper else p & 3
    j += u if axis == 0 else (v if axis == 2 else 0)
    k += v if axis < 2 else 0
    w, bit = k >> 6, np.uint64(k & 63)
    below = (ONE << bit) - ONE
    n = first[r, axis, j, w] + count_bits(edges[0][r, axis, j, w] & below)
    again = edges[1][r, axis, j, w]
    if again != NONE:  # the second vertex is that of the cells at the edge's upper side along u
        n += count_bits(again & below)
        if u == 0 and (again >> bit) & ONE:
            n += 1
    return n + (next_base if on_upper else base)


@njit(cache=True, nogil=True)
def write_faces(
    p, nodes, edges, first, base, next_base, cases, special_rows, centers, s, f, faces, signs, mixed
):  # fmt: skip
    """Write the faces of step p from f on, its special cells from number s on; return the next f.

    ``base`` and ``next_base`` are added to the numbers of step p's and step p + 1's vertices;
    ``centers[s]`` numbers a special cell's first vertex within.
    """
    crossed, is_special, triangles = cases
    vertex = np.empty(14, np.int64)
    for j in range(nodes[0].shape[1] - 1):
        _mixed_cells(p, j, nodes, mixed)
        for w in range(nodes[0].shape[2]):
            cells = mixed[w]
            if cells != NONE:
                _corner_words(p, j, w, nodes[0], signs)
            while cells != NONE:
                bit = lowest_bit(cells)
                cells &= cells - ONE
                pattern = pattern_of(signs, np.uint64(bit))
                left = np.uint64(crossed[pattern])
                while left != NONE:
                    e = lowest_bit(left)
                    left &= left - ONE
                    vertex[e] = _number(e, p, j, 64 * w + bit, edges, first, base, next_base)
                row = pattern
                if is_special[pattern]:
                    row = np.int64(special_rows[s])
                    vertex[12], vertex[13] = centers[s], centers[s] + 1
                    s += 1
                t = 0
                while t < triangles.shape[1] and triangles[row, t] >= 0:
                    for c in range(3):
                        faces[f, c] = vertex[triangles[row, t + c]]
                    f += 1
                    t += 3
    return f
