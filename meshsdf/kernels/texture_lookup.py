"""What a texture's octree shows at a point: trilinear between nodes, linear between levels.

F_l, the texture as level l shows it: in a cell with a stored corner it is the trilinear blend of
the corners, where a corner that exists but is not stored counts with F_(l+1) there; elsewhere it is
F_(l+1). On a face between two such cells all that is not stored is F_(l+1), which is bilinear on
the face, as the blend is: so F_l is continuous, and storing a brick with the values of F_(l+1)
changes F_l nowhere. This holds as long as bricks beside a stored brick's parent are stored one
level up (2:1 balance). Corners that do not exist (the surface is not near them) weigh nothing.
"""

import math

import numpy as np
from numba import njit

from .octree_tables import FIRST_GROUP, SELF, find_code, find_entry, nearest_sheet
from .texel_codes import F0, F1, LINEAR, SRGB8, decode, decoded

ABSENT = -1  # slot of an entry that is not stored; below that, -2 - tile
FIRST_TILE = -2
CORNER_PATTERN = np.uint64(0x303)
OPAQUE = 0xFF000000  # an SRGB8 texel of alpha 1 is at least this


@njit(cache=True, nogil=True, inline="always")
def read_texel(kind, slot, pool, tiles, t):
    """The four numbers of texel t of a stored entry."""
    if slot >= 0:
        return decode(kind, pool[slot, t])
    return decode(kind, tiles[FIRST_TILE - slot])


@njit(cache=True, nogil=True)
def stored_texel(kind, slot, pool, tiles, t):
    """As `read_texel`, by a call, see `decoded`."""
    return decoded(kind, np.int64(pool[slot, t] if slot >= 0 else tiles[FIRST_TILE - slot]))


@njit(cache=True, nogil=True, inline="always")
def needed(masks, entry, t):
    """Whether texel t of the entry exists."""
    return (masks[entry, t >> 6] >> np.uint64(t & 63)) & np.uint64(1) != np.uint64(0)


@njit(cache=True, nogil=True, inline="always")
def corner_entry(
    heads, pages, groups, sheets, neighbors, level, base, bx, by, bz, dx, dy, dz, nx, ny, nz, part
):
    """Entry of the brick (dx, dy, dz) further than the one of entry ``base``, which may be none."""
    if base < 0:
        return find_entry(
            heads, pages, groups, sheets, level, bx + dx, by + dy, bz + dz, nx, ny, nz, part
        )
    entry = neighbors[base, SELF + 9 * dx + 3 * dy + dz]
    if entry <= FIRST_GROUP:
        # One sheet here and several there: the point's side and part decide, as far as known
        if nx == 0.0 and ny == 0.0 and nz == 0.0:
            nx, ny, nz = sheets[base, 0], sheets[base, 1], sheets[base, 2]
        entry = nearest_sheet(groups, sheets, entry, nx, ny, nz, part)
    return entry


