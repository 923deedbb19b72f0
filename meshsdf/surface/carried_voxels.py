"""What a mesh has at the closest points of a band's nodes: places, texture coordinates, colours."""

from collections.abc import Collection

import numpy as np
from jaxtyping import Float32, Integer

from ..errors import SurfaceError
from ..grid import NarrowBand
from ..grid.brick_grid import node_mask
from ..mesh import Mesh
from ..spatial.mesh_colors import MeshColors

CARRIED_VOXELS = ("closest", "uv", "Cd")
"""World position of the closest point; texture coordinates there, then 0; linear RGB there."""


def require_carried(source: Mesh, names: Collection[str]) -> None:
    """SurfaceError unless the mesh has what is asked for."""
    where = f"the grids {', '.join(names)}"
    unknown = [name for name in names if name not in CARRIED_VOXELS]
    if unknown:
        what = f"there is no grid {unknown[0]!r}"
        raise SurfaceError(what, where, f"choose {', '.join(CARRIED_VOXELS)}")
    if "uv" in names and source.uv is None:
        what = "the mesh has no texture coordinates"
        raise SurfaceError(what, where, "leave uv out, or unwrap the mesh")
    if "Cd" in names and source.vertex_colors is None and not source.materials:
        fix = "leave Cd out, or take a mesh with materials or coloured vertices"
        raise SurfaceError("the mesh has no colours", where, fix)


def carried_in_bricks(
    source: Mesh, band: NarrowBand, name: str, slots: Integer[np.ndarray, " s"]
) -> Float32[np.ndarray, "s 8 8 8 3"]:
    """Return what the mesh has at the closest points of some bricks' active nodes, 0 elsewhere.

    Parameters
    ----------
    source : Mesh
        The mesh that the band was made from.
    band : NarrowBand
        With closest faces and barycentrics.
    name : "closest", "uv" or "Cd"
        See `CARRIED_VOXELS`.
    slots : (s,) int
        Which bricks.

    Raises
    ------
    SurfaceError
        The mesh does not have it, or the band has no closest faces.

    Notes
    -----
    Accuracy: weights of the corners are float32, so a closest point is off by 1e-7 of its face's
    size, beside the rounding of the result. Texture coordinates jump at seams, as the mesh's do.
    """
    require_carried(source, [name])
    if band.closest_face is None or band.barycentric is None:
        what = "the band has no closest faces"
        raise SurfaceError(what, "carried_in_bricks(band=...)", "pass closest=True to mesh_to_band")
    active = node_mask(band.active[slots])
    face = band.closest_face[slots][active]
    second, third = band.barycentric[slots][active].astype(np.float64).T
    weights = np.stack([1.0 - second - third, second, third], axis=1)
    out = np.zeros((*active.shape, 3), np.float32)
    if name == "Cd":
        out[active] = MeshColors(source)(face, weights)[:, :3]
    elif name == "uv":
        corners = source.uv[source.faces[face]]
        out[active, :2] = np.einsum("nkc,nk->nc", corners, weights)
    else:
        out[active] = np.einsum("nkc,nk->nc", source.vertices[source.faces[face]], weights)
    return out
