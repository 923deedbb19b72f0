"""PLY, binary of either byte order and text: positions as float64, colours, uv, polygons.

Colours are sRGB. Per-face colours and per-corner texture coordinates are not read, which is said.
Written files are binary, little-endian, with double positions, so they read back bit-equal.
"""

from pathlib import Path

import numpy as np

from ..mesh import Material, Mesh
from ..srgb import linear_rgba, srgb_rgba
from .images import read_image
from .ply_elements import Element, List, header_and_body, read_elements
from .polygons import checked_faces, fan_corners
from .warn import Warn

_UV_NAMES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"), ("texture_s", "texture_t"))
_FACE_NAMES = ("vertex_indices", "vertex_index")


def read_ply(path: Path, warn: Warn) -> Mesh:
    """Read a PLY file; ValueError says what is wrong with it."""
    header, body = header_and_body(path.read_bytes())
    elements = read_elements(header, body)
    if "vertex" not in elements:
        raise ValueError("it has no vertices")
    vertex = elements["vertex"]
    if not {"x", "y", "z"} <= vertex.columns.keys():
        raise ValueError("its vertices have no x, y and z")
    vertices = np.stack([_scalar(vertex, name) for name in "xyz"], axis=1)
    faces = _faces(elements, len(vertices), warn)
    uv = _uv(vertex)
    images = [line[len("TextureFile") :].strip() for line in header.comments_with("TextureFile")]
    material_index, materials = None, ()
    if images and uv is not None:
        file = path.parent / images[0]
        image = None
        if file.is_file():
            image = read_image(file, warn)
        else:
            warn(f"image {images[0]!r} is missing")
        materials = (Material("", np.ones(4, np.float32), image, images[0]),)
        material_index = np.zeros(len(faces), np.int32)
    return Mesh(vertices, faces, uv, _colors(vertex, warn), material_index, materials)


def write_ply(path: Path, mesh: Mesh) -> None:
    """Write binary PLY: double positions and uv, colours as 8-bit sRGB."""
    fields = [("x", "<f8"), ("y", "<f8"), ("z", "<f8")]
    columns = [("double", "x"), ("double", "y"), ("double", "z")]
    if mesh.uv is not None:
        fields += [("s", "<f8"), ("t", "<f8")]
        columns += [("double", "s"), ("double", "t")]
    if mesh.vertex_colors is not None:
        names = ("red", "green", "blue", "alpha")
        fields += [(name, "u1") for name in names]
        columns += [("uchar", name) for name in names]
    table = np.zeros(mesh.n_vertices, fields)
    for axis, name in enumerate("xyz"):
        table[name] = mesh.vertices[:, axis]
    if mesh.uv is not None:
        table["s"], table["t"] = mesh.uv.T
    if mesh.vertex_colors is not None:
        encoded = np.rint(255 * srgb_rgba(mesh.vertex_colors)).astype(np.uint8)
        for channel, name in enumerate(names):
            table[name] = encoded[:, channel]
    faces = np.zeros(mesh.n_faces, [("n", "u1"), ("corners", "<i4", 3)])
    faces["n"], faces["corners"] = 3, mesh.faces
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {mesh.n_vertices}"]
    header += [f"property {kind} {name}" for kind, name in columns]
    header += [f"element face {mesh.n_faces}", "property list uchar int vertex_indices"]
    with open(path, "wb") as file:
        file.write("\n".join([*header, "end_header\n"]).encode("ascii"))
        file.write(table.tobytes())
        file.write(faces.tobytes())


def _scalar(element: Element, name: str) -> np.ndarray:
    column = element.columns[name]
    if isinstance(column, List):
        raise ValueError(f"property {name} of its vertices is a list, not a number")
    return column.astype(np.float64)


def _faces(elements: dict[str, Element], n_vertices: int, warn: Warn) -> np.ndarray:
    face = elements.get("face")
    if face is None or face.count == 0:
        other = [name for name in ("tristrips", "edge") if name in elements]
        with_other = f" and {other[0]} elements" if other else ""
        raise ValueError(f"it holds {n_vertices} points{with_other}, but no faces")
    name = next((name for name in _FACE_NAMES if name in face.columns), None)
    if name is None or not isinstance(face.columns[name], List):
        raise ValueError("its faces have no list of vertex indices")
    for extra in face.columns.keys() & {"red", "texcoord"}:
        warn(f"the property {extra!r} of its faces is not read")
    corners = face.columns[name]
    values = corners.values
    if values.dtype.kind == "f" and (values != np.floor(values)).any():
        raise ValueError("a face names a vertex by a number that is not whole")
    few = np.count_nonzero(corners.counts < 3)
    if few:
        warn(f"{few} faces have fewer than three corners; left out")
    places, _ = fan_corners(corners.counts)
    if len(places) == 0:
        raise ValueError("no face has three corners")
    if values.dtype == np.uint64 and values.max() > n_vertices:
        raise ValueError(f"a face names a vertex that is not among the {n_vertices}")
    return checked_faces(values.astype(np.int64)[places], n_vertices)


def _uv(vertex: Element) -> np.ndarray | None:
    for names in _UV_NAMES:
        if vertex.columns.keys() >= set(names):
            return np.stack([_scalar(vertex, name) for name in names], axis=1)
    return None


def _colors(vertex: Element, warn: Warn) -> np.ndarray | None:
    """Integers span their type's range, floats run from 0 to 1."""
    for prefix in ("", "diffuse_"):
        names = [prefix + name for name in ("red", "green", "blue", "alpha")]
        if vertex.columns.keys() >= set(names[:3]):
            break
    else:
        return None
    channels = []
    for name in names[: 4 if names[3] in vertex.columns else 3]:
        dtype = vertex.types[name]
        scale = np.iinfo(dtype).max if dtype.kind in "iu" else 1
        channels.append(_scalar(vertex, name) / scale)
    encoded = np.stack(channels, axis=1)
    if len(encoded) and not (np.isfinite(encoded).all() and encoded.min() >= 0):
        warn("vertex colours are not numbers from 0 up; left out")
        return None
    return linear_rgba(encoded)
