"""A texture's octree at many points."""

import math

import numpy as np
from numba import njit

from .octree_tables import FIRST_GROUP, find_code, nearest_sheet
from .texel_codes import F0, F1, decode
from .texture_blocks import BLOCK, COLUMNS, block_values
from .texture_lookup import ABSENT, needed, read_texel


@njit(cache=True, nogil=True)
def sample(tables, slots, pool, tiles, kind, points, normals, parts, footprints, begin, end, out):
    """``out[n]`` (n, 4) float32 = the texture at ``points[n]`` for ``begin <= n < end``.

    ``normals``, ``parts`` and ``footprints`` hold one row per point, or one for all. What a
    footprint of f texels shows lies between the levels log2 f. Points that are not finite give NaN.
    """
    heads, pages, groups, sheets = tables.heads, tables.pages, tables.groups, tables.sheets
    neighbors, masks = tables.neighbors, tables.masks
    top, scale = len(heads) - 1, 1.0 / tables.texel
    levels, places, facing = np.empty(BLOCK, np.int64), np.empty((BLOCK, 3)), np.empty((BLOCK, 3))
    wanted = np.empty(BLOCK, np.int64)
    colors, shares = np.empty((BLOCK, 4), np.float32), np.empty(BLOCK, np.float32)
    targets, numbers = np.empty(BLOCK, np.int64), np.empty((BLOCK, COLUMNS), np.int64)
    fractions = np.empty((BLOCK, 3), np.float32)
    is_filtered = len(footprints) > 1 or footprints[0] * scale > 1.0
    # The finer of the two levels of every point, then the coarser
    for coarser in range(2 if is_filtered else 1):
        at = begin
        while at < end:
            count, at = _gather(
                points, normals, parts, footprints, scale, top, at, end, coarser, targets, levels,
                shares, places, facing, wanted, out,
            )  # fmt: skip
            block_values(
                heads, pages, groups, sheets, neighbors, masks, slots, pool, tiles, kind, count,
                levels, places, facing, wanted, numbers, fractions, colors,
            )  # fmt: skip
            _scatter(colors, targets, shares, count, coarser, out)


@njit(cache=True, nogil=True)
def _gather(
    points, normals, parts, footprints, scale, top, at, end, coarser, targets, levels, shares,
    places, facing, wanted, out,
):  # fmt: skip
    """Fill a block with points from ``at`` on; how many, and the first that did not fit.

    In the coarser turn only those that lie between levels.
    """
    every_normal, every_footprint = int(len(normals) > 1), int(len(footprints) > 1)
    every_part = int(len(parts) > 1)
    count = 0
    while at < end and count < len(targets):
        n = at
        at += 1
        x, y, z = points[n, 0] * scale, points[n, 1] * scale, points[n, 2] * scale
        if not (abs(x) < 4.0e15 and abs(y) < 4.0e15 and abs(z) < 4.0e15):
            out[n, 0] = out[n, 1] = out[n, 2] = out[n, 3] = np.nan
            continue
        width = footprints[n * every_footprint] * scale
        level, share = coarser, F0
        if width > 1.0:
            detail = min(math.log2(width), np.float64(top))
            level = int(detail)
            share = np.float32(detail - level)
            level += coarser
            shrink = 1.0 / (1 << level)
            x, y, z = x * shrink, y * shrink, z * shrink
        if coarser and share == F0:
            continue
        targets[count], levels[count], shares[count] = n, level, share
        places[count, 0], places[count, 1], places[count, 2] = x, y, z
        m = n * every_normal
        facing[count, 0], facing[count, 1] = normals[m, 0], normals[m, 1]
        facing[count, 2] = normals[m, 2]
        wanted[count] = parts[n * every_part]
        count += 1
    return count, at


@njit(cache=True, nogil=True)
def _scatter(colors, targets, shares, count, coarser, out):
    """Put a block's colours in place, or mix them in by their share and alpha if coarser."""
    for q in range(count):
        n = targets[q]
        r, g, b, a = colors[q, 0], colors[q, 1], colors[q, 2], colors[q, 3]
        if coarser:
            r0, g0, b0, a0 = out[n, 0], out[n, 1], out[n, 2], out[n, 3]
            if r == r0 and g == g0 and b == b0 and a == a0:
                continue
            w0, w1 = (F1 - shares[q]) * a0, shares[q] * a
            a = w0 + w1
            if a > F0:
                r, g, b = (w0 * r0 + w1 * r) / a, (w0 * g0 + w1 * g) / a, (w0 * b0 + w1 * b) / a
            else:
                r, g, b = r0, g0, b0
        out[n, 0], out[n, 1], out[n, 2], out[n, 3] = r, g, b, a


