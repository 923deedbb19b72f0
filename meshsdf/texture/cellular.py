"""Patterns of points strewn in space: cells, cracks and spots."""

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from jaxtyping import Float64

from ..arrays import Number, Points, Values
from ..kernels.cellular import nearest_features
from .colors import Color, Rgba, blend, premultiplied
from .noise import checked_points
from .parameters import means
from .solid import Solid

Distances = Float64[np.ndarray, "n 2"]


def nearest_cells(
    points: Points, *, seed: int = 0, jitter: Number = 1.0, exact: bool = False
) -> tuple[Distances, Points]:
    """Return the distances F1, F2 to the two nearest feature points, and marks of the nearest.

    Parameters
    ----------
    points : (n, 3) float64
        One unit is one cell, with one feature point in each.
    jitter : float
        0 for feature points in the middles of cells, 1 for anywhere.
    exact : bool
        Search 5 x 5 x 5 cells, which is proved to suffice, not 3 x 3 x 3, which with full jitter
        errs in F1 at one point of a million, in F2 at one of 30 000.

    Returns
    -------
    distances : (n, 2) float64
        F1 and F2.
    marks : (n, 3) float64
        Three random numbers in [0, 1) of the nearest feature point.

    References
    ----------
    Worley, "A cellular texture basis function", 1996, doi:10.1145/237170.237267.
    """
    distances, marks = np.empty((len(points), 2)), np.empty((len(points), 3))
    reach = 2 if exact else 1
    nearest_features(checked_points(points), reach, float(jitter), seed, distances, marks)
    return distances, marks


@dataclass(frozen=True, kw_only=True)
class Cellular(Solid):
    """Worley's cells: stones with mortar between, or their distances as shades.

    With F1, F2 the distances to the nearest and second nearest of points strewn one to a cell of
    the lattice: "stones" have each a colour between ``low`` and ``high``, and ``mortar`` where
    ``F2 - F1`` is less than ``mortar_width``; "f1" and "f2-f1" mix ``low`` and ``high`` by it.

    References
    ----------
    Worley, "A cellular texture basis function", 1996, doi:10.1145/237170.237267.
    """

    _strewn: ClassVar[bool] = True

    feature: str = field(
        default="stones", metadata=means("choice:stones|f1|f2-f1", "what is shown")
    )
    cell: Number = field(default=0.3, metadata=means("length", "size of a cell"))
    jitter: Number = field(default=1.0, metadata=means("share", "0 for a lattice, 1 for no order"))
    exact: bool = field(
        default=False, metadata=means("switch", "search 5 x 5 x 5 cells, which cannot err")
    )
    mortar_width: Number = field(
        default=0.08, metadata=means("share", "width of the mortar, in cells")
    )
    low: Color = field(default="#6f665c", metadata=means("color", "of the darkest stones, or of 0"))
    high: Color = field(
        default="#c9bda9", metadata=means("color", "of the lightest stones, or of 1")
    )
    mortar: Color = field(default="#3a3530", metadata=means("color", "of the mortar"))

    def _colors(self, points: Points, width: Values) -> Rgba:
        places = points / self.cell
        found, marks = nearest_cells(places, seed=self.seed, jitter=self.jitter, exact=self.exact)
        low, high = premultiplied(self.low), premultiplied(self.high)
        gap = found[:, 1] - found[:, 0]
        if self.feature != "stones":
            shade = found[:, 0] if self.feature == "f1" else gap
            return blend(low, high, np.minimum(shade, 1))
        # F2 - F1 grows by up to 2 per unit. The edge begins where the mortar is thickest, so that
        # none of it is lost in wide filters
        soft = np.clip(1.6 * width / self.cell, self.mortar_width / 3, 2 * self.mortar_width)
        soft = np.maximum(soft, 1e-12)
        share = np.clip((gap - self.mortar_width) / soft + 0.5, 0, 1)
        return blend(premultiplied(self.mortar), blend(low, high, marks[:, 0]), share)

    def _cuts(self, points: Points, width: Values) -> Values:
        return 1 + 12 * width / self.cell

    def _coarsest(self) -> float:
        return float(self.cell)


@dataclass(frozen=True, kw_only=True)
class Spots(Solid):
    """Round spots of one size or several, strewn at random.

    A spot is where F1 of Worley's cells, with half the jitter, is less than its radius, which
    varies by ``variation`` from spot to spot.

    References
    ----------
    Worley, "A cellular texture basis function", 1996, doi:10.1145/237170.237267.
    """

    _strewn: ClassVar[bool] = True

    distance: Number = field(default=0.24, metadata=means("length", "from spot to spot, about"))
    radius: Number = field(default=0.09, metadata=means("length", "of the largest spots"))
    variation: Number = field(default=0.4, metadata=means("share", "by which spots are smaller"))
    ground: Color = field(default="#e9c46a", metadata=means("color", "between the spots"))
    spot: Color = field(default="#4a2c17", metadata=means("color", "of the spots"))

    def _colors(self, points: Points, width: Values) -> Rgba:
        found, marks = nearest_cells(points / self.distance, seed=self.seed, jitter=0.6)
        radius = self.radius * (1 - self.variation * marks[:, 0])
        inside = radius - self.distance * found[:, 0]
        soft = np.clip(width, 1e-12, np.maximum(0.5 * radius, 1e-12))
        share = np.clip(inside / soft + 0.5, 0, 1)
        return blend(premultiplied(self.ground), premultiplied(self.spot), share)

    def _cuts(self, points: Points, width: Values) -> Values:
        return 1 + 5 * width / min(self.radius, 0.3 * self.distance)

    def _coarsest(self) -> float:
        return float(self.distance)
