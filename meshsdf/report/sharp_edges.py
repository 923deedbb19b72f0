"""What became of the sharp edges of a mesh: how far they are from another surface, at most.

An edge is cut into short pieces whose ends are measured. On a piece of length l with distances a
and b at its ends no point is farther than (a + b + l) / 2, for distance grows no faster than the
way; if both ends have the same closest face, none is farther than the farther end, for the
distance to a convex set is convex. Pieces that may still hold the maximum are halved.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from ..arrays import Indices, Number, Points, Values, Vector3
from ..mesh import Mesh
from ..mesh.measures import face_normals
from ..progress import Progress, silent
from ..spatial.closest_point import ClosestPoint
from .enclosure import Enclosure

SHARP_ANGLE = 30.0
"""In degrees, as in `dual_contouring`: an edge whose faces turn by more is sharp."""

KEPT_WITHIN = 0.1
"""In voxels: an edge counts as kept where the other surface is no farther."""

PIECES_PER_VOXEL = 16
MOST_PIECES = 300_000  # a second of work

Segments = Float64[np.ndarray, "k 2 3"]


@dataclass(frozen=True, eq=False)
class SharpEdges:
    """The sharp edges of a mesh, and how far another surface stays away from them.

    Attributes
    ----------
    angle : float
        Degrees; their faces turn by more.
    n_edges : int
        How many there are, equal positions joined.
    length : float
        Of all together, world units.
    distance : Enclosure
        Holds the largest distance of a point on them from the other surface, world units.
    witness : (3,) float64
        A point on them at distance ``distance.lower`` or more.
    kept : Enclosure
        Holds the share of their length that is within `KEPT_WITHIN` voxels of it.
    """

    angle: float
    n_edges: int
    length: float
    distance: Enclosure
    witness: Vector3
    kept: Enclosure


@dataclass(frozen=True, eq=False)
class _Pieces:
    """Straight pieces of edges, and what is known at their ends."""

    begin: Points
    end: Points
    begin_distance: Values
    end_distance: Values
    begin_face: Indices
    end_face: Indices

    @property
    def length(self) -> Values:
        return np.linalg.norm(self.end - self.begin, axis=1)

    @property
    def upper(self) -> Values:
        """No point of the piece is farther."""
        farther = np.maximum(self.begin_distance, self.end_distance)
        bent = 0.5 * (self.begin_distance + self.end_distance + self.length)
        return np.where(self.begin_face == self.end_face, farther, np.maximum(farther, bent))

    @property
    def lower(self) -> Values:
        """No point of the piece is nearer."""
        return 0.5 * (self.begin_distance + self.end_distance - self.length)

    def take(self, which: np.ndarray) -> "_Pieces":
        return _Pieces(*(getattr(self, name)[which] for name in self.__dataclass_fields__))


def sharp_segments(mesh: Mesh, angle: Number = SHARP_ANGLE) -> Segments:
    """Return the ends of the edges whose two faces turn by more than ``angle`` degrees.

    Edges with one face are rims of openings, not sharp; those with more than two are left out.
    """
    points, faces, table = mesh.welded.points, mesh.welded.faces, mesh.welded.table
    normals = face_normals(Mesh(points, faces))
    of_two = np.flatnonzero(table.n_uses == 2)
    first = table.first[of_two]
    left, right = table.half_edges[first] // 3, table.half_edges[first + 1] // 3
    # Faces that use an edge the same way look to different sides
    facing = np.where(table.net_uses[of_two] == 0, 1.0, -1.0)
    cosine = facing * np.einsum("ij,ij->i", normals[left], normals[right])
    has_normals = normals[left].any(axis=1) & normals[right].any(axis=1)
    return points[table.edges[of_two[has_normals & (cosine < np.cos(np.radians(angle)))]]]


def sharp_edges(
    source: Mesh,
    target: Mesh,
    *,
    voxel_size: Number,
    tolerance: Number,
    angle: Number = SHARP_ANGLE,
    progress: Progress = silent,
) -> SharpEdges | None:
    """Measure how far the sharp edges of ``source`` are from ``target``; None if there are none.

    Parameters
    ----------
    source, target : Mesh
        The target has at least one face.
    voxel_size : float
        World units; sets what counts as kept.
    tolerance : float
        World units: the largest distance is enclosed as narrowly, unless that takes more than
        `MOST_PIECES` pieces. The interval is true then, but wider.
    angle : float
        Degrees.
    """
    segments = sharp_segments(source, angle)
    if len(segments) == 0:
        return None
    closest = ClosestPoint(target)
    pieces = _cut(segments, voxel_size / PIECES_PER_VOXEL, closest)
    lengths = np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1)
    # Once for the distance, once for the place of an end
    rounding = 2 * float(closest.rounding_bound(segments.reshape(-1, 3)).max())
    kept = _kept(pieces, KEPT_WITHIN * voxel_size, rounding)
    best, witness, upper = _largest(pieces, tolerance, closest, progress)
    distance = Enclosure(max(best - rounding, 0.0), upper + rounding)
    return SharpEdges(float(angle), len(segments), float(lengths.sum()), distance, witness, kept)


def _cut(segments: Segments, longest: float, closest: ClosestPoint) -> _Pieces:
    """Pieces no longer than ``longest``, or as short as their number allows."""
    lengths = np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1)
    longest = max(longest, float(lengths.sum()) / MOST_PIECES)
    n = np.maximum(np.ceil(lengths / longest), 1).astype(np.int64)
    edge = np.repeat(np.arange(len(n)), n + 1)
    step = np.arange(len(edge)) - np.repeat(np.cumsum(n + 1) - (n + 1), n + 1)
    part = (step / n[edge])[:, None]
    points = (1 - part) * segments[edge, 0] + part * segments[edge, 1]
    found = closest.distances(points)
    begin = np.flatnonzero(step < n[edge])
    ends = [(values[begin], values[begin + 1]) for values in (points, found.distance)]
    faces = found.face_index[begin], found.face_index[begin + 1]
    return _Pieces(*ends[0], *ends[1], *faces)


def _kept(pieces: _Pieces, limit: float, rounding: float) -> Enclosure:
    """Hold the share of length within ``limit``."""
    lengths = pieces.length
    total = float(lengths.sum())
    inside = float(lengths[pieces.upper + rounding <= limit].sum())
    outside = float(lengths[pieces.lower - rounding > limit].sum())
    return Enclosure(min(inside / total, 1.0), max(1.0 - outside / total, min(inside / total, 1.0)))


def _largest(
    pieces: _Pieces, tolerance: Number, closest: ClosestPoint, progress: Progress
) -> tuple[float, Vector3, float]:
    """Return the largest distance seen, where, and a bound on the largest there is."""
    ends = np.concatenate([pieces.begin_distance, pieces.end_distance])
    best, at = float(ends.max()), int(ends.argmax())
    witness = np.concatenate([pieces.begin, pieces.end])[at]
    n_pieces, settled = len(pieces.begin), 0.0  # settled: a bound for the pieces laid aside
    while True:
        upper = pieces.upper
        is_open = upper > best + tolerance
        n_pieces += int(is_open.sum())
        if not is_open.any() or n_pieces > 2 * MOST_PIECES:
            return best, witness, max(best, settled, float(upper.max(initial=0.0)))
        settled = max(settled, float(upper[~is_open].max(initial=0.0)))
        left = pieces.take(is_open)
        progress("sharp edges", 1.0 - len(left.begin) / n_pieces)
        middle = 0.5 * (left.begin + left.end)
        found = closest.distances(middle)
        if found.distance.max() > best:
            best, witness = float(found.distance.max()), middle[found.distance.argmax()]
        pieces = _halves(left, middle, found.distance, found.face_index)


def _halves(pieces: _Pieces, middle: Points, distance: Values, face: Indices) -> _Pieces:
    both = np.concatenate
    return _Pieces(
        both([pieces.begin, middle]),
        both([middle, pieces.end]),
        both([pieces.begin_distance, distance]),
        both([distance, pieces.end_distance]),
        both([pieces.begin_face, face]),
        both([face, pieces.end_face]),
    )
