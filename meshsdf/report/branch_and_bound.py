"""Find the point of a mesh farthest from another: branch and bound over triangles, in batches.

A piece is a triangle of the source, or a part of one, with its four points (corners and centroid),
their closest faces and an upper bound. Pieces that cannot beat the best distance found by more
than the tolerance are settled; the others are cut in four. One level is worked off at a time,
largest bound first, so what the first batches find spares the later ones.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, Int32

from ..arrays import Indices, Points, Values
from ..kernels.hausdorff_bounds import upper_bounds
from ..kernels.parallel import even_ranges, run_pieces
from ..mesh import Mesh
from ..progress import Progress
from ..spatial.closest_point import ClosestPoint

BATCH = 16384  # pieces cut at a time: large enough for threads, small enough to learn from
PIECES_PER_TASK = 4096
MAX_LEVEL = 48  # sides below 2**-48 of a triangle's are rounding

# A piece has points 0 1 2 (corners), 3 (centroid), 4 5 6 (midpoints after corners 0 1 2) and
# 7 8 9 (centroids of the parts at corners 0 1 2); the fourth part keeps the centroid.
_PARTS = np.array([[0, 4, 6, 7], [4, 1, 5, 8], [6, 5, 2, 9], [4, 5, 6, 3]])


@dataclass(frozen=True, eq=False)
class Pieces:
    """Triangles with what is known at their four points; centred on the target's box."""

    points: Float64[np.ndarray, "k 4 3"]
    squares: Float64[np.ndarray, "k 4"]  # squared distances
    slots: Int32[np.ndarray, "k 4"]  # closest faces, as ClosestPoint numbers them
    face: Int32[np.ndarray, " k"]  # of the source
    upper: Float64[np.ndarray, " k"]

    def __len__(self) -> int:
        return len(self.face)

    def take(self, which: np.ndarray | slice) -> "Pieces":
        """The pieces at an index, mask or slice."""
        arrays = (self.points, self.squares, self.slots, self.face, self.upper)
        return Pieces(*(array[which] for array in arrays))

    @staticmethod
    def join(parts: list["Pieces"]) -> "Pieces":
        """All pieces of one or more lists."""
        names = ("points", "squares", "slots", "face", "upper")
        return Pieces(*(np.concatenate([getattr(p, name) for p in parts]) for name in names))


class Search:
    """The state of one branch and bound.

    Attributes
    ----------
    best : float
        The largest distance computed, at ``witness`` (centred) on ``source_face``.
    settled : float
        The largest upper bound among pieces that need no cutting.
    waiting : list of Pieces
        What is left to cut of this level, and ``next_level`` of the next.
    """

    def __init__(
        self, source: Mesh, closest: ClosestPoint, tolerance: float | None, progress: Progress
    ) -> None:
        self.closest = closest
        self.tolerance = tolerance
        self.best, self.settled = -1.0, 0.0
        self.n_evaluations, self.level = 0, 0
        self._start(source, progress)

    @property
    def enough(self) -> float:
        """Pieces whose bound is not above this need no cutting."""
        if self.tolerance is not None:
            return self.best + self.tolerance
        diagonal = 2.0 * self.closest.radius
        return self.best + max(RELATIVE_TOLERANCE * self.best, DIAGONAL_TOLERANCE * diagonal)

    @property
    def is_done(self) -> bool:
        """Nothing is left to cut."""
        return not self.waiting

    @property
    def upper(self) -> float:
        """Upper bound of the distance, but for rounding."""
        return max([self.best, self.settled, *(float(p.upper.max()) for p in self.waiting)])
