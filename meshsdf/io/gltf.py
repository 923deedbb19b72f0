"""glTF 2.0, ``.glb`` and ``.gltf``: the whole scene as one mesh, every part in its place.

trimesh decodes arrays, strips, images and node transforms, and writes GLB. It is shown triangles
and bare nodes only, after the sizes a file claims were held against the bytes it has. Attributes
go through it under private names, which it keeps as they are: under their own it rounds colours
to 8 bits and drops uv without a material. Base colours are read from the JSON for the same reason.

Notes
-----
Refused: triangle fans, sparse and compressed arrays. Left out and said: lines, points, skins,
morph targets, instances, texture transforms. Materials in the older specular-glossiness form
are white. Parts stand in the order of their nodes in the file.
"""

import base64
import io
import json
import struct
import urllib.parse
import warnings
from pathlib import Path

import numpy as np

from ..mesh import Material, Mesh
from .images import encode_png, read_image
from .polygons import checked_faces
from .stl import float32_positions
from .warn import Warn

_TRIANGLES, _STRIP, _FAN = 4, 5, 6
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_TYPES = {5120: "i1", 5121: "u1", 5122: "i2", 5123: "u2", 5125: "u4", 5126: "f4"}
_READ_AS_PLAIN = ("KHR_materials_", "KHR_texture_transform", "KHR_mesh_quantization", "KHR_lights_")
_NOT_APPLIED = ("KHR_texture_transform", "EXT_mesh_gpu_instancing", "skins", "targets")
_NODE = ("children", "matrix", "translation", "rotation", "scale")


def read_gltf(path: Path, warn: Warn) -> Mesh:
    """Read a glTF scene; ValueError says what is wrong with it."""
    import trimesh
    from PIL import Image

    tree, binary = _opened(path.read_bytes())
    shown, primitives = _surfaces(tree, warn)
    files = _files(tree, shown, path.parent, binary)
    with warnings.catch_warnings():  # an image too large to trust is then left out
        warnings.simplefilter("error", Image.DecompressionBombWarning)
        text = io.BytesIO(json.dumps(shown).encode())
        scene = trimesh.load_scene(text, file_type="gltf", resolver=files, process=False)
    # Products of our own: the scene's omit steps below 1e-8 and round matrices that almost turn.
    matrices = {scene.graph.base_frame: np.eye(4)}
    for (above, name), edge in scene.graph.transforms.edge_data.items():
        matrices[name] = matrices[above] @ edge["matrix"]
    numbers = {name: number for number, name in enumerate(scene.geometry)}
    nodes = scene.graph.transforms.node_data
    placed = [
        (int(name.partition("_")[0]), numbers[nodes[name]["geometry"]], matrices[name])
        for name in scene.graph.nodes_geometry
    ]
    placed.sort(key=lambda place: place[:2])
    parts = list(scene.geometry.values())
    if sum(len(parts[number].vertices) for _, number, _ in placed) > np.iinfo(np.int32).max:
        raise ValueError("it holds more vertices than 32-bit indices can name")
    return _joined(tree, placed, parts, primitives, warn)


def _opened(data: bytes) -> tuple[dict, bytes | None]:
    """The JSON of a file, and its binary chunk (Khronos glTF 2.0 specification, section 4)."""
    chunks = {b"JSON": data}
    if data[:4] == b"glTF":
        version, length = struct.unpack_from("<2I", data, 4)
        if version != 2:
            raise ValueError(f"it is GLB version {version}; only 2 is read")
        if length > len(data):
            raise ValueError(f"it is cut off: it promises {length} bytes, but has {len(data)}")
        chunks, at = {}, 12
        while at + 8 <= length:
            size, kind = struct.unpack_from("<I4s", data, at)
            if at + 8 + size > length:
                raise ValueError(f"a chunk should end at byte {at + 8 + size} of {length}")
            chunks.setdefault(kind, data[at + 8 : at + 8 + size])
            at += 8 + size
        if b"JSON" not in chunks:
            raise ValueError("it has no JSON chunk")
    tree = json.loads(chunks[b"JSON"].decode("utf-8-sig"))
    if not (isinstance(tree, dict) and isinstance(tree.get("asset"), dict)):
        raise ValueError("it is not a glTF document")
    version = str(tree["asset"].get("version", "unknown"))
    if not version.startswith("2"):
        raise ValueError(f"it is glTF version {version}; only 2 is read")
    for name in tree.get("extensionsRequired", []):
        if not str(name).startswith(_READ_AS_PLAIN):
            raise ValueError(f"it needs the extension {name}, which is not read")
    return tree, chunks.get(b"BIN\0")


def _item(tree: dict, name: str, index: object) -> dict:
    """One entry of a list of the document."""
    entries = tree.get(name, [])
    if not isinstance(entries, list):
        raise ValueError(f"its {name} are not a list")
    if type(index) is not int or not 0 <= index < len(entries):
        raise ValueError(f"it refers to {name}[{index!r}], but there are {len(entries)}")
    if not isinstance(entries[index], dict):
        raise ValueError(f"its {name}[{index}] is not an object")
    return entries[index]


def _items(tree: dict, name: str) -> list[dict]:
    return [_item(tree, name, index) for index in range(len(tree.get(name, ())))]


def _surfaces(tree: dict, warn: Warn) -> tuple[dict, list[dict]]:
    """What trimesh is shown of the document, and the primitives in it, in order."""
    primitives, meshes, n_other = [], [], 0
    for number, mesh in enumerate(_items(tree, "meshes")):
        modes = [primitive.get("mode", _TRIANGLES) for primitive in mesh["primitives"]]
        kept = [p for p, m in zip(mesh["primitives"], modes, strict=True) if m in (4, 5, 6)]
        n_other += len(modes) - len(kept)
        kept = [_shown_primitive(tree, primitive) for primitive in kept]
        meshes.append({"name": str(number), "primitives": kept})
        primitives += kept
    if not primitives:
        only = f"it holds {n_other} sets of lines or points, but" if n_other else "it holds"
        raise ValueError(f"{only} no faces")
    if n_other:
        warn(f"{n_other} sets of lines or points; left out")
    text = json.dumps(tree)
    for name in _NOT_APPLIED:
        if f'"{name}": ' in text:
            warn(f"its {name} are not applied")
    nodes, named = _items(tree, "nodes"), []
    for number, node in enumerate(nodes):
        named += node.get("children", [])
        nodes[number] = {key: node[key] for key in _NODE if key in node} | {"name": str(number)}
        # A node whose mesh has nothing to show would be lost, and its children's place with it.
        if "mesh" in node and _item({"meshes": meshes}, "meshes", node["mesh"])["primitives"]:
            nodes[number]["mesh"] = node["mesh"]
    roots = [number for number in range(len(nodes)) if number not in named]
    if tree.get("scenes"):
        roots = _item(tree, "scenes", tree.get("scene", 0)).get("nodes", [])
    seen = set()
    for index in [*roots, *named]:
        _item(tree, "nodes", index)
        if index in seen:
            raise ValueError(f"node {index} stands in the scene twice")
        seen.add(index)
    lists = {"bufferViews": _items(tree, "bufferViews"), "accessors": _accessors(tree)}
    kept = {name: tree.get(name, []) for name in ("textures", "images")}
    materials = [{"pbrMetallicRoughness": _base(entry)} for entry in _items(tree, "materials")]
    scene = {"scene": 0, "scenes": [{"nodes": roots}], "nodes": nodes, "meshes": meshes}
    return scene | lists | kept | {"asset": tree["asset"], "materials": materials}, primitives
