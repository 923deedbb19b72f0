"""Open Blosc frames whose values are packed with LZ4, many in one call.

Frame (C-Blosc 1, its README_CHUNK_FORMAT): bytes for the version (2), the version of the codec,
flags and the size of a value; uint32 plain size, block size and frame size; then the offset of
every block, int32. Flags: 1 shuffled, 2 plain copy, 4 bits shuffled, 16 blocks are not split; the
top three bits name the codec, 1 for LZ4. A block is one stream, or one for each byte of a value;
a stream is its size, int32, and LZ4, or a plain copy if that is its size. Shuffled blocks hold the
first bytes of all values, then the second, and so on.

LZ4 (its lz4_Block_format): a token, whose halves are a number of literals and of repeated bytes
less 4, each continued in further bytes if it is 15; the literals; how far back to repeat, uint16.
The last sequence ends with its literals.

Nothing is read or written outside the ranges given, whatever the bytes say.
"""

import numpy as np
from numba import njit

from .raw_bytes import copy_bytes, word_at

GOOD, DAMAGED, OTHER = 0, 1, 2
"""What becomes of a frame: opened; no valid frame of that size; a codec or shuffle not known."""

_HEADER, _VERSION, _LZ4 = 16, 2, 1
_SHUFFLED, _COPIED, _BITS, _FUTURE, _UNSPLIT = 1, 2, 4, 8, 16
_MOST_SPLITS, _LEAST_STREAM = 16, 128


@njit(cache=True, nogil=True)
def open_frames(source, frames, target, places, scratch, states):
    """Open every frame ``source[frames[n, 0]:frames[n, 1]]`` into its place in ``target``.

    frames, places : (n, 2) int64, begin and end; scratch : bytes of the longest place.
    """
    for n in range(len(frames)):
        states[n] = _open_frame(
            source, frames[n, 0], frames[n, 1], target, places[n, 0], places[n, 1], scratch
        )


@njit(cache=True, nogil=True)
def _number(source, at):
    """The int32 at a place."""
    number = np.int64(word_at(source, at))
    return number - (1 << 32) if number >= 1 << 31 else number


@njit(cache=True, nogil=True)
def _open_frame(source, begin, end, target, t0, t1, scratch):
    if end - begin < _HEADER:
        return DAMAGED
    flags, width = np.int64(source[begin + 2]), np.int64(source[begin + 3])
    size, block = _number(source, begin + 4), _number(source, begin + 8)
    if size != t1 - t0 or _number(source, begin + 12) != end - begin:
        return DAMAGED
    if source[begin] != _VERSION or flags & (_FUTURE | _BITS):
        return OTHER
    if size == 0:
        return GOOD
    if flags & _COPIED:
        if end - begin != _HEADER + size:
            return DAMAGED
        copy_bytes(source, begin + _HEADER, target, t0, size)
        return GOOD
    if flags >> 5 != _LZ4:
        return OTHER
    if block <= 0 or block > size or width == 0:
        return DAMAGED
    n_blocks = (size + block - 1) // block
    if begin + _HEADER + 4 * n_blocks > end:
        return DAMAGED
    for number in range(n_blocks):
        first = begin + _number(source, begin + _HEADER + 4 * number)
        length = min(block, size - number * block)
        if first < begin + _HEADER or first > end:
            return DAMAGED
        streams = 1
        is_whole = length == block and block // width >= _LEAST_STREAM
        if not flags & _UNSPLIT and width <= _MOST_SPLITS and is_whole:
            streams = width
        place = t0 + number * block
        if flags & _SHUFFLED and width > 1:
            if not _open_block(source, first, end, scratch, 0, length, streams):
                return DAMAGED
            _unshuffle(scratch, target, place, length, width)
        elif not _open_block(source, first, end, target, place, length, streams):
            return DAMAGED
    return GOOD


@njit(cache=True, nogil=True)
def _open_block(source, at, end, target, place, length, streams):
    """Open the streams of a block one after the other; whether they are as long as they must."""
    part = length // streams
    for stream in range(streams):
        if at + 4 > end:
            return False
        size = _number(source, at)
        at += 4
        if size < 0 or at + size > end:
            return False
        to = place + stream * part
        if size == part:
            copy_bytes(source, at, target, to, part)
        elif not _open_lz4(source, at, at + size, target, to, to + part):
            return False
        at += size
    return part * streams == length


@njit(cache=True, nogil=True)
def _unshuffle(scratch, target, place, length, width):
    """Bring the bytes of each value together; what is no whole value stays at the end."""
    n = length // width
    values = target[place : place + length]
    if width == 4:
        # As below, but known when compiled
        one, two, three, four = scratch[:n], scratch[n:], scratch[2 * n :], scratch[3 * n :]
        for i in range(n):
            values[4 * i], values[4 * i + 1] = one[i], two[i]
            values[4 * i + 2], values[4 * i + 3] = three[i], four[i]
    else:
        for byte in range(width):
            for i in range(n):
                values[i * width + byte] = scratch[byte * n + i]
    for i in range(n * width, length):
        target[place + i] = scratch[i]


@njit(cache=True, nogil=True)
def _open_lz4(source, at, end, target, place, stop):
    """Unpack a stream that must fill ``target[place:stop]`` exactly."""
    start = place
    while at < end:
        token = np.int64(source[at])
        at += 1
        n_literals, at = _length(source, at, end, token >> 4)
        if at < 0 or at + n_literals > end or place + n_literals > stop:
            return False
        copy_bytes(source, at, target, place, n_literals)
        at += n_literals
        place += n_literals
        if at == end:
            return place == stop
        if at + 2 > end:
            return False
        back = np.int64(source[at]) | np.int64(source[at + 1]) << 8
        n_repeated, at = _length(source, at + 2, end, token & 15)
        n_repeated += 4
        if at < 0 or back == 0 or back > place - start or place + n_repeated > stop:
            return False
        for i in range(n_repeated):
            target[place + i] = target[place + i - back]
        place += n_repeated
    return False


@njit(cache=True, nogil=True)
def _length(source, at, end, length):
    """A length whose first four bits are given, and the place behind it, or -1 past the end."""
    if length == 15:
        more = np.int64(255)
        while more == 255:
            if at >= end:
                return length, np.int64(-1)
            more = np.int64(source[at])
            length += more
            at += 1
    return length, at
