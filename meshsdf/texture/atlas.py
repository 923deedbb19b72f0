"""A flat picture of what a texture shows on a mesh, for programs that need texture coordinates.

The mesh's own coordinates are used if it has any; else xatlas unwraps it (extra ``unwrap``, in a
process of its own with a time limit); else faces are laid out in pairs, one square for each, which
works for every mesh. Texels beside a face's edge show the surface there, so that bilinear lookups
on either side of a seam agree; all others are filled from their surroundings (pull-push: Gortler,
Grzeszczuk, Szeliski and Cohen 1996, doi:10.1145/237170.237200).
"""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from jaxtyping import Float32, Int32

from ..arrays import Points2
from ..errors import TextureError
from ..kernels.uv_raster import NO_FACE, draw_faces
from ..mesh import Material, Mesh
from ..srgb import srgb_rgba
from .face_squares import lay_out_faces
from .unwrap import unwrap
from .volume_texture import VolumeTexture

Picture = Float32[np.ndarray, "h w 4"]
Method = Literal["auto", "own", "xatlas", "squares"]

LARGEST = 16384  # texels a side
MARGIN = 1.5  # texels beside an edge that bilinear lookups on the edge can touch
PER_PART = 1 << 20
# Interpolation and mipmap at spacing h average over 2 h: (2 h^2) / 6 is the variance of both
SHARE = 0.5
PROBE = 1024  # texels a side of the picture that tells whether faces cover each other
FARTHEST = 1e6
MOST_COVERED = 0.97
WHERE = "atlas_for(mesh, size, method)"


@dataclass(frozen=True, eq=False)
class Atlas:
    """Which texel shows which place of a mesh.

    Attributes
    ----------
    mesh : Mesh
        With texture coordinates; vertices may be doubled along seams.
    method : str
        "own", "xatlas" or "squares": where the coordinates come from.
    face_of : (h, w) int32
        The face that a texel shows; -1 for none.
    places : (h, w, 2) float32
        Weights of its second and third corner.
    without_xatlas : str
        Why it is squares though xatlas would have been welcome; empty if that is not so.
    """

    mesh: Mesh
    method: str
    face_of: Int32[np.ndarray, "h w"]
    places: Float32[np.ndarray, "h w 2"]
    without_xatlas: str = ""

    @property
    def coverage(self) -> float:
        """Share of the texels that show the surface."""
        return float((self.face_of != NO_FACE).mean())


def atlas_for(
    mesh: Mesh, size: int = 2048, method: Method = "auto", *, time_limit: float = 60.0
) -> Atlas:
    """Lay a mesh out on a square picture.

    Parameters
    ----------
    mesh : Mesh
        What to lay out.
    size : int
        Texels a side.
    method : "auto", "own", "xatlas" or "squares"
        "auto" takes the mesh's own coordinates if no two faces share a place, or else xatlas if it
        is installed and done in time, or else squares.
    time_limit : float
        Seconds that xatlas may take.

    Raises
    ------
    TextureError
        The mesh has no coordinates of its own, xatlas is missing or too slow (each if it was asked
        for), or the faces' squares do not fit.
    """
    if not 8 <= size <= LARGEST:
        what = f"an atlas of {size} texels a side cannot be made"
        raise TextureError(what, WHERE, f"ask for 8 to {LARGEST}")
    if method == "own" and mesh.uv is None:
        what = "the mesh has no texture coordinates of its own"
        raise TextureError(what, WHERE, 'use method="auto"')
    used, why = method, ""
    if method == "own" or (method == "auto" and mesh.uv is not None and _is_one_to_one(mesh)):
        laid, used = mesh, "own"
    elif method in ("auto", "xatlas"):
        laid, used, why = _unwrapped(mesh, size, method, time_limit)
    else:
        laid = lay_out_faces(mesh, size)
    face_of = np.full((size, size), NO_FACE, np.int32)
    places = np.zeros((size, size, 2), np.float32)
    draw_faces(_in_texels(laid.uv, size), laid.faces, size, size, MARGIN, face_of, places)
    return Atlas(laid, used, face_of, places, why)


def atlas_colors(texture: VolumeTexture, atlas: Atlas, *, channel: str = "base") -> Picture:
    """(h, w, 4) float32 that the texture shows on every texel, filled beyond the faces.

    Linear RGB and alpha, or the channel's values; first row on top.
    """
    rows, columns = np.nonzero(atlas.face_of != NO_FACE)
    picture = np.zeros((*atlas.face_of.shape, 4), np.float32)
    triangles = atlas.mesh.triangles
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    widths = SHARE * _texel_widths(atlas)
    for start in range(0, len(rows), PER_PART):
        part = slice(start, start + PER_PART)
        face = atlas.face_of[rows[part], columns[part]]
        second, third = atlas.places[rows[part], columns[part]].T.astype(np.float64)
        weights = np.stack([1 - second - third, second, third], axis=1)
        points = np.einsum("nk,nkc->nc", weights, triangles[face])
        picture[rows[part], columns[part]] = texture.colors(
            points, normals[face], widths[face], channel=channel
        )
    return pull_push(picture, atlas.face_of != NO_FACE)


