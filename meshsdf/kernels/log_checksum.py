"""The running checksum of SQLite's write-ahead log (its file format, section 4.2)."""

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def log_checksum(words, sums):
    """Carry ``sums`` (2,) uint64 on over an even number of (n,) uint32 words."""
    low = np.uint64(0xFFFFFFFF)
    a, b = sums[0], sums[1]
    for i in range(0, len(words), 2):
        a = (a + words[i] + b) & low
        b = (b + words[i + 1] + a) & low
    sums[0], sums[1] = a, b
