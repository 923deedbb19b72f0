"""Which texels are connected to a dab's ends within the dab, along the surface.

Paint must not jump to the next finger. Texels are the corners of the cells that the surface cuts,
so those of one connected piece of surface are connected by steps along the axes.
"""

import math

import numpy as np
from numba import njit

from .brush_reach import BATCH, MARGIN, PLACE, segment_distance2
from .octree_tables import SELF
from .sheets import decode_normal
from .texel_neighbors import beside_texel, is_beside, parts_beside
from .texture_lookup import needed

# A point of the surface is in a cut cell, whose corners are at most its diagonal away
SEED_DISTANCE2 = 3.0 * (1.0 + 1e-9)
HALF_DIAGONAL = 3.5 * math.sqrt(3.0)


@njit(cache=True, nogil=True)
def connected_texels(
    tables, found, n, batch, marks, finest, wanted, dabs, parts, begin, end, gates
):
    """``gates[d, i]`` (8,) uint64 = texels of ``found[i]`` connected to dab d, begin <= d < end.

    At each level the flood starts from the texels around the dab's ends that look its way and,
    where sheets are divided, are of its ``parts`` (bits); where there are none, from the nearest.
    """
    queue = np.empty(512 * n, np.int64)
    for d in range(begin, end):
        gates[d, :n, :] = np.uint64(0)
        for level in range(finest, wanted + 1):
            n_queued = _seeds(
                tables, found, n, level, dabs[d], parts[d], SEED_DISTANCE2, gates[d], queue
            )
            if n_queued == 0:
                nearest = _nearest(tables, found, n, level, dabs[d], parts[d])
                n_queued = _seeds(
                    tables, found, n, level, dabs[d], parts[d], nearest, gates[d], queue
                )
            _flood(tables, found, batch, marks, dabs, d, gates[d], queue, n_queued)


@njit(cache=True, nogil=True)
def _seeds(tables, found, n, level, dab, parts, most2, gate, queue):
    """Mark and queue the texels of a level within a distance of the dab's ends."""
    n_queued = 0
    shrink = 1.0 / (1 << level)
    reach = math.sqrt(most2) + HALF_DIAGONAL
    for i in range(n):
        e = found[i]
        if tables.levels[e] != level:
            continue
        if is_beside(tables, e, parts_beside(tables, e), parts):
            continue
        x, y, z = 8.0 * tables.bricks[e, 0], 8.0 * tables.bricks[e, 1], 8.0 * tables.bricks[e, 2]
        if _to_end2(dab, shrink, x + 3.5, y + 3.5, z + 3.5) > reach * reach:
            continue
        code = tables.texel_first[e]
        for t in range(512):
            if not needed(tables.masks, e, t):
                continue
            far2 = _to_end2(dab, shrink, x + (t >> 6), y + ((t >> 3) & 7), z + (t & 7))
            if far2 <= most2 and _looks_along(tables, code, dab):
                gate[i, t >> 6] |= np.uint64(1) << np.uint64(t & 63)
                queue[n_queued] = 512 * i + t
                n_queued += 1
            code += 1
    return n_queued


@njit(cache=True, nogil=True)
def _nearest(tables, found, n, level, dab, parts):
    """Squared distance to the dab's ends of the nearest texel that looks its way; -1 if none."""
    best = 4.0 * max(dab[6], dab[7]) ** 2 + 4.0
    any_found = False
    shrink = 1.0 / (1 << level)
    for i in range(n):
        e = found[i]
        if tables.levels[e] != level:
            continue
        if is_beside(tables, e, parts_beside(tables, e), parts):
            continue
        x, y, z = 8.0 * tables.bricks[e, 0], 8.0 * tables.bricks[e, 1], 8.0 * tables.bricks[e, 2]
        code = tables.texel_first[e]
        for t in range(512):
            if not needed(tables.masks, e, t):
                continue
            far2 = _to_end2(dab, shrink, x + (t >> 6), y + ((t >> 3) & 7), z + (t & 7))
            if far2 < best and _looks_along(tables, code, dab):
                best, any_found = far2, True
            code += 1
    return best if any_found else -1.0


@njit(cache=True, nogil=True, inline="always")
def _to_end2(dab, shrink, x, y, z):
    """Squared distance to the nearer end of the dab."""
    ax, ay, az = x - dab[0] * shrink, y - dab[1] * shrink, z - dab[2] * shrink
    bx, by, bz = x - dab[3] * shrink, y - dab[4] * shrink, z - dab[5] * shrink
    return min(ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz)


@njit(cache=True, nogil=True, inline="always")
def _looks_along(tables, code, dab):
    """Whether a texel looks the way of either end of the dab, or no way at all."""
    nx, ny, nz = decode_normal(tables.texel_normals[code, 0], tables.texel_normals[code, 1])
    a = nx * dab[10] + ny * dab[11] + nz * dab[12]
    b = nx * dab[13] + ny * dab[14] + nz * dab[15]
    return max(a, b) > 0.0 or (nx == 0.0 and ny == 0.0 and nz == 0.0)


@njit(cache=True, nogil=True)
def _flood(tables, found, batch, marks, dabs, d, gate, queue, n_queued):
    """Mark all texels within reach of the dab that steps along the axes lead to."""
    at = 0
    while at < n_queued:
        i, t = queue[at] >> 9, queue[at] & 511
        at += 1
        e = np.int64(found[i])
        shrink = 1.0 / (1 << tables.levels[e])
        reach = max(dabs[d, 6], dabs[d, 7]) * shrink + MARGIN
        for side in range(6):
            axis, step = side >> 1, 2 * (side & 1) - 1
            x = (t >> 6) + (step if axis == 0 else 0)
            y = ((t >> 3) & 7) + (step if axis == 1 else 0)
            z = (t & 7) + (step if axis == 2 else 0)
            f, j = e, i
            if (x | y | z) & ~7:
                f = beside_texel(tables, e, t, SELF + 9 * (x >> 3) + 3 * (y >> 3) + (z >> 3))
                if f < 0 or marks[f, BATCH] != batch:
                    continue
                j = np.int64(marks[f, PLACE])
            u = ((x & 7) << 6) + ((y & 7) << 3) + (z & 7)
            bit = np.uint64(1) << np.uint64(u & 63)
            if not tables.masks[f, u >> 6] & bit or gate[j, u >> 6] & bit:
                continue
            near = segment_distance2(
                dabs, d, shrink, 8.0 * tables.bricks[f, 0] + (x & 7),
                8.0 * tables.bricks[f, 1] + (y & 7), 8.0 * tables.bricks[f, 2] + (z & 7),
            )  # fmt: skip
            if near < reach * reach:
                gate[j, u >> 6] |= bit
                queue[n_queued] = 512 * j + u
                n_queued += 1
