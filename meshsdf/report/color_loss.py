"""What becomes of a mesh's colours when a texture in space carries them to another surface.

The mesh's colours are kept in a volume texture, one texel per voxel, and looked up on the surface
as they are there, by place and normal: what anybody sees who drops the mesh and keeps its texture.
"""

import numpy as np

from ..arrays import Number
from ..errors import ReportError
from ..mesh import Mesh
from ..mesh.sampling import sample_surface
from ..progress import Progress, silent
from ..sdf.memory import estimate_bricks, require_memory
from ..texture.mesh_source import MeshSource
from ..texture.mip import bake
from ..texture.volume_texture import VolumeTexture
from .color_difference import ColorDifference, ColorLoss

N_POINTS = 100_000
BYTES_PER_BRICK = 4 / 3 * (1500 + 512 * 4)  # tables and texels, with those of the coarser levels


def color_loss(
    mesh: Mesh,
    surface: Mesh,
    *,
    texel: Number,
    n_points: int = N_POINTS,
    seed: int = 0,
    progress: Progress = silent,
) -> ColorLoss:
    """Carry the colours of a mesh to a surface near it, and compare them with what they were.

    Parameters
    ----------
    mesh : Mesh
        With an image, materials or vertex colours.
    surface : Mesh
        Triangles with area; its own colours are not looked at.
    texel : float
        Spacing of the texels that carry the colours, world units.
    n_points : int
        Points to draw from the surface, at least one.
    seed : int
        The same seed gives the same points.

    Raises
    ------
    ReportError
        The mesh has no colours, or no point is to be drawn.
    TextureError, MemoryLimitError
        The colours are broken, or texels so small cannot be.
    MeshError
        The surface has no area.

    Notes
    -----
    Accuracy: mean and percentile are estimates from points, and a larger difference than the
    largest may lie between them. Colours are kept in 8 bits of sRGB, which alone makes ΔE up to
    about 0.6.
    Limits: only what is left of the surface is looked at; parts that did not come back count
    nothing.

    Examples
    --------
    >>> from dataclasses import replace
    >>> from meshsdf.mesh.primitives import box_mesh
    >>> red = np.tile(np.array([1, 0, 0, 1], np.float32), (8, 1))
    >>> loss = color_loss(replace(box_mesh(), vertex_colors=red), box_mesh(), texel=0.1)
    >>> loss.sharp.largest < 0.1, loss.sharp.expected
    (True, '#ff0000')
    """
    if n_points < 1:
        what = f"{n_points} points say nothing"
        raise ReportError(what, "color_loss(n_points=...)", "draw at least one")
    carrier = ColorCarrier(mesh, progress=progress)
    return carrier.loss(carrier.texture(texel), surface, n_points=n_points, seed=seed)


class ColorCarrier:
    """Carries the colours of one mesh to many surfaces; errors as `color_loss`.

    Parameters
    ----------
    mesh : Mesh
        With an image, materials or vertex colours.
    max_memory : float, optional
        Bytes that a texture may take; else 80 % of what is free.
    """

    def __init__(
        self, mesh: Mesh, *, max_memory: Number | None = None, progress: Progress = silent
    ) -> None:
        require_colors(mesh, "color_loss(mesh, ...)")
        self.mesh, self._max_memory, self._progress = mesh, max_memory, progress
        self._source = MeshSource(mesh)

    def texture(self, texel: Number) -> VolumeTexture:
        """A texture around the mesh that holds its colours."""
        needed = BYTES_PER_BRICK * estimate_bricks(self.mesh, texel, 1.0)
        require_memory(needed, self._max_memory, where=f"a texture with texels of {texel:g}")
        texture = VolumeTexture.around(self.mesh, texel=texel, progress=self._progress)
        bake(texture, texture.add_layer("colors"), self._source, progress=self._progress)
        return texture

    def loss(
        self, texture: VolumeTexture, surface: Mesh, *, n_points: int = N_POINTS, seed: int = 0
    ) -> ColorLoss:
        """Compare what the texture shows on a surface with what the mesh says there."""
        texel = texture.octree.texel
        drawn = sample_surface(surface, n_points, seed=seed)
        shown = texture.colors(drawn.points, drawn.normals)
        place = self._source.places(drawn.points, drawn.normals, texel)
        told = [self._source.colors(*place, footprint) for footprint in (0.0, texel)]
        differences = (ColorDifference.between(drawn.points, colors, shown) for colors in told)
        return ColorLoss(texel, n_points, *differences)


def require_colors(mesh: Mesh, where: str) -> None:
    """Refuse a mesh without any colour of its own.

    Raises
    ------
    ReportError
        It has neither vertex colours nor a face with a material.
    """
    index = mesh.material_index
    if mesh.vertex_colors is None and (index is None or not np.any(index >= 0)):
        raise ReportError(
            "the mesh has no colours: neither vertex colours nor a material on any of its "
            f"{mesh.n_faces} faces",
            where,
            "give a mesh with a texture image, materials or vertex colours, or do not ask for them",
        )
