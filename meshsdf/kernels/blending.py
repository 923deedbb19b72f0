"""How a colour lies on another: the blend modes of layers and brushes.

The formulas are those of Compositing and Blending Level 1 (World Wide Web Consortium, 2015,
https://www.w3.org/TR/compositing-1/), in linear light; add, subtract and divide are the arithmetic
that their names say. Letters as there: b is what lies below, s what is laid on it. Colours beyond
1, which half precision can hold, pass unclipped through the modes that are defined for them.
"""

import math

import numpy as np
from numba import njit

from .texel_codes import F0, F1

MODES = (
    "normal", "multiply", "screen", "overlay", "darken", "lighten", "color-dodge", "color-burn",
    "hard-light", "soft-light", "difference", "exclusion", "add", "subtract", "divide", "hue",
    "saturation", "color", "luminosity",
)  # fmt: skip
(
    NORMAL, MULTIPLY, SCREEN, OVERLAY, DARKEN, LIGHTEN, COLOR_DODGE, COLOR_BURN, HARD_LIGHT,
    SOFT_LIGHT, DIFFERENCE, EXCLUSION, ADD, SUBTRACT, DIVIDE, HUE, SATURATION, COLOR, LUMINOSITY,
) = range(len(MODES))  # fmt: skip

HALF, QUARTER, TWO = np.float32(0.5), np.float32(0.25), np.float32(2.0)
FOUR, TWELVE, SIXTEEN = np.float32(4.0), np.float32(12.0), np.float32(16.0)
# The weights of red, green and blue in the luminosity of that document
RED, GREEN, BLUE = np.float32(0.3), np.float32(0.59), np.float32(0.11)


@njit(cache=True, nogil=True, inline="always")
def composite(mode, below, above, coverage):
    """r, g, b, a (float32) of ``above`` (r, g, b) over ``below`` (r, g, b, a), alpha straight.

    ``coverage`` is the alpha of what is above, times how much of it there is.
    """
    ab = below[3]
    if coverage <= F0:
        return below
    if mode == NORMAL and (coverage >= F1 or ab <= F0):
        return above[0], above[1], above[2], max(coverage, ab)
    mixed = above
    if mode != NORMAL and ab > F0:
        blended = blend_rgb(mode, (below[0], below[1], below[2]), above)
        mixed = (
            above[0] + ab * (blended[0] - above[0]),
            above[1] + ab * (blended[1] - above[1]),
            above[2] + ab * (blended[2] - above[2]),
        )
    if ab == F1:
        return (
            below[0] + coverage * (mixed[0] - below[0]),
            below[1] + coverage * (mixed[1] - below[1]),
            below[2] + coverage * (mixed[2] - below[2]),
            F1,
        )
    alpha = coverage + ab * (F1 - coverage)
    share = coverage / alpha
    return (
        below[0] + share * (mixed[0] - below[0]),
        below[1] + share * (mixed[1] - below[1]),
        below[2] + share * (mixed[2] - below[2]),
        alpha,
    )


@njit(cache=True, nogil=True)
def blend_rgb(mode, below, above):
    """The blend B(b, s) of two opaque colours (r, g, b), float32."""
    if mode == NORMAL:
        return above
    if mode >= HUE:
        return _inseparable(mode, below, above)
    return (
        _separable(mode, below[0], above[0]),
        _separable(mode, below[1], above[1]),
        _separable(mode, below[2], above[2]),
    )


@njit(cache=True, nogil=True)
def _separable(mode, b, s):
    """One component of the modes that take each by itself."""
    if mode == MULTIPLY:
        return b * s
    if mode == SCREEN:
        return b + s - b * s
    if mode == OVERLAY:
        return _hard_light(s, b)
    if mode == DARKEN:
        return min(b, s)
    if mode == LIGHTEN:
        return max(b, s)
    if mode == COLOR_DODGE:
        if b <= F0:
            return F0
        return F1 if s >= F1 else min(F1, b / (F1 - s))
    if mode == COLOR_BURN:
        if b >= F1:
            return F1
        return F0 if s <= F0 else F1 - min(F1, (F1 - b) / s)
    if mode == HARD_LIGHT:
        return _hard_light(b, s)
    if mode == SOFT_LIGHT:
        return _soft_light(b, s)
    if mode == DIFFERENCE:
        return abs(b - s)
    if mode == EXCLUSION:
        return b + s - TWO * b * s
    if mode == ADD:
        return b + s
    if mode == SUBTRACT:
        return max(b - s, F0)
    # Divide: towards black it is white, or what it was if that is brighter
    most = max(F1, b)
    if b <= F0:
        return F0
    return min(b / s, most) if s > F0 else most


@njit(cache=True, nogil=True)
def _hard_light(b, s):
    if s <= HALF:
        return b * (TWO * s)
    t = TWO * s - F1
    return b + t - b * t


@njit(cache=True, nogil=True)
def _soft_light(b, s):
    if s <= HALF:
        return b - (F1 - TWO * s) * b * (F1 - b)
    d = ((SIXTEEN * b - TWELVE) * b + FOUR) * b if b <= QUARTER else np.float32(math.sqrt(b))
    return b + (TWO * s - F1) * (d - b)


@njit(cache=True, nogil=True)
def _inseparable(mode, b, s):
    """The modes that mix one colour's hue, saturation and luminosity with the other's."""
    if mode == HUE:
        return _with_luminosity(_with_saturation(s, _saturation(b)), _luminosity(b))
    if mode == SATURATION:
        return _with_luminosity(_with_saturation(b, _saturation(s)), _luminosity(b))
    if mode == COLOR:
        return _with_luminosity(s, _luminosity(b))
    return _with_luminosity(b, _luminosity(s))


@njit(cache=True, nogil=True)
def _luminosity(c):
    return RED * c[0] + GREEN * c[1] + BLUE * c[2]


@njit(cache=True, nogil=True)
def _saturation(c):
    return max(c[0], c[1], c[2]) - min(c[0], c[1], c[2])


@njit(cache=True, nogil=True)
def _with_luminosity(c, wanted):
    """A colour moved along the grey axis, and towards it as far as it would leave [0, 1]."""
    shift = wanted - _luminosity(c)
    r, g, b = c[0] + shift, c[1] + shift, c[2] + shift
    grey = _luminosity((r, g, b))
    least, most = min(r, g, b), max(r, g, b)
    if least < F0:
        scale = grey / (grey - least)
        r, g, b = grey + (r - grey) * scale, grey + (g - grey) * scale, grey + (b - grey) * scale
    if most > F1:
        scale = (F1 - grey) / (most - grey) if grey < F1 else F0
        r, g, b = grey + (r - grey) * scale, grey + (g - grey) * scale, grey + (b - grey) * scale
    return r, g, b


@njit(cache=True, nogil=True)
def _with_saturation(c, wanted):
    """A colour of the same hue whose largest component is ``wanted`` and smallest 0."""
    least, spread = min(c[0], c[1], c[2]), _saturation(c)
    if spread <= F0:
        return F0, F0, F0
    scale = wanted / spread
    return (c[0] - least) * scale, (c[1] - least) * scale, (c[2] - least) * scale


@njit(cache=True, nogil=True)
def blend_colors(mode, below, above, out):
    """``out[n]`` = ``above[n]`` (n, 4) float32 over ``below[n]``, alpha straight."""
    for n in range(len(below)):
        under = below[n, 0], below[n, 1], below[n, 2], below[n, 3]
        over = above[n, 0], above[n, 1], above[n, 2]
        out[n, 0], out[n, 1], out[n, 2], out[n, 3] = composite(mode, under, over, above[n, 3])
