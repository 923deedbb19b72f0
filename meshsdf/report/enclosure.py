"""A number known to lie between two others."""

from dataclasses import dataclass
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
        return self.lower <= value <= self.upper

    def scaled(self, factor: float) -> "Enclosure":
        """Return the enclosure in another unit: both ends times a positive factor."""
        return Enclosure(self.lower * factor, self.upper * factor)

    def largest(self, other: "Enclosure") -> "Enclosure":
        """Return the enclosure of the larger of the two numbers enclosed."""
        return Enclosure(max(self.lower, other.lower), max(self.upper, other.upper))
