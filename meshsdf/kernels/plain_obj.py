"""Positions and triangles of a plain OBJ file, straight from its bytes.

Plain is a file of lines ``v x y z`` and ``f a b c`` or ``f a//n b//n c//n``, counted from 1, with
comments, names and normals between them that are passed over. Anything else is told, not read.

Decimals: a number w 10^q with w below 2^53 and |q| up to 22 is one exact product or quotient
(Clinger 1990, doi:10.1145/93542.93557). For others, with up to 19 digits, the upper 128 bits of w
times a 64-bit 10^q bound the true value from below, with a known error (as in Lemire 2021,
doi:10.1002/spe.2984). Where the bound settles how to round, that is the nearest float64; the few
others are left to the caller. So every number is rounded as exact arithmetic would.
"""

import numpy as np
from numba import njit

NOT_PLAIN = -1
MOST_DIGITS = 19  # 10^19 < 2^64
LARGEST_POWER = 64  # of ten, either way: models have no more
NEWLINE, RETURN, HASH, SLASH = ord("\n"), ord("\r"), ord("#"), ord("/")
VERTEX, FACE, NORMAL = ord("v"), ord("f"), ord("n")


def _scaled(q):
    """(mantissa of 64 bits, exponent): 10^q is 2^exponent (mantissa + less than 1)."""
    whole = 10 ** abs(q)
    if q >= 0:
        shift = whole.bit_length() - 64
        return (whole >> shift if shift >= 0 else whole << -shift), shift
    shift = -63 - whole.bit_length()  # no power of ten but 1 is one of two
    return (1 << -shift) // whole, shift


_POWERS = [_scaled(q) for q in range(-LARGEST_POWER, LARGEST_POWER + 1)]
MANTISSAS = np.array([mantissa for mantissa, _ in _POWERS], np.uint64)
EXPONENTS = np.array([exponent for _, exponent in _POWERS], np.int64)
EXACT_TENS = np.array([10.0**q for q in range(23)])
LARGEST_SHIFT = 512  # above every binary exponent that can occur
TWOS = np.array([2.0**k for k in range(-LARGEST_SHIFT, LARGEST_SHIFT + 1)])

_32, _63 = np.uint64(32), np.uint64(63)
_LOW_HALF, _ONE, _TEN = np.uint64(2**32 - 1), np.uint64(1), np.uint64(10)


@njit(cache=True, nogil=True)
def _nearest(w, q):
    """(whether it is certain, the float64 nearest to w 10^q)."""
    if w < np.uint64(2**53) and -22 <= q <= 22:
        exact = np.float64(w)
        return True, (exact * EXACT_TENS[q] if q >= 0 else exact / EXACT_TENS[-q])
    if w == 0 or q < -LARGEST_POWER or q > LARGEST_POWER:
        return w == 0, 0.0
    # Highest bit of w to the top
    n_left = 0
    while w >> _63 == 0:
        w <<= _ONE
        n_left += 1
    # All 128 bits of the product: the true one is less than 2^64 above
    t = MANTISSAS[q + LARGEST_POWER]
    a, b, c, d = w >> _32, w & _LOW_HALF, t >> _32, t & _LOW_HALF
    middle = (b * d >> _32) + (a * d & _LOW_HALF) + (b * c & _LOW_HALF)
    upper = a * c + (a * d >> _32) + (b * c >> _32) + (middle >> _32)
    lower = w * t
    # 53 bits stay
    n_off = np.uint64(11) if upper >> _63 else np.uint64(10)
    kept = upper >> n_off
    rest, half = upper & ((_ONE << n_off) - _ONE), _ONE << (n_off - _ONE)
    if rest + _ONE == half or (rest == half and lower == 0):
        return False, 0.0
    if rest >= half:
        kept += _ONE
    shift = EXPONENTS[q + LARGEST_POWER] + np.int64(n_off) + 64 - n_left
    return True, np.float64(kept) * TWOS[shift + LARGEST_SHIFT]


