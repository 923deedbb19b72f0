"""A texture's octree at many points."""

import math

import numpy as np
from numba import njit

from .octree_tables import find_entry
from .texel_codes import F0, F1
from .texture_lookup import ABSENT, level_value, needed, read_texel


@njit(cache=True, nogil=True)
def sample(tables, slots, pool, tiles, kind, points, normals, footprints, begin, end, out):
    """``out[n]`` (n, 4) float32 = the texture at ``points[n]`` for ``begin <= n < end``.

    ``normals`` and ``footprints`` hold one row per point, or one for all. What a footprint of f
    texels shows lies between the levels log2 f. Points that are not finite give NaN.
    """
    heads, pages, groups, sheets = tables.heads, tables.pages, tables.groups, tables.sheets
    neighbors, masks = tables.neighbors, tables.masks
    top = len(heads) - 1
    scale = 1.0 / tables.texel
    many_normals, many_footprints = len(normals) > 1, len(footprints) > 1
    for n in range(begin, end):
        x, y, z = points[n, 0] * scale, points[n, 1] * scale, points[n, 2] * scale
        if not (abs(x) < 4.0e15 and abs(y) < 4.0e15 and abs(z) < 4.0e15):
            out[n, :] = np.nan
            continue
        m = n if many_normals else 0
        nx, ny, nz = normals[m, 0], normals[m, 1], normals[m, 2]
        width = footprints[n if many_footprints else 0] * scale
        level, between = 0, F0
        if width > 1.0:
            detail = min(math.log2(width), np.float64(top))
            level = int(detail)
            between = np.float32(detail - level)
        fine = level
        shrink = 1.0 / (1 << level)
        x, y, z = x * shrink, y * shrink, z * shrink
        r, g, b, a = F0, F0, F0, F0
        while True:
            r1, g1, b1, a1 = level_value(
                heads, pages, groups, sheets, neighbors, masks, slots, pool, tiles, kind, level,
                x, y, z, nx, ny, nz,
            )  # fmt: skip
            if level == fine:
                r, g, b, a = r1, g1, b1, a1
                if between == F0:
                    break
            else:
                if r != r1 or g != g1 or b != b1 or a != a1:
                    w0, w1 = (F1 - between) * a, between * a1
                    a = w0 + w1
                    if a > F0:
                        r, g, b = (
                            (w0 * r + w1 * r1) / a,
                            (w0 * g + w1 * g1) / a,
                            (w0 * b + w1 * b1) / a,
                        )
                break
            level += 1
            x, y, z = 0.5 * x, 0.5 * y, 0.5 * z
        out[n, 0], out[n, 1], out[n, 2], out[n, 3] = r, g, b, a


@njit(cache=True, nogil=True)
def nearest(tables, slots, pool, tiles, kind, points, normals, begin, end, out):
    """``out[n]`` = the nearest stored texel's numbers, at the finest level stored there."""
    heads, pages, groups, sheets = tables.heads, tables.pages, tables.groups, tables.sheets
    masks = tables.masks
    top = len(heads)
    scale = 1.0 / tables.texel
    many_normals = len(normals) > 1
    for n in range(begin, end):
        m = n if many_normals else 0
        nx, ny, nz = normals[m, 0], normals[m, 1], normals[m, 2]
        x, y, z = points[n, 0] * scale, points[n, 1] * scale, points[n, 2] * scale
        if not (abs(x) < 4.0e15 and abs(y) < 4.0e15 and abs(z) < 4.0e15):
            out[n, :] = np.nan
            continue
        out[n, :] = F0
        for level in range(top):
            i, j, k = math.floor(x + 0.5), math.floor(y + 0.5), math.floor(z + 0.5)
            e = find_entry(heads, pages, groups, sheets, level, i >> 3, j >> 3, k >> 3, nx, ny, nz)
            if e >= 0 and slots[e] != ABSENT:
                t = ((i & 7) << 6) + ((j & 7) << 3) + (k & 7)
                if needed(masks, e, t):
                    r, g, b, a = read_texel(kind, slots[e], pool, tiles, t)
                    out[n, 0], out[n, 1], out[n, 2], out[n, 3] = r, g, b, a
                    break
            x, y, z = 0.5 * x, 0.5 * y, 0.5 * z
