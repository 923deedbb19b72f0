"""Copy bytes, and read and write little-endian numbers among them.

Written so that the compiler sees single loads and copies: an index that could be below 0 would be
looked at byte by byte.
"""

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def copy_bytes(source, begin, target, to, n):
    """Copy ``source[begin:begin + n]`` to ``target[to:to + n]``; where that ends."""
    a, b = source[begin : begin + n], target[to : to + n]
    for i in range(min(len(a), len(b))):
        b[i] = a[i]
    return to + n


@njit(cache=True, nogil=True)
def word_at(source, at):
    """The four bytes at a place, the first lowest, as uint32."""
    i = np.uint64(at)
    low = np.uint32(source[i]) | np.uint32(source[i + np.uint64(1)]) << np.uint32(8)
    high = np.uint32(source[i + np.uint64(2)]) | np.uint32(source[i + np.uint64(3)]) << np.uint32(8)
    return np.uint32(low | high << np.uint32(16))


@njit(cache=True, nogil=True)
def bits_at(source, at):
    """The eight bytes at a place, the first lowest, as uint64."""
    return np.uint64(word_at(source, at)) | np.uint64(word_at(source, at + 4)) << np.uint64(32)


@njit(cache=True, nogil=True)
def put_number(out, at, number, n_bytes):
    """Write the lowest bytes of an int64."""
    for i in range(n_bytes):
        out[at + i] = (number >> (8 * i)) & 255
