"""How texels of every channel are stored, and what they mean.

A texel is one unsigned number. It means four float32 numbers, of which the last is how much of the
texel there is (alpha, or the coverage of a channel). Kinds: SRGB8 colour, sRGB in 8 bits, alpha
linear; red in the lowest bits. LINEAR8 three values of 8 bits and coverage. VALUE8 one value in
[0, 1]. HALF1 one half-precision number. HALF4 linear colour and alpha in half precision. NORMAL
octahedral direction in 2 x 16 bits and coverage in 16 (Meyer et al. 2010,
doi:10.1111/j.1467-8659.2010.01737.x).
"""

import math

import numpy as np
from numba import njit

from ..srgb import linear_from_srgb

SRGB8, LINEAR8, VALUE8, HALF1, HALF4, NORMAL = range(6)

LINEAR = linear_from_srgb(np.arange(256) / 255.0).astype(np.float32)
# Linear values from which on the next code is nearer in sRGB
STEPS = linear_from_srgb((np.arange(255) + 0.5) / 255.0).astype(np.float32)
# The codes at the beginnings of equal parts of [0, 1), none of which holds more than one step
PARTS = np.float32(4096.0)
FIRST_CODE = np.searchsorted(STEPS, np.arange(4096) / 4096.0, side="right").astype(np.uint8)
HALF_SCALE = np.ldexp(np.float32(1.0), np.maximum(np.arange(32), 1) - 25).astype(np.float32)

F0, F1 = np.float32(0.0), np.float32(1.0)
BYTE, WORD = np.float32(1.0 / 255.0), np.float32(1.0 / 65535.0)


@njit(cache=True, nogil=True, inline="always")
def half_value(bits):
    """The number that 16 bits stand for in half precision (infinities and NaN read as large)."""
    exponent = (bits >> 10) & 31
    fraction = bits & 1023
    if exponent > 0:
        fraction += 1024
    value = np.float32(fraction) * HALF_SCALE[exponent]
    return -value if bits & 0x8000 else value


@njit(cache=True, nogil=True)
def half_bits(value):
    """The half-precision number nearest to ``value``, ties to even, at most +-65504."""
    sign = 0x8000 if value < 0.0 else 0
    size = min(abs(np.float64(value)), 65504.0)
    if not size > 0.0:
        return sign
    exponent = max(math.frexp(size)[1] - 1, -14)
    steps = np.int64(np.rint(math.ldexp(size, 10 - exponent)))  # 1024 ... 2048, less if subnormal
    return sign | min(((exponent + 14) << 10) + steps, 0x7BFF)


@njit(cache=True, nogil=True, inline="always")
def decode(kind, texel):
    """The four float32 numbers that a texel means."""
    word = np.int64(texel)
    if kind == SRGB8:
        return (
            LINEAR[word & 255],
            LINEAR[(word >> 8) & 255],
            LINEAR[(word >> 16) & 255],
            np.float32((word >> 24) & 255) * BYTE,
        )
    if kind == LINEAR8:
        return (
            np.float32(word & 255) * BYTE,
            np.float32((word >> 8) & 255) * BYTE,
            np.float32((word >> 16) & 255) * BYTE,
            np.float32((word >> 24) & 255) * BYTE,
        )
    if kind == VALUE8:
        return np.float32(word & 255) * BYTE, F0, F0, F1
    if kind == HALF1:
        return half_value(word & 65535), F0, F0, F1
    if kind == HALF4:
        return (
            half_value(word & 65535),
            half_value((word >> 16) & 65535),
            half_value((word >> 32) & 65535),
            half_value((word >> 48) & 65535),
        )
    x = np.float32(2.0) * WORD * np.float32(word & 65535) - F1
    y = np.float32(2.0) * WORD * np.float32((word >> 16) & 65535) - F1
    z = F1 - abs(x) - abs(y)
    fold = max(-z, F0)
    x += -fold if x >= F0 else fold
    y += -fold if y >= F0 else fold
    scale = F1 / math.sqrt(x * x + y * y + z * z)
    return x * scale, y * scale, z * scale, np.float32((word >> 32) & 65535) * WORD


@njit(cache=True, nogil=True)
def decoded(kind, word):
    """As `decode`, for where a call costs little beside what else is done: it is compiled once,
    not in every place that asks."""
    return decode(kind, word)


@njit(cache=True, nogil=True)
def srgb_code(value):
    """The 8-bit sRGB code nearest to a linear value; NaN gives 0."""
    if not value >= STEPS[0]:
        return 0
    if value >= STEPS[254]:
        return 255
    code = np.int64(FIRST_CODE[np.int64(value * PARTS)])
    while value >= STEPS[code]:
        code += 1
    return code


@njit(cache=True, nogil=True, inline="always")
def unit_code(value, most):
    """``value`` in [0, 1] as the nearest of the numbers 0 ... most; NaN gives 0."""
    code = np.int64(0)
    if value > 0.0:
        code = np.int64(min(value, F1) * most + 0.5)
    return code


@njit(cache=True, nogil=True)
def encode(kind, r, g, b, a):
    """The texel (int64) that means four numbers, each rounded to the nearest there is."""
    if kind == SRGB8:
        low = srgb_code(r) | (srgb_code(g) << 8)
        return low | (srgb_code(b) << 16) | (unit_code(a, 255.0) << 24)
    if kind == LINEAR8:
        low = unit_code(r, 255.0) | (unit_code(g, 255.0) << 8)
        return low | (unit_code(b, 255.0) << 16) | (unit_code(a, 255.0) << 24)
    if kind == VALUE8:
        return unit_code(r, 255.0)
    if kind == HALF1:
        return half_bits(r)
    if kind == HALF4:
        low = half_bits(r) | (half_bits(g) << 16)
        return low | (half_bits(b) << 32) | (half_bits(a) << 48)
    return _encode_normal(r, g, b, a)


@njit(cache=True, nogil=True)
def _encode_normal(nx, ny, nz, coverage):
    total = abs(nx) + abs(ny) + abs(nz)
    x, y = 0.0, 0.0
    if total > 0.0:
        x, y = nx / total, ny / total
        if nz < 0.0:
            x, y = (
                (1.0 - abs(y)) * (1.0 if x >= 0.0 else -1.0),
                (1.0 - abs(x)) * (1.0 if y >= 0.0 else -1.0),
            )
    low = np.int64(32767.5 * (x + 1.0) + 0.5) | (np.int64(32767.5 * (y + 1.0) + 0.5) << 16)
    return low | (unit_code(coverage, 65535.0) << 32)


@njit(cache=True, nogil=True)
def decode_texels(kind, texels, out):
    """``out[n]`` (n, 4) float32 = what ``texels[n]`` means."""
    for n in range(len(texels)):
        out[n, 0], out[n, 1], out[n, 2], out[n, 3] = decode(kind, texels[n])


@njit(cache=True, nogil=True)
def encode_texels(kind, values, texels):
    """``texels[n]`` = the (n, 4) float32 ``values[n]``."""
    for n in range(len(values)):
        texels[n] = encode(kind, values[n, 0], values[n, 1], values[n, 2], values[n, 3])
