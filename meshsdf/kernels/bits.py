"""Words of 64 bits as sets of small numbers."""

import numpy as np
from numba import njit

ONE = np.uint64(1)


@njit(cache=True, nogil=True)
def count_bits(word):
    """How many bits of a word are set, by halving; the compiler turns it into one instruction."""
    word = word - ((word >> ONE) & np.uint64(0x5555555555555555))
    word = (word & np.uint64(0x3333333333333333)) + (
        (word >> np.uint64(2)) & np.uint64(0x3333333333333333)
    )
    word = (word + (word >> np.uint64(4))) & np.uint64(0x0F0F0F0F0F0F0F0F)
    return np.int64((word * np.uint64(0x0101010101010101)) >> np.uint64(56))


@njit(cache=True, nogil=True)
def lowest_bit(word):
    """Position of the lowest set bit of a word that is not zero."""
    return count_bits((word & (~word + ONE)) - ONE)
