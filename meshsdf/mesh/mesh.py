"""A triangle mesh: vertices, faces, and what they carry for textures.

Nothing is merged, moved or removed here; what the file said is what the mesh holds.
"""

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np
from jaxtyping import Float32, Float64, Int32, UInt8

from ..arrays import Faces, Points
from ..box import Box
from ..errors import MeshError
from .welded import Welded, weld_mesh


@dataclass(frozen=True, eq=False)
class Material:
    """How one group of faces looks.

    Attributes
    ----------
    name : str
        As the file names it; may be empty.
    base_color : (4,) float32
        Linear RGB and alpha.
    image : (h, w, c) uint8 or None
        The base colour texture as stored (sRGB for colour images), first row on top.
    image_name : str
        File name of the image, if it had one.
    """

    name: str
    base_color: Float32[np.ndarray, "4"]
    image: UInt8[np.ndarray, "h w c"] | None = None
    image_name: str = ""


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles in space; immutable.

    Attributes
    ----------
    vertices : (n, 3) float64
        World units, finite.
    faces : (m, 3) int32
        Vertex indices, counter-clockwise seen from outside.
    uv : (n, 2) float64 or None
        Texture coordinates, origin at the lower left of the image.
    vertex_colors : (n, 4) float32 or None
        Linear RGB and alpha.
    material_index : (m,) int32 or None
        Index into ``materials``; -1 for none.
    materials : tuple of Material
        What ``material_index`` points to.

    Raises
    ------
    MeshError
        Wrong shapes, positions that are not finite, or face indices out of range.
    """

    vertices: Points
    faces: Faces
    uv: Float64[np.ndarray, "n 2"] | None = None
    vertex_colors: Float32[np.ndarray, "n 4"] | None = None
    material_index: Int32[np.ndarray, " m"] | None = None
    materials: tuple[Material, ...] = ()

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, np.ndarray):
                object.__setattr__(self, field.name, _frozen(value))
        _check_positions(self.vertices)
        _check_indices(self.faces, len(self.vertices))

    @property
    def n_vertices(self) -> int:
        """Number of vertices, used or not."""
        return len(self.vertices)

    @property
    def n_faces(self) -> int:
        """Number of triangles, degenerate ones included."""
        return len(self.faces)

    @cached_property
    def box(self) -> Box:
        """The smallest box around the vertices that faces use.

        Raises
        ------
        MeshError
            The mesh has no faces.
        """
        if self.n_faces == 0:
            raise MeshError("the mesh has no faces, so it has no extent", "Mesh.box", "add faces")
        used = np.zeros(self.n_vertices, bool)
        used[self.faces] = True
        return Box.around(self.vertices[used])

    @cached_property
    def welded(self) -> Welded:
        """Equal positions joined, and the edges; made once and kept, about 80 bytes per face."""
        return weld_mesh(self.vertices, self.faces)

    @property
    def triangles(self) -> Float64[np.ndarray, "m 3 3"]:
        """(m, 3, 3) corner positions of every face."""
        return self.vertices[self.faces]


def _frozen(array: np.ndarray) -> np.ndarray:
    """A contiguous, read-only view (or copy) of the array; the caller's stays writable."""
    view = np.ascontiguousarray(array).view()
    view.flags.writeable = False
    return view


def _check_positions(vertices: np.ndarray) -> None:
    if np.isfinite(vertices).all():
        return
    bad = np.flatnonzero(~np.isfinite(vertices).all(axis=1))
    place = vertices[bad[0]].tolist()
    raise MeshError(
        f"{len(bad)} of {len(vertices)} vertices are NaN or infinite "
        f"(first: vertex {bad[0]} at {place})",
        "Mesh(vertices=...)",
        "remove or repair those vertices in the program that wrote the mesh",
    )


def _check_indices(faces: np.ndarray, n_vertices: int) -> None:
    if len(faces) == 0 or (faces.min() >= 0 and faces.max() < n_vertices):
        return
    bad = np.flatnonzero(((faces < 0) | (faces >= n_vertices)).any(axis=1))
    raise MeshError(
        f"{len(bad)} of {len(faces)} faces name vertices that are not among the {n_vertices} "
        f"(first: face {bad[0]} = {faces[bad[0]].tolist()})",
        "Mesh(faces=...)",
        "use vertex indices from 0 to n_vertices - 1",
    )