@njit(cache=True, nogil=True)
def nearest(tables, slots, pool, tiles, kind, points, normals, parts, begin, end, out):
    """``out[n]`` = the nearest stored texel's numbers, at the finest level stored there.

    Block by block: where texels are, then to fetch them, then what they mean. A loop that only
    fetches has many reads under way at once.
    """
    places, texels = np.empty(BLOCK, np.int64), np.empty(BLOCK, pool.dtype)
    texels_of_all = pool.reshape(pool.size)
    every_normal, every_part = int(len(normals) > 1), int(len(parts) > 1)
    for first in range(begin, end, BLOCK):
        count = min(BLOCK, end - first)
        _find_texels(tables, slots, points, first, count, places)
        for q in range(count):
            texels[q] = texels_of_all[max(places[q], 0)]
        for q in range(count):
            n = first + q
            if places[q] >= 0:
                r, g, b, a = decode(kind, texels[q])
            else:
                m = n * every_normal
                r, g, b, a = _nearest_of_levels(
                    tables, slots, pool, tiles, kind, points[n, 0], points[n, 1], points[n, 2],
                    normals[m, 0], normals[m, 1], normals[m, 2], parts[n * every_part],
                )  # fmt: skip
            out[n, 0], out[n, 1], out[n, 2], out[n, 3] = r, g, b, a


@njit(cache=True, nogil=True)
def _find_texels(tables, slots, points, first, count, places):
    """``places[q]`` = which of all texels in the pool is nearest to ``points[first + q]``.

    -1 unless it is of the finest level, in a brick of one sheet that is stored as more than a tile.
    """
    heads, pages, masks, scale = tables.heads, tables.pages, tables.masks, 1.0 / tables.texel
    for q in range(count):
        n = first + q
        x, y, z = points[n, 0] * scale, points[n, 1] * scale, points[n, 2] * scale
        place = np.int64(-1)
        if abs(x) < 4.0e15 and abs(y) < 4.0e15 and abs(z) < 4.0e15:
            i, j, k = math.floor(x + 0.5), math.floor(y + 0.5), math.floor(z + 0.5)
            entry = find_code(heads, pages, 0, i >> 3, j >> 3, k >> 3)
            if entry >= 0:
                slot, row, bit = np.int64(slots[entry]), i & 7, ((j & 7) << 3) + (k & 7)
                if slot >= 0 and (masks[entry, row] >> np.uint64(bit)) & np.uint64(1):
                    place = 512 * slot + (row << 6) + bit
        places[q] = place


@njit(cache=True, nogil=True)
def _nearest_of_levels(tables, slots, pool, tiles, kind, x, y, z, nx, ny, nz, part):
    """r, g, b, a of the nearest texel of the finest level that stores one there."""
    scale = 1.0 / tables.texel
    x, y, z = x * scale, y * scale, z * scale
    if not (abs(x) < 4.0e15 and abs(y) < 4.0e15 and abs(z) < 4.0e15):
        nan = np.float32(np.nan)
        return nan, nan, nan, nan
    for level in range(len(tables.heads)):
        i, j, k = math.floor(x + 0.5), math.floor(y + 0.5), math.floor(z + 0.5)
        e = find_code(tables.heads, tables.pages, level, i >> 3, j >> 3, k >> 3)
        if e <= FIRST_GROUP:
            e = nearest_sheet(tables.groups, tables.sheets, e, nx, ny, nz, part)
        if e >= 0 and slots[e] != ABSENT:
            t = ((i & 7) << 6) + ((j & 7) << 3) + (k & 7)
            if needed(tables.masks, e, t):
                return read_texel(kind, slots[e], pool, tiles, t)
        x, y, z = 0.5 * x, 0.5 * y, 0.5 * z
    return F0, F0, F0, F0
