"""The signed distance from any points to a mesh, with the closest places."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool

from ..arrays import Barycentrics, Indices, Points, Values
from ..errors import SdfError
from ..mesh import Mesh
from ..mesh.two_set import TwoSetReport, check
from ..progress import Progress, silent
from ..spatial.closest_point import ClosestPoint
from .placed_mesh import bounding_faces
from .point_sides import PointSides
from .sign import SignMethod, choose_sign
from .union import aside, may_overlap, union_words


@dataclass(frozen=True, eq=False)
class PointDistances:
    """For every query its signed distance and the nearest place on the mesh.

    Attributes
    ----------
    distance : (n,) float64
        World units, negative inside.
    closest_point : (n, 3) float64
        World units.
    face_index : (n,) int32
        The face of the mesh that it lies on.
    barycentric : (n, 3) float64
        ``closest_point = barycentric @ corners of the face``; each in [0, 1], together 1.
    uncertain : (n,) bool or None
        Of which the side is not certain, as `NarrowBand.uncertain` says; None if it is of all.
    """

    distance: Values
    closest_point: Points
    face_index: Indices
    barycentric: Barycentrics
    uncertain: Bool[np.ndarray, " n"] | None = None


class MeshDistance:
    """Signed distances to one mesh, for any points: near or far, in any order.

    Parameters
    ----------
    mesh : Mesh
        Any triangles with area.
    sign : "auto", "parity", "winding" or "unsigned"
        How inside is told, as in `mesh_to_band`: "auto" asks `check`.
    report : TwoSetReport, optional
        What `check` said of this mesh, if it is known already.

    Attributes
    ----------
    sign : str
        The method taken: "parity", "winding" or "unsigned".
    reason : str
        Why, in words for people.
    warnings : tuple of str
        What the user should know about the sign, and about faces that are not measured to.

    Raises
    ------
    SdfError
        A mesh without area, or parity asked of an open mesh.

    Notes
    -----
    Accuracy: the magnitude is that of `ClosestPoint`, to the faces that do not cancel. The sign of
    a closed mesh is exact wherever the magnitude exceeds ``rounding_bound``: the parity, or the
    integer winding number, of the point. For open meshes it is that of the generalised winding
    number against 1/2.
    Union: as in `mesh_to_band`, overlapping bodies are measured as their union. An overlap of one
    part with itself is seen if it holds a place beside the middle of a face, of those of a sample.
    Determinism: the result does not depend on the order of the points or on threads.
    Cost: O(m log m) to build; per point O(log m) for the distance and one ray for the sign.

    Examples
    --------
    >>> from meshsdf.mesh.primitives import box_mesh
    >>> found = MeshDistance(box_mesh())(np.array([[2.0, 0.25, 0.0], [0.25, 0.0, 0.0]]))
    >>> found.distance
    array([ 1.5 , -0.25])
    >>> found.closest_point[0]
    array([0.5 , 0.25, 0.  ])
    """

    def __init__(
        self, mesh: Mesh, *, sign: SignMethod = "auto", report: TwoSetReport | None = None
    ) -> None:
        if mesh.n_faces == 0:
            raise SdfError(
                "the mesh has no faces, so nothing is near",
                "MeshDistance(mesh)",
                "pass a mesh with at least one face",
            )
        if report is None:
            report = check(mesh, self_intersections=False)
        choice = choose_sign(report, sign)
        self.sign, self.reason, self.warnings = choice.method, choice.reason, choice.warnings
        welded = mesh.welded
        cancel = choice.method if choice.by_crossings else "unsigned"
        keep = bounding_faces(welded, cancel=cancel, report=report)
        self._faces, self._weights = np.flatnonzero(keep).astype(np.int32), None
        self._blur = 0.0
        self._query = ClosestPoint(Mesh(welded.points, welded.faces[keep]))
        self._sides = PointSides(mesh, self._query, choice, report)
        self._certain_beyond = None
        if choice.by_crossings and report.repair is not None:
            self._certain_beyond = report.repair.certain_beyond
        parts = None
        if cancel == "winding":
            parts = self._sides.find_union(self._faces, search=may_overlap(report))
        if parts is not None:
            self._faces, self._weights = parts.face_ids, parts.weights
            self._query = ClosestPoint(Mesh(parts.points, parts.faces))
            self._blur = float(np.linalg.norm(aside(welded.points)))
            self.warnings += (union_words(report, parts.n_inner),)

    def __call__(self, points: Points, *, progress: Progress = silent) -> PointDistances:
        """Measure (n, 3) points, world units.

        Raises
        ------
        SdfError
            A point is not finite.
        """
        _check_points(points)
        found = self._query(points, progress=progress)
        distance = found.distance
        inside, uncertain = self._sides(points, progress)
        if self._certain_beyond is not None:
            uncertain = distance <= self._certain_beyond
        np.negative(distance, out=distance, where=inside)
        faces, weights = self._faces[found.face_index], found.barycentric
        if self._weights is not None:
            weights = np.einsum("ni,nij->nj", weights, self._weights[found.face_index])
        return PointDistances(distance, found.point, faces, weights, uncertain)

    def rounding_bound(self, points: Points) -> Values:
        """(n,) proven bound on the error of the magnitude; the sign is exact beyond it."""
        return self._query.rounding_bound(points) + self._blur


def _check_points(points: Points) -> None:
    if np.isfinite(points).all():
        return
    bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
    raise SdfError(
        f"{len(bad)} of {len(points)} points are NaN or infinite (first: point {bad[0]})",
        "MeshDistance(...)(points)",
        "leave those points out",
    )
