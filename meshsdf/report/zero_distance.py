"""One-sided distances between a mesh and the zero set of a band's interpolant, between bounds.

The zero set Z is replaced by pieces P, each within s of Z as Z is within s of them, and d(p, Z)
differs by at most s from d(p, P): branch and bound over triangles (`branch_and_bound`) does the
rest. First with coarse pieces; then what may still hold the farthest point, and the cells near it
alone, is searched again with pieces four times finer, and again, until the tolerance is met.
"""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float64, Int32, Int64

from ..arrays import Indices, Points, Values
from ..mesh import Mesh
from ..progress import Progress
from ..spatial.closest_point import ClosestPoint
from .branch_and_bound import Pieces, Search
from .enclosure import Enclosure
from .tolerance import Tolerance
from .zero_set import HALF_DIAGONAL, Patches, ZeroSet

COARSENING = (16, 4, 1)  # of the finest pieces
SHARE = 0.25  # of the tolerance: how near to the zero set the finest pieces are, twice over
COARSE_LEVELS = 2  # cuts before the next, finer pieces: enough to drop what is far from the record


class Sieve(Search):
    """A search that settles what is below the record plus an allowance, which may be negative.

    With a negative one it is never done: it is stopped after some levels, and what then waits is
    all that may be so near to the record.
    """

    def __init__(
        self, source: Mesh, closest: ClosestPoint, allowance: float, progress: Progress
    ) -> None:
        self.allowance = allowance
        super().__init__(source, closest, Tolerance(absolute=1.0), progress)

    @property
    def enough(self) -> float:
        """Pieces whose bound is not above this need no cut."""
        return self.best + self.allowance

    @property
    def bound(self) -> float:
        """Upper bound of the distance of what is settled; negative if that is nothing."""
        return min(self.settled, self.enough)

    @property
    def left(self) -> list[Pieces]:
        """Pieces that are not settled."""
        return self.waiting + self.following

    def run(self, max_evaluations: int) -> None:
        """Cut until done, or a little where the allowance is negative."""
        while not self.is_done and self.n_evaluations < max_evaluations:
            if self.allowance <= 0 and self.level >= COARSE_LEVELS:
                break
            self.step()


class TowardZeroSet(Sieve):
    """Search for the point of a mesh farthest from Z, by distances to pieces of it.

    Upper bounds are such that, plus ``slack``, they hold for Z.
    """

    def __init__(
        self,
        source: Mesh,
        closest: ClosestPoint,
        allowance: float,
        progress: Progress,
        zero: ZeroSet,
        slack: float,
    ) -> None:
        self.zero, self.slack = zero, slack
        super().__init__(source, closest, allowance, progress)
        # Pieces have neither vertices nor edges in common
        m = closest.mesh.n_faces
        own = np.arange(3 * m, dtype=np.int32).reshape(m, 3)
        self.around = np.concatenate([own, np.full((m, 3), -1, np.int32)], axis=1)

    def _bound(
        self,
        points: Points,
        squares: Values,
        slots: Indices,
        ids: Int32[np.ndarray, "k 3"],
        faces: Int32[np.ndarray, " k"],
        upper: Float64[np.ndarray, " k"],
        **options: int,
    ) -> Pieces:
        """Bound by the interpolant itself first: it knows no seams."""
        enough = self.enough + self.slack
        found = self.zero.bound(points, ids, self.closest.center, enough) - self.slack
        upper = np.minimum(upper, found)
        open_ = upper > self.enough
        self.settled = max(self.settled, float(upper[~open_].max(initial=0.0)))
        left = ids[open_], faces[open_], upper[open_]
        return super()._bound(points, squares, slots, *left, **options)


