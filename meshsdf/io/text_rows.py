"""Lines of numbers to arrays, in a few passes over the bytes.

Decimal numbers become the nearest float64 (correctly rounded), so what a file says is what is kept.
"""

import warnings
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, Int64

_SPACE = np.zeros(256, bool)
_SPACE[list(b" \t\r\v\f")] = True
_NEWLINE = ord("\n")


@dataclass(frozen=True, eq=False)
class Rows:
    """Numbers of lines that may differ in length.

    Attributes
    ----------
    numbers : (n,) float64
        All lines, one after the other.
    starts : (r,) int64
        Where each line begins in ``numbers``.
    counts : (r,) int64
        How many numbers each line holds.
    """

    numbers: Float64[np.ndarray, " n"]
    starts: Int64[np.ndarray, " r"]
    counts: Int64[np.ndarray, " r"]

    def column(self, first: int, width: int) -> np.ndarray:
        """Return (r, width) numbers from place ``first`` on; every line must be long enough."""
        return self.numbers[self.starts[:, None] + np.arange(first, first + width)]


def token_counts(text: bytes) -> np.ndarray:
    """Return the number of blank-separated words on each line, as (r,) int64."""
    if not text:
        return np.zeros(0, np.int64)
    letters = np.frombuffer(text, np.uint8)
    is_newline = letters == _NEWLINE
    is_gap = _SPACE[letters] | is_newline
    starts_word = ~is_gap
    starts_word[1:] &= is_gap[:-1]
    total = np.concatenate([[0], np.cumsum(starts_word)])
    ends = np.concatenate([np.flatnonzero(is_newline), [len(letters)]])
    return np.diff(total[ends], prepend=0).astype(np.int64)


def numbers(text: bytes, expected: int, what: str) -> np.ndarray:
    """Return the ``expected`` float64 numbers in text; ValueError names ``what`` if one is not."""
    if expected == 0:
        return np.empty(0)
    with warnings.catch_warnings():
        # Older NumPy warns and stops where newer raises; either way the count gives it away.
        warnings.simplefilter("ignore", DeprecationWarning)
        try:
            found = np.fromstring(text, np.float64, sep=" ")
        except ValueError:
            found = np.empty(0)
    if len(found) != expected:
        raise ValueError(_first_bad_word(text, what))
    return found


def rows(text: bytes, what: str) -> Rows:
    """Parse the lines of ``text``; ValueError names ``what`` if one holds a word, no number."""
    counts = token_counts(text)
    values = numbers(text, int(counts.sum()), what)
    return Rows(values, np.cumsum(counts) - counts, counts)


def _first_bad_word(text: bytes, what: str) -> str:
    for line, content in enumerate(text.split(b"\n")):
        for word in content.split():
            try:
                float(word)
            except ValueError:
                shown = word[:40].decode("latin-1")
                return f"{what} {line + 1} holds {shown!r}, which is not a number"
    return f"a {what} holds something that is not a number"
