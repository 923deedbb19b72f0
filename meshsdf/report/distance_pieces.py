"""Pieces of a surface, and bounds on the integrals of the distance over each.

A piece is a triangle of the source, or a part of one. Its distances are bounded twice: by
`kernels.graph_distance`, where the target is a graph above it, and by
`kernels.tangent_distance`, wherever it is; what is the tighter counts.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64, Int32

from ..arrays import Number, Points, Values, writable_alias
from ..kernels.distance_integrals import finish_shares, linear_shares, linear_sums
from ..kernels.graph_distance import ANGLE, MAX_ANGLE, SETTLED, UNKNOWN, graph_measures
from ..kernels.graph_shadows import CLOSED, LONE, OPEN, SHRUNK
from ..kernels.parallel import even_ranges, run_pieces
from ..kernels.tangent_distance import tangent_bounds
from ..mesh import Mesh
from ..progress import Progress, silent
from ..spatial.closest_point import UNIT_ROUNDOFF, ClosestPoint

ROUNDING = 4096 * UNIT_ROUNDOFF
"""Times (R + r): proven bound on all rounding of a distance, twice what `kernels.graph_distance`
and its fellows derive; R and r as in `one_sided_statistics`."""

PIECES_PER_TASK = 2048
REACH_OF_CORNERS, REACH_OF_SIDE = 1.5, 0.25  # first guess of how far to look around a piece
FAR = 2.0  # pieces farther away than so many of their sides have no use for graphs
N_SUMS = 8

Thresholds = Float64[np.ndarray, " t"]
Areas = Float64[np.ndarray, "2 t"]  # certainly and possibly within each threshold

_NO_THRESHOLDS = np.empty(0)
_LONGEST_FIRST = np.array([[0, 1, 2], [1, 2, 0], [2, 0, 1]])


@dataclass(frozen=True, eq=False)
class Pieces:
    """Triangles, centred on the target's box, with what is known at their corners."""

    corners: Float64[np.ndarray, "k 3 3"]
    squares: Float64[np.ndarray, "k 3"]  # squared distances
    slots: Int32[np.ndarray, "k 3"]  # closest faces, as ClosestPoint numbers them
    areas: Float64[np.ndarray, " k"]
    face: Int32[np.ndarray, " k"]  # of the source

    def __len__(self) -> int:
        return len(self.areas)

    def take(self, which: np.ndarray | slice) -> "Pieces":
        """The pieces at an index, mask or slice."""
        return Pieces(*(getattr(self, name)[which] for name in self.__dataclass_fields__))

    @property
    def centers(self) -> Points:
        """(k, 3) centroids."""
        return self.corners.sum(axis=1) / 3.0

    @property
    def reach(self) -> Values:
        """(k,) guess of how far the faces are that matter; -1 where graphs are of no use."""
        sides = np.linalg.norm(self.corners[:, [1, 2, 0]] - self.corners, axis=2).max(axis=1)
        distances = np.sqrt(self.squares)
        guess = REACH_OF_CORNERS * distances.max(axis=1) + REACH_OF_SIDE * sides
        return np.where(distances.min(axis=1) > FAR * sides, -1.0, guess)

    def halves(self, closest: ClosestPoint) -> "Pieces":
        """Cut every piece at the middle of its longest side; one closest point each."""
        sides = self.corners[:, [1, 2, 0]] - self.corners
        turned = _LONGEST_FIRST[np.einsum("kij,kij->ki", sides, sides).argmax(axis=1)]
        v = np.take_along_axis(self.corners, turned[:, :, None], axis=1)
        middle = 0.5 * (v[:, 0] + v[:, 1])
        near = np.take_along_axis(self.slots, turned, axis=1)
        square = np.take_along_axis(self.squares, turned, axis=1)
        new_square, new_near = closest.search(middle, near[:, 0].copy())

        def both(old: np.ndarray, new: np.ndarray) -> np.ndarray:
            first = np.stack([old[:, 0], new, old[:, 2]], axis=1)
            return np.concatenate([first, np.stack([new, old[:, 1], old[:, 2]], axis=1)])

        return Pieces(
            both(v, middle),
            both(square, new_square),
            both(near, new_near),
            np.tile(0.5 * self.areas, 2),
            np.tile(self.face, 2),
        )


