"""Coarser levels of a texture from the finer: full weighting, in linear light, by alpha."""

import numpy as np
from numba import njit

from .octree_tables import FIRST_GROUP, NO_ENTRY, find_code, nearest_sheet, part_bit, sheets_of
from .sheets import MAX_SHEETS, decode_normal
from .texel_codes import decoded, encode
from .texel_neighbors import texel_code
from .texture_lookup import ABSENT, FIRST_TILE, needed

UNCHANGED, CHANGED = 0, 1
MISSING, UNSTORED, STORED, ASIDE = 0, 1, 2, 4  # the last: looks another way than the sheet
SIDE = 17  # texels along an axis that the 8 of a brick are means of
AROUND = SIDE**3


@njit(cache=True, nogil=True)
def mip_texels(tables, entries, slots, pool, tiles, kind, begin, end, texels, state):
    """``texels[i]`` (512,) = the texels of ``entries[i]`` as the level below it makes them.

    A texel is the mean of those of the finer level at 2 x + {-1, 0, 1}^3, with the weights
    [1 2 1]^3 and their alpha; only such count as exist and, where sheets part, as look its way. A
    texel keeps its number where some of these are not stored. ``state[i]`` is CHANGED or not.
    """
    codes = np.empty(27, np.int32)
    most = most_sheets(tables.groups)
    around = np.empty((most, AROUND, 4), np.float32)
    words = np.empty((most, AROUND), pool.dtype)
    states = np.empty((most, AROUND), np.uint8)
    for i in range(begin, end):
        e = entries[i]
        slot = slots[e]
        for n in range(27):
            codes[n] = find_code(
                tables.heads, tables.pages, tables.levels[e] - 1,
                2 * tables.bricks[e, 0] + n // 9 - 1, 2 * tables.bricks[e, 1] + n // 3 % 3 - 1,
                2 * tables.bricks[e, 2] + n % 3 - 1,
            )  # fmt: skip
        tile = _common_tile(tables.groups, codes, slots)
        n_sheets = 0
        if tile > FIRST_TILE:
            n_sheets = _gather(
                tables, codes, slots, pool, tiles, kind, np.int64(e), around, words, states
            )
        state[i] = UNCHANGED
        for t in range(512):
            if not needed(tables.masks, e, t):
                continue
            old = pool[slot, t] if slot >= 0 else tiles[FIRST_TILE - slot]
            new = old
            if tile <= FIRST_TILE:
                new = tiles[FIRST_TILE - tile]
            elif n_sheets == 0:
                new = _mean_of_one(around[0], words[0], states[0], kind, t, old)
            else:
                new = _mean(around, words, states, n_sheets, kind, t, old)
            texels[i, t] = new
            if new != old:
                state[i] = CHANGED


@njit(cache=True, nogil=True)
def most_sheets(groups):
    """The most sheets that a brick has, but at least two."""
    most = MAX_SHEETS
    for g in range(len(groups)):
        most = max(most, groups[g, 1])
    return most


@njit(cache=True, nogil=True)
def parents_of(tables, entries, parents):
    """``parents[i]`` (16,), or more, = the entries one level up with means of texels of an entry.

    Texels 8 b ... 8 b + 7 along an axis count in 4 b ... 4 b + 4 of the level above: in one or two
    bricks, of at most `most_sheets`. NO_ENTRY fills the row where there are fewer.
    """
    for i in range(len(entries)):
        e = entries[i]
        b = tables.bricks[e]
        at = 0
        for x in range(b[0] >> 1, ((b[0] + 1) >> 1) + 1):
            for y in range(b[1] >> 1, ((b[1] + 1) >> 1) + 1):
                for z in range(b[2] >> 1, ((b[2] + 1) >> 1) + 1):
                    code = find_code(tables.heads, tables.pages, tables.levels[e] + 1, x, y, z)
                    begin, end = sheets_of(tables.groups, code)
                    for entry in range(begin, end):
                        parents[i, at] = entry
                        at += 1
        parents[i, at:] = NO_ENTRY


@njit(cache=True, nogil=True)
def _common_tile(groups, codes, slots):
    """The tile that all sheets of bricks are, or ABSENT."""
    tile = np.int32(0)
    for code in codes:
        begin, end = sheets_of(groups, code)
        for entry in range(begin, end):
            slot = slots[entry]
            if slot > FIRST_TILE or (tile != 0 and slot != tile):
                return np.int32(ABSENT)
            tile = slot
    return tile


@njit(cache=True, nogil=True)
def _gather(tables, codes, slots, pool, tiles, kind, own, around, words, states):
    """Decode all texels that those of entry ``own`` are means of: -1 to 15 along every axis.

    ``words[s]`` and so on are of the s-th sheet of each brick. Returns how many there are of one at
    most; 0 if there is one of each, and of the brick of ``own``, too.
    """
    group = find_code(
        tables.heads, tables.pages, tables.levels[own], tables.bricks[own, 0],
        tables.bricks[own, 1], tables.bricks[own, 2],
    )  # fmt: skip
    states[:] = MISSING
    n_sheets = 1
    for n in range(27):
        begin, end = sheets_of(tables.groups, codes[n])
        n_sheets = max(n_sheets, end - begin)
        for e in range(begin, end):
            s = e - begin
            _gather_entry(
                tables, e, n, slots[e], pool, tiles, kind, own, group, around[s], words[s],
                states[s],
            )  # fmt: skip
    return 0 if n_sheets == 1 and group > FIRST_GROUP else n_sheets


