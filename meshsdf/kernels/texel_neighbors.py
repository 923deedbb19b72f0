"""Which entry lies beside another, as seen from one of its texels."""

import numpy as np
from numba import njit

from .bits import count_bits
from .octree_tables import (
    ANY_PART,
    FIRST_BITS,
    FIRST_GROUP,
    find_code,
    nearest_sheet,
    part_bit,
    parts_of,
)
from .sheets import decode_normal


@njit(cache=True, nogil=True)
def beside_texel(tables, e, t, side):
    """The entry in the brick beside entry e that continues its sheet at texel t, or below 0.

    In an octree where no sheet is divided, what ``neighbors`` says, which may be a group.
    """
    other = np.int64(tables.neighbors[e, side])
    if other > FIRST_GROUP or tables.groups.shape[1] == FIRST_BITS:
        return other
    code = texel_code(tables.texel_first, tables.masks, e, t)
    nx, ny, nz = decode_normal(tables.texel_normals[code, 0], tables.texel_normals[code, 1])
    part = part_bit(tables.texel_parts, code)
    return np.int64(nearest_sheet(tables.groups, tables.sheets, other, nx, ny, nz, part))


@njit(cache=True, nogil=True)
def texel_part(tables, e, t):
    """The part, as a bit, that texel t of an entry is of."""
    if len(tables.texel_parts) == 0:
        return np.int64(ANY_PART)
    return part_bit(tables.texel_parts, texel_code(tables.texel_first, tables.masks, e, t))


@njit(cache=True, nogil=True)
def entry_parts(tables, e):
    """The parts, as bits, that an entry is of."""
    if len(tables.texel_parts) == 0:
        return np.int64(ANY_PART)
    brick = tables.bricks[e]
    code = find_code(
        tables.heads, tables.pages, np.int64(tables.levels[e]), brick[0], brick[1], brick[2]
    )
    return parts_of(tables.groups, code, np.int64(e))


@njit(cache=True, nogil=True)
def parts_beside(tables, e):
    """The parts, as bits, that other sheets of a divided entry's brick are of, and it is not."""
    own = entry_parts(tables, e)
    if own == ANY_PART:
        return np.int64(0)
    brick = tables.bricks[e]
    group = FIRST_GROUP - np.int64(
        find_code(
            tables.heads, tables.pages, np.int64(tables.levels[e]), brick[0], brick[1], brick[2]
        )
    )
    others = np.int64(0)
    for s in range(tables.groups[group, 1]):
        bits = np.int64(tables.groups[group, FIRST_BITS + s])
        if bits != ANY_PART:
            others |= bits
    return others & ~own


@njit(cache=True, nogil=True)
def is_beside(tables, e, beside, parts):
    """Whether a dab of some parts (bits) is on other sheets than entry e of its brick alone;
    ``beside`` is what `parts_beside` says."""
    return beside & parts != 0 and entry_parts(tables, e) & parts == 0


@njit(cache=True, nogil=True)
def texel_code(first, masks, e, t):
    """Which of all texels the texel t of an entry is."""
    at = first[e]
    for word in range(t >> 6):
        at += count_bits(masks[e, word])
    return at + count_bits(masks[e, t >> 6] & ((np.uint64(1) << np.uint64(t & 63)) - np.uint64(1)))
