"""Find the point of a mesh farthest from another: branch and bound over triangles, in batches.

A piece is a triangle of the source, or a part of one, with its four points (corners and centroid),
their closest faces and an upper bound. Pieces that cannot beat the best distance found by more
than the tolerance are settled; the others are cut in two at the middle of their longest side,
which keeps needles from staying needles. One level is worked off at a time, largest bound first,
so what the first batches find spares the later ones.
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
MANY, STUBBORN = 1000, 4  # pieces, level: then it pays to know which faces of the target touch
MAX_LEVEL = 100  # a piece is then 2**-50 of its triangle's size: rounding
RELATIVE_TOLERANCE = 1e-3  # of the distance itself: three digits are enough to compare
DIAGONAL_TOLERANCE = 1e-6  # of the target's diagonal, for surfaces that coincide

# Cut at the middle of 0 1: points 0 1 2 (corners), 3 (centroid), 4 (middle), 5 6 (new centroids)
_PARTS = np.array([[0, 4, 2, 5], [4, 1, 2, 6]])
_LONGEST_FIRST = np.array([[0, 1, 2, 3], [1, 2, 0, 3], [2, 0, 1, 3]])


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
        The largest distance computed, at ``witness`` (centred), on ``source_face``; ``slot`` is
        the closest face there.
    settled : float
        The largest upper bound among pieces that need no further cut.
    waiting, following : lists of Pieces
        To be cut on this level, largest bound first, and on the next.
    """

    def __init__(
        self, source: Mesh, closest: ClosestPoint, tolerance: float | None, progress: Progress
    ) -> None:
        self.closest = closest
        self.tolerance = tolerance
        self.best, self.settled = -1.0, 0.0
        self.n_evaluations, self.level = 0, 0
        self.waiting: list[Pieces] = []
        self.following: list[Pieces] = []
        self._start(source, progress)

    @property
    def enough(self) -> float:
        """Pieces whose bound is not above this need no cut."""
        if self.tolerance is not None:
            return self.best + self.tolerance
        diagonal = 2.0 * self.closest.radius
        return self.best + max(RELATIVE_TOLERANCE * self.best, DIAGONAL_TOLERANCE * diagonal)

    @property
    def is_done(self) -> bool:
        """No piece is left that a cut could help."""
        return not self.waiting or self.level >= MAX_LEVEL

    @property
    def upper(self) -> float:
        """Upper bound of the distance, but for rounding."""
        left = [float(pieces.upper.max()) for pieces in self.waiting + self.following]
        return max([self.best, self.settled, *left])

    def step(self) -> None:
        """Cut one batch of pieces in two."""
        is_slow = self.level >= STUBBORN or sum(map(len, self.waiting)) > MANY
        if is_slow and len(self.around) == 0:
            self.around = faces_around(self.closest.mesh)
        pieces = self._keep(self.waiting.pop(0))
        if len(pieces) > 0 and len(halves := self._cut(pieces)) > 0:
            self.following.append(halves)
        if not self.waiting:
            self.level += 1
            self.waiting, self.following = self._in_batches(self.following), []

    def _start(self, source: Mesh, progress: Progress) -> None:
        """Measure all vertices and centroids, and bound every face."""
        used, corner = np.unique(source.faces, return_inverse=True)
        corners = corner.reshape(-1, 3)
        vertices = source.vertices[used] - self.closest.center
        a, b, c = (vertices[corners[:, i]] for i in range(3))
        n, m = len(used), len(corners)
        first = self.closest.search(vertices, np.empty(0, np.int32), progress)
        seeds = first[1][corners[:, 0]]
        second = self.closest.search((a + b + c) / 3.0, seeds, progress)
        points = np.concatenate([vertices, (a + b + c) / 3.0])
        squares, slots = (np.concatenate(both) for both in zip(first, second, strict=True))
        self.n_evaluations += n + m
        ids = np.column_stack([corners, np.arange(n, n + m)]).astype(np.int32)
        self.face_squares = squares[ids]
        self.around = np.empty((0, 6), np.int32)
        largest = int(squares.argmax())
        face = int(np.flatnonzero((ids == largest).any(axis=1))[0])
        self._note(points, squares, slots, face)
        upper = np.full(m, np.inf)
        faces = np.arange(m, dtype=np.int32)
        self.waiting = self._in_batches([self._bound(points, squares, slots, ids, faces, upper)])

    def _cut(self, pieces: Pieces) -> Pieces:
        """Halves of pieces, those that need cutting on."""
        k = len(pieces)
        sides = pieces.points[:, [1, 2, 0]] - pieces.points[:, :3]
        longest = np.einsum("kij,kij->ki", sides, sides).argmax(axis=1)
        turned = _LONGEST_FIRST[longest]
        v = np.take_along_axis(pieces.points, turned[:, :, None], axis=1)
        near = np.take_along_axis(pieces.slots, turned, axis=1)
        middle = 0.5 * (v[:, 0] + v[:, 1])
        ends = v[:, 2] + middle
        new = np.stack([middle, (v[:, 0] + ends) / 3.0, (v[:, 1] + ends) / 3.0], axis=1)
        seeds = near[:, [3, 0, 1]].reshape(-1)
        squares, slots = self.closest.search(new.reshape(-1, 3), seeds)
        self.n_evaluations += 3 * k
        old = np.take_along_axis(pieces.squares, turned, axis=1)
        points = np.concatenate([v, new], axis=1).reshape(-1, 3)
        squares = np.concatenate([old, squares.reshape(k, 3)], axis=1).reshape(-1)
        slots = np.concatenate([near, slots.reshape(k, 3)], axis=1).reshape(-1)
        ids = (7 * np.arange(k)[:, None, None] + _PARTS).reshape(-1, 4).astype(np.int32)
        self._note(points, squares, slots, int(pieces.face[int(squares.argmax()) // 7]))
        faces, upper = np.repeat(pieces.face, 2), np.repeat(pieces.upper, 2)
        return self._bound(points, squares, slots, ids, faces, upper)

    def _bound(
        self,
        points: Points,
        squares: Values,
        slots: Indices,
        ids: Int32[np.ndarray, "k 4"],
        faces: Int32[np.ndarray, " k"],
        upper: Float64[np.ndarray, " k"],
    ) -> Pieces:
        """Bound pieces given by point numbers; settle those with a bound that is enough."""
        found = np.empty(len(ids))
        tasks = even_ranges(len(ids), len(ids) // PIECES_PER_TASK + 1)
        closest = self.closest
        target = (closest.frames, closest.corners, closest.face_of_slot, self.around)
        enough = self.enough

        def work(task: int) -> None:
            begin, end = tasks[task]
            upper_bounds(points, squares, slots, ids, begin, end, enough, *target, found)

        run_pieces(work, len(tasks))
        upper = np.minimum(found, upper)
        open_ = upper > enough
        self.settled = max(self.settled, float(upper[~open_].max(initial=0.0)))
        ids = ids[open_]
        return Pieces(points[ids], squares[ids], slots[ids], faces[open_], upper[open_])

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
        return [pieces.take(slice(i, i + BATCH)) for i in range(0, len(pieces), BATCH)]

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
    position = np.unique(mesh.vertices + 0.0, axis=0, return_inverse=True)[1].reshape(-1)
    faces = position[mesh.faces]
    m = len(faces)
    ends = np.stack([faces, faces[:, [1, 2, 0]]], axis=-1).reshape(-1, 2)
    keys = ends.min(axis=1) * np.int64(mesh.n_vertices) + ends.max(axis=1)
    order = np.argsort(keys, kind="stable")
    same = keys[order][1:] == keys[order][:-1]
    neighbor = np.full(3 * m, -1)
    neighbor[order[:-1][same]] = order[1:][same] // 3
    neighbor[order[1:][same]] = order[:-1][same] // 3
    return np.concatenate([faces, neighbor.reshape(m, 3)], axis=1).astype(np.int32)
