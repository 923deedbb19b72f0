"""Carry colours and texture coordinates from a mesh to one extracted from its volume.

Every vertex takes what its closest point on the source has. Texture coordinates jump at seams:
a face takes the chart of the source's face under its middle, and a corner whose own coordinates lie
across a seam from there gets those of that chart, continued to it, on a vertex of its own.
"""

from collections.abc import Collection
from dataclasses import replace

import numpy as np
from jaxtyping import Float64

from ..arrays import Barycentrics, FaceLabels, Points2
from ..errors import SurfaceError
from ..mesh import Mesh
from ..progress import Progress, silent
from ..spatial import ClosestPoint
from ..spatial.mesh_colors import MeshColors

CARRIED = ("colours", "uv")

SAME_SIDE = 0.5
"""A corner's own coordinates are taken while they are nearer to those continued from the middle
than this part of the face's extent in the texture: farther ones lie across a seam."""


def carry(
    surface: Mesh, source: Mesh, what: Collection[str] = CARRIED, *, progress: Progress = silent
) -> Mesh:
    """Return the surface with colours or texture coordinates of the mesh it was made from.

    Parameters
    ----------
    surface : Mesh
        Where they go.
    source : Mesh
        Where they come from, in the same place.
    what : collection of {"colours", "uv"}
        "colours" gives every vertex the source's colour at the closest point, texture images
        included; "uv" gives texture coordinates and materials, so that the images stay sharp.

    Returns
    -------
    mesh : Mesh
        Vertices on seams are repeated; positions and order of faces are those of ``surface``.

    Raises
    ------
    SurfaceError
        Something else is asked for, or the source does not have it.

    Notes
    -----
    Accuracy: exact at the closest points, for colours in linear light with images interpolated
    bilinearly and repeated beyond their borders. Where a coordinate is continued across a seam,
    it is off by what the source bends within the face.
    Cost: one closest-point query per vertex, for "uv" also per face.
    """
    _check(surface, source, what)
    query = ClosestPoint(source)
    found = query(surface.vertices, progress=progress)
    if "colours" in what:
        colours = MeshColors(source)(found.face_index, found.barycentric)
        surface = replace(surface, vertex_colors=colours)
    if "uv" in what:
        middles = query(surface.triangles.mean(axis=1), progress=progress)
        own = _blend(source.uv[source.faces[found.face_index]], found.barycentric)
        surface = _with_uv(surface, source, own, middles.face_index)
    return surface


def _check(surface: Mesh, source: Mesh, what: Collection[str]) -> None:
    where = "carry(what=...)"
    unknown = [name for name in what if name not in CARRIED]
    if unknown or not what:
        raise SurfaceError(
            f"cannot carry {', '.join(unknown) or 'nothing'}", where, "pass colours or uv"
        )
    if surface.n_faces == 0:
        raise SurfaceError("the surface has no faces", "carry(surface=...)", "pass one with faces")
    if "uv" in what and source.uv is None:
        fix = "leave uv out, or unwrap the source"
        raise SurfaceError("the source has no texture coordinates", where, fix)
    if "colours" in what and source.vertex_colors is None and not source.materials:
        fix = "leave colours out, or read a source with materials or coloured vertices"
        raise SurfaceError("the source has no colours", where, fix)


def _blend(corners: np.ndarray, barycentric: Barycentrics) -> np.ndarray:
    """Attributes (n, 3, c) of the corners, weighted."""
    return np.einsum("nkc,nk->nc", corners, barycentric)


def _with_uv(surface: Mesh, source: Mesh, own: Points2, middle: FaceLabels) -> Mesh:
    """The surface with (n, 2) coordinates of its vertices, but where the face's chart differs."""
    corners = surface.triangles
    continued = _continue_chart(source, middle, corners)
    extent = np.linalg.norm(continued - np.roll(continued, 1, axis=1), axis=2).max(axis=1)
    wanted = own[surface.faces]
    apart = np.linalg.norm(wanted - continued, axis=2)
    uv = np.where((apart <= SAME_SIDE * extent[:, None])[..., None], wanted, continued)
    keys = np.column_stack([surface.faces.ravel(), uv.reshape(-1, 2)])
    unique, faces = np.unique(keys, axis=0, return_inverse=True)
    vertex = unique[:, 0].astype(np.int64)
    colours = surface.vertex_colors
    materials = None if source.material_index is None else source.material_index[middle]
    return Mesh(
        surface.vertices[vertex],
        faces.reshape(-1, 3).astype(np.int32),
        uv=unique[:, 1:],
        vertex_colors=None if colours is None else colours[vertex],
        material_index=materials,
        materials=source.materials,
    )


def _continue_chart(
    source: Mesh, face: FaceLabels, points: Float64[np.ndarray, "m 3 3"]
) -> Float64[np.ndarray, "m 3 2"]:
    """The affine texture map of each face, taken at three points projected onto its plane."""
    triangle = source.triangles[face]
    u, v = triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0]
    w = points - triangle[:, :1]
    uu, uv, vv = (np.einsum("mi,mi->m", a, b) for a, b in ((u, u), (u, v), (v, v)))
    wu, wv = (np.einsum("mki,mi->mk", w, a) for a in (u, v))
    area = uu * vv - uv * uv
    scale = np.divide(1.0, area, out=np.zeros_like(area), where=area > 0)[:, None]
    second = (wu * vv[:, None] - wv * uv[:, None]) * scale
    third = (wv * uu[:, None] - wu * uv[:, None]) * scale
    weights = np.stack([1 - second - third, second, third], axis=2)
    return np.einsum("mkc,mcd->mkd", weights, source.uv[source.faces[face]])
