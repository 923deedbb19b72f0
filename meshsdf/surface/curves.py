"""Curves in the plane: what marching squares gives."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Int64

from ..arrays import Points2
from ..errors import SurfaceError


@dataclass(frozen=True, eq=False)
class Curve:
    """Points joined by straight pieces, smaller values on the left.

    Attributes
    ----------
    points : (n, 2) float64
        World units, n >= 2. A closed curve does not repeat its first point.
    edges : (n, 3) int64
        The grid edge each point lies on: node (i, j), and the axis along which the edge leaves it.
        Unique on a curve, and among all curves of a grid.
    is_closed : bool
        Whether the last point is joined to the first.
    """

    points: Points2
    edges: Int64[np.ndarray, "n 3"]
    is_closed: bool

    @property
    def signed_area(self) -> float:
        """Area around which a closed curve runs counter-clockwise, world units squared.

        Of an open curve: the same with a straight piece from its last point to its first.
        """
        x, y = (self.points - self.points[0]).T
        return float(0.5 * (x * np.roll(y, -1) - y * np.roll(x, -1)).sum())

    @property
    def length(self) -> float:
        """Sum of the lengths of the pieces, world units."""
        ends = np.roll(self.points, -1, axis=0) if self.is_closed else self.points[1:]
        return float(np.linalg.norm(ends - self.points[: len(ends)], axis=1).sum())


@dataclass(frozen=True, eq=False)
class Curves:
    """Any number of curves in arrays: iterate over them, or take one by its number.

    Attributes
    ----------
    points, edges : (n, 2) float64, (n, 3) int64
        Those of all curves, one after the other; see `Curve`.
    offsets : (c + 1,) int64
        Curve number k holds the points ``offsets[k] ... offsets[k + 1] - 1``.
    is_closed : (c,) bool
        Whether the last point of a curve is joined to its first.
    """

    points: Points2
    edges: Int64[np.ndarray, "n 3"]
    offsets: Int64[np.ndarray, " c1"]
    is_closed: Bool[np.ndarray, " c"]

    def __len__(self) -> int:
        return len(self.is_closed)

    def __getitem__(self, number: int) -> Curve:
        if not -len(self) <= number < len(self):
            raise SurfaceError(
                f"there is no curve {number} among {len(self)}",
                "Curves[number]",
                f"pass a number from 0 to {len(self) - 1}",
            )
        number %= len(self)
        own = slice(self.offsets[number], self.offsets[number + 1])
        return Curve(self.points[own], self.edges[own], bool(self.is_closed[number]))

    def __iter__(self) -> Iterator[Curve]:
        return (self[number] for number in range(len(self)))
