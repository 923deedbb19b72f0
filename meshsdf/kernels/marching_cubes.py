"""Marching cubes on bricks of 8^3 nodes, 64 nodes at a time (Lorensen and Cline 1987,
doi:10.1145/37401.37422; counting before filling as in flying edges, Schroeder, Maynard and
Geveci 2015, doi:10.1109/LDAV.2015.7348069).

Bit ``8 j + k`` of word i of a brick stands for node (i, j, k), for the cell whose lowest node
that is, and, in a crossing word of axis a, for the edge that leaves the node along +a.

``inside`` and ``valid`` hold the words of all bricks and, behind them, three rows for what is not
a brick: -3 no data, -2 inside, -1 outside; a code is thus an index from the end. The first
``len(values)`` bricks have stored values, the rest are constant. ``near[w, 4 x + 2 y + z]`` is
brick or code at offset (x, y, z) from brick w; ``near[w, 0] == w``.
"""

import numpy as np
from numba import njit

from .bits import count_bits, lowest_bit

NO_DATA = -3

ALL = np.uint64(0xFFFFFFFFFFFFFFFF)
NONE = np.uint64(0)
ONE = np.uint64(1)
SEVEN = np.uint64(7)
EIGHT = np.uint64(8)
ROW = np.uint64(56)  # what j + 1 leaves behind: the word shifted by 8, seven rows of 8 bits kept
NOT_LAST = np.uint64(0x7F7F7F7F7F7F7F7F)  # k < 7
FIRST = np.uint64(0x0101010101010101)  # k = 0


@njit(cache=True, nogil=True)
def flag_blocks(values, level, shift, start, stop, has_inside, has_outside):
    """Say for blocks ``start <= bx < stop`` of a dense array which signs occur in them.

    Node (i, j, k) belongs to block ``(i + shift) // 8`` along each axis; NaN has no sign.
    """
    n_i, n_j, n_k = values.shape
    for bx in range(start, stop):
        for i in range(max(0, 8 * bx - shift), min(n_i, 8 * bx + 8 - shift)):
            for j in range(n_j):
                by = (j + shift) >> 3
                for bz in range(has_inside.shape[2]):
                    below = False
                    above = False
                    for k in range(max(0, 8 * bz - shift), min(n_k, 8 * bz + 8 - shift)):
                        below |= values[i, j, k] < level
                        above |= values[i, j, k] >= level
                    has_inside[bx, by, bz] |= below
                    has_outside[bx, by, bz] |= above


@njit(cache=True, nogil=True)
def cut_blocks(values, corners, start, stop, bricks):
    """Copy 8^3 nodes of a dense array, from ``corners[w]`` on, as far as the array has them."""
    n_i, n_j, n_k = values.shape
    for w in range(start, stop):
        x, y, z = corners[w, 0], corners[w, 1], corners[w, 2]
        for i in range(max(0, -x), min(8, n_i - x)):
            for j in range(max(0, -y), min(8, n_j - y)):
                for k in range(max(0, -z), min(8, n_k - z)):
                    bricks[w, i, j, k] = values[x + i, y + j, z + k]


@njit(cache=True, nogil=True)
def classify_bricks(values, level, start, stop, inside, valid):
    """Set the bits of nodes below the level, and of nodes that are not NaN."""
    rows = values.reshape((len(values), 8, 64))  # one loop of known length: vector instructions
    for w in range(start, stop):
        for i in range(8):
            row = rows[w, i]
            below, missing = NONE, NONE
            for bit in range(64):
                below |= np.uint64(row[bit] < level) << np.uint64(bit)
                missing |= np.uint64(row[bit] != row[bit]) << np.uint64(bit)
            inside[w, i] = below
            valid[w, i] = ~missing


@njit(cache=True, nogil=True)
def corner_words(words, near, w, i, corners):
    """``corners[4 x + 2 y + z]``: bits of the nodes (i + x, j + y, k + z), each where (j, k) is."""
    for x in range(2):
        beyond = (i + x) >> 3
        row = (i + x) & 7
        here = words[near[w, 4 * beyond], row]
        on_z = words[near[w, 4 * beyond + 1], row]
        on_y = words[near[w, 4 * beyond + 2], row]
        on_yz = words[near[w, 4 * beyond + 3], row]
        here_y = (here >> EIGHT) | (on_y << ROW)
        on_z_y = (on_z >> EIGHT) | (on_yz << ROW)
        corners[4 * x] = here
        corners[4 * x + 1] = ((here >> ONE) & NOT_LAST) | ((on_z & FIRST) << SEVEN)
        corners[4 * x + 2] = here_y
        corners[4 * x + 3] = ((here_y >> ONE) & NOT_LAST) | ((on_z_y & FIRST) << SEVEN)


@njit(cache=True, nogil=True)
def mixed_cells(signs, known):
    """Return the cells whose corners are all known and not all of one sign."""
    some = NONE
    every = ALL
    all_known = ALL
    for c in range(8):
        some |= signs[c]
        every &= signs[c]
        all_known &= known[c]
    return some & ~every & all_known


@njit(cache=True, nogil=True)
def pattern_of(signs, cell):
    """Return the sign pattern of a cell: bit c where corner c is inside."""
    pattern = NONE
    for c in range(8):
        pattern |= ((signs[c] >> cell) & ONE) << np.uint64(c)
    return np.int64(pattern)


