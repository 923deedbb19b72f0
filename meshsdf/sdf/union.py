"""Distances to the union of overlapping bodies: when to look for inner faces, and what is left.

Where the sign is that of whole winding numbers, inside is where they are not 0, and only faces
across which that changes bound anything. Ordinary meshes have no others, and nothing is searched
for in them. The search (`mesh.outer_boundary`) is made

- where the boxes of two parts meet, or bodies are one part because they share an edge;
- where a winding number beyond -1, 0 and 1 has been seen: at a node of the lattice, or beside a
  face of a sample (`beside_faces`) where there is no lattice;
- where `check` has counted crossing faces, if it was asked to.

So it is not made for a single part that overlaps itself so little that no node lies in the overlap
(or that touches itself in faces with different corners), unless its crossings were counted: its
inner walls are then measured to. Open meshes, which have no whole winding numbers, keep theirs too.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, Int32

from ..arrays import FaceLabels, Faces, Points, Vector3
from ..errors import SdfError
from ..mesh import OuterBoundary, TwoSetReport
from ..mesh.outer_boundary import NEAR, CornerWeights

# Times the longest side. Sheets up to 16 NEAR of it apart may count as one; a node may lie right
# between two of them. Seen from so far beside it, in a direction that lies in no lattice plane of
# small integers, it does not.
ASIDE = 128 * NEAR * np.sqrt(np.array([1.0, 2.0, 5.0]) / 8.0)

MOST_SAMPLES = 1024  # faces; all their places together take a few milliseconds
CLOSE = 1e-3  # times the square root of twice a face's area


@dataclass(frozen=True, eq=False)
class MeshParts:
    """Triangles that are faces of a mesh, or parts of faces.

    Attributes
    ----------
    points, faces : (u, 3) float64, (k, 3) int32
        The mesh's own points come first.
    face_ids : (k,) int32
        The face that each triangle is a part of, ascending.
    weights : (k, 3, 3) float64
        Barycentrics of its corners there.
    n_inner : int
        Faces of the mesh that are missing, wholly or in part.
    """

    points: Points
    faces: Faces
    face_ids: FaceLabels
    weights: CornerWeights
    n_inner: int


def may_overlap(report: TwoSetReport) -> bool:
    """Tell whether the report gives reason to look for inner faces."""
    if report.n_nonmanifold_edges or report.n_self_intersections:
        return True
    boxes = [component.box for component in report.components]
    if len(boxes) < 2:
        return False
    lower, upper = (np.array([getattr(b, end) for b in boxes]) for end in ("lower", "upper"))
    upper += NEAR * (upper.max(axis=0) - lower.min(axis=0)).max()
    order = np.argsort(lower[:, 0])
    lower, upper = lower[order], upper[order]
    last = np.searchsorted(lower[:, 0], upper[:, 0], side="right")
    for i in range(len(boxes) - 1):
        later = slice(i + 1, last[i])
        meet = (lower[later] <= upper[i]) & (lower[i] <= upper[later])
        if meet.all(axis=1).any():
            return True
    return False


def aside(points: Points) -> Vector3:
    """Return the step from a place to where its side is taken, when distances are to a union."""
    return (points.max(axis=0) - points.min(axis=0)).max() * ASIDE


def require_faces(found: OuterBoundary) -> None:
    """SdfError if a union has no boundary."""
    if len(found.face_ids) == 0:
        raise SdfError(
            f"all {found.n_inner} faces cancel: no winding number is other than 0, so nothing has "
            "an inside",
            'mesh_to_band(sign="winding")',
            'pass sign="unsigned" to measure the distance to the faces',
        )


def parts_of_union(
    found: OuterBoundary,
    placed_ids: Int32[np.ndarray, " p"],
    closed_ids: Int32[np.ndarray, " c"],
    points: Points,
    mesh_faces: Faces,
) -> MeshParts:
    """Return the parts of a mesh that bound the union.

    Parameters
    ----------
    found : OuterBoundary
        Of the closed mesh that crossings are counted with.
    placed_ids : (p,) int32
        The faces that distances are measured to otherwise.
    closed_ids : (c,) int32
        The faces of the closed mesh: the same, but for cracks.
    points, mesh_faces
        The mesh as it is, cracks and all.

    Notes
    -----
    Faces that vanish when cracks are zipped are kept where they share a vertex with what is left.
    """
    more, faces = found.place(points, mesh_faces[closed_ids])
    ids, weights = closed_ids[found.face_ids], found.weights
    lost = np.setdiff1d(placed_ids, closed_ids)
    if len(lost):
        is_used = np.zeros(len(more), np.bool_)
        is_used[faces] = True
        lost = lost[is_used[mesh_faces[lost]].any(axis=1)]
        faces, ids = np.concatenate([faces, mesh_faces[lost]]), np.concatenate([ids, lost])
        weights = np.concatenate([weights, np.tile(np.eye(3), (len(lost), 1, 1))])
        order = np.argsort(ids, kind="stable")
        faces, ids, weights = faces[order], ids[order], weights[order]
    return MeshParts(more, faces, ids, weights, found.n_inner)


def beside_faces(points: Points, faces: Faces) -> Float64[np.ndarray, "s 3"]:
    """Return places close to the middles of faces, on both sides; of many faces, a sample."""
    a, b, c = (points[faces[:: 1 + len(faces) // MOST_SAMPLES, i]] for i in range(3))
    normal = np.cross(b - a, c - a)
    double = np.linalg.norm(normal, axis=1, keepdims=True)
    step = CLOSE * normal / np.sqrt(np.where(double > 0.0, double, 1.0))
    middle = (a + b + c) / 3.0
    return np.concatenate([middle - step, middle + step])


def union_words(report: TwoSetReport, n_inner_faces: int) -> str:
    """Say what distances are measured to, where some faces lie inside."""
    n = report.n_components
    what = "the mesh overlaps or touches itself" if n == 1 else f"{n} parts overlap or touch"
    does = "lies" if n_inner_faces == 1 else "lie"
    return (
        f"{what}: distances are to the union; {n_inner_faces} of {report.n_faces} faces {does} "
        "inside it, wholly or in part"
    )