@dataclass(frozen=True, eq=False)
class Bounds:
    """What was found for pieces: see `kernels.graph_distance` for the columns of ``sums``.

    Attributes
    ----------
    is_graph : (k,) bool
        Bounded by a graph; by the linear functions ``lower`` and ``upper`` otherwise.
    lower, upper : (k, 3) float64
        Their values at the corners, where they were asked for.
    """

    is_graph: Bool[np.ndarray, " k"]
    sums: Float64[np.ndarray, "k 8"]
    span: Float64[np.ndarray, "k 2"]
    lower: Float64[np.ndarray, "k 3"]
    upper: Float64[np.ndarray, "k 3"]

    def take(self, which: np.ndarray | slice) -> "Bounds":
        """The bounds at an index, mask or slice."""
        return Bounds(*(getattr(self, name)[which] for name in self.__dataclass_fields__))

    @property
    def gaps(self) -> Float64[np.ndarray, "k 2"]:
        """How much is not known of the integrals of d and d²."""
        return self.sums[:, [1, 3]] - self.sums[:, [0, 2]]


class Ruler:
    """A target, ready to bound distances of pieces; counts what it does in ``n_evaluations``.

    No distance of the source is larger than ``at_most``.
    """

    def __init__(self, source: Mesh, target: Mesh, at_most: Number = np.inf) -> None:
        self.at_most = float(at_most)
        self.closest = ClosestPoint(target)
        used = np.zeros(source.n_vertices, np.bool_)
        used[source.faces] = True
        self.used = np.flatnonzero(used)
        farthest = np.linalg.norm(source.vertices[self.used] - self.closest.center, axis=1).max()
        self.size = float(farthest) + self.closest.radius
        self.rounding = ROUNDING * self.size
        self.edges = edge_kinds(target)
        self.n_evaluations = 0

    def pieces_of(self, source: Mesh, progress: Progress = silent) -> Pieces:
        """All faces of the source, measured at their corners."""
        number = np.zeros(source.n_vertices, np.int32)
        number[self.used] = np.arange(len(self.used), dtype=np.int32)
        vertices = source.vertices[self.used] - self.closest.center
        squares, slots = self.closest.search(vertices, np.empty(0, np.int32), progress)
        self.n_evaluations += len(vertices)
        ids = number[source.faces]
        corners = vertices[ids]
        sides = corners[:, 1:] - corners[:, :1]
        areas = 0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
        faces = np.arange(len(ids), dtype=np.int32)
        return Pieces(corners, squares[ids], slots[ids], areas, faces)

    def halves(self, pieces: Pieces) -> Pieces:
        """Cut every piece in two."""
        self.n_evaluations += len(pieces)
        return pieces.halves(self.closest)

    def bound(
        self,
        pieces: Pieces,
        limits: tuple[float, float],
        thresholds: Thresholds = _NO_THRESHOLDS,
        progress: Progress = silent,
    ) -> tuple[Bounds, Bool[np.ndarray, " k"], Areas]:
        """Bound all pieces; which are settled; and the areas of those within the thresholds.

        ``limits`` are the gaps of d and of d², per area, that may stay. Settled are pieces that
        are graphs within both.
        """
        self.n_evaluations += len(pieces)
        bounds, is_settled, areas = self._graphs(pieces, limits, thresholds, progress)
        rest = np.flatnonzero(~is_settled)
        if len(rest) > 0:
            linear = self.tangents(pieces.take(rest))
            better = ~bounds.is_graph[rest] | (linear.gaps[:, 0] < bounds.gaps[rest, 0])
            for name in ("is_graph", "sums", "span", "lower", "upper"):
                getattr(bounds, name)[rest[better]] = getattr(linear, name)[better]
        return bounds, is_settled, areas

    def tangents(self, pieces: Pieces) -> Bounds:
        """Bound pieces by linear functions."""
        k, closest = len(pieces), self.closest
        centers = pieces.centers
        slots = np.empty((k, 4), np.int32)
        slots[:, :3] = pieces.slots
        slots[:, 3] = closest.search(centers, pieces.slots[:, 0].copy())[1]
        self.n_evaluations += k
        lower, upper = np.empty((k, 3)), np.empty((k, 3))
        sums, span = np.zeros((k, N_SUMS)), np.empty((k, 2))
        tasks = even_ranges(k, k // PIECES_PER_TASK + 1)

        def work(task: int) -> None:
            begin, end = tasks[task]
            tangent_bounds(
                *(pieces.corners, slots, begin, end, closest.frames, closest.corners),
                *(closest.face_of_slot, *closest.tree, lower, upper),
            )
            linear_sums(lower, upper, pieces.areas, begin, end, sums, span)

        run_pieces(work, len(tasks))
        most = np.multiply.outer(pieces.areas, [self.at_most, self.at_most**2])
        sums[:, [1, 3]] = np.maximum(np.fmin(sums[:, [1, 3]], most), sums[:, [0, 2]])
        angles = self._angles(pieces, slots[:, 3])
        sums[:, ANGLE], sums[:, MAX_ANGLE] = pieces.areas * angles, angles
        return Bounds(np.zeros(k, np.bool_), sums, span, lower, upper)

    def graph_areas(self, pieces: Pieces, thresholds: Thresholds) -> Areas:
        """Areas, of pieces known to be graphs, within each of the ascending thresholds."""
        return self._graphs(pieces, (np.inf, np.inf), thresholds, silent)[2]

    def linear_areas(self, areas: Values, bounds: Bounds, thresholds: Thresholds) -> Areas:
        """Areas, of pieces between linear functions, within each of the ascending thresholds."""
        tasks = even_ranges(len(areas), len(areas) // PIECES_PER_TASK + 1)
        below = np.zeros((len(tasks), 4, len(thresholds)))
        linear = bounds.lower, bounds.upper, areas

        def work(task: int) -> None:
            linear_shares(*linear, *tasks[task], thresholds, self.rounding, below[task])

        run_pieces(work, len(tasks))
        return finish_shares(below.sum(axis=0))

    def _graphs(
        self,
        pieces: Pieces,
        limits: tuple[float, float],
        thresholds: Thresholds,
        progress: Progress,
    ) -> tuple[Bounds, Bool[np.ndarray, " k"], Areas]:
        """Bound pieces where the target is a graph above them."""
        k, closest, reach = len(pieces), self.closest, pieces.reach
        known, sums, span = np.empty(k, np.uint8), np.empty((k, N_SUMS)), np.empty((k, 2))
        tasks = even_ranges(k, k // PIECES_PER_TASK + 1)
        below = np.zeros((len(tasks), 4, len(thresholds)))
        near = (closest.corners, self.edges, closest.face_of_slot, *closest.tree)
        most = np.array(limits, dtype=np.float64)

        def work(task: int) -> None:
            graph_measures(
                *(pieces.corners, reach, *tasks[task], *near, self.size, most),
                *(thresholds, self.rounding, known, sums, span, below[task]),
            )

        run_pieces(work, len(tasks), stage="statistics", progress=progress)
        empty = np.zeros((2, k, 3))
        bounds = Bounds(known != UNKNOWN, sums, span, *empty)
        return bounds, known == SETTLED, finish_shares(below.sum(axis=0))

    def _angles(self, pieces: Pieces, slots: Int32[np.ndarray, " k"]) -> Values:
        """Angle between each piece's normal and that of the face closest to its centroid."""
        sides = pieces.corners[:, 1:] - pieces.corners[:, :1]
        normals = np.cross(sides[:, 0], sides[:, 1])
        across = self.closest.frames[slots, 9:12]
        sine = np.linalg.norm(np.cross(normals, across), axis=1)
        return np.arctan2(sine, np.einsum("ki,ki->k", normals, across))


def edge_kinds(mesh: Mesh) -> Int32[np.ndarray, "m 3"]:
    """What lies beyond the edges of every face, equal positions joined.

    CLOSED where exactly one other face uses it, the other way round, OPEN elsewhere. Faces that
    repeat a position are SHRUNK to an edge or a point of other faces, or LONE.
    """
    welded = mesh.welded
    table, faces = welded.table, welded.faces
    is_closed = (table.n_uses == 2) & (table.net_uses == 0)
    kinds = np.full((mesh.n_faces, 3), OPEN, np.int32)
    kinds[np.append(is_closed, False)[table.edge_of_corner]] = CLOSED
    shrunk = np.flatnonzero((faces == np.roll(faces, 1, axis=1)).any(axis=1))
    if len(shrunk) > 0:
        ends = np.sort(faces[shrunk], axis=1)[:, [0, 2]].astype(np.int64)
        n = np.int64(len(welded.points))
        keys = table.edges[:, 0] * n + table.edges[:, 1]
        is_used = np.zeros(n, np.bool_)
        is_used[table.edges] = True
        is_point = ends[:, 0] == ends[:, 1]
        is_part = np.where(
            is_point, is_used[ends[:, 0]], np.isin(ends[:, 0] * n + ends[:, 1], keys)
        )
        kinds[shrunk] = np.where(is_part, SHRUNK, LONE)[:, None]
    return writable_alias(kinds)
