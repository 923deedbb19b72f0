"""Coarser levels of a texture from the finer: full weighting, in linear light, by alpha."""

import numpy as np
from numba import njit

from .octree_tables import FIRST_GROUP, NO_ENTRY, find_code, nearest_sheet
from .sheets import decode_normal
from .texel_codes import decode, encode
from .texture_lookup import ABSENT, FIRST_TILE, needed

UNCHANGED, CHANGED = 0, 1


@njit(cache=True, nogil=True)
def mip_texels(tables, entries, slots, pool, tiles, kind, begin, end, texels, state):
    """``texels[i]`` (512,) = the texels of ``entries[i]`` as the level below it makes them.

    A texel is the mean of those of the finer level at 2 x + {-1, 0, 1}^3, with the weights
    [1 2 1]^3 and their alpha; only such count as exist and, where sheets part, as look its way. A
    texel keeps its number where some of these are not stored. ``state[i]`` is CHANGED or not.
    """
    codes = np.empty(27, np.int32)
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
        parted = find_code(
            tables.heads, tables.pages, tables.levels[e], tables.bricks[e, 0],
            tables.bricks[e, 1], tables.bricks[e, 2],
        ) <= FIRST_GROUP  # fmt: skip
        state[i] = UNCHANGED
        for t in range(512):
            if not needed(tables.masks, e, t):
                continue
            old = pool[slot, t] if slot >= 0 else tiles[FIRST_TILE - slot]
            new = old
            if tile <= FIRST_TILE:
                new = tiles[FIRST_TILE - tile]
            else:
                sheet = np.int32(e) if parted else np.int32(NO_ENTRY)
                new = _mean(tables, codes, slots, pool, tiles, kind, sheet, t, old)
            texels[i, t] = new
            if new != old:
                state[i] = CHANGED


@njit(cache=True, nogil=True)
def _common_tile(groups, codes, slots):
    """The tile that all sheets of bricks are, or ABSENT."""
    tile = np.int32(0)
    for code in codes:
        if code == NO_ENTRY:
            continue
        first, count = code, 1
        if code <= FIRST_GROUP:
            first, count = groups[FIRST_GROUP - code, 0], groups[FIRST_GROUP - code, 1]
        for s in range(count):
            slot = slots[first + s]
            if slot > FIRST_TILE or (tile != 0 and slot != tile):
                return np.int32(ABSENT)
            tile = slot
    return tile


@njit(cache=True, nogil=True)
def _mean(tables, codes, slots, pool, tiles, kind, sheet, t, old):
    """The weighted mean around texel t; of those that look its way, or if none does, of all."""
    for own in range(2 if sheet >= 0 else 1):
        sr, sg, sb, sa, sw = 0.0, 0.0, 0.0, 0.0, 0.0
        first = old
        same = True
        for d in range(27):
            dx, dy, dz = d // 9 - 1, d // 3 % 3 - 1, d % 3 - 1
            x, y, z = 2 * (t >> 6) + dx, 2 * ((t >> 3) & 7) + dy, 2 * (t & 7) + dz
            code = codes[9 * ((x >> 3) + 1) + 3 * ((y >> 3) + 1) + (z >> 3) + 1]
            if code == NO_ENTRY:
                continue
            entry, count = code, 1
            if code <= FIRST_GROUP:
                entry = tables.groups[FIRST_GROUP - code, 0]
                count = tables.groups[FIRST_GROUP - code, 1]
            at = ((x & 7) << 6) + ((y & 7) << 3) + (z & 7)
            weight = (2 - abs(dx)) * (2 - abs(dy)) * (2 - abs(dz))
            for e in range(entry, entry + count):
                if not needed(tables.masks, e, at):
                    continue
                if sheet >= 0 and own == 0 and not _looks_along(tables, sheet, e, at):
                    continue
                slot = slots[e]
                if slot == ABSENT:
                    return old
                texel = pool[slot, at] if slot >= 0 else tiles[FIRST_TILE - slot]
                if sw == 0.0:
                    first = texel
                same &= texel == first
                r, g, b, a = decode(kind, texel)
                w = weight * np.float64(a)
                sr, sg, sb, sa, sw = sr + w * r, sg + w * g, sb + w * b, sa + w, sw + weight
        if sw > 0.0:
            if same:
                return first
            scale = 1.0 / sa if sa > 0.0 else 0.0
            word = encode(
                kind, np.float32(sr * scale), np.float32(sg * scale), np.float32(sb * scale),
                np.float32(sa / sw),
            )  # fmt: skip
            return pool.dtype.type(word)
    return old


@njit(cache=True, nogil=True)
def _looks_along(tables, sheet, e, t):
    """Whether texel t of entry e looks the way of ``sheet`` more than of its brick's others."""
    at = tables.texel_first[e]
    for word in range(t >> 6):
        at += _bits(tables.masks[e, word])
    at += _bits(tables.masks[e, t >> 6] & ((np.uint64(1) << np.uint64(t & 63)) - np.uint64(1)))
    nx, ny, nz = decode_normal(tables.texel_normals[at, 0], tables.texel_normals[at, 1])
    group = find_code(
        tables.heads, tables.pages, tables.levels[sheet], tables.bricks[sheet, 0],
        tables.bricks[sheet, 1], tables.bricks[sheet, 2],
    )  # fmt: skip
    return nearest_sheet(tables.groups, tables.sheets, group, nx, ny, nz) == sheet


@njit(cache=True, nogil=True, inline="always")
def _bits(word):
    """How many bits of a word are set."""
    word -= (word >> np.uint64(1)) & np.uint64(0x5555555555555555)
    word = (word & np.uint64(0x3333333333333333)) + (
        (word >> np.uint64(2)) & np.uint64(0x3333333333333333)
    )
    word = (word + (word >> np.uint64(4))) & np.uint64(0x0F0F0F0F0F0F0F0F)
    return np.int64((word * np.uint64(0x0101010101010101)) >> np.uint64(56))
