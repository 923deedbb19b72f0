"""What a layer shows at the nodes of a brick that it does not store: F of the level above.

`kernels.texture_lookup` defines F. Here it is asked for at nodes of finer levels alone, which lie
on faces, edges or corners of cells more often than not: corners without weight are never looked at,
so that what is shown depends on no texel but those it is made of.
"""

import numpy as np
from numba import njit

from .octree_tables import (
    FIRST_GROUP,
    NO_ENTRY,
    find_code,
    nearest_sheet,
    part_bit,
    sheets_of,
)
from .sheets import decode_normal
from .texel_codes import F0, F1, decoded
from .texture_lookup import (
    ABSENT,
    FIRST_TILE,
    corner_entry,
    needed,
    stored_texel,
    stored_value,
)

MIXED = 0  # neither ABSENT nor a tile


@njit(cache=True, nogil=True)
def layer_values(tables, slots, own, pool, tiles, kind, entries, first, out):
    """``out`` (n, 4) float32 = what one channel of a layer shows at the texels of entries.

    Those of ``entries[i]`` go to the rows from ``first[i]`` on, in the order of the mask's bits.
    ``own[i]`` is what `known_slots` says of it.
    """
    heads, pages, groups, sheets = tables.heads, tables.pages, tables.groups, tables.sheets
    neighbors, masks = tables.neighbors, tables.masks
    for i in range(len(entries)):
        e, slot = entries[i], own[i]
        if slot <= FIRST_TILE:
            r, g, b, a = decoded(kind, np.int64(tiles[FIRST_TILE - slot]))
            for at in range(first[i], first[i + 1]):
                out[at, 0], out[at, 1], out[at, 2], out[at, 3] = r, g, b, a
            continue
        at, code = first[i], tables.texel_first[e]
        above = np.int64(tables.levels[e] + 1)
        x, y, z = 8 * tables.bricks[e, 0], 8 * tables.bricks[e, 1], 8 * tables.bricks[e, 2]
        for t in range(512):
            if not needed(masks, e, t):
                continue
            if slot >= 0:
                r, g, b, a = decoded(kind, np.int64(pool[slot, t]))
            else:
                nx, ny, nz = decode_normal(
                    tables.texel_normals[code, 0], tables.texel_normals[code, 1]
                )
                r, g, b, a = _node_value(
                    heads, pages, groups, sheets, neighbors, masks, slots, pool, tiles, kind,
                    above, x + (t >> 6), y + ((t >> 3) & 7), z + (t & 7), np.float64(nx),
                    np.float64(ny), np.float64(nz), part_bit(tables.texel_parts, code),
                )  # fmt: skip
            out[at, 0], out[at, 1], out[at, 2], out[at, 3] = r, g, b, a
            at += 1
            code += 1


@njit(cache=True, nogil=True)
def known_slots(tables, slots, entries, own):
    """``own[i]`` = the slot or tile of ``entries[i]``, the tile that is seen there where the entry
    is not stored and nothing but that tile is near above, else ABSENT."""
    for i in range(len(entries)):
        own[i] = slots[entries[i]]
        if own[i] == ABSENT:
            tile = tile_above(tables, slots, entries[i])
            if tile <= FIRST_TILE:
                own[i] = tile


@njit(cache=True, nogil=True)
def tile_above(tables, slots, e):
    """The one tile that all bricks which entry e is made of, if it is not stored, are; or MIXED.

    Levels are climbed until all that lies around is stored.
    """
    tile = np.int32(MIXED)
    x0, y0, z0 = 8 * tables.bricks[e, 0], 8 * tables.bricks[e, 1], 8 * tables.bricks[e, 2]
    x1, y1, z1 = x0 + 7, y0 + 7, z0 + 7
    for level in range(tables.levels[e] + 1, len(tables.heads)):
        x0, y0, z0 = x0 >> 1, y0 >> 1, z0 >> 1
        x1, y1, z1 = (x1 + 1) >> 1, (y1 + 1) >> 1, (z1 + 1) >> 1
        complete = True
        for bx in range(x0 >> 3, (x1 >> 3) + 1):
            for by in range(y0 >> 3, (y1 >> 3) + 1):
                for bz in range(z0 >> 3, (z1 >> 3) + 1):
                    code = np.int64(find_code(tables.heads, tables.pages, level, bx, by, bz))
                    if code <= FIRST_GROUP:
                        # The sheet that is looked up may lack nodes, which come from further up
                        complete = False
                    begin, end = sheets_of(tables.groups, code)
                    for entry in range(begin, end):
                        slot = slots[entry]
                        if slot == ABSENT:
                            complete = False
                        elif slot > FIRST_TILE or (tile != MIXED and tile != slot):
                            return np.int32(MIXED)
                        else:
                            tile = slot
        if complete and tile != MIXED:
            break
    return tile


@njit(cache=True, nogil=True)
def _node_value(
    heads, pages, groups, sheets, neighbors, masks, slots, pool, tiles, kind, level, x, y, z, nx,
    ny, nz, part,
):  # fmt: skip
    """r, g, b, a: F_level at node (x, y, z) of the level below it, on the sheet of the part that
    looks along n.

    A corner that exists and is not stored counts with what is stored above it.
    """
    below = 1
    while level < len(heads):
        i, j, k = x >> below, y >> below, z >> below
        ox, oy, oz = x - (i << below), y - (j << below), z - (k << below)
        base, is_within, stored, absent = _corners_around(
            heads, pages, groups, sheets, neighbors, masks, slots, level, i, j, k, ox, oy, oz, nx,
            ny, nz, part,
        )  # fmt: skip
        if stored:
            scale = F1 / np.float32(1 << below)
            return _blend_of_corners(
                heads, pages, groups, sheets, neighbors, masks, slots, pool, tiles, kind, level,
                base, is_within, stored, absent, i, j, k, np.float32(ox) * scale,
                np.float32(oy) * scale, np.float32(oz) * scale, nx, ny, nz, part,
            )  # fmt: skip
        level += 1
        below += 1
    return F0, F0, F0, F0