@njit(cache=True, nogil=True)
def stored_value(
    heads, pages, groups, sheets, neighbors, masks, slots, pool, tiles, kind, level, x, y, z, nx,
    ny, nz, part,
):  # fmt: skip
    """r, g, b, a, found: the blend of the stored corners around (x, y, z), nodes of the level.

    Levels are climbed until some corner is stored.
    """
    top = len(heads)
    while level < top:
        i, j, k = math.floor(x), math.floor(y), math.floor(z)
        fx, fy, fz = np.float32(x - i), np.float32(y - j), np.float32(z - k)
        bx, by, bz = i >> 3, j >> 3, k >> 3
        base = find_entry(heads, pages, groups, sheets, level, bx, by, bz, nx, ny, nz, part)
        sr, sg, sb, sa, sw = F0, F0, F0, F0, F0
        same, first = True, True
        r0, g0, b0, a0 = F0, F0, F0, F0
        for c in range(8):
            cx, cy, cz = c >> 2, (c >> 1) & 1, c & 1
            w = (fx if cx else F1 - fx) * (fy if cy else F1 - fy) * (fz if cz else F1 - fz)
            if w == F0:
                continue
            ox, oy, oz = (i & 7) + cx, (j & 7) + cy, (k & 7) + cz
            e = corner_entry(
                heads, pages, groups, sheets, neighbors, level, base, bx, by, bz, ox >> 3, oy >>
                3, oz >> 3, nx, ny, nz, part,
            )  # fmt: skip
            if e < 0:
                continue
            t = ((ox & 7) << 6) + ((oy & 7) << 3) + (oz & 7)
            slot = slots[e]
            if slot == ABSENT or not needed(masks, e, t):
                continue
            r, g, b, a = stored_texel(kind, slot, pool, tiles, t)
            if first:
                r0, g0, b0, a0, first = r, g, b, a, False
            elif r != r0 or g != g0 or b != b0 or a != a0:
                same = False
            wa = w * a
            sr += wa * r
            sg += wa * g
            sb += wa * b
            sa += wa
            sw += w
        if not first:
            if same:
                return r0, g0, b0, a0, True
            if sw > F0:
                if sa > F0:
                    return sr / sa, sg / sa, sb / sa, sa / sw, True
                return F0, F0, F0, F0, True
        level += 1
        x, y, z = 0.5 * x, 0.5 * y, 0.5 * z
    return F0, F0, F0, F0, False


@njit(cache=True, nogil=True, forceinline=True)
def level_value(
    heads, pages, groups, sheets, neighbors, masks, slots, pool, tiles, kind, level, x, y, z, nx,
    ny, nz, part,
):  # fmt: skip
    """r, g, b, a: F_level at (x, y, z), in nodes of the level, on the sheet of the part that looks
    along n."""
    top = len(heads)
    while level < top:
        i, j, k = math.floor(x), math.floor(y), math.floor(z)
        bx, by, bz = i >> 3, j >> 3, k >> 3
        tx, ty, tz = i & 7, j & 7, k & 7
        base = find_code(heads, pages, level, bx, by, bz)
        if base < -1:
            base = nearest_sheet(groups, sheets, base, nx, ny, nz, part)
        if tx < 7 and ty < 7 and tz < 7:
            slot = np.int32(ABSENT)
            if base >= 0:
                slot = slots[base]
            if slot <= FIRST_TILE:
                return decoded(kind, np.int64(tiles[FIRST_TILE - slot]))
            if slot >= 0:
                shift = np.uint64((ty << 3) + tz)
                both = masks[base, tx] & masks[base, tx + 1]
                if (both >> shift) & CORNER_PATTERN == CORNER_PATTERN:
                    t = (tx << 6) + (ty << 3) + tz
                    return blended(
                        kind, pool[slot, t], pool[slot, t + 1], pool[slot, t + 8],
                        pool[slot, t + 9], pool[slot, t + 64], pool[slot, t + 65],
                        pool[slot, t + 72], pool[slot, t + 73],
                        np.float32(x - i), np.float32(y - j), np.float32(z - k),
                    )  # fmt: skip
            if slot == ABSENT:
                level += 1
                x, y, z = 0.5 * x, 0.5 * y, 0.5 * z
                continue
        elif base >= 0:
            ux, uy, uz = tx + 1, ty + 1, tz + 1
            s0 = _stored_corner(neighbors, masks, slots, base, tx, ty, tz)
            s1 = _stored_corner(neighbors, masks, slots, base, tx, ty, uz)
            s2 = _stored_corner(neighbors, masks, slots, base, tx, uy, tz)
            s3 = _stored_corner(neighbors, masks, slots, base, tx, uy, uz)
            s4 = _stored_corner(neighbors, masks, slots, base, ux, ty, tz)
            s5 = _stored_corner(neighbors, masks, slots, base, ux, ty, uz)
            s6 = _stored_corner(neighbors, masks, slots, base, ux, uy, tz)
            s7 = _stored_corner(neighbors, masks, slots, base, ux, uy, uz)
            if min(min(min(s0, s1), min(s2, s3)), min(min(s4, s5), min(s6, s7))) >= 0:
                return blended(
                    kind,
                    pool[s0, _texel_index(tx, ty, tz)], pool[s1, _texel_index(tx, ty, uz)],
                    pool[s2, _texel_index(tx, uy, tz)], pool[s3, _texel_index(tx, uy, uz)],
                    pool[s4, _texel_index(ux, ty, tz)], pool[s5, _texel_index(ux, ty, uz)],
                    pool[s6, _texel_index(ux, uy, tz)], pool[s7, _texel_index(ux, uy, uz)],
                    np.float32(x - i), np.float32(y - j), np.float32(z - k),
                )  # fmt: skip
        r, g, b, a, found = _blend_across(
            heads, pages, groups, sheets, neighbors, masks, slots, pool, tiles, kind, level, base,
            x, y, z, nx, ny, nz, part,
        )  # fmt: skip
        if found:
            return r, g, b, a
        level += 1
        x, y, z = 0.5 * x, 0.5 * y, 0.5 * z
    return F0, F0, F0, F0


