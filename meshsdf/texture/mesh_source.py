"""A mesh's own colours as a function of space: what its closest place says."""

import numpy as np
from jaxtyping import Float64

from ..arrays import Barycentrics, Indices, Number, Points, Values
from ..mesh import Mesh
from ..spatial import ClosestPoint
from ..spatial.mesh_colors import MeshColors
from .channels import Numbers

STEPS = (1.0, 2.0, 4.0)  # how far to look past a sheet of the other side, in footprints


class MeshSource:
    """Colours of a mesh (image, materials, vertex colours) at the closest point of any place.

    Parameters
    ----------
    mesh : Mesh
        Textured or coloured.

    Notes
    -----
    Where a normal is given and the closest face looks the other way, the place belongs to the
    other side of something thin: it is moved along its normal by a few footprints until the
    closest face looks along it.
    """

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh
        self.colors = MeshColors(mesh)
        self._closest = ClosestPoint(mesh)
        corners = mesh.triangles
        self._cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])

    def __call__(
        self,
        points: Points,
        normals: Float64[np.ndarray, "n 3"] | None = None,
        footprint: Number | Values = 0.0,
        feet: Points | None = None,
    ) -> Numbers:
        """(n, 4) linear RGB and alpha, averaged over the footprint (world units).

        ``feet``, if they are given, are asked in place of the points: see `VolumeTexture.feet`.
        """
        places = self.places(points if feet is None else feet, normals, footprint)
        return self.colors(*places, footprint)

    def places(
        self,
        points: Points,
        normals: Float64[np.ndarray, "n 3"] | None = None,
        step: Number | Values = 0.0,
    ) -> tuple[Indices, Barycentrics]:
        """The faces that answer, and where on them; steps off the wrong side are in world units."""
        found = self._closest(points)
        face, barycentric = found.face_index.copy(), found.barycentric.copy()
        if normals is not None:
            width = np.broadcast_to(np.asarray(step, np.float64), len(points))
            wrong = np.flatnonzero(self._looks_away(face, normals))
            for factor in STEPS:
                if len(wrong) == 0:
                    break
                moved = points[wrong] + factor * width[wrong, None] * normals[wrong]
                other = self._closest(moved)
                right = ~self._looks_away(other.face_index, normals[wrong])
                face[wrong[right]] = other.face_index[right]
                barycentric[wrong[right]] = other.barycentric[right]
                wrong = wrong[~right]
        return face, barycentric

    def _looks_away(self, face: np.ndarray, normals: np.ndarray) -> np.ndarray:
        return np.einsum("nk,nk->n", self._cross[face], normals) < 0
