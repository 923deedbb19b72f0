"""Axis-aligned boxes."""

from dataclasses import dataclass

import numpy as np

from .arrays import Points, Vector3


@dataclass(frozen=True, eq=False)
class Box:
    """The closed box ``lower <= x <= upper``, world units."""

    lower: Vector3
    upper: Vector3

    @classmethod
    def around(cls, points: Points) -> "Box":
        """Return the smallest box that holds all of the (n >= 1, 3) points."""
        return cls(points.min(axis=0), points.max(axis=0))

    @property
    def size(self) -> Vector3:
        """(3,) side lengths."""
        return self.upper - self.lower

    @property
    def center(self) -> Vector3:
        """(3,) midpoint; safe from overflow."""
        return 0.5 * self.lower + 0.5 * self.upper

    @property
    def longest_side(self) -> float:
        """Length of the longest side."""
        return float(self.size.max())

    @property
    def diagonal(self) -> float:
        """Length of the diagonal."""
        return float(np.linalg.norm(self.size))
