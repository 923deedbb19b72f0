"""What a texture shows, in files that know nothing of it: meshes, pictures, volumes of colours.

A mesh gets an image, or colours at its vertices where its format has no images. A picture alone
fits one layout of one mesh, which is written beside it.
"""

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ..arrays import Number
from ..errors import OutputError
from ..mesh import Mesh
from ..texture.atlas import Atlas, Method, atlas_colors, atlas_for, textured, vertex_colored
from ..texture.volume_texture import VolumeTexture
from .atomic import check_output
from .meshes import write_mesh
from .mtl import material_image
from .pictures import write_picture
from .registry import able_suffixes
from .vdb_texture import write_vdb_texture
from .warn import Warn, ignore

PICTURES = (".png", ".jpg", ".jpeg", ".exr")
VOLUMES = (".vdb",)
COLORLESS = (".stl", ".off")


@dataclass(frozen=True)
class Layout:
    """How a mesh is laid out on an image.

    Attributes
    ----------
    size : int
        Of the image, pixels a side.
    method, time_limit
        As for `atlas_for`.
    """

    size: int = 2048
    method: Method = "auto"
    time_limit: Number = 60.0


PLAIN = Layout()


def check_texture_output(path: str | os.PathLike, force: bool = False) -> None:
    """Refuse a place that `write_texture` could not write to; IoError as `check_output`."""
    suffix = Path(path).suffix.lower()
    known = (*able_suffixes("mesh", "writer"), *VOLUMES, *PICTURES)
    if suffix not in known:
        what = f"a texture with suffix {suffix!r} cannot be written"
        raise OutputError(what, f"output {path}", f"use one of {', '.join(known)}")
    check_output(path, force, kind=None if suffix in (*PICTURES, *VOLUMES) else "mesh")
    for place in companions(path):
        if place.exists() and not force:
            what = f"{place.name}, which goes with {Path(path).name}, exists"
            raise OutputError(
                what, f"output {path}", "pass --force to replace it, or take other names"
            )
        check_output(place, force)


def check_texture_outputs(paths: Sequence[str | os.PathLike], force: bool = False) -> None:
    """Refuse what `write_texture` could not write, one after another; IoError as `check_output`.

    Pictures of one stem share the mesh that goes with them; all other files must differ.
    """
    taken: dict[str, str] = {}
    for path in paths:
        check_texture_output(path, force)
        shared = mesh_beside(path) if Path(path).suffix.lower() in PICTURES else None
        for place in (Path(path), *companions(path)):
            key = os.path.realpath(place)
            owner = f"the mesh of {place.stem}" if place == shared else os.fspath(path)
            if key in taken and not (place == shared and taken[key] == owner):
                what = f"{place.name} would be written twice"
                raise OutputError(what, f"output {path}", "name each file once, with other stems")
            taken[key] = owner


def companions(path: str | os.PathLike) -> tuple[Path, ...]:
    """The files that are written beside one, so that it can be used."""
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix in PICTURES:
        return (mesh_beside(path),)
    if suffix == ".obj":
        return path.with_suffix(".mtl"), material_image(path, path.stem)
    return ()


def colored_mesh(
    texture: VolumeTexture,
    mesh: Mesh,
    path: str | os.PathLike,
    *,
    at_vertices: bool | None = None,
    layout: Layout = PLAIN,
    warn: Warn = ignore,
) -> tuple[Mesh, dict[str, Any]]:
    """Return the mesh with a texture's colours as a file can have them, and how that was done.

    Parameters
    ----------
    texture, mesh : VolumeTexture, Mesh
        Any mesh of the textured surface.
    path : path
        The file to be: its suffix says what it can hold, its stem names the image.
    at_vertices : bool, optional
        Colours at vertices, or an image; if not given, the former for ``.ply`` alone.
    layout : Layout
    warn : callable
        Told if the file can hold no colours.
    """
    suffix = Path(path).suffix.lower()
    if at_vertices is None:
        at_vertices = suffix == ".ply"
    if suffix in COLORLESS:
        warn(f"{suffix} files hold no colours")
        return mesh, {"colors": "none"}
    if at_vertices:
        return vertex_colored(texture, mesh), {"colors": "vertices"}
    laid = atlas_for(mesh, layout.size, layout.method, time_limit=float(layout.time_limit))
    return textured(texture, laid, Path(path).stem), _image_facts(laid, layout)


def write_texture(
    path: str | os.PathLike,
    texture: VolumeTexture,
    mesh: Mesh,
    *,
    layout: Layout = PLAIN,
    channel: str = "base",
    with_mesh: bool = True,
    force: bool = False,
    warn: Warn = ignore,
) -> dict[str, Any]:
    """Write what a texture shows on a mesh, as the suffix says, and return how that was done.

    Parameters
    ----------
    path : path
        ``.glb`` or ``.obj`` with an image, ``.ply`` with vertex colours, ``.vdb`` with voxels, or
        ``.png``, ``.jpg`` or ``.exr``: an image alone, with its mesh beside it (`mesh_beside`).
    texture, mesh, layout, warn
        As for `colored_mesh`.
    channel : str
        Of an image alone.
    with_mesh : bool
        Whether the mesh goes beside an image alone; it is there already for one of the same stem.
    force : bool
        Whether existing files may be replaced.

    Raises
    ------
    IoError
        As the writers of those files; TextureError as `atlas_for`.
    """
    suffix = Path(path).suffix.lower()
    if suffix in VOLUMES:
        write_vdb_texture(path, texture, force=force)
        return {"colors": "voxels"}
    if suffix in PICTURES:
        laid = atlas_for(mesh, layout.size, layout.method, time_limit=float(layout.time_limit))
        write_picture(path, atlas_colors(texture, laid, channel=channel), force=force)
        bare = replace(laid.mesh, material_index=None, materials=(), vertex_colors=None)
        if with_mesh:
            write_mesh(mesh_beside(path), bare, force=force)
        return _image_facts(laid, layout) | {"mesh": mesh_beside(path).name}
    colored, facts = colored_mesh(texture, mesh, path, layout=layout, warn=warn)
    write_mesh(path, colored, force=force)
    return facts


def mesh_beside(picture: str | os.PathLike) -> Path:
    """Where the mesh goes that a picture alone fits."""
    return Path(picture).with_name(f"{Path(picture).stem}-atlas.obj")


def words_of(facts: dict[str, Any]) -> str:
    """What `write_texture` returned, for people."""
    words = {
        "none": "no colours",
        "vertices": "colours at vertices",
        "voxels": "colours at voxels",
        "image": "an image",
    }[facts["colors"]]
    if facts["colors"] != "image":
        return words
    by = {
        "own": "the mesh's own coordinates",
        "xatlas": "coordinates by xatlas",
        "squares": "a square for every two faces",
    }[facts["atlas"]]
    why = f" ({facts['without_xatlas']})" if facts.get("without_xatlas") else ""
    return f"{words} of {facts['size']} x {facts['size']} pixels, {by}{why}"


def _image_facts(laid: Atlas, layout: Layout) -> dict[str, Any]:
    facts = {"colors": "image", "atlas": laid.method, "size": layout.size}
    why = {"without_xatlas": laid.without_xatlas} if laid.without_xatlas else {}
    return facts | {"coverage": laid.coverage} | why
