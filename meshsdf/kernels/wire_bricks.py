"""Bricks of a texture as a graphics card samples them: 9^3 nodes, everything resolved.

A brick that goes over the wire holds its own 8^3 nodes and the first ones of the bricks after it,
so that trilinear filtering needs no other. What its nodes say is F_l of `texture_lookup`, see
`wire_nodes`; in which bytes, see `wire_codes`.
"""

import numpy as np
from numba import njit

from .texel_codes import F0, F1, SRGB8
from .texel_neighbors import entry_parts, texel_part
from .texture_lookup import stored_texel, stored_value
from .wire_codes import node_code, node_numbers
from .wire_nodes import (
    COARSER,
    DEEP,
    INCOMPLETE,
    MISSING,
    NO_NODE,
    NODES,
    PRESENT,
    SIDE,
    STORED,
    is_deep,
    is_lonely,
    look_at_nodes,
    texel_normal,
    wanted_rows,
)

MASK_BYTES = 92
HEAD_BYTES = 12
OPAQUE = 255 << 24

NOTHING, FLAT, TEXELS = 0, 1, 2  # states of a brick: coarser levels are shown, one colour, many
NO_PRINT, EMPTY_PRINT, BLANK_PRINT = 0, 1, 2
MIXER = np.uint64(0x9E3779B97F4A7C15)  # 2^64 over the golden ratio, odd


@njit(cache=True, nogil=True)
def resolve(
    tables, slots, pool, tiles, kind, picture, entries, begin, end, with_codes, grid, origin,
    holders, exist, wanted, made_of, states, counts, prints, masks_out, codes,
):  # fmt: skip
    """Make a picture's wire bricks of ``entries[begin:end]``, or only see what they are made of.

    Fills, a row per entry, made_of (n,) with PRESENT (some node is stored, so it is sent),
    INCOMPLETE (some node is not, and comes from the level above) and DEEP (or from above that);
    and with codes states (n,), counts (n,) of codes, prints (n,) uint64 (two bricks of the same
    are the same), masks_out (n, 92) bytes and codes (n, 729) uint32. Scratch, of 729 each: grid
    uint32, origin uint8, holders int64; exist and wanted (9, 9) int64.
    """
    heads, pages, groups, masks = tables.heads, tables.pages, tables.groups, tables.masks
    for n in range(begin, end):
        e = np.int64(entries[n])
        level = np.int64(tables.levels[e])
        bx, by, bz = tables.bricks[e, 0], tables.bricks[e, 1], tables.bricks[e, 2]
        wanted_rows(heads, pages, groups, masks, level, bx, by, bz, exist, wanted)
        found = look_at_nodes(tables, slots, e, wanted, origin, holders)
        if found & INCOMPLETE and is_deep(tables, slots, e, origin, holders):
            found |= DEEP
        made_of[n] = found
        if with_codes:
            states[n], counts[n], prints[n] = NOTHING, 0, np.uint64(EMPTY_PRINT)
            if found & PRESENT:
                _fill_grid(tables, slots, pool, tiles, kind, picture, e, origin, holders, grid)
                if found & INCOMPLETE:
                    _fill_gaps(picture, origin, grid)
                states[n], counts[n] = _packed(grid, origin, masks_out[n], codes[n])
                prints[n] = _print_of(states[n], counts[n], masks_out[n], codes[n])