@njit(cache=True, nogil=True, forceinline=True)
def blend(kind, t000, t001, t010, t011, t100, t101, t110, t111, fx, fy, fz):
    """The trilinear blend of eight texels, weighted by their alpha."""
    other = (t000 ^ t001) | (t000 ^ t010) | (t000 ^ t011) | (t000 ^ t100)
    if not other | (t000 ^ t101) | (t000 ^ t110) | (t000 ^ t111):
        return decode(kind, t000)
    gx, gy, gz = F1 - fx, F1 - fy, F1 - fz
    w00, w01, w10, w11 = gx * gy, gx * fy, fx * gy, fx * fy
    sums = F0, F0, F0, F0
    if kind == SRGB8 and t000 & t001 & t010 & t011 & t100 & t101 & t110 & t111 >= OPAQUE:
        sums = _added_opaque(sums, w00 * gz, t000)
        sums = _added_opaque(sums, w00 * fz, t001)
        sums = _added_opaque(sums, w01 * gz, t010)
        sums = _added_opaque(sums, w01 * fz, t011)
        sums = _added_opaque(sums, w10 * gz, t100)
        sums = _added_opaque(sums, w10 * fz, t101)
        sums = _added_opaque(sums, w11 * gz, t110)
        sums = _added_opaque(sums, w11 * fz, t111)
        return sums[0], sums[1], sums[2], F1
    sums = _added(kind, sums, w00 * gz, t000)
    sums = _added(kind, sums, w00 * fz, t001)
    sums = _added(kind, sums, w01 * gz, t010)
    sums = _added(kind, sums, w01 * fz, t011)
    sums = _added(kind, sums, w10 * gz, t100)
    sums = _added(kind, sums, w10 * fz, t101)
    sums = _added(kind, sums, w11 * gz, t110)
    sums = _added(kind, sums, w11 * fz, t111)
    if sums[3] > F0:
        scale = F1 / sums[3]
        return sums[0] * scale, sums[1] * scale, sums[2] * scale, sums[3]
    return F0, F0, F0, F0


@njit(cache=True, nogil=True)
def blended(kind, t000, t001, t010, t011, t100, t101, t110, t111, fx, fy, fz):
    """As `blend`, by a call, see `decoded`."""
    return blend(kind, t000, t001, t010, t011, t100, t101, t110, t111, fx, fy, fz)


@njit(cache=True, nogil=True, forceinline=True)
def _added_opaque(sums, weight, texel):
    word = np.int64(texel)
    return (
        sums[0] + weight * LINEAR[word & 255],
        sums[1] + weight * LINEAR[(word >> 8) & 255],
        sums[2] + weight * LINEAR[(word >> 16) & 255],
        F1,
    )


@njit(cache=True, nogil=True, forceinline=True)
def _added(kind, sums, weight, texel):
    r, g, b, a = decode(kind, texel)
    w = weight * a
    return sums[0] + w * r, sums[1] + w * g, sums[2] + w * b, sums[3] + w


