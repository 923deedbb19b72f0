"""Find the point of a mesh farthest from another: branch and bound over triangles, in batches.

A piece is a triangle of the source, or a part of one, with the distances and closest faces of its
corners, and an upper bound. Pieces that cannot beat the best distance found by more than the
tolerance are settled; the others are cut in two at the middle of their longest side, which keeps
needles from staying needles. One level is worked off at a time, largest bound first, so what the
first batches find spares the later ones.

Rounding. Everything is computed relative to the centre of the target's box. With R the largest
distance of a source vertex from it, r half the diagonal of the box and u = 2**-53, each bound is
off by at most ``ROUNDING (R + r)``, which is the sum of

- u for moving the vertices of both meshes to the centre, one subtraction each;
- 100 u for the places of corners: a middle is rounded by u R, and lies between corners that are
  displaced already, once on each of at most ``MAX_LEVEL`` levels. The pieces then cover the source
  but for as much, and no point of theirs is farther from it;
- 200 u for a distance to a face, or of a face's vertex to a piece: ``50 u (|p - a| + L)`` by
  `kernels.point_triangle`, with |p - a| <= R + 2 r and L <= 2 r, or 2 R the other way round. The
  search loses nothing to it: a face is passed over only when its box is farther than the answer;
- 27 u for what a bound adds to a distance (`kernels.hausdorff_bounds`).

Where lengths fall below the normal range of float32, boxes of the search are off by ``UNDERFLOW``.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float64, Int32

from ..arrays import Indices, Points, Values
from ..kernels.hausdorff_bounds import upper_bounds
from ..kernels.parallel import even_ranges, run_pieces
from ..mesh import Mesh
from ..progress import Progress
from ..spatial.closest_point import UNIT_ROUNDOFF, ClosestPoint
from .tolerance import Tolerance

FIRST_BATCH, BATCH = 512, 16384  # pieces cut at a time: few to learn from, then more for threads
PIECES_PER_TASK = 4096
PROBED_FROM = 4096  # faces; of fewer, all are cut anyway before a record has spared any
CUTS_PER_FACE = 0.1  # of the target: after so many, knowing which faces touch has paid
MAX_LEVEL = 100  # a piece is then 2**-50 of its triangle's size: rounding
ROUNDING = (1 + MAX_LEVEL + 200 + 27) * UNIT_ROUNDOFF
UNDERFLOW = 1e-44  # float32 rounds by up to 2**-150 there: sqrt(3) of these, rounded up

# Cut at point 3, the middle of 0 1
_HALVES = np.array([[0, 3, 2], [3, 1, 2]], np.int32)
_LONGEST_FIRST = np.array([[0, 1, 2], [1, 2, 0], [2, 0, 1]])


@dataclass(frozen=True, eq=False)
class Pieces:
    """Triangles with what is known at their corners; centred on the target's box."""

    points: Float64[np.ndarray, "k 3 3"]
    squares: Float64[np.ndarray, "k 3"]  # squared distances
    slots: Int32[np.ndarray, "k 3"]  # closest faces, as ClosestPoint numbers them
    face: Int32[np.ndarray, " k"]  # of the source
    upper: Float64[np.ndarray, " k"]

    def __len__(self) -> int:
        return len(self.face)

    @cached_property
    def largest(self) -> float:
        """The largest of the upper bounds."""
        return float(self.upper.max())

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
        The largest distance computed, at ``witness`` (centred), on ``source_face``; ``slot`` is
        the closest face there.
    settled : float
        The largest upper bound among pieces that need no further cut.
    rounding : float
        What both ends may be off by.
    corners, corner_squares : (m, 3) int32, (n,) float64
        The faces in terms of the vertices they use, and these vertices' squared distances.
    waiting, following : lists of Pieces
        To be cut on this level, largest bound first, and on the next.

    With ``probes``, a few places inside the most promising faces are measured before any face gets
    the dearer bounds, so that fewer do.
    """

    def __init__(
        self,
        source: Mesh,
        closest: ClosestPoint,
        tolerance: Tolerance,
        progress: Progress,
        *,
        probes: bool = False,
    ) -> None:
        self.closest = closest
        self.tolerance = tolerance
        self.best, self.settled = -1.0, 0.0
        self.n_evaluations, self.n_cuts, self.level = 0, 0, 0
        self.around = np.empty((0, 6), np.int32)
        self.waiting: list[Pieces] = []
        self.following: list[Pieces] = []
        self._start(source, progress, probes)

    @property
    def enough(self) -> float:
        """Pieces whose bound is not above this need no cut: rounding takes its part on top."""
        asked = self.tolerance.width(self.best)
        return self.best + max(asked - 3 * self.rounding, self.rounding)

    @property
    def is_done(self) -> bool:
        """No piece is left that a cut could help."""
        return not self.waiting or self.level >= MAX_LEVEL

    @property
    def upper(self) -> float:
        """Upper bound of the distance, but for rounding."""
        left = [pieces.largest for pieces in self.waiting + self.following]
        return max([self.best, self.settled, *left])

    def step(self) -> None:
        """Cut one batch of pieces in two."""
        target = self.closest.mesh
        if len(self.around) == 0 and self.n_cuts > CUTS_PER_FACE * target.n_faces:
            self.around = faces_around(target)
        pieces = self._keep(self.waiting.pop(0))
        if len(pieces) > 0 and len(halves := self._cut(pieces)) > 0:
            self.following.append(halves)
        if not self.waiting:
            self.level += 1
            self.waiting, self.following = self._in_batches(self.following), []

    def _start(self, source: Mesh, progress: Progress, probes: bool) -> None:
        """Measure all vertices, and bound every face."""
        used = np.zeros(source.n_vertices, bool)
        used[source.faces] = True
        self.corners = (np.cumsum(used, dtype=np.int32) - np.int32(1))[source.faces]
        points = source.vertices[used] - self.closest.center
        reach = float(np.sqrt(np.einsum("ij,ij->i", points, points).max()))
        self.rounding = ROUNDING * (reach + self.closest.radius) + UNDERFLOW
        squares, slots = self.closest.search(points, np.empty(0, np.int32), progress)
        self.n_evaluations += len(points)
        self.corner_squares = squares
        face = int(np.flatnonzero((self.corners == squares.argmax()).any(axis=1))[0])
        self._note(points, squares, slots, face)
        upper = self._upper(points, squares, slots, self.corners, last=2)
        if probes and source.n_faces >= PROBED_FROM:
            self._probe(points, upper)
        # Cheap bounds have settled most faces; the rest get all
        open_ = upper > self.enough
        self.settled = float(upper[~open_].max(initial=0.0))
        left = np.flatnonzero(open_).astype(np.int32)
        pieces = self._bound(points, squares, slots, self.corners[left], left, upper[left])
        self.waiting = self._in_batches([pieces])

    def _probe(self, points: Points, upper: Float64[np.ndarray, " m"]) -> None:
        """Measure the middles of the sides of the most promising faces, for their record."""
        top = np.argpartition(upper, -FIRST_BATCH)[-FIRST_BATCH:].astype(np.int32)
        corners = points[self.corners[top]]
        middles = (0.5 * (corners + corners[:, [1, 2, 0]])).reshape(-1, 3)
        squares, slots = self.closest.search(middles, np.empty(0, np.int32))
        self.n_evaluations += len(middles)
        self._note(middles, squares, slots, int(top[int(squares.argmax()) // 3]))

    def _cut(self, pieces: Pieces) -> Pieces:
        """Halves of pieces, those that need cutting on."""
        k = len(pieces)
        sides = pieces.points[:, [1, 2, 0]] - pieces.points
        longest = np.einsum("kij,kij->ki", sides, sides).argmax(axis=1)
        turned = _LONGEST_FIRST[longest]
        v = np.take_along_axis(pieces.points, turned[:, :, None], axis=1)
        near = np.take_along_axis(pieces.slots, turned, axis=1)
        old = np.take_along_axis(pieces.squares, turned, axis=1)
        middle = 0.5 * (v[:, 0] + v[:, 1])
        found, slots = self.closest.search(middle, near[:, 0].copy())
        self.n_evaluations += k
        self.n_cuts += k
        points = np.concatenate([v, middle[:, None]], axis=1).reshape(-1, 3)
        squares = np.concatenate([old, found[:, None]], axis=1).reshape(-1)
        slots = np.concatenate([near, slots[:, None]], axis=1).reshape(-1)
        ids = (4 * np.arange(k, dtype=np.int32)[:, None, None] + _HALVES).reshape(-1, 3)
        self._note(points, squares, slots, int(pieces.face[int(squares.argmax()) // 4]))
        faces, upper = np.repeat(pieces.face, 2), np.repeat(pieces.upper, 2)
        return self._bound(points, squares, slots, ids, faces, upper)

    def _bound(
        self,
        points: Points,
        squares: Values,
        slots: Indices,
        ids: Int32[np.ndarray, "k 3"],
        faces: Int32[np.ndarray, " k"],
        upper: Float64[np.ndarray, " k"],
    ) -> Pieces:
        """Bound pieces given by point numbers; settle those with a bound that is enough."""
        last, enough = (5 if len(self.around) > 0 else 3), self.enough
        upper = np.minimum(self._upper(points, squares, slots, ids, last=last), upper)
        open_ = upper > enough
        self.settled = max(self.settled, float(upper[~open_].max(initial=0.0)))
        ids = ids[open_]
        return Pieces(points[ids], squares[ids], slots[ids], faces[open_], upper[open_])

    def _upper(
        self,
        points: Points,
        squares: Values,
        slots: Indices,
        ids: Int32[np.ndarray, "k 3"],
        *,
        last: int,
    ) -> Float64[np.ndarray, " k"]:
        """The best of bounds 1 to ``last`` for each piece; any that is enough will do."""
        upper = np.empty(len(ids))
        tasks = even_ranges(len(ids), len(ids) // PIECES_PER_TASK + 1)
        closest, enough = self.closest, self.enough
        target = (closest.frames, closest.corners, closest.face_of_slot, self.around)

        def work(task: int) -> None:
            begin, end = tasks[task]
            upper_bounds(points, squares, slots, ids, begin, end, enough, last, *target, upper)

        run_pieces(work, len(tasks))
        return upper

    def _keep(self, pieces: Pieces) -> Pieces:
        """Settle pieces that the best distance found meanwhile has made good enough."""
        open_ = pieces.upper > self.enough
        self.settled = max(self.settled, float(pieces.upper[~open_].max(initial=0.0)))
        return pieces if open_.all() else pieces.take(open_)

    def _in_batches(self, parts: list[Pieces]) -> list[Pieces]:
        """All pieces that still need cutting, largest bound first."""
        parts = [kept for part in parts if len(kept := self._keep(part)) > 0]
        if not parts:
            return []
        pieces = Pieces.join(parts)
        pieces = pieces.take(np.argsort(-pieces.upper, kind="stable"))
        batches, begin, size = [], 0, FIRST_BATCH
        while begin < len(pieces):
            batches.append(pieces.take(slice(begin, begin + size)))
            begin, size = begin + size, min(2 * size, BATCH)
        return batches

    def _note(self, points: Points, squares: Values, slots: Indices, source_face: int) -> None:
        """Remember the farthest of the points if it is a record."""
        largest = int(squares.argmax())
        distance = float(np.sqrt(squares[largest]))
        if distance > self.best:
            self.best, self.witness = distance, points[largest].copy()
            self.source_face, self.slot = source_face, int(slots[largest])


def faces_around(mesh: Mesh) -> Int32[np.ndarray, "m 6"]:
    """(m, 6): each face's vertices, named by position, and its neighbour over the edge after each.

    -1 where there is none; of several, one.
    """
    welded = mesh.welded
    half_edges, first = welded.table.half_edges, welded.table.first
    shared = first[:-1][np.diff(first) > 1]
    one, other = half_edges[shared], half_edges[shared + 1]
    neighbor = np.full(3 * mesh.n_faces, -1, np.int32)
    neighbor[one], neighbor[other] = other // 3, one // 3
    return np.concatenate([welded.faces, neighbor.reshape(-1, 3)], axis=1)
