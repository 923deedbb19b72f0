"""Which nodes a brick on the wire has, and where what they say comes from.

A node is sent where a cell of the brick may need it: one whose eight corners all exist, on
whichever sheet. It says its own texel; if its entry is not stored, what coarser levels show there;
and if this sheet has no such texel, the mean of those around.
"""

import math

import numpy as np
from numba import njit

from .octree_tables import (
    FIRST_BITS,
    FIRST_GROUP,
    NO_ENTRY,
    SELF,
    find_code,
    find_entry,
    sheets_of,
)
from .sheets import decode_normal
from .texel_codes import F0
from .texel_neighbors import entry_parts, texel_part
from .texture_lookup import ABSENT, corner_entry, needed

SIDE = 9
NODES = SIDE**3

PRESENT, INCOMPLETE, DEEP = 1, 2, 4  # bits of what a brick is made of
MISSING, STORED, COARSER = 0, 1, 2  # where a node's value comes from
NO_NODE = 3


@njit(cache=True, nogil=True)
def wanted_rows(heads, pages, groups, masks, level, bx, by, bz, exist, wanted):
    """``wanted`` (9, 9), bit k of row (i, j) = the nodes that cells of a brick may need.

    Scratch: ``exist`` (9, 9), the nodes that are on some sheet.
    """
    for i in range(SIDE):
        for j in range(SIDE):
            exist[i, j] = wanted[i, j] = 0
    for d in range(8):
        dx, dy, dz = d >> 2, (d >> 1) & 1, d & 1
        code = np.int64(find_code(heads, pages, level, bx + dx, by + dy, bz + dz))
        begin, end = sheets_of(groups, code)
        for e in range(begin, end):
            for i in range(1 if dx else 8):
                word = masks[e, i]
                if word == 0:
                    continue
                for j in range(1 if dy else 8):
                    row = np.int64((word >> np.uint64(8 * j)) & np.uint64(255))
                    exist[8 * dx + i, 8 * dy + j] |= (row & 1) << 8 if dz else row
    for i in range(8):
        for j in range(8):
            both = exist[i, j] & exist[i, j + 1] & exist[i + 1, j] & exist[i + 1, j + 1]
            cells = both & (both >> 1)
            if cells:
                both = cells | (cells << 1)
                wanted[i, j] |= both
                wanted[i, j + 1] |= both
                wanted[i + 1, j] |= both
                wanted[i + 1, j + 1] |= both


@njit(cache=True, nogil=True)
def _ones(word):
    """How many bits of a word are set."""
    word -= (word >> np.uint64(1)) & np.uint64(0x5555555555555555)
    pairs = np.uint64(0x3333333333333333)
    word = (word & pairs) + ((word >> np.uint64(2)) & pairs)
    word = (word + (word >> np.uint64(4))) & np.uint64(0x0F0F0F0F0F0F0F0F)
    return np.int64((word * np.uint64(0x0101010101010101)) >> np.uint64(56))


@njit(cache=True, nogil=True)
def texel_normal(masks, texel_first, texel_normals, e, t):
    """Mean normal of the surface at a texel that exists."""
    at = texel_first[e]
    for word in range(t >> 6):
        at += _ones(masks[e, word])
    at += _ones(masks[e, t >> 6] & ((np.uint64(1) << np.uint64(t & 63)) - np.uint64(1)))
    return decode_normal(texel_normals[at, 0], texel_normals[at, 1])


@njit(cache=True, nogil=True)
def _normal_near(masks, sheets, texel_first, texel_normals, e, x, y, z):
    """Which way an entry's surface looks at a node of 0 ... 8, or next to it."""
    x, y, z = min(x, 7), min(y, 7), min(z, 7)
    t = (x << 6) + (y << 3) + z
    if needed(masks, e, t):
        return texel_normal(masks, texel_first, texel_normals, e, t)
    sx, sy, sz = F0, F0, F0
    for i in range(max(x - 1, 0), min(x + 2, 8)):
        for j in range(max(y - 1, 0), min(y + 2, 8)):
            for k in range(max(z - 1, 0), min(z + 2, 8)):
                t = (i << 6) + (j << 3) + k
                if needed(masks, e, t):
                    nx, ny, nz = texel_normal(masks, texel_first, texel_normals, e, t)
                    sx, sy, sz = sx + nx, sy + ny, sz + nz
    length = math.sqrt(sx * sx + sy * sy + sz * sz)
    if length > F0:
        return np.float32(sx / length), np.float32(sy / length), np.float32(sz / length)
    return sheets[e, 0], sheets[e, 1], sheets[e, 2]


