"""Which parts of a surface did not come back at all: farther than a voxel at every point."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Int32

from ..arrays import FaceMask, Number, Vector3
from ..errors import ReportError
from ..mesh import Mesh
from ..mesh.measures import face_areas
from ..mesh.pieces import connected_labels
from .distance_pieces import Bounds, Pieces, Ruler
from .enclosure import Enclosure

MAX_LEVEL = 24  # cuts of a face before it is given up
MOST_PIECES = 200_000  # that are not decided, at any time


@dataclass(frozen=True, eq=False)
class LostPart:
    """Faces of the source that hang together by edges, each certainly far from the target.

    Attributes
    ----------
    n_faces : int
        How many.
    area : float
        Of all together, square world units.
    center : (3,) float64
        Their centre of mass, world units; the mean of the centroids where they have no area.
    largest : Enclosure
        Holds the largest distance of a point on them from the target, world units; narrow where
        the faces are small against it.
    """

    n_faces: int
    area: float
    center: Vector3
    largest: Enclosure


def lost_parts(source: Mesh, target: Mesh, voxel_size: Number) -> tuple[LostPart, ...]:
    """Find the parts of ``source`` that are certainly farther than a voxel from ``target``.

    Parameters
    ----------
    source, target : Mesh
        At least one face each.
    voxel_size : float
        World units.

    Returns
    -------
    parts : tuple of LostPart
        Of largest area first. A face counts if every point of it is farther than ``voxel_size``,
        proven by bounds as in `kernels.tangent_distance` on pieces of it; faces hang together if
        they share an edge, equal positions joined.

    Raises
    ------
    ReportError
        The voxel size is not positive.

    Examples
    --------
    >>> from meshsdf.mesh.primitives import box_mesh
    >>> (part,) = lost_parts(box_mesh((3.0, 3.0, 3.0)), box_mesh(), 0.5)
    >>> part.n_faces, part.area
    (12, 54.0)
    >>> part.largest.contains(3**0.5)  # from corner to corner
    True
    """
    if not voxel_size > 0:
        what = f"the voxel size is {voxel_size:g}"
        raise ReportError(what, "lost_parts(voxel_size=...)", "pass a positive length")
    ruler = Ruler(source, target)
    return parts_of(source, ruler, ruler.pieces_of(source), voxel_size)


def parts_of(
    source: Mesh, ruler: Ruler, pieces: Pieces, voxel_size: Number
) -> tuple[LostPart, ...]:
    """Do the same with all faces of the source measured at their corners already."""
    far = np.sqrt(pieces.squares) > voxel_size + ruler.rounding
    candidates = pieces.take(far.all(axis=1))
    if len(candidates) == 0:
        return ()
    first = ruler.tangents(candidates)
    is_lost = np.zeros(source.n_faces, np.bool_)
    is_lost[candidates.face] = True
    _rule_out(ruler, candidates, first, voxel_size, is_lost)
    label = _labels(source, is_lost)
    of_candidate = label[candidates.face]
    order = np.argsort(of_candidate, kind="stable")
    ends = np.searchsorted(of_candidate[order], np.arange(-1, label.max() + 1), side="right")
    parts = []
    for begin, end in pairwise(ends.tolist()):
        mine = order[begin:end]
        near = np.sqrt(candidates.squares[mine]).max() - ruler.rounding
        upper = first.span[mine, 1].max() + ruler.rounding
        largest = Enclosure(max(float(near), 0.0), float(upper))
        parts.append(_part(source, candidates.face[mine], largest))
    return tuple(sorted(parts, key=lambda part: -part.area))


def _rule_out(
    ruler: Ruler, pieces: Pieces, bounds: Bounds, voxel_size: Number, is_lost: FaceMask
) -> None:
    """Clear the faces that have a point within a voxel, or of which it is not known."""
    far = voxel_size + ruler.rounding
    for _ in range(MAX_LEVEL):
        near = np.sqrt(pieces.squares) <= far
        is_lost[pieces.face[near.any(axis=1)]] = False
        open_ = is_lost[pieces.face] & (bounds.span[:, 0] <= far)
        pieces = pieces.take(open_)
        if len(pieces) == 0 or len(pieces) > MOST_PIECES:
            break
        pieces = ruler.halves(pieces)
        bounds = ruler.tangents(pieces)
    is_lost[pieces.face] = False


def _labels(source: Mesh, is_lost: FaceMask) -> Int32[np.ndarray, " m"]:
    """Number the connected parts; -1 for faces that are in none."""
    faces = np.flatnonzero(is_lost)
    labels = np.full(source.n_faces, -1, np.int32)
    if len(faces) == 0:
        return labels
    edges = source.welded.table.edge_of_corner[faces]
    used, edge = np.unique(edges, return_inverse=True)
    face = np.repeat(np.arange(len(faces)), 3)
    links = np.column_stack([face, len(faces) + edge.reshape(-1)])[edges.reshape(-1) >= 0]
    found = connected_labels(len(faces) + len(used), links)[: len(faces)]
    labels[faces] = np.unique(found, return_inverse=True)[1]
    return labels


def _part(source: Mesh, faces: Int32[np.ndarray, " k"], largest: Enclosure) -> LostPart:
    part = Mesh(source.vertices, source.faces[faces])
    areas, centers = face_areas(part), part.triangles.mean(axis=1)
    weights = areas if areas.sum() > 0 else np.ones(len(areas))
    center = (weights[:, None] * centers).sum(axis=0) / weights.sum()
    return LostPart(len(faces), float(areas.sum()), center, largest)
