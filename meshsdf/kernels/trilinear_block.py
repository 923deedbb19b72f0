"""The trilinear interpolant on a small block of nodes, and over boxes of any size within it.

A block (s, s, s) holds node values; node (i, j, k) lies at coordinates (i, j, k), cell (i, j, k)
between it and (i + 1, j + 1, k + 1). Corners of a box are numbered 4 x + 2 y + z.

In every variable alone the interpolant F of a cell has degree one. So has, therefore, what is
F minus a linear function, and so is every derivative of F along a fixed direction: over a box
within the cell each of them is a mean of its values at the eight corners, and its extremes are
among them (the Bernstein form of degree one; Lin and Rokne 1995, doi:10.1016/0167-8396(94)00023-K).
A box that overlaps several cells is cut by their faces first.
"""

import numpy as np
from numba import njit

ROUNDING = 256 * 2.0**-53
"""Times the largest |value| of a block: more than the rounding of any number formed here from it.

Three products per weight, eight terms, coordinates up to 8: under 100 roundings.
"""

MOST_STEPS = 40  # of Gilbert's algorithm, which gets nearer like one over their number
NEARLY = 0.998  # of the largest slope is enough


@njit(cache=True, nogil=True)
def value_in_cell(block, i, j, k, u, v, w):
    """F at fractions (u, v, w) of cell (i, j, k)."""
    a = (1.0 - w) * block[i, j, k] + w * block[i, j, k + 1]
    b = (1.0 - w) * block[i, j + 1, k] + w * block[i, j + 1, k + 1]
    c = (1.0 - w) * block[i + 1, j, k] + w * block[i + 1, j, k + 1]
    d = (1.0 - w) * block[i + 1, j + 1, k] + w * block[i + 1, j + 1, k + 1]
    return (1.0 - u) * ((1.0 - v) * a + v * b) + u * ((1.0 - v) * c + v * d)


@njit(cache=True, nogil=True)
def gradient_in_cell(block, i, j, k, u, v, w):
    """The gradient of F, per voxel, at fractions (u, v, w) of cell (i, j, k)."""
    f0, f1 = block[i, j, k], block[i, j, k + 1]
    f2, f3 = block[i, j + 1, k], block[i, j + 1, k + 1]
    f4, f5 = block[i + 1, j, k], block[i + 1, j, k + 1]
    f6, f7 = block[i + 1, j + 1, k], block[i + 1, j + 1, k + 1]
    gx = (1.0 - v) * ((1.0 - w) * (f4 - f0) + w * (f5 - f1)) + v * (
        (1.0 - w) * (f6 - f2) + w * (f7 - f3)
    )
    gy = (1.0 - u) * ((1.0 - w) * (f2 - f0) + w * (f3 - f1)) + u * (
        (1.0 - w) * (f6 - f4) + w * (f7 - f5)
    )
    gz = (1.0 - u) * ((1.0 - v) * (f1 - f0) + v * (f3 - f2)) + u * (
        (1.0 - v) * (f5 - f4) + v * (f7 - f6)
    )
    return gx, gy, gz


@njit(cache=True, nogil=True)
def largest_value(block):
    """The largest finite |value|."""
    largest = 0.0
    for i in range(block.shape[0]):
        for j in range(block.shape[1]):
            for k in range(block.shape[2]):
                size = abs(block[i, j, k])
                if largest < size < np.inf:
                    largest = size
    return largest


@njit(cache=True, nogil=True)
def corner_values(block, first, low, high, f):
    """``f[c]`` = F at the corners of a box in cell (first, first, first).

    ``low`` and ``high`` (3,) are its lowest and highest corner, as fractions of the cell.
    """
    for c in range(8):
        u = high[0] if c >> 2 else low[0]
        v = high[1] if (c >> 1) & 1 else low[1]
        w = high[2] if c & 1 else low[2]
        f[c] = value_in_cell(block, first, first, first, u, v, w)


@njit(cache=True, nogil=True)
def mean_gradient(f, low, high):
    """Mean gradient over a box, and its norm, from the values at its corners."""
    gx = 0.25 / (high[0] - low[0]) * (f[4] + f[5] + f[6] + f[7] - f[0] - f[1] - f[2] - f[3])
    gy = 0.25 / (high[1] - low[1]) * (f[2] + f[3] + f[6] + f[7] - f[0] - f[1] - f[4] - f[5])
    gz = 0.25 / (high[2] - low[2]) * (f[1] + f[3] + f[5] + f[7] - f[0] - f[2] - f[4] - f[6])
    return gx, gy, gz, np.sqrt(gx * gx + gy * gy + gz * gz)