@njit(cache=True, nogil=True)
def _node_entry(
    groups, sheets, neighbors, masks, texel_first, texel_normals, e, x, y, z, parts
):  # fmt: skip
    """The entry that holds node (x, y, z), 0 ... 8, of the sheet of entry e, or NO_ENTRY."""
    entry = np.int64(neighbors[e, SELF + 9 * (x >> 3) + 3 * (y >> 3) + (z >> 3)])
    if entry <= FIRST_GROUP:
        # One sheet here and several there: of those that have the node, or of all if none has it,
        # the one that looks as this one does beside it; of its parts, if there are any
        nx, ny, nz = _normal_near(masks, sheets, texel_first, texel_normals, e, x, y, z)
        t = ((x & 7) << 6) + ((y & 7) << 3) + (z & 7)
        group = FIRST_GROUP - entry
        entry, most = np.int64(NO_ENTRY), -8.0e38
        for s in range(groups[group, 1]):
            one = np.int64(groups[group, 0] + s)
            dot = np.float64(sheets[one, 0] * nx + sheets[one, 1] * ny + sheets[one, 2] * nz)
            if not needed(masks, one, t):
                dot -= 4.0
            if groups.shape[1] > FIRST_BITS and not groups[group, FIRST_BITS + s] & parts:
                dot -= 16.0
            if dot > most:
                entry, most = one, dot
    return entry


@njit(cache=True, nogil=True)
def look_at_nodes(tables, slots, e, wanted, origin, holders):
    """Put down where each node's value comes from, and of which entry's texel.

    Returns PRESENT and INCOMPLETE, or 0.
    """
    masks, parts = tables.masks, entry_parts(tables, e)
    here = COARSER if slots[e] == ABSENT else STORED
    found = 0
    for i in range(SIDE):
        for j in range(SIDE):
            row, at = wanted[i, j], 81 * i + 9 * j
            own = np.int64(0)
            if i < 8 and j < 8:
                own = np.int64((masks[e, i] >> np.uint64(8 * j)) & np.uint64(255))
            for k in range(SIDE):
                origin[at + k], holders[at + k] = NO_NODE, e
                if not (row >> k) & 1:
                    continue
                said = MISSING
                if (own >> k) & 1:
                    said = here
                elif i == 8 or j == 8 or k == 8:
                    f = _node_entry(
                        tables.groups, tables.sheets, tables.neighbors, masks, tables.texel_first,
                        tables.texel_normals, e, i, j, k, parts,
                    )  # fmt: skip
                    if f >= 0 and needed(masks, f, ((i & 7) << 6) + ((j & 7) << 3) + (k & 7)):
                        said = COARSER if slots[f] == ABSENT else STORED
                        holders[at + k] = f
                origin[at + k] = said
                found |= PRESENT if said == STORED else INCOMPLETE
    return found if found & PRESENT else 0


@njit(cache=True, nogil=True)
def is_lonely(origin, i, j, k):
    """Whether no node around says anything."""
    for x in range(max(i - 1, 0), min(i + 2, SIDE)):
        for y in range(max(j - 1, 0), min(j + 2, SIDE)):
            for z in range(max(k - 1, 0), min(k + 2, SIDE)):
                said = origin[81 * x + 9 * y + z]
                if said in (STORED, COARSER):
                    return False
    return True


