"""Cells whose sign pattern does not settle what they hold: their values, and vertices within."""

import numpy as np
from numba import njit

from .marching_cubes import (
    NONE,
    ONE,
    corner_words,
    crossing,
    lowest_bit,
    mixed_cells,
    node_value,
    pattern_of,
)


@njit(cache=True, nogil=True)
def collect_bricks(
    values, inside, valid, near, corners, background, is_special, first_special, start, stop,
    cells, cell_values,
):  # fmt: skip
    """Write place and corner values of special cells; brick w's from ``first_special[w]`` on."""
    signs = np.empty(8, np.uint64)
    known = np.empty(8, np.uint64)
    for w in range(start, stop):
        s = first_special[w]
        if s == first_special[w + 1]:
            continue
        for i in range(8):
            corner_words(inside, near, w, i, signs)
            corner_words(valid, near, w, i, known)
            mixed = mixed_cells(signs, known)
            while mixed != NONE:
                bit = lowest_bit(mixed)
                mixed &= mixed - ONE
                if not is_special[pattern_of(signs, np.uint64(bit))]:
                    continue
                j, k = bit >> 3, bit & 7
                cells[s, 0] = corners[w, 0] + i
                cells[s, 1] = corners[w, 1] + j
                cells[s, 2] = corners[w, 2] + k
                for c in range(8):
                    i1, j1, k1 = i + (c >> 2), j + ((c >> 1) & 1), k + (c & 1)
                    o = near[w, ((i1 >> 3) << 2) | ((j1 >> 3) << 1) | (k1 >> 3)]
                    cell_values[s, c] = node_value(
                        values, inside, background, o, i1 & 7, j1 & 7, k1 & 7
                    )
                s += 1


@njit(cache=True, nogil=True)
def place_centers(values, rows, center_edges, cells, place, start, points):
    """Write the vertices within special cells, those of cell s from ``start[s]`` on.

    Each is the mean of crossings. ``place`` holds level, toward_infinity, voxel_size and the
    three numbers of the translation.
    """
    mean = np.empty(3)
    for s in range(len(rows)):
        for n in range(start[s + 1] - start[s]):
            edges = np.int64(center_edges[rows[s], n])
            mean[:] = 0.0
            n_edges = 0
            for e in range(12):
                if not (edges >> e) & 1:
                    continue
                axis, u, v = e >> 2, (e >> 1) & 1, e & 1
                low = (2 * u if axis == 0 else 4 * u) + (2 * v if axis == 2 else v)
                a, b = values[s, low], values[s, low + (4 >> axis)]
                for x in range(3):
                    mean[x] += (low >> (2 - x)) & 1
                mean[axis] += crossing(a, b, place[0], place[1])
                n_edges += 1
            for x in range(3):
                points[start[s] + n, x] = (
                    place[2] * (cells[s, x] + mean[x] / n_edges) + place[3 + x]
                )
