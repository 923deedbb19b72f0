"""How far the zeros of the trilinear interpolant F move when its samples change by up to delta.

Interpolation takes means, so the changed interpolant F' is within delta of F everywhere. Let x be
a zero of either: |F(x)| <= delta. Where F grows by at least m per voxel along a direction d, all
the way from x - s d to x + s d with s = delta / m, F reaches -delta on one end and +delta on the
other: both F and F' change sign between, so each has a zero within s of x. The box of all such x
is enlarged by s, and d chosen so that the least slope among the gradients in it is largest.
"""

import numpy as np
from numba import njit

from .trilinear_block import (
    ROUNDING,
    common_slope,
    corner_values,
    largest_value,
    list_gradients,
)

EMPTY, BOUNDED, OPEN = 0, 1, 2
"""States of a box: |F| > delta in all of it; the shift is bounded; it is not."""

LARGEST_SHIFT = 1.0  # voxels: a block ends one voxel beyond its middle cell
LEAST = 1e-13  # voxels added to a shift, so that signs beyond it are strict
ATTEMPTS = 4


@njit(cache=True, nogil=True)
def bound_shifts(blocks, cells, lows, size, delta, begin, end, state, shift):
    """``shift[n]``, in voxels, bounds how far zeros in box n move, where it is BOUNDED.

    Box n has the side ``size`` and the lowest corner ``size * lows[n]`` in the middle cell of
    ``blocks[cells[n]]`` (4, 4, 4). Nodes without data may be beyond that cell: directions are
    then such that they are not needed.
    """
    f, low, high, direction = np.empty(8), np.empty(3), np.empty(3), np.empty(3)
    lower, upper, gradients = np.empty(3), np.empty(3), np.empty((216, 3))
    is_known = np.empty(3, np.bool_)
    for n in range(begin, end):
        block = blocks[cells[n]]
        for axis in range(3):
            low[axis] = size * lows[n, axis]
            high[axis] = low[axis] + size
        corner_values(block, 1, low, high, f)
        noise = ROUNDING * largest_value(block)
        if f.min() > delta + noise or f.max() < -delta - noise:
            state[n] = EMPTY
            continue
        state[n] = OPEN
        for axis in range(3):
            is_known[axis] = _is_known(block, axis)
        way = 0.0
        for _ in range(ATTEMPTS):
            for axis in range(3):
                more = way if is_known[axis] else 0.0
                lower[axis] = max(1.0 + low[axis] - more, 0.0)
                upper[axis] = min(1.0 + high[axis] + more, 3.0)
            count = list_gradients(block, lower, upper, gradients)
            for axis in range(3):
                if not is_known[axis]:
                    gradients[:, axis] = 0.0
            slope = common_slope(gradients, count, direction) - noise if count > 0 else 0.0
            if not slope > 0.0:
                break
            need = delta / slope * (1.0 + 1e-9) + LEAST
            if need <= way:
                state[n], shift[n] = BOUNDED, need
                break
            way = 1.25 * need
            if not way <= LARGEST_SHIFT:
                break


@njit(cache=True, nogil=True)
def _is_known(block, axis):
    """Whether there are values one voxel before the middle cell, and one beyond, along an axis."""
    for side in range(2):
        at = 3 * side
        for p in range(1, 3):
            for q in range(1, 3):
                i = at if axis == 0 else p
                j = at if axis == 1 else (p if axis == 0 else q)
                k = at if axis == 2 else q
                if not abs(block[i, j, k]) < np.inf:
                    return False
    return True
