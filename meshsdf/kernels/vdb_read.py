"""Find nodes in the bytes of a ``.vdb`` file, and put their values in place.

A node is an active mask, a code, what the code tells, then data; `io.vdb_values` has the layout.
How long one is stands in itself, so finding them is a walk from one to the next. It checks all
that the other kernels rely on: every part of a node found lies in the window.
"""

import numpy as np
from numba import njit

from .raw_bytes import bits_at, copy_bytes, word_at

FULL = 6
"""The code of a node that stores all its values."""

N_TOLD = (0, 0, 1, 0, 1, 2, 0)  # how many values follow each code
HAS_MASK = (False, False, False, True, True, True, False)
SLACK = 64  # bytes by which a packing may exceed what it packs; Blosc's header takes 16

BEGIN, CODE, DATA, END, COUNT, PACKED = range(6)
"""Columns of a record: where a node begins, its code, where its data begin and end, how many
values they are, and whether they are packed."""

FOUND, CUT_OFF, BAD_CODE, BAD_SIZE = range(4)
"""What ended the walk."""


@njit(cache=True, nogil=True)
def find_nodes(window, n, last, layout, records, fault):
    """Fill ``records`` (k, 6) with the nodes of ``n`` values from the first byte on; how many.

    The walk ends after k nodes, at a node that begins after ``last``, or at one that makes no
    sense, which ``fault`` (3,) tells: why, and the numbers concerned. ``layout`` (5,): bytes of a
    value at full width and as data, the first code with all values, whether data are behind their
    size, and whether that is left out where there are none.
    """
    width, stored, mask_bytes = layout[0], layout[1], n >> 3
    at, found = np.int64(0), 0
    fault[0] = FOUND
    while found < len(records) and at <= last:
        begin = at
        at += mask_bytes
        if at >= len(window):
            fault[0] = CUT_OFF
            break
        code = np.int64(window[at])
        if code > FULL:
            fault[0], fault[1] = BAD_CODE, code
            break
        count = n if code >= layout[2] else _n_marked(window, begin, at)
        told = N_TOLD[code] * width + (mask_bytes if HAS_MASK[code] else 0)
        data, size, packed = at + 1 + told, count * stored, 0
        if layout[3] and (count or not layout[4]):
            data, size, packed = _claim(window, data, size, fault)
        if fault[0] == FOUND and data + size > len(window):
            fault[0] = CUT_OFF
        if fault[0] != FOUND:
            break
        at = data + size
        records[found, BEGIN], records[found, CODE] = begin, code
        records[found, DATA], records[found, END] = data, at
        records[found, COUNT], records[found, PACKED] = count, packed
        found += 1
    return found


@njit(cache=True, nogil=True)
def _claim(window, at, size, fault):
    """Where data begin whose bytes are told before them, how many they are, whether packed."""
    if at + 8 > len(window):
        fault[0] = CUT_OFF
        return at, size, 0
    claim = np.int64(bits_at(window, at))
    # A packing is only written when it is shorter, so a longer one is no honest claim
    if claim > size + SLACK or (claim <= 0 and claim != -size):
        fault[0], fault[1], fault[2] = BAD_SIZE, claim, size
        return at, size, 0
    return at + 8, abs(claim), 1 if claim > 0 else 0


@njit(cache=True, nogil=True)
def _n_marked(window, begin, end):
    """How many bits are set in a mask."""
    n = 0
    for at in range(begin, end, 8):
        n += _n_ones(bits_at(window, at))
    return n


@njit(cache=True, nogil=True)
def _n_ones(bits):
    """How many bits are set, added up in ever wider fields."""
    two, four = np.uint64(0x3333333333333333), np.uint64(0x0F0F0F0F0F0F0F0F)
    bits -= (bits >> np.uint64(1)) & np.uint64(0x5555555555555555)
    bits = (bits & two) + ((bits >> np.uint64(2)) & two)
    bits = (bits + (bits >> np.uint64(4))) & four
    return np.int64((bits * np.uint64(0x0101010101010101)) >> np.uint64(56))


@njit(cache=True, nogil=True)
def copy_plain(window, records, target, places):
    """Copy the data that are not packed to where ``places`` (k + 1,) says that they begin."""
    for i in range(len(records)):
        if records[i, PACKED] == 0:
            begin, end = records[i, DATA], records[i, END]
            copy_bytes(window, begin, target, places[i], end - begin)


@njit(cache=True, nogil=True)
def place_values(window, records, full_from, data, sides, values, active, rows):
    """Fill the rows of ``values`` (m, n c) and ``active`` (m, n / 64) that belong to nodes.

    A value is ``c`` words of 32 bits. ``data`` (t,) are those of the stored values, one node after
    another, and ``c`` words more; ``sides`` (2, c) the background and its opposite.
    """
    n_words, c = active.shape[1], sides.shape[1]
    one, all_ones = np.uint64(1), ~np.uint64(0)
    told = np.empty((2, c), np.uint32)
    at = 0
    for i in range(len(records)):
        row, begin, code = rows[i], records[i, BEGIN], records[i, CODE]
        choice = begin + 8 * n_words + 1
        for k in range(c):
            told[0, k] = sides[0 if code == 0 else 1, k]
            told[1, k] = sides[0, k]
        for number in range(N_TOLD[code]):
            for k in range(c):
                told[number, k] = word_at(window, choice)
                choice += 4
        first, second, to = told[0, 0], told[1, 0], 0
        for w in range(n_words):
            mask = bits_at(window, begin + 8 * w)
            active[row, w] = mask
            stored = all_ones if code >= full_from else mask
            which = bits_at(window, choice + 8 * w) if HAS_MASK[code] else np.uint64(0)
            for bit in range(64):
                is_stored = (stored >> np.uint64(bit)) & one
                is_second = (which >> np.uint64(bit)) & one
                if c == 1:
                    # Without a branch, which would be taken by chance
                    side = second if is_second else first
                    kept = data[at]
                    values[row, to] = kept if is_stored else side
                else:
                    for k in range(c):
                        side = told[1, k] if is_second else told[0, k]
                        values[row, to + k] = data[at + k] if is_stored else side
                to += c
                at += c * np.int64(is_stored)