def textured(texture: VolumeTexture, atlas: Atlas, name: str = "texture") -> Mesh:
    """The atlas's mesh with the picture as its only material: 8 bits, sRGB."""
    rgba = srgb_rgba(atlas_colors(texture, atlas).reshape(-1, 4))
    image = np.rint(255 * rgba).astype(np.uint8).reshape(*atlas.face_of.shape, 4)
    if (image[..., 3] == 255).all():
        image = image[..., :3]
    look = Material(name, np.ones(4, np.float32), np.ascontiguousarray(image), f"{name}.png")
    index = np.zeros(atlas.mesh.n_faces, np.int32)
    return replace(atlas.mesh, material_index=index, materials=(look,), vertex_colors=None)


def vertex_colored(texture: VolumeTexture, mesh: Mesh) -> Mesh:
    """The mesh with the texture's colours at its vertices, averaged over a third of each fan.

    A vertex between sheets that look apart shows the one it looks along on average.
    """
    triangles = mesh.triangles
    cross = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals = np.zeros((mesh.n_vertices, 3))
    shares = np.zeros(mesh.n_vertices)
    for corner in range(3):
        np.add.at(normals, mesh.faces[:, corner], cross)
        np.add.at(shares, mesh.faces[:, corner], np.linalg.norm(cross, axis=1) / 6)
    colors = texture.colors(np.array(mesh.vertices), normals, np.sqrt(shares))
    return replace(mesh, vertex_colors=colors, uv=None, material_index=None, materials=())


def pull_push(picture: Picture, known: np.ndarray) -> Picture:
    """Fill texels that are not known from coarser and coarser averages of those that are."""
    weights = known.astype(np.float32)[..., None]
    levels = [(picture * weights, weights)]
    while max(levels[-1][0].shape[:2]) > 1:
        levels.append(tuple(_halved(part) for part in levels[-1]))
    values, weights = levels[-1]
    filled = np.divide(values, weights, out=np.zeros_like(values), where=weights > 0)
    for values, weights in reversed(levels[:-1]):
        above = _doubled(filled, values.shape[:2])
        kept = np.minimum(weights, 1)
        own = np.divide(values, weights, out=np.zeros_like(values), where=weights > 0)
        filled = kept * own + (1 - kept) * above
    return np.where(known[..., None], picture, filled)


def _halved(part: np.ndarray) -> np.ndarray:
    """Sums of 2 x 2 texels; an odd last row or column stands alone."""
    h, w = part.shape[:2]
    padded = np.pad(part, ((0, h % 2), (0, w % 2), (0, 0)))
    return padded[::2, ::2] + padded[1::2, ::2] + padded[::2, 1::2] + padded[1::2, 1::2]


def _doubled(part: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Bilinear copies of twice the size: 3/4 of the nearest and 1/4 of the next, each way."""
    for axis in (0, 1):
        part = np.moveaxis(part, axis, 0)
        before, after = part[[0, *range(len(part) - 1)]], part[[*range(1, len(part)), -1]]
        both = np.stack([0.75 * part + 0.25 * before, 0.75 * part + 0.25 * after], axis=1)
        part = np.moveaxis(both.reshape(-1, *part.shape[1:])[: shape[axis]], 0, axis)
    return part.astype(np.float32)


def _in_texels(uv: Points2, size: int) -> Points2:
    return np.stack([size * uv[:, 0], size * (1 - uv[:, 1])], axis=1)


def _is_one_to_one(mesh: Mesh) -> bool:
    """Faces hardly cover each other on the picture, which repeats."""
    used = mesh.uv[mesh.faces]
    if not np.abs(used).max() < FARTHEST:
        return False
    face_of = np.full((PROBE, PROBE), NO_FACE, np.int32)
    draw_faces(
        _in_texels(mesh.uv, PROBE), mesh.faces, PROBE, PROBE, 0.0, face_of,
        np.empty((PROBE, PROBE, 2), np.float32),
    )  # fmt: skip
    u, v = used[:, 1] - used[:, 0], used[:, 2] - used[:, 0]
    area = 0.5 * np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]).sum()
    return bool(area > 0 and (face_of != NO_FACE).mean() > MOST_COVERED * area)


def _texel_widths(atlas: Atlas) -> np.ndarray:
    """(m,) width of a texel on every face, world units."""
    corners = _in_texels(atlas.mesh.uv, len(atlas.face_of))[atlas.mesh.faces]
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    flat = np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
    triangles = atlas.mesh.triangles
    cross = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    area = np.linalg.norm(cross, axis=1)
    return np.sqrt(np.divide(area, flat, out=np.zeros_like(area), where=flat > 0))


def _unwrapped(mesh: Mesh, size: int, method: str, time_limit: float) -> tuple[Mesh, str, str]:
    """The mesh laid out by xatlas, or else by squares, and why not by xatlas."""
    try:
        return unwrap(mesh, size, time_limit), "xatlas", ""
    except TextureError as error:
        if method == "xatlas":
            raise
        why = f"{error.what}: {error.fix.split(', or ')[0]}"
    return lay_out_faces(mesh, size), "squares", why
