"""Texels of like colour that steps along the axes connect with a first one."""

import numpy as np
from numba import njit

from .octree_tables import SELF
from .texel_neighbors import beside_texel, texel_code


@njit(cache=True, nogil=True)
def nearest_texel(tables, begin, end, x, y, z, nx, ny, nz):
    """Entry and number of the texel, of the entries ``begin ... end - 1``, nearest to a point.

    The point is in nodes of the entries' level. Texels that look away from n count only where there
    are no others; the first of several equally near. (-1, -1) if there are no texels.
    """
    best, entry, texel = np.inf, -1, -1
    for e in range(begin, end):
        bx, by, bz = 8.0 * tables.bricks[e, 0], 8.0 * tables.bricks[e, 1], 8.0 * tables.bricks[e, 2]
        away2 = _outside(x - bx) ** 2 + _outside(y - by) ** 2 + _outside(z - bz) ** 2
        looks = tables.sheets[e, 0] * nx + tables.sheets[e, 1] * ny + tables.sheets[e, 2] * nz
        extra = 1e12 if looks < 0.0 else 0.0
        if away2 + extra >= best:
            continue
        for t in range(512):
            if not (tables.masks[e, t >> 6] >> np.uint64(t & 63)) & np.uint64(1):
                continue
            dx, dy, dz = bx + (t >> 6) - x, by + ((t >> 3) & 7) - y, bz + (t & 7) - z
            far2 = dx * dx + dy * dy + dz * dz + extra
            if far2 < best:
                best, entry, texel = far2, e, t
    return entry, texel


@njit(cache=True, nogil=True, inline="always")
def _outside(a):
    """How far a coordinate, from a brick's first texel, is outside the brick."""
    return max(max(a - 7.0, -a), 0.0)


@njit(cache=True, nogil=True)
def flood(tables, first_entry, entry, texel, colors, tolerance, bits, queue):
    """Mark in ``bits`` (n, 8) the texels connected with one of like colour; returns how many.

    ``colors`` (texels, 4) are of the texels of the level whose entries begin with ``first_entry``,
    as `OctreeTables.texel_first` counts them. Like is who differs from the first one by at most
    ``tolerance`` in every number.
    """
    offset = tables.texel_first[first_entry]
    start = texel_code(tables.texel_first, tables.masks, entry, texel) - offset
    bits[entry - first_entry, texel >> 6] |= np.uint64(1) << np.uint64(texel & 63)
    queue[0] = 512 * np.int64(entry) + texel
    n, at = 1, 0
    while at < n:
        e, t = queue[at] >> 9, queue[at] & 511
        at += 1
        for side in range(6):
            axis, step = side >> 1, 2 * (side & 1) - 1
            x = (t >> 6) + (step if axis == 0 else 0)
            y = ((t >> 3) & 7) + (step if axis == 1 else 0)
            z = (t & 7) + (step if axis == 2 else 0)
            f = beside_texel(tables, e, t, SELF + 9 * (x >> 3) + 3 * (y >> 3) + (z >> 3))
            if f < 0:
                continue
            u = ((x & 7) << 6) + ((y & 7) << 3) + (z & 7)
            bit = np.uint64(1) << np.uint64(u & 63)
            if not tables.masks[f, u >> 6] & bit or bits[f - first_entry, u >> 6] & bit:
                continue
            other = texel_code(tables.texel_first, tables.masks, f, u) - offset
            like = True
            for c in range(4):
                like &= abs(colors[other, c] - colors[start, c]) <= tolerance
            if like:
                bits[f - first_entry, u >> 6] |= bit
                queue[n] = 512 * f + u
                n += 1
    return n
