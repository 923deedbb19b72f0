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
_INDICES = (5121, 5123, 5125)  # the unsigned component types
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_TYPES = {5120: "i1", 5121: "u1", 5122: "i2", 5123: "u2", 5125: "u4", 5126: "f4"}
_READ_AS_PLAIN = ("KHR_materials_", "KHR_texture_transform", "KHR_mesh_quantization", "KHR_lights_")
_NOT_APPLIED = ("KHR_texture_transform", "EXT_mesh_gpu_instancing", "skins", "targets")
_PUBLIC = {"_UV": "TEXCOORD_0", "_COLOR": "COLOR_0"}  # trimesh keeps names with "_" as they are
_NODE = ("children", "matrix", "translation", "rotation", "scale")


def read_gltf(path: Path, warn: Warn) -> Mesh:
    """Read a glTF scene; ValueError says what is wrong with it."""
    import trimesh
    from PIL import Image

    tree, binary = _opened(path.read_bytes())
    meshes = _meshes(tree, warn)
    shown = _shown(tree, meshes)
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
    primitives = [primitive for mesh in meshes for primitive in mesh["primitives"]]
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


def _size(value: object, what: str) -> int:
    if type(value) is not int or value < 0:
        raise ValueError(f"the {what} is {value!r}")
    return value


def _base(material: dict) -> dict:
    return material.get("pbrMetallicRoughness", {})


def _meshes(tree: dict, warn: Warn) -> list[dict]:
    """The meshes as trimesh is shown them: triangles alone."""
    meshes, n_other = [], 0
    found = {*tree.get("extensionsUsed", ()), *(["skins"] if tree.get("skins") else [])}
    for number, mesh in enumerate(_items(tree, "meshes")):
        modes = (_TRIANGLES, _STRIP, _FAN)
        kept = [p for p in mesh["primitives"] if p.get("mode", _TRIANGLES) in modes]
        n_other += len(mesh["primitives"]) - len(kept)
        found = found.union(*kept)
        kept = [_primitive(tree, primitive) for primitive in kept]
        meshes.append({"name": str(number), "primitives": kept})
    if not any(mesh["primitives"] for mesh in meshes):
        only = f"it holds {n_other} sets of lines or points, but" if n_other else "it holds"
        raise ValueError(f"{only} no faces")
    if n_other:
        warn(f"{n_other} sets of lines or points; left out")
    for name in sorted(found.intersection(_NOT_APPLIED)):
        warn(f"its {name} are not applied")
    return meshes


def _primitive(tree: dict, primitive: dict) -> dict:
    """One set of triangles; its uv are those that the base colour image uses."""
    shown = {key: primitive[key] for key in ("mode", "indices", "material") if key in primitive}
    if shown.get("mode") == _FAN:
        raise ValueError("it holds triangle fans, which are not read")
    texture = {}
    if "material" in shown:
        texture = _base(_item(tree, "materials", shown["material"])).get("baseColorTexture", {})
    given = primitive["attributes"]
    sources = {"_UV": f"TEXCOORD_{texture.get('texCoord', 0)}", "_COLOR": "COLOR_0"}
    names = {to: given[name] for to, name in sources.items() if name in given}
    shown["attributes"] = {"POSITION": given["POSITION"]} | names
    arrays = [_item(tree, "accessors", index) for index in shown["attributes"].values()]
    counts = {array["count"] for array in arrays}
    if len(counts) > 1:
        raise ValueError(f"the attributes of its vertices have {sorted(counts)} entries")
    arrays.append(_item(tree, "accessors", shown["indices"]) if "indices" in shown else arrays[0])
    if any("sparse" in array or "bufferView" not in array for array in arrays):
        raise ValueError("its arrays are sparse or compressed, which is not read")
    if arrays[0]["type"] != "VEC3":
        raise ValueError(f"its positions are of type {arrays[0]['type']}")
    if "indices" in shown and arrays[-1]["componentType"] not in _INDICES:
        raise ValueError(f"its indices are of component type {arrays[-1]['componentType']}")
    if shown.get("mode", _TRIANGLES) == _TRIANGLES and arrays[-1]["count"] % 3:
        raise ValueError(f"a list of triangles has {arrays[-1]['count']} corners, not 3 for each")
    return shown


