"""glTF 2.0, ``.glb`` and ``.gltf``: the whole scene as one mesh, every part in its place.

A mesh that several nodes show appears once for each. A node transform that mirrors turns the
faces of its part round, so that counter-clockwise still means outside. Lines and points, skins,
morph targets and animations are not read, which is said.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..mesh import Mesh
from .gltf_document import Document, open_document
from .gltf_materials import read_materials, texture_set
from .polygons import checked_faces
from .warn import Warn

_TRIANGLES, _STRIP, _FAN = 4, 5, 6
_READ_AS_PLAIN = ("KHR_materials_", "KHR_texture_transform", "KHR_mesh_quantization", "KHR_lights_")
_MAX_VERTICES = np.iinfo(np.int32).max


@dataclass(frozen=True, eq=False)
class _Part:
    """One primitive where a node puts it; parts with one ``source`` share their vertices."""

    source: tuple
    positions: np.ndarray
    faces: np.ndarray
    uv: np.ndarray | None
    colors: np.ndarray | None
    material: int


def read_gltf(path: Path, warn: Warn) -> Mesh:
    """Read a glTF scene; ValueError says what is wrong with it."""
    document = open_document(path)
    for name in document.json.get("extensionsRequired", []):
        if not str(name).startswith(_READ_AS_PLAIN):
            raise ValueError(f"it needs the extension {name}, which is not read")
    parts, n_vertices, n_other = [], 0, 0
    for place, (mesh_index, matrix) in enumerate(_placed_meshes(document, warn)):
        for primitive in document.item("meshes", mesh_index)["primitives"]:
            if primitive.get("mode", _TRIANGLES) not in (_TRIANGLES, _STRIP, _FAN):
                n_other += 1
                continue
            parts.append(_part(document, primitive, place, matrix, warn))
            n_vertices += len(parts[-1].positions)
            if n_vertices > _MAX_VERTICES:
                raise ValueError("it holds more vertices than 32-bit indices can name")
    parts = [part for part in parts if len(part.faces)]
    if not parts:
        only = f"it holds {n_other} sets of lines or points, but" if n_other else "it holds"
        raise ValueError(f"{only} no faces")
    if n_other:
        warn(f"{n_other} sets of lines or points; left out")
    return _joined(parts, document, warn)


def write_glb(path: Path, mesh: Mesh) -> None:
    """Write a GLB file; see `gltf_write`."""
    from .gltf_write import glb_bytes

    path.write_bytes(glb_bytes(mesh))


def _placed_meshes(document: Document, warn: Warn):
    """(mesh, (4, 4) transform to world) of every node of the scene that shows a mesh."""
    stack = [(node, np.eye(4)) for node in reversed(_roots(document))]
    seen, placed = set(), []
    while stack:
        index, above = stack.pop()
        node = document.item("nodes", index)
        if index in seen:
            raise ValueError(f"node {index} stands in the scene twice")
        seen.add(index)
        matrix = above @ _matrix(node)
        if "mesh" in node:
            placed.append((node["mesh"], matrix))
        if "skin" in node:
            warn(f"node {index} is skinned; its mesh is read in rest position")
        if "EXT_mesh_gpu_instancing" in node.get("extensions", {}):
            warn(f"node {index} has instances; only one is read")
        stack += [(child, matrix) for child in reversed(node.get("children", []))]
    return placed


def _roots(document: Document) -> list:
    if document.items("scenes"):
        return document.item("scenes", document.json.get("scene", 0)).get("nodes", [])
    nodes = document.items("nodes")
    if not nodes:
        return []
    children = {child for node in nodes for child in node.get("children", [])}
    return [index for index in range(len(nodes)) if index not in children]


def _matrix(node: dict) -> np.ndarray:
    """The (4, 4) transform of a node: its matrix, or scale, then rotation, then translation."""
    if "matrix" in node:
        return np.array(node["matrix"], np.float64).reshape(4, 4).T
    matrix = np.eye(4)
    x, y, z, w = np.array(node.get("rotation", (0, 0, 0, 1)), np.float64)
    if (x, y, z) != (0, 0, 0):
        x, y, z, w = np.array([x, y, z, w]) / np.sqrt(x * x + y * y + z * z + w * w)
        matrix[:3, :3] = [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    matrix[:3, :3] *= np.array(node.get("scale", (1, 1, 1)), np.float64)
    matrix[:3, 3] = np.array(node.get("translation", (0, 0, 0)), np.float64)
    return matrix


def _part(document: Document, primitive: dict, place: int, matrix: np.ndarray, warn: Warn) -> _Part:
    attributes = primitive["attributes"]
    if "KHR_draco_mesh_compression" in primitive.get("extensions", {}):
        raise ValueError("its meshes are compressed with Draco, which is not read")
    if primitive.get("targets"):
        warn("morph targets are not applied")
    positions = document.array(attributes["POSITION"]).astype(np.float64)
    if "indices" in primitive:
        order = document.array(primitive["indices"])[:, 0].astype(np.int64)
    else:
        order = np.arange(len(positions))
    faces = checked_faces(_triangles(order, primitive.get("mode", _TRIANGLES)), len(positions))
    material = primitive.get("material", -1)
    uv_name = f"TEXCOORD_{texture_set(document, material)}"
    uv = _attribute(document, attributes, uv_name, len(positions))
    colors = _attribute(document, attributes, "COLOR_0", len(positions))
    if not np.array_equal(matrix, np.eye(4)):
        positions = positions @ matrix[:3, :3].T + matrix[:3, 3]
        if np.linalg.det(matrix[:3, :3]) < 0:
            faces = faces[:, ::-1]
    source = (place, *(attributes.get(name) for name in ("POSITION", uv_name, "COLOR_0")))
    return _Part(source, positions, faces, uv, colors, material)


def _triangles(order: np.ndarray, mode: int) -> np.ndarray:
    """(m, 3) corners of a list, a strip (every second one turned round) or a fan."""
    if mode == _TRIANGLES:
        if len(order) % 3:
            raise ValueError(f"a list of triangles has {len(order)} corners, not 3 for each")
        return order.reshape(-1, 3)
    if len(order) < 3:
        return np.empty((0, 3), np.int64)
    if mode == _FAN:
        first = np.full(len(order) - 2, order[0])
        return np.stack([first, order[1:-1], order[2:]], axis=1)
    strip = np.stack([order[:-2], order[1:-1], order[2:]], axis=1)
    strip[1::2] = strip[1::2, [1, 0, 2]]
    # A strip uses faces without area to jump; they are not part of the shape.
    a, b, c = strip.T
    return strip[(a != b) & (b != c) & (c != a)]


def _attribute(document: Document, attributes: dict, name: str, count: int) -> np.ndarray | None:
    if name not in attributes:
        return None
    values = document.array(attributes[name])
    if len(values) != count:
        raise ValueError(f"{name} has {len(values)} entries for {count} vertices")
    return values


def _joined(parts: list[_Part], document: Document, warn: Warn) -> Mesh:
    """One mesh of all parts; those that draw on the same arrays keep their common vertices."""
    sources = {part.source: part for part in parts}
    n_before = np.cumsum([0] + [len(part.positions) for part in sources.values()])
    first = dict(zip(sources, n_before.tolist(), strict=False))
    faces = [part.faces + np.int32(first[part.source]) for part in parts]
    uv = colors = material_index = None
    if any(part.uv is not None for part in parts):
        uv = np.zeros((n_before[-1], 2))
    if any(part.colors is not None for part in parts):
        colors = np.ones((n_before[-1], 4), np.float32)  # no colour means white
    for source, part in sources.items():
        rows = slice(first[source], first[source] + len(part.positions))
        if part.uv is not None:
            uv[rows, 0] = part.uv[:, 0]
            uv[rows, 1] = 1 - part.uv[:, 1].astype(np.float64)  # glTF counts from the top
        if part.colors is not None:
            colors[rows, : part.colors.shape[1]] = part.colors
    if any(part.material >= 0 for part in parts):
        counts = [len(part.faces) for part in parts]
        material_index = np.repeat(np.array([p.material for p in parts], np.int32), counts)
    return Mesh(
        np.concatenate([part.positions for part in sources.values()]),
        np.concatenate(faces),
        uv=uv,
        vertex_colors=colors,
        material_index=material_index,
        materials=read_materials(document, {p.material for p in parts} - {-1}, warn),
    )
