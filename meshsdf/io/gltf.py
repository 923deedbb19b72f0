"""glTF 2.0, ``.glb`` and ``.gltf``: the whole scene as one mesh, every part in its place.

trimesh decodes and encodes. What a file claims is held against the bytes it has before, and
attributes pass through trimesh under private names, which it keeps as they are: under their own
it rounds colours to 8 bits and drops uv without a material.

Notes
-----
Refused: triangle fans, sparse and compressed arrays. Left out and said: lines, points, skins,
morph targets, instances, texture transforms, and materials in the older specular-glossiness form,
which become white. Parts stand in the order of their nodes in the file. The first call imports
trimesh, about half a second.
"""

import io
import itertools
import json
import struct
import urllib.parse
import warnings
from collections import Counter
from pathlib import Path

import numpy as np

from ..mesh import Material, Mesh
from .images import encode_png, read_image
from .polygons import checked_faces
from .stl import float32_positions
from .warn import Warn

_POINTS, _TRIANGLES, _STRIP, _FAN = 0, 4, 5, 6
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_TYPES = {5120: "i1", 5121: "u1", 5122: "i2", 5123: "u2", 5125: "u4", 5126: "f4"}
_READ_AS_PLAIN = ("KHR_materials_", "KHR_texture_transform", "KHR_mesh_quantization", "KHR_lights_")
_NOT_APPLIED = {"KHR_texture_transform", "EXT_mesh_gpu_instancing", "skins", "targets"}
_NOT_APPLIED |= {"KHR_materials_pbrSpecularGlossiness"}
_PUBLIC = {"_UV": "TEXCOORD_0", "_COLOR": "COLOR_0"}
_BINARY = "its binary chunk"
_LISTS = ("buffers", "bufferViews", "accessors", "meshes", "nodes", "scenes")
_LISTS += ("materials", "textures", "images")


