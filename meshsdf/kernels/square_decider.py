"""Which corners of an alternating square hang together: decided exactly, in floating point.

Corners a, b, c, d go around the square; a and c are on one side of the level, b and d on the
other. Where ``(a - L)(c - L)`` exceeds ``(b - L)(d - L)``, the saddle of the bilinear interpolant
has the sign of a and c (Nielson and Hamann 1991, doi:10.1109/VISUAL.1991.175782). The mean of the
corners asks for the sign of ``(a - L) + (b - L) + (c - L) + (d - L)``.

Both are first evaluated as they stand, with a bound on the rounding error; if that leaves the sign
open, without any error, as sums of floats that do not overlap (Shewchuk 1997,
doi:10.1007/PL00009321). Numbers so large or small that products would lose bits are left to the
caller, as UNDECIDED.
"""

import numpy as np
from numba import njit

APART, JOINED, UNDECIDED = 0, 1, 2

BILINEAR, MEAN, DIAGONAL, ANTIDIAGONAL = 0, 1, 2, 3

# A product of two rounded differences, rounded, is off by less than 4 u of itself (u = 2**-53), a
# sum of four rounded differences by less than 5 u of the sum of their sizes; rounded up.
ERROR = 8 * 2.0**-53
SMALLEST, LARGEST = 1e-280, 1e280  # between these the relative bound holds for the products
# Numbers in this range, their differences (which are multiples of 2**-252) and products of four
# parts of them lose no bit to underflow or overflow.
SAFE_LOW, SAFE_HIGH = 2.0**-200, 2.0**200
SPLITTER = 2.0**27 + 1  # halves the 53 bits of a float64 (Dekker 1971, doi:10.1007/BF01397083)


@njit(cache=True, nogil=True)
def _two_sum(a, b):
    """The sum and its rounding error."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


@njit(cache=True, nogil=True)
def _two_product(a, b):
    """The product and its rounding error."""
    product = a * b
    big = SPLITTER * a
    a_high = big - (big - a)
    big = SPLITTER * b
    b_high = big - (big - b)
    a_low, b_low = a - a_high, b - b_high
    rest = ((product - a_high * b_high) - a_low * b_high) - a_high * b_low
    return product, a_low * b_low - rest


@njit(cache=True, nogil=True)
def _add(terms, n, value):
    """Add a float to the exact sum ``terms[:n]``; return the new n."""
    for t in range(n):
        value, terms[t] = _two_sum(value, terms[t])
    terms[n] = value
    return n + 1


@njit(cache=True, nogil=True)
def _sign(terms, n):
    """The sign of the exact sum: that of its last term that is not zero."""
    for t in range(n - 1, -1, -1):
        if terms[t] != 0.0:
            return 1 if terms[t] > 0.0 else -1
    return 0


@njit(cache=True, nogil=True)
def _sign_of_mean(a, b, c, d, level, terms):
    """Sign of the mean of the corners less the level; 2 where it is left open."""
    parts = (a - level, b - level, c - level, d - level)
    total = (parts[0] + parts[1]) + (parts[2] + parts[3])
    size = (abs(parts[0]) + abs(parts[1])) + (abs(parts[2]) + abs(parts[3]))
    if not size < LARGEST:
        return 2
    if abs(total) > ERROR * size:
        return 1 if total > 0.0 else -1
    n = 0
    for value in (a, b, c, d):
        n = _add(terms, n, value)
        n = _add(terms, n, -level)
    return _sign(terms, n)


@njit(cache=True, nogil=True)
def _sign_of_saddle(a, b, c, d, level, terms):
    """Sign of (a - level)(c - level) - (b - level)(d - level); 2 where it is left open."""
    left = (a - level) * (c - level)
    right = (b - level) * (d - level)
    size = abs(left) + abs(right)
    if SMALLEST < size < LARGEST and abs(left - right) > ERROR * size:
        return 1 if left > right else -1
    for value in (a, b, c, d, level):
        if value != 0.0 and not SAFE_LOW <= abs(value) <= SAFE_HIGH:
            return 2
    n = 0
    for p, q, sign in ((a, c, 1.0), (b, d, -1.0)):
        p_high, p_low = _two_sum(p, -level)
        q_high, q_low = _two_sum(q, -level)
        for x in (p_high, p_low):
            for y in (q_high, q_low):
                high, low = _two_product(sign * x, y)
                n = _add(terms, n, low)
                n = _add(terms, n, high)
    return _sign(terms, n)


@njit(cache=True, nogil=True)
def decide(a, b, c, d, level, rule, a_is_inside, terms):
    """JOINED where the two inside corners of the square hang together, APART where not.

    A tie leaves them apart: a point at the level is outside. ``terms`` is (16,) scratch.
    """
    if rule in (DIAGONAL, ANTIDIAGONAL):
        return JOINED if a_is_inside == (rule == DIAGONAL) else APART
    if rule == MEAN:
        sign = _sign_of_mean(a, b, c, d, level, terms)
        return UNDECIDED if sign == 2 else (JOINED if sign < 0 else APART)
    sign = _sign_of_saddle(a, b, c, d, level, terms)
    if sign == 2:
        return UNDECIDED
    # A positive sign means the saddle is on the side of a and c
    if sign == 0:
        return APART
    return JOINED if (sign > 0) == a_is_inside else APART


@njit(cache=True, nogil=True)
def classify_squares(values, sides, level, rule, cases):
    """Fill ``cases`` (r - 1, n - 1) uint8 for the squares between r rows of n nodes.

    ``sides`` (r, n) uint8: 0 outside, 1 inside, 2 no data. Bits 0 to 3 of a case: a = (i, j),
    b = (i + 1, j), c = (i + 1, j + 1), d = (i, j + 1) is inside; 0 without data. Bits 4 and 5: what
    `decide` says of the two alternating cases. Returns how many squares are UNDECIDED.
    """
    terms = np.empty(16)
    n_open = 0
    for i in range(cases.shape[0]):
        for j in range(cases.shape[1]):
            a, b = sides[i, j], sides[i + 1, j]
            c, d = sides[i + 1, j + 1], sides[i, j + 1]
            if (a | b | c | d) > 1:
                cases[i, j] = 0
                continue
            case = a | (b << 1) | (c << 2) | (d << 3)
            if case == 5 or case == 10:
                verdict = decide(
                    values[i, j], values[i + 1, j], values[i + 1, j + 1], values[i, j + 1],
                    level, rule, case == 5, terms,
                )  # fmt: skip
                n_open += verdict == UNDECIDED
                case |= verdict << 4
            cases[i, j] = case
    return n_open
