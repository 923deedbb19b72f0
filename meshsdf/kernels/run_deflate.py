"""Deflate for words that are noise or repeat the one before: runs and literals, no search.

Words are 4 bytes. One that equals the word before is part of a match at distance 4, of up to 64
words; any other is four literals. (Deutsch 1996, doi:10.17487/RFC1951.)
"""

import numpy as np
from numba import njit

LONGEST = 64
"""Words in a match, 256 bytes of the 258 that the format allows."""


@njit(cache=True, nogil=True)
def count_symbols(words, literals, matches):
    """Add up how often each byte is a literal, and each number of words a match."""
    at, n = 0, len(words)
    while at < n:
        run = 0
        if at > 0:
            before = words[at - 1]
            while run < LONGEST and at + run < n and words[at + run] == before:
                run += 1
        if run:
            matches[run] += 1
            at += run
        else:
            word = words[at]
            for shift in range(0, 32, 8):
                literals[(word >> np.uint32(shift)) & np.uint32(255)] += 1
            at += 1


@njit(cache=True, nogil=True)
def deflate_runs(words, codes, lengths, match_codes, match_lengths, held, n_held, out):
    """Write the symbols of the words and the end of the block; return how many bytes.

    ``codes`` are bits as they go into the stream, first bit lowest, of literals 0 to 255 and the
    end, 256; ``held`` are ``n_held`` < 8 bits that stand before. 8 bytes of ``out`` for each word,
    and 8 more, are enough.
    """
    bits, n_bits = np.uint64(held), np.uint64(n_held)
    full, byte = np.uint64(32), np.uint64(255)
    size, at, n = 0, 0, len(words)
    while at < n:
        run = 0
        if at > 0:
            before = words[at - 1]
            while run < LONGEST and at + run < n and words[at + run] == before:
                run += 1
        if run:
            bits |= match_codes[run] << n_bits
            n_bits += match_lengths[run]
            at += run
        else:
            word = words[at]
            for shift in range(0, 32, 16):
                # Two literals are at most 30 bits
                low = (word >> np.uint32(shift)) & np.uint32(255)
                high = (word >> np.uint32(shift + 8)) & np.uint32(255)
                bits |= codes[low] << n_bits
                n_bits += lengths[low]
                bits |= codes[high] << n_bits
                n_bits += lengths[high]
                if shift == 0 and n_bits >= full:
                    for _ in range(4):
                        out[size] = bits & byte
                        bits >>= np.uint64(8)
                        size += 1
                    n_bits -= full
            at += 1
        if n_bits >= full:
            for _ in range(4):
                out[size] = bits & byte
                bits >>= np.uint64(8)
                size += 1
            n_bits -= full
    bits |= codes[256] << n_bits
    n_bits += lengths[256]
    while n_bits > 0:
        out[size] = bits & byte
        bits >>= np.uint64(8)
        size += 1
        n_bits -= min(n_bits, np.uint64(8))
    return size