class _Files(dict):
    """The bytes that a document names; those of files are found beside it when asked for."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def __missing__(self, uri: str) -> bytes:
        for path in (self.folder / urllib.parse.unquote(uri), self.folder / uri):
            if path.is_file():
                return self.setdefault(uri, path.read_bytes())
        raise ValueError(f"the file {uri[:80]!r} that it needs is missing")


def read_gltf(path: Path, warn: Warn) -> Mesh:
    """Read a glTF scene; ValueError says what is wrong with it."""
    import trimesh
    from PIL import Image

    text, files = path.read_bytes(), _Files(path.parent)
    if text[:4] == b"glTF":
        text, files[_BINARY] = _chunks(text)
    tree = json.loads(text.decode("utf-8-sig"))
    primitives = _prepared(tree, files, warn)
    # Of materials trimesh needs the image alone; it rounds base colours and mixes others in.
    bases = [entry.get("pbrMetallicRoughness", {}) for entry in tree["materials"]]
    pictured = [{"baseColorTexture": base.get("baseColorTexture")} for base in bases]
    file = io.BytesIO(json.dumps(tree | {"materials": pictured}).encode())
    try:
        with warnings.catch_warnings():  # an image that makes trouble is left out by trimesh
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            scene = trimesh.load_scene(file, file_type="gltf", resolver=files, process=False)
    except AssertionError as error:
        raise ValueError("it is cut off: an array ends behind the last byte") from error
    # Multiplied here: the scene's own products omit steps of 1e-8 and straighten near rotations.
    matrices = {scene.graph.base_frame: np.eye(4)}
    for (above, name), edge in scene.graph.transforms.edge_data.items():
        matrices[name] = matrices[above] @ edge["matrix"]
    parts = zip(scene.geometry.values(), primitives, strict=True)
    parts = [list(itertools.islice(parts, len(mesh["primitives"]))) for mesh in tree["meshes"]]
    # Placed by the document: trimesh names the many parts of a mesh by chance, and some alike.
    placed = [
        (number, matrices[str(number)], *part)
        for number, node in enumerate(tree["nodes"])
        if "mesh" in node and str(number) in matrices
        for part in parts[node["mesh"]]
    ]
    return _joined(tree, placed, warn)


def _chunks(data: bytes) -> tuple[bytes, bytes]:
    """The JSON and the binary chunk of a GLB file (glTF 2.0 specification, section 4)."""
    version, length, size, kind = struct.unpack_from("<3I4s", data, 4)
    if version != 2:
        raise ValueError(f"it is GLB version {version}; only 2 is read")
    if max(length, 20 + size) > len(data):
        promised = max(length, 20 + size)
        raise ValueError(f"it is cut off: it promises {promised} bytes, but has {len(data)}")
    if kind != b"JSON":
        raise ValueError("it has no JSON chunk in front")
    return data[20 : 20 + size], data[28 + size : length]


def _item(tree: dict, name: str, index: object) -> dict:
    if type(index) is not int or not 0 <= index < len(tree[name]):
        raise ValueError(f"it refers to {name}[{index!r}], but there are {len(tree[name])}")
    return tree[name][index]


def _size(value: object, what: str) -> int:
    if type(value) is not int or value < 0:
        raise ValueError(f"the {what} is {value!r}")
    return value


def _prepared(tree: dict, files: _Files, warn: Warn) -> list[dict]:
    """Change the document so that trimesh reads it truly; return its primitives, in order."""
    _check_version(tree.get("asset", {}).get("version", "2.0"))
    for name in tree.get("extensionsRequired", ()):
        if not str(name).startswith(_READ_AS_PLAIN):
            raise ValueError(f"it needs the extension {name}, which is not read")
    for name in _LISTS:
        entries = tree.setdefault(name, [])
        if not (isinstance(entries, list) and all(isinstance(entry, dict) for entry in entries)):
            raise ValueError(f"its {name} are not a list of objects")
    _check_sizes(tree, files)
    primitives = [part for mesh in tree["meshes"] for part in mesh["primitives"]]
    found = {*tree, *tree.get("extensionsUsed", ())}.union(*primitives)
    for primitive in primitives:
        _prepare(tree, primitive)
    n_other = sum(primitive["mode"] == _POINTS for primitive in primitives)
    if n_other == len(primitives):
        only = f"it holds {n_other} sets of lines or points, but" if n_other else "it holds"
        raise ValueError(f"{only} no faces")
    if n_other:
        warn(f"{n_other} sets of lines or points; left out")
    for name in sorted(found & _NOT_APPLIED):
        warn(f"its {name} are not applied")
    _prepare_nodes(tree)
    return primitives


def _check_version(version: object) -> None:
    """Version 1 is another format altogether."""
    if int(float(str(version).split(".")[0])) < 2:
        raise ValueError(f"it is glTF version {version}; only 2 is read")


def _prepare_nodes(tree: dict) -> None:
    """Name the nodes by their numbers, and see to it that none is shown twice."""
    children = []
    for number, node in enumerate(tree["nodes"]):
        if "mesh" in node:
            _item(tree, "meshes", node["mesh"])
        children += node.get("children", ())
        node["name"] = str(number)
        node.pop("camera", None)  # trimesh would drop the node with it
    if not tree["scenes"]:
        tree["scenes"] = [{"nodes": sorted({*range(len(tree["nodes"]))}.difference(children))}]
    roots = _item(tree, "scenes", tree.get("scene", 0)).get("nodes", [])
    for number, count in Counter([*roots, *children]).items():
        _item(tree, "nodes", number)
        if count > 1:
            raise ValueError(f"node {number} stands in the scene twice")


def _check_sizes(tree: dict, files: _Files) -> None:
    """ValueError if a claim exceeds the bytes there are; arrays without bytes are made empty."""
    for number, buffer in enumerate(tree["buffers"]):
        uri = buffer.setdefault("uri", _BINARY if number == 0 and _BINARY in files else None)
        if not isinstance(uri, str):
            raise ValueError(f"buffer {number} has no data, but refers to {uri!r}")
        _, is_base64, body = uri.partition("base64,")
        there = len(body) * 3 // 4 if is_base64 else len(files[uri])
        claim = _size(buffer["byteLength"], "length of a buffer")
        if claim > there:
            raise ValueError(f"buffer {number} promises {claim} bytes, but has {there}")
    for number, view in enumerate(tree["bufferViews"]):
        there = _item(tree, "buffers", view["buffer"])["byteLength"]
        start = _size(view.get("byteOffset", 0), "offset of a view")
        end = start + _size(view["byteLength"], "length of a view")
        if end > there:
            raise ValueError(f"view {number} should end at byte {end}, but there are {there}")
    for number, array in enumerate(tree["accessors"]):
        if "sparse" in array or "bufferView" not in array:
            tree["accessors"][number] = {"count": 0, "componentType": 5126, "type": "SCALAR"}
            continue
        view = _item(tree, "bufferViews", array["bufferView"])
        item = np.dtype(_TYPES[array["componentType"]]).itemsize * _WIDTHS[array["type"]]
        stride = _size(view.get("byteStride", item), "stride of a view")
        before = max(_size(array["count"], "count of an array") - 1, 0) * stride
        end = _size(array.get("byteOffset", 0), "offset of an array") + before + item
        if end > view["byteLength"]:
            there = view["byteLength"]
            raise ValueError(f"array {number} should end at byte {end}, but there are {there}")


def _prepare(tree: dict, primitive: dict) -> None:
    """Leave a primitive what is read of it; all that is no surface becomes points."""
    mode, given = primitive.get("mode", _TRIANGLES), primitive["attributes"]
    if mode == _FAN:
        raise ValueError("it holds triangle fans, which are not read")
    primitive["mode"] = mode if mode in (_TRIANGLES, _STRIP) else _POINTS
    names = dict(_PUBLIC)
    if "material" in primitive:
        material = _item(tree, "materials", primitive["material"])
        texture = material.get("pbrMetallicRoughness", {}).get("baseColorTexture", {})
        names["_UV"] = f"TEXCOORD_{texture.get('texCoord', 0)}"
    kept = {to: given[name] for to, name in names.items() if name in given}
    primitive["attributes"] = kept | {"POSITION": given["POSITION"]}
    primitive.pop("extensions", None)
    counts = {_item(tree, "accessors", i)["count"] for i in primitive["attributes"].values()}
    corners = counts
    if "indices" in primitive:
        corners = {_item(tree, "accessors", primitive["indices"])["count"]}
    if 0 in counts | corners:
        raise ValueError("it holds empty, sparse or compressed arrays, which are not read")
    if len(counts) > 1:
        raise ValueError(f"the attributes of its vertices have {sorted(counts)} entries")
    if mode == _TRIANGLES and max(corners) % 3:
        raise ValueError(f"a list of triangles has {max(corners)} corners, not 3 for each")


def _joined(tree: dict, placed: list[tuple], warn: Warn) -> Mesh:
    """One mesh of all parts; those of one node that draw on the same arrays share vertices."""
    first, n_vertices, has, pictures = {}, 0, set(), {}
    vertices, faces, uv, colors, material_index = [], [], [], [], []
    for node, matrix, part, primitive in placed:
        if primitive["mode"] == _POINTS:
            continue
        source = (node, *sorted(primitive["attributes"].items()))
        if source not in first:
            first[source], n = n_vertices, len(part.vertices)
            n_vertices += n
            raw = {"POSITION": part.vertices} | part.vertex_attributes
            values = {k: _values(tree["accessors"][i], raw[k]) for k, i in source[1:]}
            vertices.append(values["POSITION"] @ matrix[:3, :3].T + matrix[:3, 3])
            uv.append(np.array(values.get("_UV", np.zeros((n, 2))), np.float64))
            uv[-1][:, 1] = 1 - uv[-1][:, 1]  # glTF counts from the top
            colors.append(np.ones((n, 4), np.float32))  # no colour means white
            if "_COLOR" in values:
                colors[-1][:, : values["_COLOR"].shape[1]] = values["_COLOR"]
            has.update(values)
        corners = checked_faces(np.asarray(part.faces), len(part.vertices))
        if primitive["mode"] == _STRIP:  # it jumps by way of faces without area
            corners = corners[(corners != np.roll(corners, 1, axis=1)).all(axis=1)]
        turn = -1 if np.linalg.det(matrix[:3, :3]) < 0 else 1
        faces.append(corners[:, ::turn] + np.int32(first[source]))
        material_index.append(np.full(len(corners), primitive.get("material", -1), np.int32))
        if "material" in primitive:
            pictures[primitive["material"]] = part.visual.material.baseColorTexture
    if not any(map(len, faces)):
        raise ValueError("it holds no faces")
    return Mesh(
        np.concatenate(vertices),
        np.concatenate(faces),
        uv=np.concatenate(uv) if "_UV" in has else None,
        vertex_colors=np.concatenate(colors) if "_COLOR" in has else None,
        material_index=np.concatenate(material_index) if pictures else None,
        materials=_materials(tree, pictures, warn),
    )


def _values(array: dict, values: np.ndarray) -> np.ndarray:
    """An attribute as plain numbers; normalized integers stand for fractions."""
    kind = _TYPES[array["componentType"]]
    if not array.get("normalized") or kind == "f4":
        return np.asarray(values)
    return np.maximum(np.asarray(values) / np.iinfo(kind).max, -1.0)


def _materials(tree: dict, pictures: dict, warn: Warn) -> tuple[Material, ...]:
    """All materials; images are decoded for those in use, whose ``pictures`` are given."""
    materials = []
    for index, entry in enumerate(tree["materials"]):
        base = entry.get("pbrMetallicRoughness", {})
        color = np.array(base.get("baseColorFactor", [1] * 4), np.float32)
        if color.shape != (4,) or not np.isfinite(color).all():
            raise ValueError(f"the base colour of material {index} is {color.tolist()}")
        image, image_name = None, ""
        if "baseColorTexture" in base and index in pictures:
            texture = _item(tree, "textures", base["baseColorTexture"]["index"])
            webp = texture.get("extensions", {}).get("EXT_texture_webp", texture)
            stored = _item(tree, "images", webp["source"])
            uri = stored.get("uri", "data:")
            image_name = str(stored.get("name", "")) if uri.startswith("data:") else uri
            if pictures[index] is None:
                warn(f"image {webp['source']} {image_name!r} is missing or cannot be read")
            else:
                image = read_image(pictures[index], warn)
        materials.append(Material(str(entry.get("name", "")), color, image, image_name))
    return tuple(materials)


def write_glb(path: Path, mesh: Mesh) -> None:
    """Write one node with one primitive for each material; all float32, colours linear."""
    import trimesh

    attributes = {}
    if mesh.uv is not None:
        attributes["_UV"] = np.stack([mesh.uv[:, 0], 1 - mesh.uv[:, 1]], axis=1, dtype=np.float32)
    if mesh.vertex_colors is not None:
        attributes["_COLOR"] = mesh.vertex_colors
    index = mesh.material_index if mesh.materials else None
    groups = [-1] if index is None else np.unique(index).tolist()
    positions, scene = float32_positions(mesh.vertices), trimesh.Scene()
    for group in groups:
        faces = mesh.faces if index is None else mesh.faces[index == group]
        part = trimesh.Trimesh(positions, faces, process=False, vertex_attributes=attributes)
        scene.add_geometry(part, geom_name=str(group))

    def finish(buffers: dict, tree: dict) -> None:
        """Make the parts one mesh, which share their arrays already, and add the materials."""
        primitives = [part["primitives"][0] for part in tree["meshes"]]
        for group, primitive in zip(groups, primitives, strict=True):
            given = primitive["attributes"]
            primitive["attributes"] = {_PUBLIC.get(name, name): given[name] for name in given}
            primitive |= {"material": group} if group >= 0 else {}
        tree |= {"meshes": [{"primitives": primitives}], "nodes": [{"mesh": 0}]}
        tree |= {"scenes": [{"nodes": [0]}]}
        tree["materials"] = [_entry(material, buffers, tree) for material in mesh.materials]

    data = scene.export(file_type="glb", include_normals=False, buffer_postprocessor=finish)
    path.write_bytes(data)


def _entry(material: Material, buffers: dict, tree: dict) -> dict:
    """A material for the document, to which its image is added."""
    color = np.clip(np.nan_to_num(material.base_color), 0, 1).astype(float).tolist()
    shading = {"baseColorFactor": color, "metallicFactor": 0.0}
    if material.image is not None:
        shading["baseColorTexture"] = {"index": len(tree["textures"])}
        tree["textures"].append({"source": len(tree["images"])})
        image = {"name": material.image_name, "mimeType": "image/png", "bufferView": len(buffers)}
        tree["images"].append(image)
        png = encode_png(material.image)
        buffers[f"image {len(buffers)}"] = png + bytes(-len(png) % 4)
    return {"name": material.name, "pbrMetallicRoughness": shading}
