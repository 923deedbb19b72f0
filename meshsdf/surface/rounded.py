"""Signs of polynomials of many cells at once: in floating point where that is safe, else exactly.

The same expression, written with + - * alone, is evaluated on `Rounded` numbers first. Where the
bound they carry leaves a sign open, it is evaluated again on whole numbers, which Python holds
exactly at any size.
"""

from dataclasses import dataclass

import numpy as np

UNIT = 2.0**-52  # twice the rounding error of one operation, which covers that of the bound
TINY = 2.0**-1000  # more than underflow can take away


@dataclass(frozen=True, eq=False)
class Rounded:
    """Float64 numbers, and bounds on their distance from what they stand for.

    Running error analysis (Higham 2002, doi:10.1137/1.9780898718027, section 3.3).
    """

    value: np.ndarray
    error: np.ndarray

    def __neg__(self) -> "Rounded":
        return Rounded(-self.value, self.error)

    def __add__(self, other: "Rounded") -> "Rounded":
        value = self.value + other.value
        return Rounded(value, self.error + other.error + UNIT * np.abs(value))

    def __sub__(self, other: "Rounded") -> "Rounded":
        return self + -other

    def __mul__(self, other: "Rounded") -> "Rounded":
        value = self.value * other.value
        error = self.error * (np.abs(other.value) + other.error) + np.abs(self.value) * other.error
        return Rounded(value, error + UNIT * np.abs(value) + TINY)


Numbers = Rounded | np.ndarray
"""Rounded numbers, or an object array of Python's whole numbers."""


def sign(number: Numbers) -> np.ndarray:
    """-1, 0 or 1; of rounded numbers, 0 says that the sign is open."""
    if isinstance(number, Rounded):
        surely = np.abs(number.value) > number.error
        return np.where(surely, np.sign(number.value), 0).astype(np.int8)
    return (number > 0).astype(np.int8) - (number < 0).astype(np.int8)


def choose(condition: np.ndarray, one: Numbers, other: Numbers) -> Numbers:
    """Take from ``one`` where the condition holds, else from ``other``."""
    if isinstance(one, Rounded):
        return Rounded(
            np.where(condition, one.value, other.value), np.where(condition, one.error, other.error)
        )
    return np.where(condition, one, other)


def constant(number: int, like: Numbers) -> Numbers:
    """An exact number for every entry of ``like``."""
    if isinstance(like, Rounded):
        return Rounded(np.full_like(like.value, number), np.zeros_like(like.error))
    return np.full(like.shape, number, object)


def rounded_differences(values: np.ndarray, level: float) -> list[Rounded]:
    """``values[:, c] - level`` of every cell for each c, scaled by powers of two to below 2."""
    finite = np.where(np.isfinite(values), values, 0.0)
    size = np.maximum(np.abs(finite).max(axis=1, initial=0.0), abs(level))
    exponent = -np.frexp(size)[1][:, None]
    # A level of 0 is subtracted without error; scaling errs by no more than an underflow.
    scaled = np.ldexp(finite, exponent) - np.ldexp(level, exponent)
    error = TINY + (UNIT * np.abs(scaled) if level else np.zeros_like(scaled))
    return [Rounded(scaled[:, c], error[:, c]) for c in range(values.shape[1])]


def whole_differences(values: np.ndarray, level: float) -> list[np.ndarray]:
    """``values[:, c] - level`` for each c, all times one power of two that makes them integers."""
    finite = np.where(np.isfinite(values), values, 0.0)
    fraction, exponent = np.frexp(np.append(finite.ravel(), level))
    digits = np.ldexp(fraction, 53).astype(np.int64).astype(object)
    lowest = exponent.min(where=fraction != 0, initial=2000)
    shift = np.where(fraction == 0, 0, exponent - lowest)
    whole = digits << shift.astype(object)
    return list((whole[:-1] - whole[-1]).reshape(values.shape).T)


def above_ties(numbers: list[np.ndarray]) -> list[np.ndarray]:
    """Add to whole numbers one amount so small that no sign of a polynomial can tell it from 0,
    unless it was 0: all degrees up to 4, coefficients up to 2**16.

    Instead of being so small, it is 1 and the numbers are made larger (simulation of simplicity,
    Edelsbrunner and Muecke 1990, doi:10.1145/77635.77639).
    """
    bits = max((int(abs(n)).bit_length() for array in numbers for n in array), default=0)
    return [array * (1 << (4 * bits + 24)) + 1 for array in numbers]