def _shown(tree: dict, meshes: list[dict]) -> dict:
    """The document that trimesh reads; its buffers are added by `_files`."""
    nodes, children = [], []
    for number, node in enumerate(_items(tree, "nodes")):
        children += node.get("children", [])
        nodes.append({key: node[key] for key in _NODE if key in node} | {"name": str(number)})
        # A node whose mesh shows nothing would be lost, and with it the place of its children.
        if "mesh" in node and _item({"meshes": meshes}, "meshes", node["mesh"])["primitives"]:
            nodes[number]["mesh"] = node["mesh"]
    roots = [number for number in range(len(nodes)) if number not in {*children}]
    if tree.get("scenes"):
        roots = _item(tree, "scenes", tree.get("scene", 0)).get("nodes", [])
    seen = set()
    for index in [*roots, *children]:
        _item(tree, "nodes", index)
        if index in seen:
            raise ValueError(f"node {index} stands in the scene twice")
        seen.add(index)
    shown = {name: _items(tree, name) for name in ("bufferViews", "textures", "images")}
    shown["accessors"] = [_accessor(tree, *entry) for entry in enumerate(_items(tree, "accessors"))]
    shown["materials"] = [{"pbrMetallicRoughness": _base(m)} for m in _items(tree, "materials")]
    scene = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": roots}]}
    return scene | {"nodes": nodes, "meshes": meshes} | shown


def _accessor(tree: dict, number: int, entry: dict) -> dict:
    """An array, when it lies within its bytes; one without bytes of its own is shown empty."""
    if "bufferView" not in entry:
        return {"count": 0, "componentType": 5126, "type": "SCALAR"}
    view = _item(tree, "bufferViews", entry["bufferView"])
    item = np.dtype(_TYPES[entry["componentType"]]).itemsize * _WIDTHS[entry["type"]]
    stride = _size(view.get("byteStride", item), "stride of an array")
    count = _size(entry["count"], "count of an array")
    end = _size(entry.get("byteOffset", 0), "offset of an array") + max(count - 1, 0) * stride
    there = _size(view["byteLength"], "length of a view")
    if end + item * (count > 0) > there:
        raise ValueError(f"array {number} should end at byte {end + item}, but there are {there}")
    return entry


def _files(tree: dict, shown: dict, folder: Path, binary: bytes | None) -> dict[str, bytes]:
    """The bytes of buffers and of images outside them, by the names they are shown under."""
    files, lengths = {}, []
    for number, buffer in enumerate(_items(tree, "buffers")):
        if number or binary is None or "uri" in buffer:
            binary = _bytes(buffer.get("uri", f"buffer {number}"), folder)
        lengths.append(_size(buffer["byteLength"], "length of a buffer"))
        if len(binary) < lengths[-1]:
            promise = f"buffer {number} promises {lengths[-1]} bytes"
            raise ValueError(f"{promise}, but has {len(binary)}")
        files[f"buffer {number}"] = binary
    shown["buffers"] = [{"uri": name} for name in files]
    for number, view in enumerate(shown["bufferViews"]):
        there = _size(_item(tree, "buffers", view["buffer"])["byteLength"], "length of a buffer")
        end = _size(view.get("byteOffset", 0), "offset of a view") + view["byteLength"]
        if _size(end, "end of a view") > there:
            raise ValueError(f"view {number} should end at byte {end}, but there are {there}")
    for image in shown["images"]:
        if "uri" in image:
            try:
                files[image["uri"]] = _bytes(image["uri"], folder)
            except ValueError:
                continue  # said when its material is made
    return files


def _bytes(uri: object, folder: Path) -> bytes:
    """What a data URI holds, or a file beside the document."""
    if not isinstance(uri, str):
        raise ValueError(f"it refers to the file {uri!r}")
    if uri.startswith("data:"):
        return base64.b64decode(uri.partition("base64,")[2])
    for path in (folder / urllib.parse.unquote(uri), folder / uri):
        if path.is_file():
            return path.read_bytes()
    raise ValueError(f"the file {uri[:80]!r} that it needs is missing")


def _joined(tree: dict, placed: list, parts: list, primitives: list[dict], warn: Warn) -> Mesh:
    """One mesh of all parts; those of one node that draw on the same arrays share vertices."""
    first, n_vertices, has = {}, 0, set()
    vertices, faces, uv, colors, material_index, pictures = [], [], [], [], [], {}
    for node, number, matrix in placed:
        part, primitive = parts[number], primitives[number]
        given = primitive["attributes"]
        source = (node, *given.items())
        if source not in first:
            first[source], n = n_vertices, len(part.vertices)
            n_vertices += n
            raw = {"POSITION": np.asarray(part.vertices)} | part.vertex_attributes
            values = {name: _values(tree, given[name], raw[name]) for name in given}
            vertices.append(values["POSITION"] @ matrix[:3, :3].T + matrix[:3, 3])
            uv.append(np.array(values.get("_UV", np.zeros((n, 2))), np.float64))
            uv[-1][:, 1] = 1 - uv[-1][:, 1]  # glTF counts from the top
            colors.append(np.ones((n, 4), np.float32))  # no colour means white
            color = values.get("_COLOR", colors[-1])
            colors[-1][:, : color.shape[1]] = color
            has.update(values)
        corners = checked_faces(np.asarray(part.faces), len(part.vertices))
        if primitive.get("mode") == _STRIP:  # it jumps by way of faces without area
            corners = corners[(corners != np.roll(corners, 1, axis=1)).all(axis=1)]
        turn = -1 if np.linalg.det(matrix[:3, :3]) < 0 else 1
        faces.append(corners[:, ::turn] + np.int32(first[source]))
        material_index.append(np.full(len(corners), primitive.get("material", -1), np.int32))
        if "material" in primitive:
            pictures[primitive["material"]] = part.visual.material.baseColorTexture
    if not sum(map(len, faces)):
        raise ValueError("it holds no faces")
    return Mesh(
        np.concatenate(vertices),
        np.concatenate(faces),
        uv=np.concatenate(uv) if "_UV" in has else None,
        vertex_colors=np.concatenate(colors) if "_COLOR" in has else None,
        material_index=np.concatenate(material_index) if pictures else None,
        materials=_materials(tree, pictures, warn),
    )


