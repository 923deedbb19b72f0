"""Number equal rows of integers, in order of first appearance, by open addressing.

The table holds the first row of every number, at most half full, probed linearly. Rows are mixed
by multiplication with odd constants (the golden ratio and two primes of the 64-bit FNV and
xxHash families) and by folding the upper bits onto the lower ones; equality is always decided on
the rows themselves, so the outcome does not depend on the mixing.
"""

import numpy as np
from numba import njit

MIX_0 = np.uint64(0x9E3779B97F4A7C15)
MIX_1 = np.uint64(0xC2B2AE3D27D4EB4F)
MIX_2 = np.uint64(0x100000001B3)
FOLD = np.uint64(29)
LAST = np.uint64(32)


@njit(cache=True, nogil=True)
def _mixed(a, b, c):
    """One 64-bit hash of three 64-bit words."""
    h = a * MIX_0
    h = ((h ^ (h >> FOLD)) + b) * MIX_1
    h = ((h ^ (h >> FOLD)) + c * MIX_2) * MIX_0
    return h ^ (h >> LAST)


@njit(cache=True, nogil=True)
def number_rows(rows, table, labels, first_row):
    """Fill ``labels`` (n,) and ``first_row`` (up to n,); return how many rows differ.

    rows : (n, 3) uint64; table : (2**k,) int32 filled with -1, 2**k >= 2 n.
    """
    mask = np.uint64(len(table) - 1)
    step = np.uint64(1)
    n_different = 0
    for i in range(len(rows)):
        a, b, c = rows[i, 0], rows[i, 1], rows[i, 2]
        slot = _mixed(a, b, c) & mask
        while True:
            label = table[slot]
            if label < 0:
                table[slot] = n_different
                first_row[n_different] = i
                labels[i] = n_different
                n_different += 1
                break
            j = first_row[label]
            if rows[j, 0] == a and rows[j, 1] == b and rows[j, 2] == c:
                labels[i] = label
                break
            slot = (slot + step) & mask
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