@njit(cache=True, nogil=True)
def set_ticks(ticks, lower, upper):
    """Write ``lower``, the whole numbers strictly between, and ``upper``; return how many."""
    ticks[0] = lower
    n = 1
    mark = np.floor(lower) + 1.0
    while mark < upper:
        ticks[n] = mark
        n += 1
        mark += 1.0
    ticks[n] = upper
    return n + 1


@njit(cache=True, nogil=True)
def linear_range(block, ticks, n_ticks, gx, gy, gz):
    """Least and largest value of F - g.x over the box with these ticks (3, ...) along its axes.

    Infinite where a node that counts has no value.
    """
    low, high = np.inf, -np.inf
    last = block.shape[0] - 2
    for a in range(n_ticks[0]):
        x = ticks[0, a]
        i = min(int(x), last)
        for b in range(n_ticks[1]):
            y = ticks[1, b]
            j = min(int(y), last)
            for c in range(n_ticks[2]):
                z = ticks[2, c]
                k = min(int(z), last)
                rest = value_in_cell(block, i, j, k, x - i, y - j, z - k)
                rest -= gx * x + gy * y + gz * z
                if not abs(rest) < np.inf:
                    return -np.inf, np.inf
                low, high = min(low, rest), max(high, rest)
    return low, high


@njit(cache=True, nogil=True)
def list_gradients(block, lower, upper, gradients):
    """Write the gradients of F, per voxel, whose means are all there are in a box; return how many.

    The box may overlap several cells; gradients at the corners of each part of it, up to
    ``8 * 27`` for three cells along every axis. -1 where a node that counts has no value.
    """
    n = 0
    for i in range(int(lower[0]), int(np.ceil(upper[0]))):
        for j in range(int(lower[1]), int(np.ceil(upper[1]))):
            for k in range(int(lower[2]), int(np.ceil(upper[2]))):
                for c in range(8):
                    # The corners of what the box and the cell have in common
                    u = min(upper[0], i + 1.0) if c >> 2 else max(lower[0], i)
                    v = min(upper[1], j + 1.0) if (c >> 1) & 1 else max(lower[1], j)
                    w = min(upper[2], k + 1.0) if c & 1 else max(lower[2], k)
                    gx, gy, gz = gradient_in_cell(block, i, j, k, u - i, v - j, w - k)
                    if not abs(gx) + abs(gy) + abs(gz) < np.inf:
                        return -1
                    gradients[n, 0], gradients[n, 1], gradients[n, 2] = gx, gy, gz
                    n += 1
    return n


@njit(cache=True, nogil=True)
def common_slope(gradients, n, direction):
    """Write the unit vector along which the least of n slopes is largest; return that slope.

    It points to the point of the vectors' convex hull nearest to the origin, found by Gilbert's
    algorithm (1966, doi:10.1137/0304007). Whatever the vector, the slope returned is the least of
    all along it; 0 if none was found to be positive.
    """
    x, y, z = 0.0, 0.0, 0.0
    for c in range(n):
        x, y, z = x + gradients[c, 0] / n, y + gradients[c, 1] / n, z + gradients[c, 2] / n
    best = 0.0
    for _ in range(MOST_STEPS):
        square = x * x + y * y + z * z
        if not square > 0.0:
            break
        least, at = np.inf, 0
        for c in range(n):
            slope = gradients[c, 0] * x + gradients[c, 1] * y + gradients[c, 2] * z
            if slope < least:
                least, at = slope, c
        norm = np.sqrt(square)
        if least / norm > best:
            best = least / norm
            direction[0], direction[1], direction[2] = x / norm, y / norm, z / norm
        if best > NEARLY * norm:
            break
        # Nearest point to the origin on the way to the vector that stands farthest back
        dx, dy, dz = gradients[at, 0] - x, gradients[at, 1] - y, gradients[at, 2] - z
        way = dx * dx + dy * dy + dz * dz
        share = min(max((square - least) / way, 0.0), 1.0) if way > 0.0 else 0.0
        x, y, z = x + share * dx, y + share * dy, z + share * dz
    return best
