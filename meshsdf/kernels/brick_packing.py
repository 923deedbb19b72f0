"""Put the texels that exist side by side, and back into their bricks."""

import numpy as np
from numba import njit


@njit(cache=True, nogil=True, inline="always")
def row_of(masks, e, row):
    """The eight bits of texels 8 row ... 8 row + 7 of an entry; most rows have none."""
    return np.int64((masks[e, row >> 3] >> np.uint64((row & 7) << 3)) & np.uint64(255))


@njit(cache=True, nogil=True)
def count_written(masks, entries, slots, pool, nothing, counts):
    """``counts[i]`` = texels to pack of ``entries[i]``: all, or 0 if none was ever written."""
    for i in range(len(entries)):
        e, slot = entries[i], slots[i]
        n, written = 0, False
        for row in range(64):
            bits = row_of(masks, e, row)
            if bits == 0:
                continue
            for t in range(8 * row, 8 * row + 8):
                if (bits >> (t & 7)) & 1:
                    n += 1
                    written |= pool[slot, t] != nothing
        counts[i] = n if written else 0


@njit(cache=True, nogil=True)
def pack_bricks(masks, entries, slots, pool, packed):
    """Fill ``packed`` with the texels that exist of the entries, one entry after another."""
    at = 0
    for i in range(len(entries)):
        e, slot = entries[i], slots[i]
        for row in range(64):
            bits = row_of(masks, e, row)
            if bits == 0:
                continue
            for t in range(8 * row, 8 * row + 8):
                if (bits >> (t & 7)) & 1:
                    packed[at] = pool[slot, t]
                    at += 1


@njit(cache=True, nogil=True)
def unpack_bricks(masks, entries, slots, packed, pool):
    """Put back into the slots of the entries what `pack_bricks` packed."""
    at = 0
    for i in range(len(entries)):
        e, slot = entries[i], slots[i]
        for row in range(64):
            bits = row_of(masks, e, row)
            if bits == 0:
                continue
            for t in range(8 * row, 8 * row + 8):
                if (bits >> (t & 7)) & 1:
                    pool[slot, t] = packed[at]
                    at += 1
