"""What the four bytes of a node mean, in each of the pictures that go over the wire.

All are multiplied by how much there is (alpha, or coverage), so that blending them is right. BASE:
colour in linear light, then sRGB in 8 bits, and linear alpha. NORMALS: three numbers from -127 to
127, and coverage in 8 bits. HEIGHTS: half precision, and coverage in 16 bits.
"""

import math

import numpy as np
from numba import njit

from .texel_codes import BYTE, F0, LINEAR, SRGB8, WORD, encode, half_bits, half_value, unit_code

BASE, NORMALS, HEIGHTS = range(3)
PICTURES = ("base", "normal", "height")  # the channels they show
BLANK = (0, 0, 0xFFFF0000)  # nothing was painted; heights are everywhere
MINUS_ZERO = 0x8000
STEP = np.float32(1.0 / 127.0)


@njit(cache=True, nogil=True)
def node_code(picture, r, g, b, a):
    """The four bytes (int64, the first lowest) of numbers that are multiplied by a."""
    if picture == BASE:
        return encode(SRGB8, r, g, b, a)
    if picture == HEIGHTS:
        bits = half_bits(r)
        return (0 if bits == MINUS_ZERO else bits) | (unit_code(a, 65535.0) << 16)
    low = _signed_byte(r) | (_signed_byte(g) << 8) | (_signed_byte(b) << 16)
    return low | (unit_code(a, 255.0) << 24)


@njit(cache=True, nogil=True, inline="always")
def _signed_byte(value):
    """A number in [-1, 1] as the nearest of -127 ... 127, in 8 bits."""
    return math.floor(min(max(value, -1.0), 1.0) * 127.0 + 0.5) & 255


@njit(cache=True, nogil=True)
def node_numbers(picture, word):
    """The four float32 numbers that bytes stand for, still multiplied by the last."""
    if picture == BASE:
        r, g, b = LINEAR[word & 255], LINEAR[(word >> 8) & 255], LINEAR[(word >> 16) & 255]
        return r, g, b, np.float32(word >> 24) * BYTE
    if picture == HEIGHTS:
        return half_value(word & 65535), F0, F0, np.float32(word >> 16) * WORD
    r, g, b = _from_byte(word & 255), _from_byte((word >> 8) & 255), _from_byte((word >> 16) & 255)
    return r, g, b, np.float32(word >> 24) * BYTE


@njit(cache=True, nogil=True, inline="always")
def _from_byte(byte):
    """The number in [-1, 1] that 8 bits stand for."""
    return np.float32(byte - 256 if byte > 127 else byte) * STEP
