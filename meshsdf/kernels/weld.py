"""Number equal rows of integers, in order of first appearance, by open addressing.

The table holds the first row of every kind, at most half full, probed linearly. Rows fall into
parts by their hashes; parts share nothing, so each may have a thread and a table of its own. Rows
are mixed by multiplication with odd constants (the golden ratio and two primes of the 64-bit FNV
and xxHash families) and by folding the upper bits onto the lower ones; equality is always decided
on the rows themselves, so the outcome does not depend on the mixing.
"""

import numpy as np
from numba import njit

MIX_0 = np.uint64(0x9E3779B97F4A7C15)
MIX_1 = np.uint64(0xC2B2AE3D27D4EB4F)
MIX_2 = np.uint64(0x100000001B3)
FOLD = np.uint64(29)
LAST = np.uint64(32)
HIGH = np.uint64(40)  # bits that choose the part, above those that choose the slot


@njit(cache=True, nogil=True)
def _mixed(a, b, c):
    """One 64-bit hash of three 64-bit words."""
    h = a * MIX_0
    h = ((h ^ (h >> FOLD)) + b) * MIX_1
    h = ((h ^ (h >> FOLD)) + c * MIX_2) * MIX_0
    return h ^ (h >> LAST)


@njit(cache=True, nogil=True)
def find_first_rows(rows, part, n_parts, table, first):
    """Fill ``first`` (n,) int32: the first row equal to each, for the rows that fall to ``part``.

    rows : (n, 3) uint64; table : (2**k,) int32 filled with -1. Returns False, with the work undone,
    if the table gets more than 7/8 full.
    """
    mask = np.uint64(len(table) - 1)
    step = np.uint64(1)
    free = len(table) - len(table) // 8
    for i in range(len(rows)):
        a, b, c = rows[i, 0], rows[i, 1], rows[i, 2]
        h = _mixed(a, b, c)
        if n_parts > 1 and (h >> HIGH) % np.uint64(n_parts) != np.uint64(part):
            continue
        slot = h & mask
        while True:
            j = table[slot]
            if j < 0:
                table[slot] = i
                first[i] = i
                free -= 1
                if free == 0:
                    return False
                break
            if rows[j, 0] == a and rows[j, 1] == b and rows[j, 2] == c:
                first[i] = j
                break
            slot = (slot + step) & mask
    return True


@njit(cache=True, nogil=True)
def number_firsts(labels):
    """Turn first rows into numbers, in place, in order of first appearance; how many there are."""
    n_different = 0
    for i in range(len(labels)):
        if labels[i] == i:
            labels[i] = n_different
            n_different += 1
        else:
            labels[i] = labels[labels[i]]
    return n_different


@njit(cache=True, nogil=True)
def sort_corners(faces, rows, is_even):
    """Fill ``rows`` (m, 3) with every face's corners, ascending; ``is_even``: by an even swap."""
    for f in range(len(faces)):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        even = True
        if a > b:
            a, b = b, a
            even = not even
        if b > c:
            b, c = c, b
            even = not even
        if a > b:
            a, b = b, a
            even = not even
        rows[f, 0], rows[f, 1], rows[f, 2] = a, b, c
        is_even[f] = even
