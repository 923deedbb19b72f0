"""A mesh as the bytes of a GLB file: one node, one primitive for each material.

Positions, uv and colours are float32, by the format. Colours are linear light, as glTF wants
them, so no precision is lost to an encoding. Faces are grouped by material.
"""

import json
import struct

import numpy as np

from ..mesh import Material, Mesh
from .images import encode_png
from .stl import float32_positions

_UINT32, _FLOAT32 = 5125, 5126
_VERTEX_BUFFER, _INDEX_BUFFER = 34962, 34963


class _Builder:
    """Collects buffer views and accessors."""

    def __init__(self) -> None:
        self.binary = bytearray()
        self.views: list[dict] = []
        self.accessors: list[dict] = []

    def view(self, data: bytes, target: int | None = None) -> int:
        """Append bytes; return the number of their view."""
        self.binary += b"\0" * (-len(self.binary) % 4)
        entry = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)}
        if target is not None:
            entry["target"] = target
        self.views.append(entry)
        self.binary += data
        return len(self.views) - 1

    def array(self, values: np.ndarray, kind: str, with_bounds: bool = False) -> int:
        """Append float32 or uint32 values; return the number of their accessor."""
        is_index = values.dtype.kind == "u"
        data = values.astype("<u4" if is_index else "<f4").tobytes()
        entry = {
            "bufferView": self.view(data, _INDEX_BUFFER if is_index else _VERTEX_BUFFER),
            "componentType": _UINT32 if is_index else _FLOAT32,
            "count": len(values),
            "type": kind,
        }
        if with_bounds:
            entry["min"] = values.min(axis=0).astype(float).tolist()
            entry["max"] = values.max(axis=0).astype(float).tolist()
        self.accessors.append(entry)
        return len(self.accessors) - 1


def glb_bytes(mesh: Mesh) -> bytes:
    """Return the mesh as a GLB file; IoError if a position does not fit float32."""
    build = _Builder()
    attributes = {"POSITION": build.array(float32_positions(mesh.vertices), "VEC3", True)}
    if mesh.uv is not None:
        flipped = np.stack([mesh.uv[:, 0], 1 - mesh.uv[:, 1]], axis=1)
        attributes["TEXCOORD_0"] = build.array(flipped.astype(np.float32), "VEC2")
    if mesh.vertex_colors is not None:
        attributes["COLOR_0"] = build.array(mesh.vertex_colors, "VEC4")
    primitives = []
    for material, faces in _by_material(mesh):
        corners = faces.ravel().astype(np.uint32)
        primitive = {"attributes": attributes, "indices": build.array(corners, "SCALAR")}
        if material >= 0:
            primitive["material"] = material
        primitives.append(primitive)
    document = {
        "asset": {"version": "2.0", "generator": "meshsdf"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": primitives}],
        **_materials(mesh.materials, build),
        "accessors": build.accessors,
        "bufferViews": build.views,
        "buffers": [{"byteLength": len(build.binary)}],
    }
    return _packed(document, bytes(build.binary))


def _by_material(mesh: Mesh) -> list[tuple[int, np.ndarray]]:
    if mesh.material_index is None or not mesh.materials:
        return [(-1, mesh.faces)]
    index = mesh.material_index
    return [(int(number), mesh.faces[index == number]) for number in np.unique(index)]


def _materials(materials: tuple[Material, ...], build: _Builder) -> dict:
    entries, images = [], []
    for material in materials:
        color = np.clip(np.nan_to_num(material.base_color), 0, 1).astype(float).tolist()
        shading = {"baseColorFactor": color, "metallicFactor": 0.0}
        if material.image is not None:
            shading["baseColorTexture"] = {"index": len(images)}
            view = build.view(encode_png(material.image))
            images.append(
                {"name": material.image_name, "mimeType": "image/png", "bufferView": view}
            )
        entries.append({"name": material.name, "pbrMetallicRoughness": shading})
    found = {"materials": entries} if entries else {}
    if images:
        found["images"] = images
        found["textures"] = [{"source": number} for number in range(len(images))]
    return found


def _packed(document: dict, binary: bytes) -> bytes:
    text = json.dumps(document, separators=(",", ":"), allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4s2I", b"glTF", 2, 12 + len(chunks)) + chunks
