"""Which bricks of a picture are nothing but means of finer ones."""

import numpy as np
from numba import njit

from .octree_tables import find_code, sheets_of
from .texture_lookup import ABSENT, needed


@njit(cache=True, nogil=True)
def drop_means(tables, entries, before, stored, wanted):
    """``wanted[i]`` = False where every texel of ``entries[i]`` is and was a mean of finer ones.

    Such an entry of a coarser level is no matter of what layers show there.
    """
    for i in range(len(entries)):
        e = entries[i]
        wanted[i] = before[e] == ABSENT or not _all_means(tables, e, stored)


@njit(cache=True, nogil=True)
def _all_means(tables, e, stored):
    """Whether every texel of an entry has finer ones to be the mean of, all of them stored."""
    level = np.int64(tables.levels[e] - 1)
    if level < 0:
        return False
    codes = np.empty(27, np.int64)
    for n in range(27):
        codes[n] = find_code(
            tables.heads, tables.pages, level, 2 * tables.bricks[e, 0] + n // 9 - 1,
            2 * tables.bricks[e, 1] + n // 3 % 3 - 1, 2 * tables.bricks[e, 2] + n % 3 - 1,
        )  # fmt: skip
        begin, end = sheets_of(tables.groups, codes[n])
        for entry in range(begin, end):
            if not stored[entry]:
                return False
    for t in range(512):
        if needed(tables.masks, e, t) and not _has_finer(tables, codes, t):
            return False
    return True


@njit(cache=True, nogil=True)
def _has_finer(tables, codes, t):
    """Whether any texel of the level below lies around texel t."""
    for d in range(27):
        x, y, z = (
            2 * (t >> 6) + d // 9 - 1,
            2 * ((t >> 3) & 7) + d // 3 % 3 - 1,
            2 * (t & 7) + d % 3 - 1,
        )
        code = codes[9 * ((x >> 3) + 1) + 3 * ((y >> 3) + 1) + (z >> 3) + 1]
        at = ((x & 7) << 6) + ((y & 7) << 3) + (z & 7)
        begin, end = sheets_of(tables.groups, code)
        for entry in range(begin, end):
            if needed(tables.masks, entry, at):
                return True
    return False
