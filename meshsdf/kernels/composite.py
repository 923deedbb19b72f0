"""Laying layers of a texture over one another, texel by texel."""

from numba import njit

from .blending import composite
from .texel_codes import F1


@njit(cache=True, nogil=True)
def lay_over(mode, values, masks, opacity, below):
    """``below`` (n, 4) = ``values`` over it, alpha (or coverage) times opacity times mask.

    ``masks`` holds a row per texel, or one for all.
    """
    many = len(masks) > 1
    for n in range(len(values)):
        coverage = values[n, 3] * (opacity * masks[n if many else 0, 0])
        under = below[n, 0], below[n, 1], below[n, 2], below[n, 3]
        over = values[n, 0], values[n, 1], values[n, 2]
        below[n, 0], below[n, 1], below[n, 2], below[n, 3] = composite(mode, under, over, coverage)


@njit(cache=True, nogil=True)
def add_up(values, masks, opacity, below):
    """Add the first of ``values`` (n, 4), times opacity times mask, to the first of ``below``."""
    many = len(masks) > 1
    for n in range(len(values)):
        below[n, 0] += values[n, 0] * (opacity * masks[n if many else 0, 0])
        below[n, 3] = F1