def _values(tree: dict, index: int, values: np.ndarray) -> np.ndarray:
    """An attribute as numbers; normalized integers stand for fractions."""
    kind = _TYPES[tree["accessors"][index]["componentType"]]
    if not tree["accessors"][index].get("normalized") or kind == "f4":
        return values
    return np.maximum(values / np.iinfo(kind).max, -1.0)


def _materials(tree: dict, pictures: dict, warn: Warn) -> tuple[Material, ...]:
    """All materials; images are decoded for those in use, whose ``pictures`` are given."""
    materials = []
    for index, entry in enumerate(_items(tree, "materials")):
        color = np.array(_base(entry).get("baseColorFactor", [1] * 4), np.float32)
        if color.shape != (4,) or not np.isfinite(color).all():
            raise ValueError(f"the base colour of material {index} is {color.tolist()}")
        texture, image, image_name = _base(entry).get("baseColorTexture"), None, ""
        if texture is not None and index in pictures:
            texture = _item(tree, "textures", texture["index"])
            webp = texture.get("extensions", {}).get("EXT_texture_webp", {})
            number = webp.get("source", texture.get("source"))
            stored = _item(tree, "images", number)
            uri = stored.get("uri", "data:")
            image_name = str(stored.get("name", "")) if uri.startswith("data:") else uri
            if pictures[index] is None:
                warn(f"image {number} {image_name!r} is missing or cannot be read")
            else:
                image = read_image(pictures[index], warn)
        materials.append(Material(str(entry.get("name", "")), color, image, image_name))
    return tuple(materials)


def write_glb(path: Path, mesh: Mesh) -> None:
    """Write one node with one primitive for each material; float32, colours linear."""
    import trimesh

    index = mesh.material_index if mesh.materials else None
    attributes = {}
    if mesh.uv is not None:
        attributes["_UV"] = np.stack([mesh.uv[:, 0], 1 - mesh.uv[:, 1]], 1).astype(np.float32)
    if mesh.vertex_colors is not None:
        attributes["_COLOR"] = mesh.vertex_colors
    positions, scene = float32_positions(mesh.vertices), trimesh.Scene()
    groups = [-1] if index is None else np.unique(index).tolist()
    for group in groups:
        faces = mesh.faces if index is None else mesh.faces[index == group]
        part = trimesh.Trimesh(positions, faces, process=False, vertex_attributes=attributes)
        scene.add_geometry(part, geom_name=str(group))

    def finish(buffers: dict, tree: dict) -> None:
        """Join the parts under the standard's names; equal arrays are stored once already."""
        primitives = [entry["primitives"][0] for entry in tree["meshes"]]
        for group, primitive in zip(groups, primitives, strict=True):
            given = primitive["attributes"]
            primitive["attributes"] = {_PUBLIC.get(name, name): given[name] for name in given}
            primitive |= {"material": group} if group >= 0 else {}
        tree |= {"meshes": [{"primitives": primitives}], "nodes": [{"mesh": 0}]}
        tree |= {"scenes": [{"nodes": [0]}], "asset": {"version": "2.0", "generator": "meshsdf"}}
        for material in mesh.materials:
            color = np.clip(np.nan_to_num(material.base_color), 0, 1).astype(float).tolist()
            shading = {"baseColorFactor": color, "metallicFactor": 0.0}
            if material.image is not None:
                shading["baseColorTexture"] = {"index": len(tree["images"])}
                tree["textures"].append({"source": len(tree["images"])})
                image = {"name": material.image_name, "mimeType": "image/png"}
                tree["images"].append(image | {"bufferView": len(buffers)})
                png = encode_png(material.image)
                buffers[f"image {len(buffers)}"] = png + bytes(-len(png) % 4)
            tree["materials"].append({"name": material.name, "pbrMetallicRoughness": shading})

    data = scene.export(file_type="glb", include_normals=False, buffer_postprocessor=finish)
    path.write_bytes(data)
