"""Random points on the surface of a mesh, uniform by area."""

from dataclasses import dataclass

import numpy as np

from ..arrays import Barycentrics, FaceValues, Indices, Points
from ..errors import MeshError
from .measures import face_areas, face_normals
from .mesh import Mesh


@dataclass(frozen=True, eq=False)
class SurfacePoints:
    """Points on a mesh, and where on it.

    Attributes
    ----------
    points : (n, 3) float64
        World units.
    normals : (n, 3) float64
        Unit normal of the face.
    face_index : (n,) int32
        The face of the mesh that the point lies on.
    barycentric : (n, 3) float64
        ``points = barycentric @ corners of the face``; each in [0, 1], together 1.
    """

    points: Points
    normals: Points
    face_index: Indices
    barycentric: Barycentrics


class SurfaceSampler:
    """Draws points from a mesh, each place as likely as any other; prepared once, drawn often.

    Parameters
    ----------
    mesh : Mesh
        Any triangles with area. Faces that overlap count each.

    Raises
    ------
    MeshError
        No face has an area.

    Notes
    -----
    Method: a face by the inverse of the summed areas, a place in it by the square root of a
    uniform number (Osada et al. 2002, "Shape distributions", doi:10.1145/571647.571648).
    Cost: O(m) to build, O(log m) per point.
    """

    def __init__(self, mesh: Mesh) -> None:
        self._mesh, self._normals = mesh, face_normals(mesh)
        self._reached = np.cumsum(_areas(mesh))
        if mesh.n_faces == 0 or not self._reached[-1] > 0:
            raise MeshError(
                f"none of the {mesh.n_faces} faces has an area, so no point can be drawn",
                "SurfaceSampler(mesh)",
                "pass a mesh with faces",
            )

    def __call__(self, n: int, random: np.random.Generator) -> SurfacePoints:
        """Draw n points; the same state of ``random`` gives the same ones."""
        at = random.random(n) * self._reached[-1]
        # A face without area is never chosen: its sum equals the one before
        last = len(self._reached) - 1
        face = np.searchsorted(self._reached, at, side="right").clip(max=last).astype(np.int32)
        root, share = np.sqrt(random.random(n)), random.random(n)
        weights = np.stack([1 - root, root * (1 - share), root * share], axis=1)
        points = np.einsum("ni,nij->nj", weights, self._mesh.vertices[self._mesh.faces[face]])
        return SurfacePoints(points, self._normals[face], face, weights)


def sample_surface(mesh: Mesh, n: int, *, seed: int = 0) -> SurfacePoints:
    """Draw n points from the surface of a mesh, uniform by area.

    Parameters
    ----------
    mesh : Mesh
        Any triangles with area.
    n : int
        How many, from 0 on.
    seed : int
        From 0 on; the same seed gives the same points.

    Raises
    ------
    MeshError
        No face has an area.

    Examples
    --------
    >>> from meshsdf.mesh.primitives import box_mesh
    >>> found = sample_surface(box_mesh(), 1000)
    >>> bool(np.allclose(np.abs(found.points).max(axis=1), 0.5))
    True
    """
    return SurfaceSampler(mesh)(n, np.random.default_rng(seed))


def _areas(mesh: Mesh) -> FaceValues:
    """Areas up to a factor: neither 0 nor infinite because the mesh is tiny or huge."""
    size = mesh.box.longest_side if mesh.n_faces else 0.0
    if not size > 0:
        return np.zeros(mesh.n_faces)
    return face_areas(Mesh((mesh.vertices - mesh.box.center) / size, mesh.faces))
