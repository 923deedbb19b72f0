"""Pack values into Blosc frames with LZ4, many in one call; `blosc_frames` has the layout.

The bytes of values are shuffled, and packed in one stream for each byte of a value where the
format allows it. LZ4 asks that the last sequence is literals alone, that the last 5 bytes are
literals, and that no repetition begins in the last 12 bytes (its lz4_Block_format).

Repetitions are found as in all quick packers of this kind: a table remembers where four bytes were
seen last, and the longer nothing is found, the more places are passed over.
"""

import numpy as np
from numba import njit

from .raw_bytes import copy_bytes, put_number, word_at

LARGEST_BLOCK = 1 << 16
"""Bytes; a repetition reaches back less far than this."""

TABLE = 1 << 12
"""Entries of the table of places."""

_HEADER, _VERSION, _CODEC_VERSION = 16, 2, 1
_FLAGS = 1 << 5 | 1  # LZ4, shuffled
_MOST_SPLITS, _LEAST_STREAM = 16, 128
_LITERALS_AFTER, _LITERALS_LAST, _SHORTEST = 12, 5, 4
_SCATTER = 2654435761  # 2^32 over the golden ratio (Knuth 1973, vol. 3, section 6.4)
_PATIENCE = 5  # so many doublings of misses until a second place is passed over


@njit(cache=True, nogil=True)
def pack_frames(data, ends, width, scratch, table, packed, sizes):
    """Pack the values of each node into a frame, or copy them if that is not shorter.

    ``ends`` (n,): where in ``data`` those of each end; ``scratch`` as long as the longest block,
    ``table`` (`TABLE`,) int32, ``packed`` as long as ``data``. Fills ``sizes`` (n,): the length of
    a frame, or that of a copy, below 0. Returns where the last ends in ``packed``.
    """
    begin, at = np.int64(0), np.int64(0)
    for n in range(len(ends)):
        end = ends[n]
        stop = _pack_frame(data, begin, end, width, scratch, table, packed, at)
        if stop < 0:
            stop = at + end - begin
            copy_bytes(data, begin, packed, at, end - begin)
            sizes[n] = begin - end
        else:
            sizes[n] = stop - at
        begin, at = end, stop
    return at


@njit(cache=True, nogil=True)
def _pack_frame(data, begin, end, width, scratch, table, out, at):
    """Pack ``data[begin:end]`` into ``out[at:]``; where that ends, or -1 if it is not shorter."""
    size = end - begin
    block = min(size, LARGEST_BLOCK // width * width)
    n_blocks = (size + block - 1) // block if size else 0
    stop = at + size - 1  # no frame may end beyond
    to = at + _HEADER + 4 * n_blocks
    if size == 0 or to > stop:
        return np.int64(-1)
    out[at], out[at + 1], out[at + 2], out[at + 3] = _VERSION, _CODEC_VERSION, _FLAGS, width
    for number in range(n_blocks):
        put_number(out, at + _HEADER + 4 * number, to - at, 4)
        first = begin + number * block
        length = min(block, end - first)
        is_split = length == block and width <= _MOST_SPLITS and block // width >= _LEAST_STREAM
        streams = width if is_split else 1
        _shuffle(data, first, scratch, length, width)
        part = length // streams
        for stream in range(streams):
            if to + 4 > stop:
                return np.int64(-1)
            source = scratch[stream * part : (stream + 1) * part]
            last = _pack_lz4(source, table, out, to + 4, min(stop, to + 4 + part - 1))
            if last < 0:
                last = to + 4 + part
                if last > stop:
                    return np.int64(-1)
                copy_bytes(source, 0, out, to + 4, part)
            put_number(out, to, last - to - 4, 4)
            to = last
    put_number(out, at + 4, size, 4)
    put_number(out, at + 8, block, 4)
    put_number(out, at + 12, to - at, 4)
    return to


@njit(cache=True, nogil=True)
def _shuffle(data, first, scratch, length, width):
    """The first bytes of all values, then the second, and so on."""
    n = length // width
    for byte in range(width):
        plane, values = scratch[byte * n : (byte + 1) * n], data[first + byte : first + length]
        if width == 4:
            # As below, but known when compiled
            for i in range(n):
                plane[i] = values[4 * i]
        else:
            for i in range(n):
                plane[i] = values[width * i]


@njit(cache=True, nogil=True)
def _pack_lz4(source, table, out, at, stop):
    """Pack a stream into ``out[at:stop]``; where that ends, or -1 if it has no room."""
    size = len(source)
    bits = 6
    while bits < 12 and 1 << bits < size:
        bits += 1
    for i in range(1 << bits):
        table[i] = -1
    anchor, place, misses = 0, 0, 0
    while place < size - _LITERALS_AFTER:
        word = word_at(source, place)
        slot = ((np.int64(word) * _SCATTER) & 0xFFFFFFFF) >> (32 - bits)
        before = np.int64(table[slot])
        table[slot] = place
        if before < 0 or word_at(source, before) != word:
            place += 1 + (misses >> _PATIENCE)
            misses += 1
            continue
        misses = 0
        end = place + _SHORTEST
        while end < size - _LITERALS_LAST and source[end] == source[end - place + before]:
            end += 1
        while place > anchor and before > 0 and source[place - 1] == source[before - 1]:
            place, before = place - 1, before - 1
        at = _put_sequence(source, anchor, place, place - before, end - place, out, at, stop)
        if at < 0:
            return np.int64(-1)
        anchor = place = end
    return _put_sequence(source, anchor, size, 0, 0, out, at, stop)


@njit(cache=True, nogil=True)
def _put_sequence(source, anchor, place, back, n_repeated, out, at, stop):
    """Write the literals ``source[anchor:place]`` and a repetition; none if ``back`` is 0."""
    n_literals = place - anchor
    more = n_repeated - _SHORTEST if back else 0
    room = 1 + n_literals + (n_literals + 240) // 255 + (2 + (more + 240) // 255 if back else 0)
    if at + room > stop:
        return np.int64(-1)
    out[at] = min(n_literals, 15) << 4 | min(more, 15)
    at = _put_length(n_literals, out, at + 1)
    at = copy_bytes(source, anchor, out, at, n_literals)
    if back:
        out[at], out[at + 1] = back & 255, back >> 8
        at = _put_length(more, out, at + 2)
    return at


@njit(cache=True, nogil=True)
def _put_length(length, out, at):
    """What is beyond the four bits of a length, in further bytes."""
    if length >= 15:
        length -= 15
        while length >= 255:
            out[at] = 255
            at, length = at + 1, length - 255
        out[at] = length
        at += 1
    return at