@dataclass
class ZeroSides:
    """Both one-sided distances of any mesh and one zero set, to one tolerance.

    Attributes
    ----------
    tolerance : float
        Width asked of the enclosures, world units.
    max_evaluations : int
        Closest points for each search, after which nothing is cut further.
    met_limit : bool
        Whether an interval given so far is wider than asked.
    """

    zero: ZeroSet
    tolerance: float
    max_evaluations: int
    progress: Progress
    met_limit: bool = False
    limits: list[float] = field(init=False)  # how near pieces are to Z, voxels
    coarse: Patches = field(init=False)  # of all of Z
    coarse_closest: ClosestPoint | None = field(init=False)  # None where no piece is sure

    def __post_init__(self) -> None:
        finest = SHARE * self.tolerance / self.zero.band.voxel_size
        self.limits = [coarser * finest for coarser in COARSENING]
        self.coarse = self.zero.patches(np.arange(len(self.zero.cells)), self.limits[0])
        self.coarse_closest = _closest(self.coarse)

    def from_zero_set(self, target: ClosestPoint) -> Enclosure:
        """Enclose the largest distance of a point of Z from a mesh."""
        patches, cells = self.coarse, self.coarse.cell
        lower, settled, rounding = 0.0, 0.0, 0.0
        for i, limit in enumerate(self.limits):
            if i > 0:
                patches = self.zero.patches(cells, limit)
            search = Sieve(patches.mesh, target, self._allowance(patches, i), self.progress)
            search.run(self.max_evaluations)
            rounding = max(rounding, search.rounding)
            best = search.best
            if not patches.is_sure.all():
                best = _record(patches.sure_part(), target, self.progress)
            lower = max(lower, best - patches.slack)
            settled = max(settled, search.bound + patches.slack)
            if not search.left:
                return self._enclosure(lower, settled, rounding)
            cells = np.unique(patches.cell[_faces(search)])
        return self._enclosure(lower, max(settled, _largest(search) + patches.slack), rounding)

    def to_zero_set(self, source: Mesh) -> Enclosure:
        """Enclose the largest distance of a point of a mesh from Z."""
        patches, closest, cells = self.coarse, self.coarse_closest, self.coarse.cell
        lower, settled, rounding = 0.0, 0.0, 0.0
        for i, limit in enumerate(self.limits):
            if i > 0:
                patches = self.zero.patches(cells, limit)
                closest = _closest(patches)
            if closest is None:
                return self._enclosure(lower, np.inf, rounding)
            allowance, slack = self._allowance(patches, i), patches.slack
            search = TowardZeroSet(source, closest, allowance, self.progress, self.zero, slack)
            search.run(self.max_evaluations)
            rounding = max(rounding, search.rounding)
            best = search.best
            if not patches.is_sure.all():
                witness = (search.witness + closest.center)[None]
                best = float(ClosestPoint(patches.mesh).distances(witness).distance[0])
            lower = max(lower, best - slack)
            settled = max(settled, search.bound + slack)
            if not search.left:
                return self._enclosure(lower, settled, rounding)
            source = Mesh(source.vertices, source.faces[np.unique(_faces(search))])
            cells = self._within_reach(source, max(settled, _largest(search) + slack))
        return self._enclosure(lower, max(settled, _largest(search) + slack), rounding)

    def _allowance(self, patches: Patches, i: int) -> float:
        """By how much bounds may exceed the record: less than nothing while pieces are coarse."""
        rest = self.tolerance - 2.0 * patches.slack
        return max(rest, SHARE * self.tolerance) if i == len(self.limits) - 1 else rest

    def _within_reach(self, part: Mesh, distance: float) -> Int64[np.ndarray, " k"]:
        """Cells that may hold the point of Z nearest to any point of a mesh, so near to it."""
        reach = distance + HALF_DIAGONAL * self.zero.band.voxel_size + self.zero.rounding
        found = ClosestPoint(part).distances(self.zero.centers, progress=self.progress)
        return np.flatnonzero(found.distance <= reach * (1.0 + 1e-9))

    def _enclosure(self, lower: float, upper: float, rounding: float) -> Enclosure:
        """Round both ends outwards; twice, for a search among parts has another centre."""
        lower, upper, rounding = float(lower), float(upper), 2.0 * float(rounding)
        self.met_limit |= upper - lower > self.tolerance * (1.0 + 1e-9)
        return Enclosure(max(lower - rounding, 0.0), max(upper, lower) + rounding)


def _closest(patches: Patches) -> ClosestPoint | None:
    """Answers queries on the pieces that are proved to be near the zero set."""
    return ClosestPoint(patches.sure_part()) if patches.is_sure.any() else None


def _faces(search: Sieve) -> Int32[np.ndarray, " k"]:
    """The faces of the pieces that are left."""
    return np.concatenate([pieces.face for pieces in search.left])


def _largest(search: Sieve) -> float:
    """The largest bound of a piece that is left."""
    return max(pieces.largest for pieces in search.left)


def _record(source: Mesh, target: ClosestPoint, progress: Progress) -> float:
    """The largest distance of a vertex from a mesh; 0 without faces."""
    if source.n_faces == 0:
        return 0.0
    return Sieve(source, target, np.inf, progress).best
