"""Where the texels of an octree are, and putting values into them."""

import numpy as np
from numba import njit

from .octree_tables import part_bit
from .sheets import decode_normal
from .texel_codes import encode


@njit(cache=True, nogil=True)
def texel_places(tables, entries, first, begin, end, points, normals):
    """Positions and normals of the needed texels of ``entries[begin:end]``.

    Those of ``entries[i]`` go to the rows from ``first[i]`` on, in the order of the mask's bits.
    """
    for i in range(begin, end):
        e = entries[i]
        spacing = tables.texel * (1 << tables.levels[e])
        at, code = first[i], tables.texel_first[e]
        for t in range(512):
            if not (tables.masks[e, t >> 6] >> np.uint64(t & 63)) & np.uint64(1):
                continue
            points[at, 0] = spacing * (8 * tables.bricks[e, 0] + (t >> 6))
            points[at, 1] = spacing * (8 * tables.bricks[e, 1] + ((t >> 3) & 7))
            points[at, 2] = spacing * (8 * tables.bricks[e, 2] + (t & 7))
            nx, ny, nz = decode_normal(tables.texel_normals[code, 0], tables.texel_normals[code, 1])
            normals[at, 0], normals[at, 1], normals[at, 2] = nx, ny, nz
            at += 1
            code += 1


@njit(cache=True, nogil=True)
def texel_bits(tables, entries, first, parts):
    """``parts`` = the parts, as bits, of the texels of entries, in the order of `texel_places`."""
    for i in range(len(entries)):
        code = tables.texel_first[entries[i]]
        for n in range(first[i + 1] - first[i]):
            parts[first[i] + n] = part_bit(tables.texel_parts, code + n)


@njit(cache=True, nogil=True)
def put_texels(tables, entries, slots, first, begin, end, kind, values, pool):
    """Store ``values`` (n, 4), in the order of `texel_places`, in the slots of the entries."""
    for i in range(begin, end):
        e = entries[i]
        slot, at = slots[i], first[i]
        for t in range(512):
            if (tables.masks[e, t >> 6] >> np.uint64(t & 63)) & np.uint64(1):
                pool[slot, t] = encode(
                    kind, values[at, 0], values[at, 1], values[at, 2], values[at, 3]
                )
                at += 1


@njit(cache=True, nogil=True)
def uniform_entries(tables, entries, slots, pool, begin, end, uniform):
    """``uniform[i]`` = all needed texels of ``entries[i]`` hold the same numbers."""
    for i in range(begin, end):
        e, slot = entries[i], slots[i]
        known = -1
        same = True
        for t in range(512):
            if not (tables.masks[e, t >> 6] >> np.uint64(t & 63)) & np.uint64(1):
                continue
            if known < 0:
                known = t
            if pool[slot, t] != pool[slot, known]:
                same = False
                break
        uniform[i] = same and known >= 0
