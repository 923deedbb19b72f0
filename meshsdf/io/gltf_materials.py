"""The base colour and its image of glTF materials."""

import numpy as np

from ..mesh import Material
from .gltf_document import Document
from .images import read_image
from .warn import Warn


def texture_set(document: Document, material: object) -> int:
    """Return which set of texture coordinates the base colour image of a material uses."""
    if material == -1:
        return 0
    texture = _base(document.item("materials", material))[1]
    number = texture.get("texCoord", 0)
    if not (isinstance(number, int) and 0 <= number < 64):
        raise ValueError(f"a texture uses the coordinate set {number!r}")
    return number


def read_materials(document: Document, used: set[int], warn: Warn) -> tuple[Material, ...]:
    """Return all materials; images are decoded for those that are used."""
    materials, images = [], {}
    for index, entry in enumerate(document.items("materials")):
        factor, texture = _base(entry)
        color = np.array(factor, np.float32)
        if color.shape != (4,) or not np.isfinite(color).all():
            raise ValueError(f"the base colour of material {index} is {factor!r}")
        image, image_name = None, ""
        source = _image_index(document, texture)
        if source is not None and index in used:
            if source not in images:
                images[source] = _image(document, source, warn)
            image, image_name = images[source]
        if image is not None and "KHR_texture_transform" in texture.get("extensions", {}):
            warn(f"the texture transform of material {index} is not applied")
        materials.append(Material(str(entry.get("name", "")), color, image, image_name))
    return tuple(materials)


def _base(entry: dict) -> tuple[object, dict]:
    """Colour factor and texture of the base colour, in either of the two ways of writing it."""
    older = entry.get("extensions", {}).get("KHR_materials_pbrSpecularGlossiness")
    if older is not None and "pbrMetallicRoughness" not in entry:
        return older.get("diffuseFactor", [1, 1, 1, 1]), older.get("diffuseTexture", {})
    shading = entry.get("pbrMetallicRoughness", {})
    return shading.get("baseColorFactor", [1, 1, 1, 1]), shading.get("baseColorTexture", {})


def _image_index(document: Document, texture: dict) -> object:
    if "index" not in texture:
        return None
    entry = document.item("textures", texture["index"])
    webp = entry.get("extensions", {}).get("EXT_texture_webp", {})
    return entry.get("source", webp.get("source"))


def _image(document: Document, index: object, warn: Warn) -> tuple[np.ndarray | None, str]:
    entry = document.item("images", index)
    name = str(entry.get("name", ""))
    try:
        if "uri" in entry:
            source = document.file(entry["uri"])
            if not entry["uri"].startswith("data:"):
                name = entry["uri"]
        else:
            source = bytes(document.view(entry["bufferView"]))
    except ValueError as error:
        warn(f"image {index} is missing: {error}")
        return None, name
    return read_image(source, warn), name
