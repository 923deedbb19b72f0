"""Integrals of a linear function over a triangle: means, mean squares, and shares of its area.

Sums of these are the moments and the distribution of distances. The shares of many triangles are
collected for a sorted row of thresholds at once: a triangle touches only the thresholds between
its least and its largest value, and is counted in full from there on by a step that
`finish_shares` sums up.
"""

import numpy as np
from numba import njit

LOWER, UPPER, LOWER_STEP, UPPER_STEP = 0, 1, 2, 3  # rows of ``below``


@njit(cache=True, nogil=True)
def positive_moments(a, b, c):
    """Means over a triangle of max(f, 0) and of its square, f linear with corner values a, b, c."""
    if a <= 0.0 and b <= 0.0 and c <= 0.0:
        return 0.0, 0.0
    mean = (a + b + c) / 3.0
    square = (a * a + b * b + c * c + a * b + b * c + c * a) / 6.0
    n_positive = (a > 0.0) + (b > 0.0) + (c > 0.0)
    if n_positive == 3 or (a >= 0.0 and b >= 0.0 and c >= 0.0):
        return mean, square
    # One corner x is alone on its side: a small triangle with the values x, 0, 0 is cut off there
    x, y, z = a, b, c
    if (b > 0.0) == (n_positive == 1):
        x, y, z = b, c, a
    elif (c > 0.0) == (n_positive == 1):
        x, y, z = c, a, b
    share = (x / (x - y)) * (x / (x - z))
    if n_positive == 1:
        return share * x / 3.0, share * x * x / 6.0
    return max(mean - share * x / 3.0, 0.0), max(square - share * x * x / 6.0, 0.0)


@njit(cache=True, nogil=True)
def share_below(a, b, c, threshold):
    """Share of a triangle's area where a linear function is at most a threshold."""
    low, high = min(a, b, c), max(a, b, c)
    if threshold < low:
        return 0.0
    if threshold >= high:
        return 1.0
    middle = max(min(a, b), min(max(a, b), c))
    if threshold < middle:
        return ((threshold - low) / (high - low)) * ((threshold - low) / (middle - low))
    return 1.0 - ((high - threshold) / (high - low)) * ((high - threshold) / (high - middle))


@njit(cache=True, nogil=True)
def add_shares(a, b, c, area, thresholds, shift, row, below):
    """Add a triangle to ``below[row]``: its area where f <= threshold + shift, f linear."""
    low, high = min(a, b, c), max(a, b, c)
    begin, end = 0, len(thresholds)
    while begin < end:
        middle = (begin + end) >> 1
        if thresholds[middle] + shift < low:
            begin = middle + 1
        else:
            end = middle
    for k in range(begin, len(thresholds)):
        threshold = thresholds[k] + shift
        if threshold >= high:
            below[row + 2, k] += area
            return
        below[row, k] += area * share_below(a, b, c, threshold)


@njit(cache=True, nogil=True)
def linear_sums(lower, upper, area, begin, end, sums, span):
    """Sums and span of pieces between two linear functions, given at the corners (k, 3).

    ``sums[n]`` = lower and upper end of the integral of d, lower and upper end of that of d²;
    ``span[n]`` holds d.
    """
    for n in range(begin, end):
        m, s = positive_moments(lower[n, 0], lower[n, 1], lower[n, 2])
        sums[n, 0], sums[n, 2] = area[n] * m, area[n] * s
        m, s = positive_moments(upper[n, 0], upper[n, 1], upper[n, 2])
        sums[n, 1], sums[n, 3] = area[n] * m, area[n] * s
        span[n, 0] = max(0.0, min(lower[n, 0], lower[n, 1], lower[n, 2]))
        span[n, 1] = max(upper[n, 0], upper[n, 1], upper[n, 2])


@njit(cache=True, nogil=True)
def linear_shares(lower, upper, area, begin, end, thresholds, slack, below):
    """Add pieces between two linear functions to both rows of shares, moved out by ``slack``."""
    for n in range(begin, end):
        a, b, c = lower[n, 0], lower[n, 1], lower[n, 2]
        add_shares(a, b, c, area[n], thresholds, slack, np.int64(UPPER), below)
        a, b, c = upper[n, 0], upper[n, 1], upper[n, 2]
        add_shares(a, b, c, area[n], thresholds, -slack, np.int64(LOWER), below)


def finish_shares(below: np.ndarray) -> np.ndarray:
    """(2, k) areas certainly and possibly within each threshold, from all that was added."""
    return below[:2] + np.cumsum(below[2:], axis=1)
