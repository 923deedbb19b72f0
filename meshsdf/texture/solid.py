"""What all solid textures share: a seed, a scale, and the mean over a footprint.

A texture gives colours that are right for small filters: edges widened, fine octaves left out. For
a wide filter the cube is cut into k^3 smaller ones and their colours are averaged, k at most
`MOST_CUTS`; where the cube holds so many features that this is the mean of all space, to what the
cuts can tell, that mean is taken.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from functools import lru_cache
from typing import ClassVar

import numpy as np

from ..arrays import Number, Points, Values
from ..kernels.parallel import run_pieces
from .colors import Rgba, StraightRgba, straight
from .noise import box_widths, checked_points
from .parameters import check_parameters, means

CUTS = np.array([1, 2, 3, 4, 6, 8])  # smaller cubes along an axis
MOST_CUTS = int(CUTS[-1])
POINTS_PER_PIECE = 8192  # arrays of a piece stay in the cache
# Widths, in coarsest features, between which the mean of a cube passes into that of all space:
# a cube of 12^3 independent features differs from it by 1/42 of the pattern's contrast
MEAN_BEGIN, MEAN_END = 8.0, 12.0
PLASTIC = 1.2207440846057596  # the root of x^4 = x + 1
MEAN_POINTS = 1 << 17  # random, so that the mean is known to 1/360 of the contrast


@dataclass(frozen=True, kw_only=True)
class Solid(ABC):
    """A texture of all space: ``texture(points, footprint=0.0)`` gives colours.

    Points are divided by ``scale`` first, so that it is the length of the pattern's unit.
    """

    seed: int = field(
        default=0, metadata=means("seed", "another number, another piece of the same material")
    )
    scale: Number = field(
        default=1.0, metadata=means("length", "length of the pattern's unit, in world units")
    )

    _strewn: ClassVar[bool] = False  # whether the pattern sits on a lattice that cuts may alias

    def __post_init__(self) -> None:
        check_parameters(self)

    def __call__(self, points: Points, footprint: Number | Values = 0.0) -> StraightRgba:
        """Return the mean colour over a cube around each point.

        Parameters
        ----------
        points : (n, 3) float64
            World units.
        footprint : float or (n,) float64
            Width of the cube, world units; 0 for the colour at the point.

        Returns
        -------
        colors : (n, 4) float32
            Linear RGB, straight alpha.
        """
        unit = checked_points(points / self.scale)
        widths = box_widths(footprint, len(points))[:, 0] / self.scale
        colors = np.empty((len(points), 4), np.float32)

        def piece(number: int) -> None:
            part = slice(number * POINTS_PER_PIECE, (number + 1) * POINTS_PER_PIECE)
            colors[part] = straight(self._mean_colors(unit[part], widths[part]))

        run_pieces(piece, -(-len(points) // POINTS_PER_PIECE))
        return colors

    @abstractmethod
    def _colors(self, points: Points, width: Values) -> Rgba:
        """Colours right for cubes that are small beside the features; all in pattern units."""

    @abstractmethod
    def _cuts(self, points: Points, width: Values) -> Values:
        """Into how many cubes along each axis a cube is better cut."""

    def _coarsest(self) -> float:
        """Size of the largest feature of a pattern that is alike everywhere; else infinite."""
        return np.inf

    def _mean_colors(self, points: Points, width: Values) -> Rgba:
        coarsest = self._coarsest()
        known = np.clip((width / coarsest - MEAN_BEGIN) / (MEAN_END - MEAN_BEGIN), 0, 1)
        if not known.any():
            return self._cut_colors(points, width)
        out = np.tile(_mean_of_space(self), (len(points), 1))
        near = known < 1
        if near.any():
            cut = self._cut_colors(points[near], width[near])
            out[near] = cut + known[near, None] * (out[near] - cut)
        return out

    def _cut_colors(self, points: Points, width: Values) -> Rgba:
        if not width.any():
            return self._colors(points, width)
        wanted = np.minimum(self._cuts(points, width), MOST_CUTS)
        number = CUTS[np.searchsorted(CUTS, wanted)]
        out = np.zeros((len(points), 4))
        for cuts in np.unique(number):
            own = number == cuts
            if own.all():
                own = slice(None)
            out[own] = self._average(points[own], width[own], int(cuts))
        return out

    def _average(self, points: Points, width: Values, cuts: int) -> Rgba:
        # Many places at once, so that few points do not cost a call for each of their places
        offsets = _offsets(cuts, self._strewn and cuts > 4)
        at_once = max(1, POINTS_PER_PIECE // len(points))
        total = np.zeros((len(points), 4))
        for begin in range(0, len(offsets), at_once):
            some = offsets[begin : begin + at_once]
            places = points + width[:, None] * some[:, None]
            colors = self._colors(places.reshape(-1, 3), np.tile(width / cuts, len(some)))
            for part in colors.reshape(len(some), -1, 4):
                total += part
        return total / cuts**3


@lru_cache(maxsize=16)
def _offsets(cuts: int, strewn: bool) -> Points:
    """Places in a cube of width 1 around 0: middles of cuts^3 cubes, or as many evenly strewn.

    The latter are a lattice of rank 1 (Roberts 2018, "The unreasonable effectiveness of
    quasirandom sequences"), whose rows are in step with no pattern along the axes.
    """
    if not strewn:
        middles = (np.arange(cuts) + 0.5) / cuts - 0.5
        return np.stack(np.meshgrid(middles, middles, middles), axis=-1).reshape(-1, 3)
    number = np.arange(1, cuts**3 + 1)[:, None]
    return (number * PLASTIC ** -np.arange(1.0, 4.0) + 0.5) % 1 - 0.5


@lru_cache(maxsize=64)
def _mean_of_space(texture: Solid) -> Rgba:
    side = 256 * texture._coarsest()
    points = np.random.default_rng(0).random((MEAN_POINTS, 3)) * side
    total = np.zeros(4)
    for part in np.split(points, MEAN_POINTS // POINTS_PER_PIECE):
        total += texture._colors(part, np.zeros(len(part))).sum(axis=0)
    return (total / MEAN_POINTS)[None]
