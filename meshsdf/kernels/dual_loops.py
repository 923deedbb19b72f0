"""The loops of cells and the crossings of edges, numbered: the two sides of dual contouring.

Crossings are numbered as the vertices of `marching_cubes`: brick by brick, by axis and node. Loops
are numbered brick by brick, cell by cell, in the order of the cell's pattern. Lists of a loop's
crossings run as the loop does; lists of a crossing's loops run counter-clockwise seen from
outside, and the arc between two of them leads *to* the crossing in the earlier loop's list.
"""

import numpy as np
from numba import njit

from .bits import count_bits, lowest_bit
from .marching_cubes import (
    NONE,
    ONE,
    corner_words,
    crossing,
    mixed_cells,
    node_value,
    pattern_of,
)


@njit(cache=True, nogil=True)
def count_loops(inside, valid, near, n_loops, n_sides, start, stop, crossings, totals):
    """Write the crossing words and ``totals[w]``: loops of a brick's cells, and their crossings."""
    signs = np.empty(8, np.uint64)
    known = np.empty(8, np.uint64)
    for w in range(start, stop):
        loops, sides = 0, 0
        for i in range(8):
            corner_words(inside, near, w, i, signs)
            corner_words(valid, near, w, i, known)
            for axis in range(3):
                o = 4 >> axis
                crossings[w, 8 * axis + i] = (signs[0] ^ signs[o]) & known[0] & known[o]
            cells = mixed_cells(signs, known)
            while cells != NONE:
                pattern = pattern_of(signs, np.uint64(lowest_bit(cells)))
                loops += n_loops[pattern]
                sides += n_sides[pattern]
                cells &= cells - ONE
        totals[w, 0], totals[w, 1] = loops, sides


@njit(cache=True, nogil=True)
def fill_crossings(
    values, inside, near, crossings, first, corners, base, place, start, stop,
    nodes, ways, fractions,
):  # fmt: skip
    """Write where the crossings of bricks ``start <= w < stop`` lie.

    ``nodes[c]`` is the edge's lower node relative to ``base``; ``ways[c]`` numbers the direction
    from inside to outside: -x, +x, -y, +y, -z, +z; ``fractions[c]`` is where linear interpolation
    puts the level. ``place`` holds background, level and toward_infinity (see `crossing`).
    """
    background, level, toward_infinity = place[0], place[1], place[2]
    for w in range(start, stop):
        for word in range(24):
            bits = crossings[w, word]
            axis, i = word >> 3, word & 7
            c = first[w, word]
            while bits != NONE:
                bit = lowest_bit(bits)
                bits &= bits - ONE
                j, k = bit >> 3, bit & 7
                a = node_value(values, inside, background, w, i, j, k)
                i1, j1, k1 = i + (axis == 0), j + (axis == 1), k + (axis == 2)
                o = near[w, ((i1 >> 3) << 2) | ((j1 >> 3) << 1) | (k1 >> 3)]
                b = node_value(values, inside, background, o, i1 & 7, j1 & 7, k1 & 7)
                nodes[c, 0] = corners[w, 0] - base[0] + i
                nodes[c, 1] = corners[w, 1] - base[1] + j
                nodes[c, 2] = corners[w, 2] - base[2] + k
                lower_is_inside = (inside[w, i] >> np.uint64(bit)) & ONE
                ways[c] = 2 * axis + (1 if lower_is_inside else 0)
                fractions[c] = crossing(a, b, level, toward_infinity)
                c += 1


@njit(cache=True, nogil=True)
def fill_loops(
    inside, valid, near, crossings, first, corners, base, ways,
    n_loops, loop_size, loop_edges, folded, quadrants, first_loop, first_side, start, stop,
    cells, kinds, loop_start, loop_crossings, around, folds,
):  # fmt: skip
    """Write the loops of the cells of bricks ``start <= w < stop``.

    ``cells[l]`` is the cell's lower node relative to ``base``, ``kinds[l]`` its pattern and the
    loop's number there, ``256 n + pattern``; loop l has the crossings
    ``loop_crossings[loop_start[l]:loop_start[l + 1]]``. ``around[c]`` names the four loops around
    a crossing, and stays as it is where a cell has none; bit 0 (1) of ``folds[c, q]`` is set where
    the cell in quadrant q finds its face towards the next (the last) quadrant folded.
    """
    signs = np.empty(8, np.uint64)
    known = np.empty(8, np.uint64)
    for w in range(start, stop):
        loop, side = first_loop[w], first_side[w]
        if loop == first_loop[w + 1]:
            continue
        for i in range(8):
            corner_words(inside, near, w, i, signs)
            corner_words(valid, near, w, i, known)
            mixed = mixed_cells(signs, known)
            while mixed != NONE:
                cell = lowest_bit(mixed)
                mixed &= mixed - ONE
                pattern = pattern_of(signs, np.uint64(cell))
                j, k = cell >> 3, cell & 7
                at = 0
                for n in range(n_loops[pattern]):
                    cells[loop, 0] = corners[w, 0] - base[0] + i
                    cells[loop, 1] = corners[w, 1] - base[1] + j
                    cells[loop, 2] = corners[w, 2] - base[2] + k
                    kinds[loop] = 256 * n + pattern
                    loop_start[loop] = side
                    for _ in range(loop_size[pattern, n]):
                        e = loop_edges[pattern, at]
                        at += 1
                        # Number of the crossing: first of its word, plus its rank
                        axis, u, v = e >> 2, (e >> 1) & 1, e & 1
                        i1 = i + (u if axis > 0 else 0)
                        j1 = j + (u if axis == 0 else (v if axis == 2 else 0))
                        k1 = k + (v if axis < 2 else 0)
                        o = near[w, ((i1 >> 3) << 2) | ((j1 >> 3) << 1) | (k1 >> 3)]
                        word = 8 * axis + (i1 & 7)
                        below = (ONE << np.uint64(8 * (j1 & 7) + (k1 & 7))) - ONE
                        c = first[o, word] + count_bits(crossings[o, word] & below)
                        loop_crossings[side] = c
                        side += 1
                        # Quadrants turn about the way out, so backwards for ways that point down
                        q = quadrants[e, 0]
                        after, before = quadrants[e, 1], quadrants[e, 2]
                        if ways[c] & 1 == 0:
                            q = (4 - q) & 3
                            after, before = before, after
                        around[c, q] = loop
                        folds[c, q] = folded[pattern, after] | (folded[pattern, before] << 1)
                    loop += 1
