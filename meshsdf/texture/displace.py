"""A surface moved along its normals by what is painted in the height channel.

The displaced solid needs no mesh in between: its field is phi(x) - d(q(x)), where phi is the signed
distance, q(x) the closest point of the surface and d the painted height there.
"""

from dataclasses import replace

import numpy as np

from ..arrays import Number
from ..errors import TextureError
from ..grid import NarrowBand
from ..mesh import Mesh
from ..progress import Progress, silent
from ..sdf import mesh_to_band
from ..spatial import ClosestPoint
from .volume_texture import VolumeTexture

PER_PART = 1 << 20
MOST = 64.0  # voxels of height


def displaced_band(
    texture: VolumeTexture,
    mesh: Mesh,
    *,
    resolution: Number | None = None,
    voxel_size: Number | None = None,
    scale: Number = 1.0,
    progress: Progress = silent,
) -> NarrowBand:
    """Return the band of a mesh after its surface has moved by the texture's height channel.

    Parameters
    ----------
    texture : VolumeTexture
        With a height channel, in finest texels along the outward normal.
    mesh : Mesh
        The surface to move: what the texture was made around, or another mesh of its shape.
    resolution, voxel_size : float
        As for `mesh_to_band`.
    scale : float
        Multiplies the heights.

    Raises
    ------
    TextureError
        Heights reach further than 64 voxels, or no side of the mesh is outside.

    Notes
    -----
    Accuracy: the zero set is the surface moved along its normals as long as heights are smaller
    than the surface's reach (the distance to its medial axis); beyond, neighbouring parts merge as
    a union does. Values are distances up to the slope of the heights: |gradient| <= sqrt(1 + s^2).
    """
    where = "displaced_band(texture, mesh)"
    unit = texture.octree.texel * float(scale)
    most = _largest_height(texture) * abs(unit)
    size = float(voxel_size) if voxel_size is not None else float(mesh.box.size.max()) / resolution
    if most > MOST * size:
        what = f"heights reach {most:g}, which is {most / size:.0f} voxels"
        raise TextureError(
            what, where, f"use larger voxels, or a scale below {MOST * size / most:g}"
        )
    band = mesh_to_band(
        mesh, voxel_size=size, half_width=3.0 + most / size, closest=True, progress=progress
    )
    if not band.is_signed:
        what = "the mesh has no inside, so that nothing can be moved outwards"
        raise TextureError(what, where, "close the mesh")
    values = band.values.copy()
    mask = band.active_mask()
    moved = values[mask]
    ijk = band.active_ijk()
    corners = mesh.triangles
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    closest = ClosestPoint(mesh)
    for start in range(0, len(ijk), PER_PART):
        part = slice(start, start + PER_PART)
        found = closest(band.to_world(ijk[part]))
        height = texture.colors(found.point, normals[found.face_index], channel="height")[:, 0]
        moved[part] -= (unit * height).astype(np.float32)
        progress("displacement", min(1.0, (start + PER_PART) / len(ijk)))
    values[mask] = np.clip(moved, -band.background, band.background)
    return replace(band, values=values, closest_face=None, barycentric=None, hermite=None)


def _largest_height(texture: VolumeTexture) -> float:
    """The largest height stored anywhere, in finest texels."""
    channel = texture.channels["height"]
    most = float(np.abs(channel.decoded(texture.tiles.arrays["height"])[:, 0]).max(initial=0.0))
    pool = texture.pool.arrays.get("height")
    if pool is not None:
        for slots in (layer.slots[layer.slots >= 0] for layer in texture.layers):
            stored = channel.decoded(np.unique(pool[slots]))
            most = max(most, float(np.abs(stored[:, 0]).max(initial=0.0)))
    return most
