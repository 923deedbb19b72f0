"""How small the gradient of the trilinear interpolant F is where F is zero, box by box.

Over a box the gradient is a mean of the gradients at the eight corners, so its norm is at least
the distance of the origin from their convex hull. From above: on an edge of the box, F
and its gradient are linear, so a zero between two signs is known with its gradient.
"""

import numpy as np
from numba import njit

from .trilinear_block import (
    ROUNDING,
    common_slope,
    corner_values,
    gradient_in_cell,
    largest_value,
)

OVERLAP = 1 / 16
"""Of boxes, in parts of their size: zeros that lie in a common face of two are within both."""


@njit(cache=True, nogil=True)
def bound_gradients(blocks, cells, lows, size, begin, end, lower, upper, points):
    """``lower[n] <= |gradient|``, per voxel, at all zeros in box n; ``upper[n]`` at one of them.

    Box n has the side ``size`` and the lowest corner ``size * lows[n]`` in cell
    ``blocks[cells[n]]`` (2, 2, 2); it is made a little larger, within the cell. ``points[n]`` is
    that zero, as fractions of the cell. Both are infinite where F has no zero; ``upper`` where
    none is certain.
    """
    f, low, high, g = np.empty(8), np.empty(3), np.empty(3), np.empty((8, 3))
    direction = np.empty(3)
    for n in range(begin, end):
        block = blocks[cells[n]]
        lower[n], upper[n] = np.inf, np.inf
        for axis in range(3):
            low[axis] = max(size * (lows[n, axis] - OVERLAP), 0.0)
            high[axis] = min(size * (lows[n, axis] + 1 + OVERLAP), 1.0)
        corner_values(block, 0, low, high, f)
        noise = ROUNDING * largest_value(block)
        if f.min() > noise or f.max() < -noise:
            continue
        for c in range(8):
            u = high[0] if c >> 2 else low[0]
            v = high[1] if (c >> 1) & 1 else low[1]
            w = high[2] if c & 1 else low[2]
            g[c, 0], g[c, 1], g[c, 2] = gradient_in_cell(block, 0, 0, 0, u, v, w)
        # From below: the least slope along one direction
        lower[n] = max(common_slope(g, 8, direction) - noise, 0.0)
        # From above: zeros on edges, and at nodes that hold exactly zero
        for a in range(8):
            if size == 1.0 and f[a] == 0.0:
                _note(g[a, 0], g[a, 1], g[a, 2], noise, n, upper, low, high, a, a, 0.0, points)
            for axis in range(3):
                b = a | (4 >> axis)
                if b == a or abs(f[a]) <= noise or abs(f[b]) <= noise or f[a] * f[b] > 0.0:
                    continue
                share = f[a] / (f[a] - f[b])
                gx = g[a, 0] + share * (g[b, 0] - g[a, 0])
                gy = g[a, 1] + share * (g[b, 1] - g[a, 1])
                gz = g[a, 2] + share * (g[b, 2] - g[a, 2])
                # The true zero is elsewhere by the rounding of f
                change = np.sqrt(
                    (g[b, 0] - g[a, 0]) ** 2 + (g[b, 1] - g[a, 1]) ** 2 + (g[b, 2] - g[a, 2]) ** 2
                )
                slack = noise + 4.0 * noise / (abs(f[a]) + abs(f[b])) * change
                _note(gx, gy, gz, slack, n, upper, low, high, a, b, share, points)


@njit(cache=True, nogil=True)
def _note(gx, gy, gz, slack, n, upper, low, high, a, b, share, points):
    """Keep a zero between corners a and b if its gradient is the least so far."""
    norm = np.sqrt(gx * gx + gy * gy + gz * gz) + slack
    if norm < upper[n]:
        upper[n] = norm
        for axis in range(3):
            at_a, at_b = (a >> (2 - axis)) & 1, (b >> (2 - axis)) & 1
            part = at_a + share * (at_b - at_a)
            points[n, axis] = low[axis] + part * (high[axis] - low[axis])
