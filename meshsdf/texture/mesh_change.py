"""What changed between two meshes: the faces that only one of them has."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from ..arrays import FaceMask, Number, Points
from ..mesh import Mesh
from ..spatial import ClosestPoint


@dataclass(frozen=True, eq=False)
class MeshChange:
    """Two meshes, ready for closest points, and their difference.

    Attributes
    ----------
    old, new : ClosestPoint
        Of the two meshes.
    changed : ClosestPoint or None
        Of all faces that only one mesh has; None if there are none.
    """

    old: ClosestPoint
    new: ClosestPoint
    changed: ClosestPoint | None

    @classmethod
    def between(cls, old: Mesh, new: Mesh) -> "MeshChange":
        """Compare two meshes, face by face."""
        triangles = np.concatenate(
            [old.triangles[~is_in(old, new)], new.triangles[~is_in(new, old)]]
        )
        changed = None
        if len(triangles):
            faces = np.arange(3 * len(triangles), dtype=np.int32).reshape(-1, 3)
            changed = ClosestPoint(Mesh(triangles.reshape(-1, 3), faces))
        return cls(ClosestPoint(old), ClosestPoint(new), changed)

    def is_near(self, points: Points, distance: Number) -> Bool[np.ndarray, " n"]:
        """Which points are no farther than a distance from a changed face."""
        if self.changed is None:
            return np.zeros(len(points), bool)
        return self.changed.distances(points).distance <= distance


def is_in(mesh: Mesh, other: Mesh) -> FaceMask:
    """(m,) which faces of a mesh the other has, too: the same corners, bit by bit, and the same way
    round, whichever comes first."""
    return np.isin(_keys(mesh), _keys(other))


def face_normals(mesh: Mesh) -> Float64[np.ndarray, "m 3"]:
    """Unit normals; zero for faces without area."""
    corners = mesh.triangles
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(cross, axis=1, keepdims=True)
    return np.divide(cross, length, out=np.zeros_like(cross), where=length > 0)


def _keys(mesh: Mesh) -> np.ndarray:
    """(m,) numbers of 72 bytes: the corners of every face, the least first."""
    corners = mesh.triangles + 0.0  # so that -0 and 0 are one
    first = np.zeros(len(corners), np.int64)
    for corner in (1, 2):
        best = corners[np.arange(len(corners)), first]
        apart = corners[:, corner] != best
        axis = apart.argmax(axis=1)
        rows = np.arange(len(corners))
        first[corners[rows, corner, axis] < best[rows, axis]] = corner
    order = (first[:, None] + np.arange(3)) % 3
    turned = np.take_along_axis(corners, order[:, :, None], axis=1)
    return np.ascontiguousarray(turned).reshape(len(corners), 9).view("S72")[:, 0]
