"""Cells and nodes of a lattice, each entered once, and the faces between them.

Node (i, j, k) of a lattice of ``shape`` nodes has the key ``(i * shape[1] + j) * shape[2] + k``, a
cell that of its lowest node. A table of slots (a power of two of them, at most half used, probed
one after the other) gives the number of each key, in the order of entry.
"""

import numpy as np
from numba import njit

from .marching_cubes import crossing

OUTSIDE, INSIDE, NO_DATA = 0, 1, 2
EMPTY = 0  # the pattern of a cell that the surface does not enter

HASH = np.uint64(0x9E3779B97F4A7C15)  # 2**64 / golden ratio (Knuth 1973, section 6.4)
N_CORNERS = 8


@njit(cache=True, nogil=True, inline="always")
def _find(slots, keys, key):
    """The slot that holds the number of a key, or that is free for it."""
    mask = np.uint64(len(slots) - 1)
    mixed = np.uint64(key) * HASH
    at = (mixed ^ (mixed >> np.uint64(32))) & mask
    while slots[at] >= 0 and keys[slots[at]] != key:
        at = (at + np.uint64(1)) & mask
    return at


@njit(cache=True, nogil=True)
def rehash(keys, n, slots):
    """Enter ``keys[:n]`` into new slots, all of them -1."""
    for number in range(n):
        slots[_find(slots, keys, keys[number])] = number


@njit(cache=True, nogil=True)
def find_numbers(wanted, slots, keys, numbers):
    """``numbers[n]`` = the number of a key, -1 if it is not known."""
    for n in range(len(wanted)):
        numbers[n] = slots[_find(slots, keys, wanted[n])]


@njit(cache=True, nogil=True)
def enter(new, slots, keys, n):
    """Enter keys, in order, unless they are known; return the new number of keys."""
    for number in range(len(new)):
        at = _find(slots, keys, new[number])
        if slots[at] < 0:
            slots[at] = n
            keys[n] = new[number]
            n += 1
    return n


@njit(cache=True, nogil=True)
def enter_corners(cells, start, stop, shape, slots, keys, n, corners):
    """Enter the corners of cells; ``corners[c, 4 x + 2 y + z]`` becomes the number of each.

    Returns the new number of nodes.
    """
    for c in range(start, stop):
        for corner in range(N_CORNERS):
            x, y, z = corner >> 2, (corner >> 1) & 1, corner & 1
            key = cells[c] + (x * shape[1] + y) * shape[2] + z
            at = _find(slots, keys, key)
            if slots[at] < 0:
                slots[at] = n
                keys[n] = key
                n += 1
            corners[c, corner] = slots[at]
    return n


@njit(cache=True, nogil=True)
def classify_cells(corners, sides, start, stop, patterns):
    """Set the sign patterns of cells; EMPTY where the corners are alike or one has no data."""
    for c in range(start, stop):
        pattern = 0
        known = True
        for corner in range(N_CORNERS):
            side = sides[corners[c, corner]]
            known &= side != NO_DATA
            pattern |= (side & 1) << corner
        patterns[c] = pattern if known and pattern != 255 else EMPTY


@njit(cache=True, nogil=True)
def enter_neighbours(cells, patterns, start, stop, shape, mixed_faces, slots, n):
    """Enter the cells across faces whose corners differ; return the new number of cells.

    Bit ``2 axis + side`` of ``mixed_faces[pattern]`` stands for the low or high face of an axis.
    ``cells`` is the list that the cells are read from and written to.
    """
    for c in range(start, stop):
        faces = mixed_faces[patterns[c]]
        if faces == 0:
            continue
        key = cells[c]
        rest = key // shape[2]
        index = (rest // shape[1], rest % shape[1], key % shape[2])
        step = (shape[1] * shape[2], shape[2], np.int64(1))
        for axis in range(3):
            for side in range(2):
                if not (faces >> (2 * axis + side)) & 1:
                    continue
                place = index[axis] + 2 * side - 1
                if place < 0 or place > shape[axis] - 2:
                    continue
                neighbour = key + (2 * side - 1) * step[axis]
                at = _find(slots, cells, neighbour)
                if slots[at] < 0:
                    slots[at] = n
                    cells[n] = neighbour
                    n += 1
    return n


@njit(cache=True, nogil=True)
def list_links(cells, patterns, n, mixed_faces, shape, slots, links):
    """Fill ``links`` with the pairs of cells on both sides of a mixed face; return how many."""
    step = (shape[1] * shape[2], shape[2], np.int64(1))
    n_links = 0
    for c in range(n):
        for axis in range(3):
            if (mixed_faces[patterns[c]] >> (2 * axis + 1)) & 1:
                # Beyond the last cell lies a key that no cell has
                number = slots[_find(slots, cells, cells[c] + step[axis])]
                if number >= 0 and (mixed_faces[patterns[number]] >> (2 * axis)) & 1:
                    links[n_links, 0] = c
                    links[n_links, 1] = number
                    n_links += 1
    return n_links


@njit(cache=True, nogil=True)
def mark_edges(patterns, corners, edge_ends, crossed, upper):
    """``upper[node, axis]`` = the other end of each crossed edge, -1 where no cell has it crossed.

    Edge ``4 axis + ...`` of a cell joins the corners ``edge_ends[edge]``, lower first.
    """
    for c in range(len(patterns)):
        for edge in range(12):
            if (crossed[patterns[c]] >> edge) & 1:
                low, high = edge_ends[edge, 0], edge_ends[edge, 1]
                upper[corners[c, low], edge >> 2] = corners[c, high]


@njit(cache=True, nogil=True)
def write_shares(a, b, level, shares):
    """``shares[n]`` = where the line from a[n] to b[n] meets the level, as a fraction."""
    for n in range(len(a)):
        shares[n] = crossing(a[n], b[n], level, 0.5)


@njit(cache=True, nogil=True)
def write_faces(patterns, corners, order, edge_ends, triangles, vertex, faces):
    """Write the faces of the cells in the given order; return how many there are."""
    f = 0
    for place in range(len(order)):
        c = order[place]
        t = 0
        while t < triangles.shape[1] and triangles[patterns[c], t] >= 0:
            for corner in range(3):
                edge = triangles[patterns[c], t + corner]
                node = corners[c, edge_ends[edge, 0]]
                faces[f, corner] = vertex[node, edge >> 2]
            t += 3
            f += 1
    return f