@njit(cache=True, nogil=True)
def _corners_around(
    heads, pages, groups, sheets, neighbors, masks, slots, level, i, j, k, ox, oy, oz, nx, ny, nz,
    part,
):  # fmt: skip
    """base, is_within, stored, absent: the entry of cell (i, j, k), whether it has all corners
    with weight, and which of these are stored and which only exist, as bits."""
    base = find_code(heads, pages, level, i >> 3, j >> 3, k >> 3)
    if base < NO_ENTRY:
        base = nearest_sheet(groups, sheets, base, nx, ny, nz, part)
    # Most cells lie within one brick that has all their corners
    if base >= 0 and slots[base] != ABSENT:
        stored = _corners_within(masks, base, i & 7, j & 7, k & 7, ox, oy, oz)
        if stored:
            return base, True, stored, 0
    stored, absent = 0, 0
    for c in range(8):
        cx, cy, cz = c >> 2, (c >> 1) & 1, c & 1
        if (cx and ox == 0) or (cy and oy == 0) or (cz and oz == 0):
            continue
        e = corner_of_cell(
            heads, pages, groups, sheets, neighbors, level, base, i, j, k, cx, cy, cz, nx, ny, nz,
            part,
        )  # fmt: skip
        if e >= 0 and needed(masks, e, texel_index(i + cx, j + cy, k + cz)):
            if slots[e] == ABSENT:
                absent |= 1 << c
            else:
                stored |= 1 << c
    return base, False, stored, absent


@njit(cache=True, nogil=True)
def _blend_of_corners(
    heads, pages, groups, sheets, neighbors, masks, slots, pool, tiles, kind, level, base,
    is_within, stored, absent, i, j, k, fx, fy, fz, nx, ny, nz, part,
):  # fmt: skip
    """r, g, b, a: the blend of a cell's corners, see `_corners_around`, at (fx, fy, fz) in it."""
    sr, sg, sb, sa, sw = F0, F0, F0, F0, F0
    r0, g0, b0, a0 = F0, F0, F0, F0
    first, same = True, True
    for c in range(8):
        if not ((stored | absent) >> c) & 1:
            continue
        cx, cy, cz = c >> 2, (c >> 1) & 1, c & 1
        if (stored >> c) & 1:
            e = base
            if not is_within:
                e = corner_of_cell(
                    heads, pages, groups, sheets, neighbors, level, base, i, j, k, cx, cy, cz, nx,
                    ny, nz, part,
                )  # fmt: skip
            t = texel_index(i + cx, j + cy, k + cz)
            r, g, b, a = stored_texel(kind, slots[e], pool, tiles, t)
        else:
            r, g, b, a, found = stored_value(
                heads, pages, groups, sheets, neighbors, masks, slots, pool, tiles, kind,
                level + 1, 0.5 * (i + cx), 0.5 * (j + cy), 0.5 * (k + cz), nx, ny, nz, part,
            )  # fmt: skip
            if not found:
                continue
        if first:
            r0, g0, b0, a0, first = r, g, b, a, False
        same &= r == r0 and g == g0 and b == b0 and a == a0
        w = (fx if cx else F1 - fx) * (fy if cy else F1 - fy) * (fz if cz else F1 - fz)
        wa = w * a
        sr, sg, sb, sa, sw = sr + wa * r, sg + wa * g, sb + wa * b, sa + wa, sw + w
    if same:
        return r0, g0, b0, a0
    if sa > F0:
        return sr / sa, sg / sa, sb / sa, sa / sw
    return F0, F0, F0, F0


@njit(cache=True, nogil=True, inline="always")
def _corners_within(masks, e, x, y, z, ox, oy, oz):
    """The corners with weight of the cell at node (x, y, z) of entry e, as bits; 0 unless all are
    its own and exist."""
    if x + (ox > 0) > 7 or y + (oy > 0) > 7 or z + (oz > 0) > 7:
        return 0
    bits = 0
    for c in range(8):
        cx, cy, cz = c >> 2, (c >> 1) & 1, c & 1
        if (cx and ox == 0) or (cy and oy == 0) or (cz and oz == 0):
            continue
        if not needed(masks, e, ((x + cx) << 6) + ((y + cy) << 3) + z + cz):
            return 0
        bits |= 1 << c
    return bits


@njit(cache=True, nogil=True)
def corner_of_cell(
    heads, pages, groups, sheets, neighbors, level, base, i, j, k, cx, cy, cz, nx, ny, nz, part
):
    """Entry of the brick that holds a corner of cell (i, j, k), or NO_ENTRY."""
    dx, dy, dz = ((i & 7) + cx) >> 3, ((j & 7) + cy) >> 3, ((k & 7) + cz) >> 3
    if base >= 0 and dx + dy + dz == 0:
        return np.int32(base)
    return corner_entry(
        heads, pages, groups, sheets, neighbors, level, base, i >> 3, j >> 3, k >> 3, dx, dy, dz,
        nx, ny, nz, part,
    )  # fmt: skip


@njit(cache=True, nogil=True, inline="always")
def texel_index(x, y, z):
    return ((x & 7) << 6) + ((y & 7) << 3) + (z & 7)
