"""What has to be stored before bricks may be, and where a texture is one colour."""

import numpy as np
from numba import njit

from .octree_tables import NO_ENTRY, find_code, sheets_of
from .texture_lookup import FIRST_TILE

FAMILY = 54  # two sheets in each of 27 bricks, the most unless sheets are divided


@njit(cache=True, nogil=True)
def parents_around(tables, entries, begin, end, family):
    """``family[i]`` (54,), or so, = all sheets of the 27 bricks around the parent of an entry.

    NO_ENTRY fills the row where there are fewer.
    """
    for i in range(begin, end):
        e = entries[i]
        level = tables.levels[e] + 1
        bx, by, bz = tables.bricks[e, 0] >> 1, tables.bricks[e, 1] >> 1, tables.bricks[e, 2] >> 1
        at = 0
        for n in range(27):
            x, y, z = bx + n // 9 - 1, by + n // 3 % 3 - 1, bz + n % 3 - 1
            code = find_code(tables.heads, tables.pages, level, x, y, z)
            begin, end = sheets_of(tables.groups, code)
            for entry in range(begin, end):
                family[i, at] = entry
                at += 1
        family[i, at:] = NO_ENTRY


@njit(cache=True, nogil=True)
def constant_families(family, slots, codes):
    """``codes[i]`` = the tile that all of ``family[i]`` are stored as, or 0 if they differ."""
    for i in range(len(family)):
        code = slots[family[i, 0]]
        if code > FIRST_TILE:
            code = np.int32(0)
        for entry in family[i]:
            if entry == NO_ENTRY:
                break
            if slots[entry] != code:
                code = np.int32(0)
                break
        codes[i] = code
