"""Brushes that move paint about: blurring it, and smudging it along.

What they make of texels is written beside the texels, and put in their place when all is known: a
texel does not see what its neighbours become. Means are taken in linear light, by alpha.
"""

import numpy as np
from numba import njit

from .octree_tables import SELF, part_bit
from .sheets import decode_normal
from .texel_codes import F0, F1, encode
from .texel_neighbors import beside_texel
from .texture_lookup import ABSENT, needed, stored_texel, stored_value


@njit(cache=True, nogil=True)
def blurred(
    tables, entries, begin, end, rows, changed, slots, coverage, opacity, kind, pool, tiles, out
):
    """``out[i, t]`` = marked texel t of ``entries[i]``, mixed with the mean around it.

    The mean is over the 27 texels around it that exist and are stored, with the weights
    [1 2 1]^3; the coverage times ``opacity`` says how much of it there is.
    """
    for i in range(begin, end):
        e = entries[i]
        for t in range(512):
            if not (changed[i, t >> 6] >> np.uint64(t & 63)) & np.uint64(1):
                continue
            sr, sg, sb, sa, sw = F0, F0, F0, F0, F0
            for n in range(27):
                dx, dy, dz = n // 9 - 1, n // 3 % 3 - 1, n % 3 - 1
                x, y, z = (t >> 6) + dx, ((t >> 3) & 7) + dy, (t & 7) + dz
                f = beside_texel(tables, e, t, SELF + 9 * (x >> 3) + 3 * (y >> 3) + (z >> 3))
                u = ((x & 7) << 6) + ((y & 7) << 3) + (z & 7)
                if f < 0 or slots[f] == ABSENT or not needed(tables.masks, f, u):
                    continue
                r, g, b, a = stored_texel(kind, slots[f], pool, tiles, u)
                weight = np.float32((2 - abs(dx)) * (2 - abs(dy)) * (2 - abs(dz)))
                w = weight * a
                sr, sg, sb, sa, sw = sr + w * r, sg + w * g, sb + w * b, sa + w, sw + weight
            own = stored_texel(kind, slots[e], pool, tiles, t)
            share = opacity * coverage[rows[i], t]
            if sa > F0:
                mean = sr / sa, sg / sa, sb / sa, sa / sw
            else:
                mean = F0, F0, F0, F0
            r, g, b, a = mixed(own, mean, share)
            out[i, t] = encode(kind, r, g, b, a)


@njit(cache=True, nogil=True)
def smudged(
    tables, entries, begin, end, rows, changed, slots, coverage, opacity, way, kind, pool, tiles,
    out,
):  # fmt: skip
    """``out[i, t]`` = marked texel t of ``entries[i]``, mixed with what lies ``way`` behind it.

    The way (3,), in finest texels, is laid flat on the surface at each texel.
    """
    heads, pages, groups, sheets = tables.heads, tables.pages, tables.groups, tables.sheets
    neighbors, masks = tables.neighbors, tables.masks
    for i in range(begin, end):
        e = entries[i]
        level = tables.levels[e]
        shrink = 1.0 / (1 << level)
        code = tables.texel_first[e] - 1
        for t in range(512):
            if not needed(masks, e, t):
                continue
            code += 1
            if not (changed[i, t >> 6] >> np.uint64(t & 63)) & np.uint64(1):
                continue
            nx, ny, nz = decode_normal(tables.texel_normals[code, 0], tables.texel_normals[code, 1])
            out_of = way[0] * nx + way[1] * ny + way[2] * nz
            x = 8.0 * tables.bricks[e, 0] + (t >> 6) - shrink * (way[0] - out_of * nx)
            y = 8.0 * tables.bricks[e, 1] + ((t >> 3) & 7) - shrink * (way[1] - out_of * ny)
            z = 8.0 * tables.bricks[e, 2] + (t & 7) - shrink * (way[2] - out_of * nz)
            r, g, b, a, found = stored_value(
                heads, pages, groups, sheets, neighbors, masks, slots, pool, tiles, kind,
                np.int64(level), x, y, z, np.float64(nx), np.float64(ny), np.float64(nz),
                part_bit(tables.texel_parts, code),
            )  # fmt: skip
            own = stored_texel(kind, slots[e], pool, tiles, t)
            share = opacity * coverage[rows[i], t] if found else F0
            r, g, b, a = mixed(own, (r, g, b, a), share)
            out[i, t] = encode(kind, r, g, b, a)


@njit(cache=True, nogil=True)
def mixed(one, other, share):
    """Two colours with straight alpha mixed in linear light."""
    w0, w1 = (F1 - share) * one[3], share * other[3]
    a = w0 + w1
    if share <= F0 or not a > F0:
        return one[0], one[1], one[2], one[3] if share <= F0 else a
    return (
        (w0 * one[0] + w1 * other[0]) / a,
        (w0 * one[1] + w1 * other[1]) / a,
        (w0 * one[2] + w1 * other[2]) / a,
        a,
    )


@njit(cache=True, nogil=True)
def replace(entries, rows, changed, slots, values, pool, coverage):
    """Put the marked ``values`` (n, 512) in the texels' place, and forget their coverage."""
    for i in range(len(entries)):
        slot = slots[entries[i]]
        for t in range(512):
            if (changed[i, t >> 6] >> np.uint64(t & 63)) & np.uint64(1):
                pool[slot, t] = values[i, t]
                coverage[rows[i], t] = F0
