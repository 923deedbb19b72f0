"""Operations that bring colours from elsewhere: a mesh's own, and images that are projected."""

from typing import Any

import numpy as np

from ..errors import TextureError
from ..mesh import Material, Mesh
from ..progress import Progress, silent
from ..spatial.image import Image
from .camera_projection import CameraProjection
from .detail import Level, bake_level
from .mesh_source import MeshSource
from .project import Cylindrical, Decal, Planar, Spherical, Triplanar
from .projection import Projection
from .volume_texture import VolumeTexture

PROJECTIONS: dict[str, type[Projection]] = {
    "planar": Planar,
    "cylindrical": Cylindrical,
    "spherical": Spherical,
    "triplanar": Triplanar,
    "decal": Decal,
    "camera": CameraProjection,
}
"""What `project_image` projects by."""

_VECTORS = ("eye", "target", "up")


def mesh_params(mesh: Mesh) -> dict[str, Any]:
    """What `mesh_colors` needs to know of a mesh, as parameters of an operation."""
    params: dict[str, Any] = {
        "vertices": np.array(mesh.vertices),
        "faces": np.array(mesh.faces),
        "materials": [
            {
                "base_color": [float(value) for value in material.base_color],
                "image": None if material.image is None else np.array(material.image),
            }
            for material in mesh.materials
        ],
    }
    for name in ("uv", "vertex_colors", "material_index"):
        value = getattr(mesh, name)
        params[name] = None if value is None else np.array(value)
    return params


def mesh_colors(
    texture: VolumeTexture,
    *,
    layer: int,
    level: Level = 0,
    progress: Progress = silent,
    **mesh: Any,
) -> None:
    """Fill a layer with the colours that a mesh has at the closest places; see `mesh_params`.

    ``level`` is as `detail.bake_level` takes it.
    """
    from .operation_kinds import layer_numbered

    materials = tuple(
        Material("", np.array(one["base_color"], np.float32), one["image"])
        for one in mesh.pop("materials")
    )
    source = MeshSource(Mesh(**mesh, materials=materials))
    bake_level(texture, layer_numbered(texture, layer), source, level=level, progress=progress)


def project_image(
    texture: VolumeTexture,
    *,
    layer: int,
    image: np.ndarray,
    projection: str,
    level: Level = 0,
    matrix: np.ndarray | None = None,
    progress: Progress = silent,
    **options: Any,
) -> None:
    """Fill a layer with an image projected onto the surface; nothing where it does not reach.

    ``image`` is (h, w, c) uint8, sRGB, or float32, linear; ``projection`` is one of `PROJECTIONS`,
    ``options`` are its attributes. A camera's picture reaches what the texture's surface does not
    hide.

    Raises
    ------
    TextureError
        There is no such layer or projection, or it has other attributes.
    """
    from .operation_kinds import layer_numbered

    found = layer_numbered(texture, layer)
    made = make_projection(texture, image, projection, matrix, **options)
    bake_level(texture, found, made, level=level, progress=progress)


def make_projection(
    texture: VolumeTexture,
    image: np.ndarray,
    projection: str,
    matrix: np.ndarray | None = None,
    **options: Any,
) -> Projection:
    """The projection that `project_image` evaluates; errors as there."""
    where = f"projection {projection!r}"
    if projection not in PROJECTIONS:
        what = f"there is no projection {projection!r}"
        raise TextureError(what, where, f"use one of {', '.join(PROJECTIONS)}")
    picture = Image.from_srgb(image) if image.dtype == np.uint8 else Image.from_linear(image)
    given = {
        name: np.asarray(value, np.float64) if name in _VECTORS else value
        for name, value in options.items()
    }
    if projection == "camera":
        given |= {"hides": texture.surface, "texel": texture.octree.texel}
    if matrix is not None:
        given["matrix"] = np.asarray(matrix, np.float64)
    try:
        return PROJECTIONS[projection](picture, **given)
    except TypeError as error:
        words = str(error).split("__init__() ")[-1]
        raise TextureError(f"{projection}: {words}", where, "see its attributes") from None
