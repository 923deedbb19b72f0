"""Near which points a texture's sheets are divided, so that parts have to be told apart."""

import math

import numpy as np
from numba import njit

from .octree_tables import FIRST_BITS, FIRST_GROUP, find_code, is_divided
from .texture_lookup import ABSENT

BEYOND = 2  # levels above the first that is stored at a point, whose texels may be asked for


@njit(cache=True, nogil=True)
def divided_levels(tables, levels):
    """``levels[l]`` = some sheet is divided at level l."""
    groups = tables.groups
    for g in range(len(groups) if groups.shape[1] > FIRST_BITS else 0):
        if is_divided(groups, FIRST_GROUP - g):
            levels[tables.levels[groups[g, 0]]] = True


@njit(cache=True, nogil=True)
def near_divided(tables, levels, slots, points, widths, begin, end, is_near):
    """``is_near[n]`` = bricks that a lookup at ``points[n]`` may ask are divided.

    ``widths`` are the footprints, one for each point or one for all.
    """
    scale, top = 1.0 / tables.texel, len(levels)
    every = int(len(widths) > 1)
    for n in range(begin, end):
        is_near[n] = False
        x, y, z = points[n, 0] * scale, points[n, 1] * scale, points[n, 2] * scale
        if not (abs(x) < 4.0e15 and abs(y) < 4.0e15 and abs(z) < 4.0e15):
            continue
        width = widths[n * every] * scale
        level = int(min(math.log2(width), top - 1.0)) if width > 1.0 else 0
        left = BEYOND + 1
        while level < top and left > 0:
            shrink = 1.0 / (1 << level)
            i, j, k = math.floor(x * shrink), math.floor(y * shrink), math.floor(z * shrink)
            if levels[level] and _is_any_divided(tables, level, i, j, k):
                is_near[n] = True
                break
            if left <= BEYOND or _is_stored(tables, slots, level, i >> 3, j >> 3, k >> 3):
                left -= 1
            level += 1


@njit(cache=True, nogil=True)
def _is_any_divided(tables, level, i, j, k):
    """Whether a brick that holds a corner of cell (i, j, k) is divided."""
    for bx in range(i >> 3, ((i + 1) >> 3) + 1):
        for by in range(j >> 3, ((j + 1) >> 3) + 1):
            for bz in range(k >> 3, ((k + 1) >> 3) + 1):
                code = find_code(tables.heads, tables.pages, level, bx, by, bz)
                if code <= FIRST_GROUP and is_divided(tables.groups, code):
                    return True
    return False


@njit(cache=True, nogil=True)
def _is_stored(tables, slots, level, bx, by, bz):
    code = np.int64(find_code(tables.heads, tables.pages, level, bx, by, bz))
    if code <= FIRST_GROUP:
        code = np.int64(tables.groups[FIRST_GROUP - code, 0])
    return code >= 0 and slots[code] != ABSENT
