"""When an interval around a length is narrow enough."""

from dataclasses import dataclass
from math import isfinite

from ..arrays import Number
from ..errors import ReportError


@dataclass(frozen=True)
class Tolerance:
    """The width that an interval may keep: the larger of a length and a share of what it encloses.

    Attributes
    ----------
    absolute : float
        World units.
    relative : float
        Times the length enclosed.

    Raises
    ------
    ReportError
        One is negative, or both are zero.

    Examples
    --------
    >>> Tolerance(relative=1e-3).width(2.0)
    0.002
    >>> Tolerance.in_voxels(0.01, voxel_size=0.5).width(2.0)
    0.005
    """

    absolute: Number = 0.0
    relative: Number = 0.0

    def __post_init__(self) -> None:
        for value in (self.absolute, self.relative):
            if not (isfinite(value) and value >= 0):
                what, fix = f"the tolerance is {value:g}", "pass a positive number"
                raise ReportError(what, "Tolerance(absolute, relative)", fix)
        if self.absolute == self.relative == 0:
            what = "the tolerance is 0, which rounding alone exceeds"
            raise ReportError(what, "Tolerance(absolute, relative)", "pass a positive number")

    @classmethod
    def in_voxels(cls, share: Number, voxel_size: Number) -> "Tolerance":
        """Part of a voxel, whose size is in world units."""
        return cls(absolute=share * voxel_size)

    @classmethod
    def of(cls, tolerance: "Number | Tolerance") -> "Tolerance":
        """A bare number is a length in world units."""
        return tolerance if isinstance(tolerance, Tolerance) else cls(absolute=tolerance)

    def width(self, length: Number) -> float:
        """How wide an interval around about this length may be, world units."""
        return float(max(self.absolute, self.relative * length))
