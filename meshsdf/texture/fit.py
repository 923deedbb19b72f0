"""Does a mesh lie on the surface that a texture was made around?

A texture has texels near its surface alone, so a mesh elsewhere gets no colour. How much of its
area that is, is estimated from points spread evenly by area, and their exact distances.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..arrays import Number, Points
from ..errors import TextureError
from ..mesh import Mesh
from ..mesh.measures import face_areas
from ..mesh.sampling import sample_surface
from .volume_texture import VolumeTexture

REACH = 8.0  # finest texels; remeshing at a few texels' spacing stays within
N_POINTS = 4096  # the estimate of a share s is within 2.6 sqrt(s (1 - s) / n), at 99 %: 2 % at 1/2
REFUSED_FROM = 0.5  # of the area: more of it without colour than with
TOLD_FROM = 0.02


@dataclass(frozen=True)
class Fit:
    """How a mesh lies to a texture's surface.

    Attributes
    ----------
    reach : float
        8 of the finest texels, world units.
    off : float
        Share of the mesh's area that lies farther than that from the surface, estimated.
    farthest : float
        The largest distance seen, world units: the truth may be larger.
    """

    reach: Number
    off: Number
    farthest: Number


def fit_of(texture: VolumeTexture, mesh: Mesh, *, n_points: int = N_POINTS) -> Fit:
    """Estimate how much of a mesh lies off a texture's surface; equal meshes get equal answers.

    Parameters
    ----------
    texture : VolumeTexture
        It knows its surface.
    mesh : Mesh
        Whose area counts; that of a mesh without area is taken as evenly spread over its vertices.
    n_points : int
        From 1 on.

    Raises
    ------
    TextureError
        The texture knows of no surface.

    Notes
    -----
    Accuracy: distances are exact to rounding, see `ClosestPoint`; the share is the mean of
    ``n_points`` draws, its standard deviation ``sqrt(off (1 - off) / n_points)``.
    """
    reach = float(REACH * texture.octree.texel)
    points = _spread(mesh, n_points)
    if len(points) == 0:
        return Fit(reach, 0.0, 0.0)
    distance = np.linalg.norm(points - texture.on_surface(points)[0], axis=1)
    return Fit(reach, float((distance > reach).mean()), float(distance.max()))


def require_fit(
    texture: VolumeTexture, mesh: Mesh, *, where: str, warn: Callable[[str], object]
) -> None:
    """Refuse a mesh that lies mostly off the texture's surface, and tell of one that does in part.

    Raises
    ------
    TextureError
        More than half of the mesh's area is farther than 8 finest texels from the surface.
    """
    if texture.surface is None or mesh is texture.surface:
        return
    found = fit_of(texture, mesh)
    share = f"{100 * found.off:.0f} % of the mesh's area"
    far = f"farther than {found.reach:.3g} (8 texels) from the textured surface"
    most = f"as far as {found.farthest:.3g}"
    if found.off > REFUSED_FROM:
        what = f"{share} lies {far}, {most}, where the texture has no colour"
        fix = "the texture was made around another mesh: name that one or another mesh of its "
        fix += "surface, at its place and size, or make a texture around this one"
        raise TextureError(what, where, fix)
    if found.off > TOLD_FROM:
        warn(f"{share} lies {far}, {most}: it gets no colour there")


def _spread(mesh: Mesh, n: int) -> Points:
    if mesh.n_faces and face_areas(mesh).any():
        return sample_surface(mesh, n).points
    return np.array(mesh.vertices)