@njit(cache=True, nogil=True)
def _gather_entry(
    tables, e, n, slot, pool, tiles, kind, own, group, around, words, states
):  # fmt: skip
    """Decode those of one entry, the ``n``-th brick of 27; see `_gather`."""
    bx, by, bz = n // 9, n // 3 % 3, n % 3
    row = SIDE * (SIDE * (8 * bx - 7) + 8 * by - 7) + 8 * bz - 7
    for x in range(7 if bx == 0 else 0, 8):
        for y in range(7 if by == 0 else 0, 8):
            bits = (tables.masks[e, x] >> np.uint64(8 * y)) & np.uint64(255)
            if bits == np.uint64(0):
                continue
            for z in range(7 if bz == 0 else 0, 8):
                if (bits >> np.uint64(z)) & np.uint64(1) == np.uint64(0):
                    continue
                at, t = row + SIDE * (SIDE * x + y) + z, (x << 6) + (y << 3) + z
                states[at] = UNSTORED if slot == ABSENT else STORED
                if group <= FIRST_GROUP and not _looks_along(tables, own, group, e, t):
                    states[at] |= ASIDE
                if slot == ABSENT:
                    continue
                word = pool[slot, t] if slot >= 0 else tiles[FIRST_TILE - slot]
                words[at] = word
                r, g, b, a = decoded(kind, np.int64(word))
                around[at, 0], around[at, 1], around[at, 2], around[at, 3] = r, g, b, a


@njit(cache=True, nogil=True)
def _mean(around, words, states, n_sheets, kind, t, old):
    """The weighted mean around texel t; of those that look its way, or if none does, of all."""
    for left_out in (ASIDE, 0):
        sr, sg, sb, sa, sw = 0.0, 0.0, 0.0, 0.0, 0.0
        first, same = old, True
        for d in range(27):
            dx, dy, dz = d // 9, d // 3 % 3, d % 3
            at = SIDE * (SIDE * (2 * (t >> 6) + dx) + 2 * ((t >> 3) & 7) + dy) + 2 * (t & 7) + dz
            weight = (1 + (dx == 1)) * (1 + (dy == 1)) * (1 + (dz == 1))
            for s in range(n_sheets):
                state = states[s, at]
                if state == MISSING or state & left_out:
                    continue
                if state & UNSTORED:
                    return old
                texel = words[s, at]
                if sw == 0.0:
                    first = texel
                same &= texel == first
                r, g, b, a = around[s, at, 0], around[s, at, 1], around[s, at, 2], around[s, at, 3]
                w = weight * np.float64(a)
                sr, sg, sb, sa, sw = sr + w * r, sg + w * g, sb + w * b, sa + w, sw + weight
        if sw > 0.0:
            return first if same else words.dtype.type(_word(kind, sr, sg, sb, sa, sw))
    return old


@njit(cache=True, nogil=True)
def _mean_of_one(around, words, states, kind, t, old):
    """`_mean` where no brick has a second sheet, to the same bits."""
    sr, sg, sb, sa, sw = 0.0, 0.0, 0.0, 0.0, 0.0
    first, same = old, True
    for dx in range(3):
        for dy in range(3):
            row = SIDE * (SIDE * (2 * (t >> 6) + dx) + 2 * ((t >> 3) & 7) + dy) + 2 * (t & 7)
            for dz in range(3):
                at = row + dz
                if states[at] == MISSING:
                    continue
                if states[at] == UNSTORED:
                    return old
                weight = (1 + (dx == 1)) * (1 + (dy == 1)) * (1 + (dz == 1))
                if sw == 0.0:
                    first = words[at]
                same &= words[at] == first
                w = weight * np.float64(around[at, 3])
                sr, sg, sb = sr + w * around[at, 0], sg + w * around[at, 1], sb + w * around[at, 2]
                sa, sw = sa + w, sw + weight
    if sw == 0.0:
        return old
    return first if same else words.dtype.type(_word(kind, sr, sg, sb, sa, sw))


@njit(cache=True, nogil=True)
def _word(kind, sr, sg, sb, sa, sw):
    """The texel of sums of weighted colours, of their alpha, and of weights."""
    scale = 1.0 / sa if sa > 0.0 else 0.0
    return encode(
        kind, np.float32(sr * scale), np.float32(sg * scale), np.float32(sb * scale),
        np.float32(sa / sw),
    )  # fmt: skip


@njit(cache=True, nogil=True)
def _looks_along(tables, sheet, group, e, t):
    """Whether texel t of entry e is of the parts of ``sheet``, and looks its way more than that of
    others of its ``group``."""
    at = texel_code(tables.texel_first, tables.masks, e, t)
    nx, ny, nz = decode_normal(tables.texel_normals[at, 0], tables.texel_normals[at, 1])
    part = part_bit(tables.texel_parts, at)
    return nearest_sheet(tables.groups, tables.sheets, group, nx, ny, nz, part) == sheet