@njit(cache=True, nogil=True)
def _number(text, at, end):
    """(where the number ends, or NOT_PLAIN; whether it is certain; the number)."""
    is_negative = at < end and text[at] == ord("-")
    if at < end and (is_negative or text[at] == ord("+")):
        at += 1
    w, q, n_digits, n_written, is_behind = np.uint64(0), 0, 0, 0, False
    while at < end:
        letter = text[at]
        if ord("0") <= letter <= ord("9"):
            n_written += 1
            if n_digits > 0 or letter != ord("0"):
                n_digits += 1
            if n_digits <= MOST_DIGITS:
                w = w * _TEN + np.uint64(letter - ord("0"))
                q -= is_behind
        elif letter == ord(".") and not is_behind:
            is_behind = True
        else:
            break
        at += 1
    if n_written == 0:
        return NOT_PLAIN, False, 0.0
    if at < end and (text[at] == ord("e") or text[at] == ord("E")):
        at += 1
        sign = 1
        if at < end and (text[at] == ord("-") or text[at] == ord("+")):
            sign = -1 if text[at] == ord("-") else 1
            at += 1
        first, power = at, 0
        while at < end and ord("0") <= text[at] <= ord("9"):
            power = min(10 * power + (text[at] - ord("0")), 10**6)
            at += 1
        if at == first:
            return NOT_PLAIN, False, 0.0
        q += sign * power
    is_certain, value = _nearest(w, q)
    return at, is_certain and n_digits <= MOST_DIGITS, (-value if is_negative else value)


@njit(cache=True, nogil=True)
def _is_blank(letter):
    return letter == ord(" ") or letter == ord("\t") or letter == ord("\r")


@njit(cache=True, nogil=True)
def _kind(text, at, end):
    """VERTEX, FACE, 0 for a line to pass over, or NOT_PLAIN, of the line that begins here."""
    first = text[at]
    second = text[at + 1] if at + 1 < end else NEWLINE
    if first in (NEWLINE, HASH) or (first == RETURN and second == NEWLINE):
        return 0
    if first == VERTEX and second == NORMAL:
        return 0 if at + 2 < end and _is_blank(text[at + 2]) else NOT_PLAIN
    if not _is_blank(second):
        return 0 if first == ord("g") and second == NEWLINE else NOT_PLAIN
    if first in (VERTEX, FACE):
        return first
    return 0 if first == ord("o") or first == ord("g") or first == ord("s") else NOT_PLAIN


@njit(cache=True, nogil=True)
def count_plain(text, begin, end, counts):
    """``counts`` = positions and triangles on the lines of begin..end; NOT_PLAIN if others are."""
    counts[0] = counts[1] = 0
    at = begin
    while at < end:
        kind = _kind(text, at, end)
        if kind == NOT_PLAIN:
            counts[0] = NOT_PLAIN
            return
        counts[0] += kind == VERTEX
        counts[1] += kind == FACE
        while at < end and text[at] != NEWLINE:
            at += 1
        at += 1


@njit(cache=True, nogil=True)
def fill_plain(text, begin, end, v, f, places, corners, hard):
    """Read begin..end into ``places`` from row v and ``corners`` from row f; return n of ``hard``.

    ``hard`` gets (3 row + column, first byte, byte behind) of numbers to be rounded elsewhere.
    NOT_PLAIN if a line is not, or there is no room left in ``hard``.
    """
    n_hard, at = 0, begin
    while at < end:
        kind = _kind(text, at, end)
        if kind in (VERTEX, FACE):
            at += 1
            for axis in range(3):
                # Blanks before every number
                if at >= end or not _is_blank(text[at]):
                    return NOT_PLAIN
                while at < end and _is_blank(text[at]):
                    at += 1
                if kind == VERTEX:
                    first = at
                    at, is_certain, value = _number(text, at, end)
                    if at == NOT_PLAIN or (not is_certain and n_hard == len(hard)):
                        return NOT_PLAIN
                    places[v, axis] = value
                    if not is_certain:
                        hard[n_hard, 0], hard[n_hard, 1], hard[n_hard, 2] = 3 * v + axis, first, at
                        n_hard += 1
                else:
                    at, corners[f, axis] = _corner(text, at, end, len(places))
                    if at == NOT_PLAIN:
                        return NOT_PLAIN
            while at < end and _is_blank(text[at]):
                at += 1
            if at < end and text[at] != NEWLINE:
                return NOT_PLAIN
            v += kind == VERTEX
            f += kind == FACE
        while at < end and text[at] != NEWLINE:
            at += 1
        at += 1
    return n_hard


@njit(cache=True, nogil=True)
def _corner(text, at, end, n_vertices):
    """(where ``a`` or ``a//n`` ends, a - 1); NOT_PLAIN unless a is one of the vertices."""
    number = 0
    while at < end and ord("0") <= text[at] <= ord("9"):
        number = min(10 * number + (text[at] - ord("0")), n_vertices + 1)
        at += 1
    if number < 1 or number > n_vertices:
        return NOT_PLAIN, 0
    if at + 1 < end and text[at] == SLASH and text[at + 1] == SLASH:
        first = at = at + 2
        while at < end and ord("0") <= text[at] <= ord("9"):
            at += 1
        if at == first:
            return NOT_PLAIN, 0
    return at, number - 1
