"""Wavefront MTL: the base colour and its image; everything that fails is said, nothing stops.

``Kd`` is linear light, ``d`` the alpha. ``Tr`` is left alone: programs disagree on its direction.
"""

from pathlib import Path

import numpy as np

from ..mesh import Material
from .images import read_image
from .warn import Warn


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
