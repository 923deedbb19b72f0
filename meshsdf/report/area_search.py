"""Narrow the integrals of the distance over a surface: branch and bound, the widest gaps first."""

import numpy as np
from jaxtyping import Bool, Float64

from ..arrays import Number, Values
from ..kernels.graph_distance import ANGLE, D_LOW, MAX_ANGLE, S_LOW
from ..mesh import Mesh
from ..progress import Progress
from ..spatial.closest_point import UNIT_ROUNDOFF
from .distance_pieces import Areas, Bounds, Pieces, Ruler, Thresholds
from .tolerance import Tolerance

N_THRESHOLDS = 64
DECADES = 4  # of distances below the largest one seen that thresholds are laid out for
SETTLED_SHARE = 0.4  # of the gap that may stay: what pieces settled at first sight may have of it
ROUND_SHARE = 0.3  # one round of cuts takes all but this much, times the gap that may stay
MOST_PER_ROUND = 100_000  # pieces cut at a time
AREA_ROUNDING = 32 * UNIT_ROUNDOFF  # times a piece's longest side and the coordinates' size


class AreaSearch:
    """The state of one branch and bound.

    Attributes
    ----------
    area : float
        Of the source.
    settled, spans : Pieces and (s, 2) float64
        Pieces with a narrow gap at first sight, with the range of their distances; ``areas`` of
        them are within the ``thresholds``, certainly and possibly.
    pieces, bounds : Pieces and Bounds
        All other pieces.
    """

    def __init__(
        self,
        source: Mesh,
        target: Mesh,
        tolerance: Tolerance,
        progress: Progress,
        *,
        at_most: Number = np.inf,
    ) -> None:
        self.tolerance = tolerance
        self.ruler = Ruler(source, target, at_most)
        pieces = self.ruler.pieces_of(source, progress)
        self.area = float(pieces.areas.sum())
        sides = np.abs(pieces.corners[:, [1, 2, 0]] - pieces.corners).sum(axis=(1, 2))
        lost = AREA_ROUNDING * self.ruler.size * float(sides.sum())
        # Relative rounding of the whole area, of the pieces' share of it and of the sums
        self.area_rounding = 4.0 * lost / self.area + len(pieces) * 2.0**-44 * UNIT_ROUNDOFF
        self.area_rounding += 1e-12
        self._first_look(pieces, progress)

    def _first_look(self, pieces: Pieces, progress: Progress) -> None:
        """Bound all faces; those whose gap is small enough are done with."""
        corner_mean = np.sqrt(pieces.squares).mean(axis=1)
        mean = float(pieces.areas @ corner_mean) / self.area
        square = float(pieces.areas @ pieces.squares.mean(axis=1)) / self.area
        limits = SETTLED_SHARE * self._allowed(mean, square)
        self.limits = (float(limits[0]), float(limits[1]))
        self.thresholds = first_thresholds(np.sqrt(pieces.squares), self.ruler.size)
        bounds, is_settled, self.areas = self.ruler.bound(
            pieces, self.limits, self.thresholds, progress
        )
        self.settled, self.spans = pieces.take(is_settled), bounds.span[is_settled]
        sums = bounds.sums[is_settled]
        self.settled_sums = sums.sum(axis=0)
        self.largest_angle = float(sums[:, MAX_ANGLE].max(initial=0.0))
        self.pieces, self.bounds = pieces.take(~is_settled), bounds.take(~is_settled)

    @property
    def sums(self) -> Values:
        """(8,) sums over all pieces, in the columns of `kernels.graph_distance`."""
        return self.settled_sums + self.bounds.sums.sum(axis=0)

    @property
    def angle(self) -> tuple[float, float]:
        """Mean and largest angle between the normals, radians."""
        largest = float(self.bounds.sums[:, MAX_ANGLE].max(initial=self.largest_angle))
        return float(self.sums[ANGLE]) / self.area, largest

    @property
    def largest(self) -> float:
        """No point is farther."""
        spans = (self.spans[:, 1], self.bounds.span[:, 1])
        seen = max(float(span.max(initial=0.0)) for span in spans)
        return min(seen + self.ruler.rounding, self.ruler.at_most)

    @property
    def excess(self) -> Float64[np.ndarray, "2"]:
        """Gaps of mean and mean square, over those that may stay: done when none is above 1."""
        sums = self.sums / self.area
        gaps = np.array([sums[1] - sums[0], sums[3] - sums[2]])
        return gaps / self._allowed(sums[D_LOW], sums[S_LOW])

    def all_pieces(self) -> Pieces:
        """Settled ones and others; before the first step these are all faces."""
        return _join(self.settled, self.pieces)

    def step(self) -> None:
        """Cut the pieces that have the most of the gap."""
        sums = self.sums / self.area
        allowed = self._allowed(sums[D_LOW], sums[S_LOW]) * self.area
        weight = (self.bounds.gaps / allowed).sum(axis=1)
        order = np.argsort(-weight, kind="stable")
        left = weight.sum() - np.cumsum(weight[order])
        n_cut = int(np.searchsorted(-left, -ROUND_SHARE)) + 1
        cut = order[: min(n_cut, MOST_PER_ROUND)]
        stays = np.ones(len(order), np.bool_)
        stays[cut] = False
        halves = self.ruler.halves(self.pieces.take(cut))
        bounds = self.ruler.bound(halves, self.limits)[0]
        self.pieces = _join(self.pieces.take(stays), halves)
        self.bounds = _join(self.bounds.take(stays), bounds)

    def first_areas(self) -> Areas:
        """Areas certainly and possibly within each of the first ``thresholds``."""
        return self.areas + self._areas_of(self.pieces, self.bounds, self.thresholds)

    def areas_within(self, thresholds: Thresholds, windows: Float64[np.ndarray, "w 2"]) -> Areas:
        """Areas within ascending thresholds, each inside one of a few windows.

        Only pieces whose distances reach into a window need a look.
        """
        areas = np.zeros((2, len(thresholds)))
        for pieces, span in ((self.settled, self.spans), (self.pieces, self.bounds.span)):
            inside = self._reach_into(span, windows)
            first = np.searchsorted(thresholds, span[~inside, 1])
            outside = np.bincount(first, pieces.areas[~inside], len(thresholds) + 1)
            areas += np.cumsum(outside[:-1])
            if pieces is self.settled:
                areas += self.ruler.graph_areas(pieces.take(inside), thresholds)
            else:
                bounds = self.bounds.take(inside)
                areas += self._areas_of(pieces.take(inside), bounds, thresholds)
        return areas

    def _areas_of(self, pieces: Pieces, bounds: Bounds, thresholds: Thresholds) -> Areas:
        is_graph = bounds.is_graph
        rest = pieces.areas[~is_graph]
        linear = self.ruler.linear_areas(rest, bounds.take(~is_graph), thresholds)
        return linear + self.ruler.graph_areas(pieces.take(is_graph), thresholds)

    def _reach_into(
        self, span: Float64[np.ndarray, "s 2"], windows: Float64[np.ndarray, "w 2"]
    ) -> Bool[np.ndarray, " s"]:
        """Pieces that may have a distance within one of the windows."""
        inside = np.zeros(len(span), np.bool_)
        rounding = self.ruler.rounding
        for low, high in windows:
            inside |= (span[:, 0] <= high + rounding) & (span[:, 1] >= low - rounding)
        return inside

    def _allowed(self, mean: float, square: float) -> Float64[np.ndarray, "2"]:
        """Gaps of mean and mean square within which mean and rms are as narrow as asked.

        A part of a length below the rounding is that part of the rounding, so none is zero.
        """
        least = self.ruler.rounding
        rms = max(float(np.sqrt(max(square, 0.0))), least)
        width = self.tolerance.width(rms)
        return np.array([self.tolerance.width(max(mean, least)), (2.0 * rms + width) * width])


def first_thresholds(distances: np.ndarray, size: float) -> Values:
    """(k,) ascending distances, evenly spaced by their logarithm, for a first distribution."""
    largest = float(distances.max())
    if largest < 1e-12 * size:
        largest = 1e-6 * size
    return np.geomspace(10.0**-DECADES * largest, largest, N_THRESHOLDS)


def _join(first, second):
    """Two lists of pieces, or of their bounds, as one."""
    names = first.__dataclass_fields__
    return type(first)(*(np.concatenate([getattr(x, n) for x in (first, second)]) for n in names))