@njit(cache=True, nogil=True)
def is_deep(tables, slots, e, origin, holders):
    """Whether some node of entry e comes from further up than the level above."""
    masks, sheets, own = tables.masks, tables.sheets, entry_parts(tables, e)
    level = np.int64(tables.levels[e]) + 1
    x0, y0, z0 = 8 * tables.bricks[e, 0], 8 * tables.bricks[e, 1], 8 * tables.bricks[e, 2]
    if level + 1 >= len(tables.heads):
        return False
    for at in range(NODES):
        i, j, k = at // 81, at // 9 % 9, at % 9
        nx, ny, nz, parts = sheets[e, 0], sheets[e, 1], sheets[e, 2], own
        if origin[at] == COARSER:
            t = ((i & 7) << 6) + ((j & 7) << 3) + (k & 7)
            nx, ny, nz = texel_normal(
                masks, tables.texel_first, tables.texel_normals, holders[at], t
            )
            parts = texel_part(tables, holders[at], t)
        elif origin[at] != MISSING or not is_lonely(origin, i, j, k):
            continue
        if not _is_stored_at(tables, slots, level, x0 + i, y0 + j, z0 + k, nx, ny, nz, parts):
            return True
    return False


@njit(cache=True, nogil=True)
def _is_stored_at(tables, slots, level, x, y, z, nx, ny, nz, parts):
    """Whether ``stored_value`` finds something at this level for a node of the finer one."""
    heads, pages, groups, sheets = tables.heads, tables.pages, tables.groups, tables.sheets
    i, j, k = x >> 1, y >> 1, z >> 1
    bx, by, bz = i >> 3, j >> 3, k >> 3
    base = find_entry(heads, pages, groups, sheets, level, bx, by, bz, nx, ny, nz, parts)
    for cx in range(1 + (x & 1)):
        for cy in range(1 + (y & 1)):
            for cz in range(1 + (z & 1)):
                ox, oy, oz = (i & 7) + cx, (j & 7) + cy, (k & 7) + cz
                f = corner_entry(
                    heads, pages, groups, sheets, tables.neighbors, level, base, bx, by, bz,
                    ox >> 3, oy >> 3, oz >> 3, nx, ny, nz, parts,
                )  # fmt: skip
                t = ((ox & 7) << 6) + ((oy & 7) << 3) + (oz & 7)
                if f >= 0 and slots[f] != ABSENT and needed(tables.masks, f, t):
                    return True
    return False


@njit(cache=True, nogil=True)
def mark_affected(tables, made_of, deep, changed, marked):
    """Mark the entries whose wire brick may be another after other texels are in ``changed``.

    ``deep`` lists the entries whose ``made_of`` says so.
    """
    heads, pages, groups = tables.heads, tables.pages, tables.groups
    bricks, levels = tables.bricks, tables.levels
    for n in range(len(changed)):
        c = changed[n]
        level = np.int64(levels[c])
        bx, by, bz = bricks[c, 0], bricks[c, 1], bricks[c, 2]
        # Bricks of the level whose last nodes are this one's first
        for d in range(8):
            x, y, z = bx - (d >> 2), by - ((d >> 1) & 1), bz - (d & 1)
            _mark_brick(heads, pages, groups, level, x, y, z, made_of, 0, marked)
        # Bricks of the next finer level with nodes between this one's
        for d in range(27 if level > 0 else 0):
            x, y, z = 2 * bx + d // 9 - 1, 2 * by + d // 3 % 3 - 1, 2 * bz + d % 3 - 1
            _mark_brick(heads, pages, groups, level - 1, x, y, z, made_of, INCOMPLETE, marked)
        for m in range(len(deep)):
            e = deep[m]
            if levels[e] < level - 1:
                size = np.int64(1) << (level - levels[e])
                meet = True
                for axis in range(3):
                    low, high = (8 * bricks[c, axis] - 1) * size, (8 * bricks[c, axis] + 8) * size
                    meet &= 8 * bricks[e, axis] <= high and 8 * bricks[e, axis] + 8 >= low
                marked[e] |= meet


@njit(cache=True, nogil=True)
def _mark_brick(heads, pages, groups, level, bx, by, bz, made_of, bits, marked):
    """Mark the sheets of a brick that have these bits."""
    code = np.int64(find_code(heads, pages, level, bx, by, bz))
    begin, end = sheets_of(groups, code)
    for entry in range(begin, end):
        if made_of[entry] & bits == bits:
            marked[entry] = True
