"""A number known to lie between two others, and what of it may be printed."""

from dataclasses import dataclass
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from math import isnan

from ..errors import ReportError


@dataclass(frozen=True)
class Enclosure:
    """The truth lies in [lower, upper], both included.

    Attributes
    ----------
    lower, upper : float
        ``lower <= upper``; ReportError otherwise, or if one is NaN.
    """

    lower: float
    upper: float

    def __post_init__(self) -> None:
        if isnan(self.lower) or isnan(self.upper) or self.lower > self.upper:
            what = f"nothing lies between {self.lower:g} and {self.upper:g}"
            raise ReportError(what, "Enclosure(lower, upper)", "pass lower <= upper")

    @property
    def width(self) -> float:
        """How much is not known."""
        return self.upper - self.lower

    @property
    def middle(self) -> float:
        """Halfway between both ends."""
        return 0.5 * self.lower + 0.5 * self.upper

    def contains(self, value: float) -> bool:
        """Tell whether ``lower <= value <= upper``."""
        return bool(self.lower <= value <= self.upper)

    def scaled(self, factor: float) -> "Enclosure":
        """Return the enclosure in another unit: both ends times a positive factor."""
        return Enclosure(self.lower * factor, self.upper * factor)

    def largest(self, other: "Enclosure") -> "Enclosure":
        """Return the enclosure of the larger of the two numbers enclosed."""
        return Enclosure(max(self.lower, other.lower), max(self.upper, other.upper))

    def __str__(self) -> str:
        return f"[{floor_digits(self.lower)}, {ceil_digits(self.upper)}]"


def floor_digits(value: float, digits: int = 6) -> str:
    """Write with so many digits, rounded down: what is at least this stays at least this."""
    return f"{Context(digits, ROUND_FLOOR).create_decimal(value):g}"


def ceil_digits(value: float, digits: int = 6) -> str:
    """Write with so many digits, rounded up: what is at most this stays at most this."""
    return f"{Context(digits, ROUND_CEILING).create_decimal(value):g}"