@njit(cache=True, nogil=True)
def _fill_grid(tables, slots, pool, tiles, kind, picture, e, origin, holders, grid):
    """Put what nodes show in the grid; of those that the sheet lacks only lonely ones."""
    sheets, masks, own = tables.sheets, tables.masks, entry_parts(tables, e)
    level = np.int64(tables.levels[e])
    x0, y0, z0 = 8 * tables.bricks[e, 0], 8 * tables.bricks[e, 1], 8 * tables.bricks[e, 2]
    for at in range(NODES):
        said = origin[at]
        if said == NO_NODE:
            continue
        i, j, k = at // 81, at // 9 % 9, at % 9
        f, t = holders[at], ((i & 7) << 6) + ((j & 7) << 3) + (k & 7)
        if said == STORED:
            slot = slots[f]
            if kind == SRGB8 and slot >= 0 and pool[slot, t] >= OPAQUE:
                grid[at] = pool[slot, t]
                continue
            r, g, b, a = stored_texel(kind, slot, pool, tiles, t)
        else:
            nx, ny, nz, parts = sheets[e, 0], sheets[e, 1], sheets[e, 2], own
            if said == COARSER:
                nx, ny, nz = texel_normal(masks, tables.texel_first, tables.texel_normals, f, t)
                parts = texel_part(tables, f, t)
            elif not is_lonely(origin, i, j, k):
                continue
            r, g, b, a, _ = stored_value(
                tables.heads, tables.pages, tables.groups, sheets, tables.neighbors, masks, slots,
                pool, tiles, kind, level + 1, 0.5 * (x0 + i), 0.5 * (y0 + j), 0.5 * (z0 + k),
                np.float64(nx), np.float64(ny), np.float64(nz), parts,
            )  # fmt: skip
            origin[at] = COARSER
        grid[at] = node_code(picture, r * a, g * a, b * a, a)


@njit(cache=True, nogil=True)
def _fill_gaps(picture, origin, grid):
    """Give nodes that the sheet lacks the mean of those around."""
    for at in range(NODES):
        if origin[at] != MISSING:
            continue
        i, j, k = at // 81, at // 9 % 9, at % 9
        r, g, b, a, n = F0, F0, F0, F0, F0
        for x in range(max(i - 1, 0), min(i + 2, SIDE)):
            for y in range(max(j - 1, 0), min(j + 2, SIDE)):
                for z in range(max(k - 1, 0), min(k + 2, SIDE)):
                    near = 81 * x + 9 * y + z
                    if origin[near] == STORED or origin[near] == COARSER:
                        nr, ng, nb, na = node_numbers(picture, np.int64(grid[near]))
                        r, g, b, a, n = r + nr, g + ng, b + nb, a + na, n + F1
        grid[at] = node_code(picture, r / n, g / n, b / n, a / n)


@njit(cache=True, nogil=True)
def _packed(grid, origin, mask, codes):
    """Write the nodes one after another, and say of which state the brick is, and how many."""
    n, same = 0, True
    for at in range(MASK_BYTES):
        mask[at] = 0
    for at in range(NODES):
        if origin[at] != NO_NODE:
            mask[at >> 3] |= np.uint8(1 << (at & 7))
            codes[n] = grid[at]
            same &= codes[n] == codes[0]
            n += 1
    if same:
        return FLAT, 0
    return TEXELS, n


@njit(cache=True, nogil=True)
def _print_of(state, n, mask, codes):
    """A number of 64 bits that differs when bricks differ, but for one time in 2^60 or so.

    Words are mixed in by multiplication, as in FNV-1a, and high bits are brought down.
    """
    found = np.uint64(state + EMPTY_PRINT)
    for at in range(MASK_BYTES if state == TEXELS else 0):
        found = (found ^ np.uint64(mask[at])) * MIXER
        found ^= found >> np.uint64(29)
    for at in range(n if state == TEXELS else 1):
        found = (found ^ np.uint64(codes[at])) * MIXER
        found ^= found >> np.uint64(32)
    return max(found, np.uint64(BLANK_PRINT + 1))


@njit(cache=True, nogil=True)
def write_records(entries, versions, states, counts, masks, codes, starts, begin, end, out):
    """Write the records of bricks from ``out[starts[i]]`` on: their heads, masks and colours."""
    for n in range(begin, end):
        at = starts[n]
        at = _write_word(out, at, np.int64(entries[n]))
        at = _write_word(out, at, np.int64(versions[n]))
        at = _write_word(out, at, np.int64(states[n]) | (np.int64(counts[n]) << 16))
        if states[n] == FLAT:
            at = _write_word(out, at, np.int64(codes[n, 0]))
        if states[n] == TEXELS:
            for i in range(MASK_BYTES):
                out[at + i] = masks[n, i]
            at += MASK_BYTES
            for i in range(counts[n]):
                at = _write_word(out, at, np.int64(codes[n, i]))


@njit(cache=True, nogil=True, inline="always")
def _write_word(out, at, word):
    for i in range(4):
        out[at + i] = (word >> (8 * i)) & 255
    return at + 4
