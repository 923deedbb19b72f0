"""Wavefront MTL: the base colour and its image; everything that fails is said, nothing stops.

``Kd`` is linear light, ``d`` the alpha. ``Tr`` is left alone: programs disagree on its direction.
"""

import re
from pathlib import Path

import numpy as np

from ..mesh import Material, Mesh
from .atomic import atomic_write, check_output
from .images import encode_png, read_image
from .warn import Warn


def material_name(name: str) -> str:
    """The name by which OBJ and MTL know a material: one line, never empty."""
    return " ".join(name.split()) or "none"


def material_image(path: Path, name: str) -> Path:
    """The file for the image of a material of an OBJ file: ``cow-hide.png`` of ``cow.obj``."""
    plain = re.sub(r"[^\w.-]+", "_", material_name(name))
    return path.with_name(f"{path.stem}-{plain}.png")


def has_library(mesh: Mesh) -> bool:
    """Whether a mesh has images, for which an OBJ file needs a material file beside it."""
    return mesh.uv is not None and any(one.image is not None for one in mesh.materials)


def write_materials(path: Path, mesh: Mesh, force: bool) -> str:
    """Write the material file of an OBJ file, and its images as PNG; return the file's name.

    For ``cow.obj`` these are ``cow.mtl`` and ``cow-hide.png`` for a material "hide".

    Raises
    ------
    IoError
        One of them exists and ``force`` is false, or cannot be written; then none is.
    """
    images, lines = {}, []
    for number, material in enumerate(mesh.materials):
        name = material_name(material.name)
        color = " ".join(repr(float(value)) for value in material.base_color[:3])
        lines += [f"newmtl {name}", f"Kd {color}", f"d {float(material.base_color[3])!r}"]
        if material.image is not None:
            file = material_image(path, name)
            if file in images:
                file = file.with_name(f"{file.stem}-{number}.png")
            images[file] = encode_png(material.image)
            lines.append(f"map_Kd {file.name}")
    library = path.with_suffix(".mtl")
    for file in (library, *images):
        check_output(file, force)
    for file, data in images.items():
        with atomic_write(file, force) as temporary:
            temporary.write_bytes(data)
    with atomic_write(library, force) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8", errors="replace")
    return library.name


def read_materials(folder: Path, libraries: list[str], warn: Warn) -> dict[str, Material]:
    """Return the materials of the files that ``mtllib`` lines name, by name."""
    materials: dict[str, Material] = {}
    for line in libraries:
        # The line may be one name with spaces or several names.
        names = [line] if _find(folder, line) else line.split()
        for name in names:
            file = _find(folder, name)
            if file is None:
                warn(f"material file {name!r} is missing; names are kept, colours are white")
                continue
            try:
                text = file.read_bytes().decode("utf-8", "replace")
            except OSError as error:
                warn(f"material file {name!r} cannot be read: {error.strerror}")
                continue
            materials |= _parse(text, file.parent, warn)
    return materials


def _find(folder: Path, name: str) -> Path | None:
    """The named file beside the model; a name from elsewhere is tried by its last part too."""
    if "\0" in name or not name.strip():
        return None
    plain = name.replace("\\", "/")
    for candidate in (folder / plain, folder / plain.rsplit("/", 1)[-1]):
        try:
            if candidate.is_file():
                return candidate
        except OSError:  # a name longer than the system allows
            continue
    return None


def _parse(text: str, folder: Path, warn: Warn) -> dict[str, Material]:
    materials: dict[str, Material] = {}
    name = None
    for line in text.splitlines():
        keyword, _, rest = line.strip().replace("\t", " ").partition(" ")
        keyword, rest = keyword.lower(), rest.strip()
        if keyword == "newmtl":
            name = rest
            materials[name] = Material(name, np.ones(4, np.float32))
        elif name is not None and keyword in ("kd", "d", "map_kd"):
            materials[name] = _with(materials[name], keyword, rest, folder, warn)
    return materials


def _with(material: Material, keyword: str, rest: str, folder: Path, warn: Warn) -> Material:
    """The material with one more of its lines taken in."""
    color, image, image_name = material.base_color.copy(), material.image, material.image_name
    if keyword == "map_kd":
        image_name, file = _image_file(rest, folder)
        if file is None:
            warn(f"image {image_name!r} of material {material.name!r} is missing")
        else:
            image = read_image(file, warn)
        return Material(material.name, color, image, image_name)
    try:
        values = np.array([float(word) for word in rest.split()[:3]], np.float32)
    except ValueError:
        values = np.empty(0, np.float32)
    needed = 3 if keyword == "kd" else 1
    if len(values) < needed or not np.isfinite(values).all():
        warn(f"material {material.name!r}: {keyword!r} is followed by {rest[:40]!r}; left out")
        return material
    if keyword == "kd":
        color[:3] = values
    else:
        color[3] = values[0]
    return Material(material.name, color, image, image_name)


def _image_file(rest: str, folder: Path) -> tuple[str, Path | None]:
    """The image behind options such as ``-s 1 1 1``; its name may hold spaces."""
    words = rest.split(" ")
    for first in range(len(words)):
        name = " ".join(words[first:])
        file = _find(folder, name)
        if file is not None:
            return name, file
        if not rest.startswith("-"):
            break
    return rest, None