@njit(cache=True, nogil=True, inline="always")
def _stored_corner(neighbors, masks, slots, base, x, y, z):
    """Slot (or ABSENT) of the brick that holds node (x, y, z), 0 ... 8, counted from base's."""
    entry = neighbors[base, SELF + 9 * (x >> 3) + 3 * (y >> 3) + (z >> 3)]
    slot = np.int32(ABSENT)
    if entry >= 0:
        t = ((y & 7) << 3) + (z & 7)
        if (masks[entry, x & 7] >> np.uint64(t)) & np.uint64(1):
            slot = slots[entry]
    return slot


@njit(cache=True, nogil=True, inline="always")
def _texel_index(x, y, z):
    return ((x & 7) << 6) + ((y & 7) << 3) + (z & 7)


@njit(cache=True, nogil=True)
def _blend_across(
    heads, pages, groups, sheets, neighbors, masks, slots, pool, tiles, kind, level, base, x, y,
    z, nx, ny, nz, part,
):  # fmt: skip
    """F_level in a cell that bricks share, or where corners do not exist; found is False if no
    corner is stored. Where all eight exist, the sums are those of `blend`, bit by bit."""
    i, j, k = math.floor(x), math.floor(y), math.floor(z)
    fx, fy, fz = np.float32(x - i), np.float32(y - j), np.float32(z - k)
    bx, by, bz = i >> 3, j >> 3, k >> 3
    stored, absent = 0, 0
    for c in range(8):
        ox, oy, oz = (i & 7) + (c >> 2), (j & 7) + ((c >> 1) & 1), (k & 7) + (c & 1)
        e = corner_entry(
            heads, pages, groups, sheets, neighbors, level, base, bx, by, bz, ox >> 3, oy >> 3, oz
            >> 3, nx, ny, nz, part,
        )  # fmt: skip
        if e >= 0 and needed(masks, e, _texel_index(ox, oy, oz)):
            if slots[e] == ABSENT:
                absent |= 1 << c
            else:
                stored |= 1 << c
    if stored == 0:
        return F0, F0, F0, F0, False
    sr, sg, sb, sa, sw = F0, F0, F0, F0, F0
    r0, g0, b0, a0 = F0, F0, F0, F0
    n, same, opaque = 0, True, True
    for c in range(8):
        if not ((stored | absent) >> c) & 1:
            continue
        cx, cy, cz = c >> 2, (c >> 1) & 1, c & 1
        w = (fx if cx else F1 - fx) * (fy if cy else F1 - fy) * (fz if cz else F1 - fz)
        if (stored >> c) & 1:
            ox, oy, oz = (i & 7) + cx, (j & 7) + cy, (k & 7) + cz
            e = corner_entry(
                heads, pages, groups, sheets, neighbors, level, base, bx, by, bz, ox >> 3, oy >>
                3, oz >> 3, nx, ny, nz, part,
            )  # fmt: skip
            r, g, b, a = stored_texel(kind, slots[e], pool, tiles, _texel_index(ox, oy, oz))
        else:
            r, g, b, a, found = stored_value(
                heads, pages, groups, sheets, neighbors, masks, slots, pool, tiles, kind, level +
                1, 0.5 * (i + cx), 0.5 * (j + cy), 0.5 * (k + cz), nx, ny, nz, part,
            )  # fmt: skip
            if not found:
                continue
        if n == 0:
            r0, g0, b0, a0 = r, g, b, a
        same &= r == r0 and g == g0 and b == b0 and a == a0
        opaque &= a == F1
        n += 1
        wa = w * a
        sr, sg, sb, sa, sw = sr + wa * r, sg + wa * g, sb + wa * b, sa + wa, sw + w
    if same:
        return r0, g0, b0, a0, True
    if not sw > F0:
        return F0, F0, F0, F0, False
    if n == 8 and opaque and kind == SRGB8:
        return sr, sg, sb, F1, True
    if sa > F0:
        scale = F1 / sa
        return sr * scale, sg * scale, sb * scale, sa if n == 8 else sa / sw, True
    return F0, F0, F0, F0, True