@njit(cache=True, nogil=True)
def count_bricks(inside, valid, near, sizes, start, stop, crossings, counts):
    """Write the crossing words ``crossings[w, 8 a + i]`` and ``counts[w]``.

    These are the faces of each brick, and its special cells, whose faces are not among them.
    """
    signs = np.empty(8, np.uint64)
    known = np.empty(8, np.uint64)
    for w in range(start, stop):
        n_faces, n_special = 0, 0
        for i in range(8):
            corner_words(inside, near, w, i, signs)
            corner_words(valid, near, w, i, known)
            for axis in range(3):
                o = 4 >> axis
                crossings[w, 8 * axis + i] = (signs[0] ^ signs[o]) & known[0] & known[o]
            cells = mixed_cells(signs, known)
            while cells != NONE:
                pattern = pattern_of(signs, np.uint64(lowest_bit(cells)))
                cells &= cells - ONE
                n_faces += sizes[pattern, 0]
                n_special += sizes[pattern, 1]
        counts[w, 0], counts[w, 1] = n_faces, n_special


@njit(cache=True, nogil=True)
def node_value(values, inside, background, w, i, j, k):
    """Return the stored value, or what a constant brick stands for."""
    if 0 <= w < len(values):
        return np.float64(values[w, i, j, k])
    if inside[w, 0] & ONE:
        return -background
    return background


@njit(cache=True, nogil=True)
def crossing(a, b, level, toward_infinity):
    """Return where the line from a to b meets the level, as a fraction in [0, 1] of the edge.

    An infinite end says nothing of the place: that is then ``toward_infinity`` of the way from
    the finite end.
    """
    if np.isinf(b):
        return 0.5 if np.isinf(a) else toward_infinity
    if np.isinf(a):
        return 1.0 - toward_infinity
    span = b - a
    if np.isinf(span):  # two finite numbers too far apart to subtract
        return (0.5 * level - 0.5 * a) / (0.5 * b - 0.5 * a)
    return min(max((level - a) / span, 0.0), 1.0)


@njit(cache=True, nogil=True)
def fill_vertices(values, inside, near, crossings, first, corners, place, start, stop, vertices):
    """Write the vertices of bricks ``start <= w < stop``, in the order of their crossing bits.

    ``first[w, 8 a + i]`` is the number of the first vertex of a word, ``corners[w]`` the lowest
    node of a brick. ``place`` holds background, level, toward_infinity, voxel_size and the three
    numbers of the translation.
    """
    background, level, toward_infinity, voxel_size = place[0], place[1], place[2], place[3]
    node = np.empty(3)
    for w in range(start, stop):
        for word in range(24):
            bits = crossings[w, word]
            if bits == NONE:
                continue
            axis, i = word >> 3, word & 7
            v = first[w, word]
            while bits != NONE:
                bit = lowest_bit(bits)
                bits &= bits - ONE
                j, k = bit >> 3, bit & 7
                a = node_value(values, inside, background, w, i, j, k)
                # The upper end, perhaps in the next brick
                i1, j1, k1 = i + (axis == 0), j + (axis == 1), k + (axis == 2)
                o = near[w, ((i1 >> 3) << 2) | ((j1 >> 3) << 1) | (k1 >> 3)]
                b = node_value(values, inside, background, o, i1 & 7, j1 & 7, k1 & 7)
                node[0] = corners[w, 0] + i
                node[1] = corners[w, 1] + j
                node[2] = corners[w, 2] + k
                node[axis] += crossing(a, b, level, toward_infinity)
                for x in range(3):
                    vertices[v, x] = voxel_size * node[x] + place[4 + x]
                v += 1


@njit(cache=True, nogil=True)
def fill_faces(
    inside, valid, near, crossings, first, first_face, cases, first_special, rows, centers,
    start, stop, faces,
):  # fmt: skip
    """Write the faces of bricks ``start <= w < stop``, beginning at ``first_face[w]``.

    ``cases`` holds crossed, is_special and triangles of `CellCases`; ``rows[s]`` is the row of
    special cell s and ``centers[s]`` the number of its first vertex within.
    """
    crossed, is_special, triangles = cases
    signs = np.empty(8, np.uint64)
    known = np.empty(8, np.uint64)
    vertex = np.empty(14, np.int64)
    for w in range(start, stop):
        f, s = first_face[w], first_special[w]
        if f == first_face[w + 1]:
            continue
        for i in range(8):
            corner_words(inside, near, w, i, signs)
            corner_words(valid, near, w, i, known)
            cells = mixed_cells(signs, known)
            while cells != NONE:
                cell = lowest_bit(cells)
                cells &= cells - ONE
                pattern = pattern_of(signs, np.uint64(cell))
                # Number of the vertex on each crossed edge: first of its word, plus its rank
                edges = np.uint64(crossed[pattern])
                while edges != NONE:
                    e = lowest_bit(edges)
                    edges &= edges - ONE
                    axis, u, v = e >> 2, (e >> 1) & 1, e & 1
                    i1 = i + (u if axis > 0 else 0)
                    j1 = (cell >> 3) + (u if axis == 0 else (v if axis == 2 else 0))
                    k1 = (cell & 7) + (v if axis < 2 else 0)
                    o = near[w, ((i1 >> 3) << 2) | ((j1 >> 3) << 1) | (k1 >> 3)]
                    word = 8 * axis + (i1 & 7)
                    below = (ONE << np.uint64(8 * (j1 & 7) + (k1 & 7))) - ONE
                    vertex[e] = first[o, word] + count_bits(crossings[o, word] & below)
                row = pattern
                if is_special[pattern]:
                    row = np.int64(rows[s])
                    vertex[12], vertex[13] = centers[s], centers[s] + 1
                    s += 1
                t = 0
                while t < triangles.shape[1] and triangles[row, t] >= 0:
                    for c in range(3):
                        faces[f, c] = vertex[triangles[row, t + c]]
                    f += 1
                    t += 3
