"""Wavefront OBJ: text, positions as float64, one mesh for the whole file.

What is read: ``v`` (with colours), ``vt``, ``f`` with any number of corners and relative (negative)
indices, ``usemtl``, ``mtllib``. Normals, groups, smoothing, lines and points are not kept.

OBJ indexes positions and texture coordinates apart; a mesh has one index. A vertex here is a
distinct pair (v, vt) that some face uses, in the order of v and then vt, so vertices along uv
seams appear more than once and positions that no face uses are left out (and said).
"""

import re
from itertools import pairwise
from pathlib import Path

import numpy as np

from ..mesh import Material, Mesh
from ..srgb import linear_rgba, srgb_rgba
from .mtl import material_name, read_materials
from .obj_faces import Defined, corner_indices
from .obj_plain import read_plain_obj
from .polygons import checked_faces, fan_corners
from .text_rows import Rows, rows, token_counts
from .warn import Warn

_FACES_AND_MATERIALS = re.compile(rb"^[ \t]*(?:f[ \t]|usemtl([^\n]*))", re.MULTILINE)
_LINES_AND_POINTS = re.compile(rb"^[ \t]*[lp][ \t]", re.MULTILINE)
_LIBRARIES = re.compile(rb"^[ \t]*mtllib[ \t]+([^\n]*)", re.MULTILINE)


def read_obj(path: Path, warn: Warn) -> Mesh:
    """Read an OBJ file; ValueError says what is wrong with it."""
    text = path.read_bytes()
    mesh = read_plain_obj(text, warn)
    if mesh is not None:
        return mesh
    text = text.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ")
    if b"\n" not in text:
        text = text.replace(b"\r", b"\n")
    places = rows(_lines(text, b"v"), "vertex line")
    coordinates = rows(_lines(text, b"vt"), "texture coordinate line")
    _check_widths(places, 3, "a vertex needs 3")
    _check_widths(coordinates, 1, "a texture coordinate needs 1")
    face_lines = _lines(text, b"f")
    counts = token_counts(face_lines)
    if len(counts) == 0:
        raise ValueError(_no_faces(text, len(places.counts)))
    _tell_lines(text, warn)
    if (counts < 3).any():
        warn(f"{np.count_nonzero(counts < 3)} faces have fewer than three corners; left out")
    defined = Defined(text, counts, len(places.counts), len(coordinates.counts))
    vertex, texture = corner_indices(face_lines, defined)
    corners, polygon = fan_corners(counts)
    if len(corners) == 0:
        raise ValueError("no face has three corners")
    checked_faces(vertex[corners], len(places.counts))
    pairs, faces = _vertices_in_use(vertex, texture, corners)
    unused = len(places.counts) - len(np.unique(pairs[:, 0]))
    if unused:
        warn(f"{unused} of {len(places.counts)} positions are used by no face; left out")
    material_index, materials = _materials(text, path, polygon, warn)
    return Mesh(
        places.column(0, 3)[pairs[:, 0]],
        faces,
        uv=_uv(coordinates, pairs[:, 1], warn),
        vertex_colors=_colors(places, pairs[:, 0], warn),
        material_index=material_index,
        materials=materials,
    )


def write_obj(path: Path, mesh: Mesh, library: str = "") -> None:
    """Write positions and uv so that they read back bit-equal; colours as sRGB text.

    ``library`` is the name of the material file, if there is one.
    """
    table, place = [mesh.vertices], "v %r %r %r\n"
    if mesh.vertex_colors is not None:
        table.append(srgb_rgba(mesh.vertex_colors)[:, :3])
        place = "v %r %r %r %r %r %r\n"
    corner = "%d" if mesh.uv is None else "%d/%d"
    with open(path, "w", encoding="utf-8", errors="replace", newline="\n") as file:
        if library:
            file.write(f"mtllib {library}\n")
        file.write(_formatted(place, np.hstack(table)))
        if mesh.uv is not None:
            file.write(_formatted("vt %r %r\n", mesh.uv))
        for name, first, last in _material_runs(mesh):
            if name is not None:
                file.write(f"usemtl {name}\n")
            indices = mesh.faces[first:last] + np.int64(1)
            if mesh.uv is not None:
                indices = np.repeat(indices, 2, axis=1)
            file.write(_formatted(f"f {corner} {corner} {corner}\n", indices))


def _formatted(line: str, table: np.ndarray) -> str:
    return (line * len(table)) % tuple(table.ravel().tolist())


def _material_runs(mesh: Mesh):
    """(name or None, first face, last face + 1) of each run of faces of one material."""
    if mesh.material_index is None or not mesh.n_faces or not mesh.materials:
        return [(None, 0, mesh.n_faces)]
    index = mesh.material_index
    cuts = np.flatnonzero(np.diff(index)) + 1
    runs = []
    for first, last in pairwise([0, *cuts.tolist(), mesh.n_faces]):
        name = mesh.materials[index[first]].name if index[first] >= 0 else ""
        # Faces have no material until the first usemtl; afterwards OBJ cannot take it back.
        is_bare = index[first] < 0 and first == 0
        runs.append((None if is_bare else material_name(name), first, last))
    return runs


def _lines(text: bytes, keyword: bytes) -> bytes:
    """What stands behind the keyword on each of its lines; no newline after the last."""
    if keyword not in text:
        return b""
    pattern = rb"^[ \t]*" + keyword + rb"[ \t]+([^\n#]*)"
    return b"\n".join(re.findall(pattern, text, re.MULTILINE))


def _check_widths(found: Rows, least: int, need: str) -> None:
    short = np.flatnonzero(found.counts < least)
    if len(short):
        raise ValueError(f"{need} numbers; number {short[0] + 1} has {found.counts[short[0]]}")


def _tell_lines(text: bytes, warn: Warn) -> None:
    # The plain search is fast where the pattern is not, and nearly always says no.
    if b"\nl " in text or b"\np " in text:
        warn(f"{len(_LINES_AND_POINTS.findall(text))} lines or points; left out")


def _no_faces(text: bytes, n_vertices: int) -> str:
    n_lines = len(_LINES_AND_POINTS.findall(text))
    if n_lines:
        return f"it holds {n_lines} lines or points, but no faces"
    if n_vertices:
        return f"it holds {n_vertices} points, but no faces"
    return "it holds no faces"


def _vertices_in_use(vertex: np.ndarray, texture: np.ndarray, corners: np.ndarray):
    """The distinct (position, texture coordinate) pairs in order, and faces that name them."""
    width = int(texture.max()) + 2
    key = vertex[corners] * width + texture[corners] + 1
    if width == 1:
        # Without uv a mask does what the sort inside np.unique does, in a fifth of the time.
        is_used = np.zeros(int(key.max()) + 1, bool)
        is_used[key] = True
        used, faces = np.flatnonzero(is_used), (np.cumsum(is_used) - 1)[key]
    else:
        used, inverse = np.unique(key, return_inverse=True)
        faces = inverse.reshape(-1, 3)
    position, coordinate = np.divmod(used, width)
    return np.stack([position, coordinate - 1], axis=1), checked_faces(faces, len(used))


def _uv(coordinates: Rows, index: np.ndarray, warn: Warn) -> np.ndarray | None:
    if index.max() < 0:
        return None
    if index.min() < 0:
        warn(f"{np.count_nonzero(index < 0)} vertices have no texture coordinate; set to (0, 0)")
    uv = np.zeros((len(coordinates.counts) + 1, 2))  # the last row serves index -1
    uv[:-1, 0] = coordinates.column(0, 1)[:, 0]
    has_v = coordinates.counts > 1
    uv[:-1][has_v, 1] = coordinates.numbers[coordinates.starts[has_v] + 1]
    return uv[index]


def _colors(places: Rows, index: np.ndarray, warn: Warn) -> np.ndarray | None:
    """Colours stand behind the position as sRGB in [0, 1], or in [0, 255] in some programs."""
    has_color = places.counts >= 6
    if not has_color.any():
        return None
    if not has_color.all():
        n, total = np.count_nonzero(has_color), len(has_color)
        warn(f"only {n} of {total} vertices have a colour; colours left out")
        return None
    color = places.column(3, 3)[index]
    if not np.isfinite(color).all() or color.min() < 0:
        warn("vertex colours are not numbers from 0 to 1; left out")
        return None
    return linear_rgba(color / 255 if color.max() > 1 else color)


def _materials(text: bytes, path: Path, polygon: np.ndarray, warn: Warn):
    """Material of every triangle and what the materials are; (None, ()) if there are none."""
    if b"usemtl" not in text:
        return None, ()
    names, current, of_face = {}, -1, []
    for match in _FACES_AND_MATERIALS.finditer(text):
        if match[1] is None:
            of_face.append(current)
        else:
            current = names.setdefault(match[1].decode("utf-8", "replace").strip(), len(names))
    libraries = [line.decode("utf-8", "replace").strip() for line in _LIBRARIES.findall(text)]
    known = read_materials(path.parent, libraries, warn)
    materials = []
    for name in names:
        if name not in known and libraries:
            warn(f"material {name!r} is in none of its material files; white instead")
        materials.append(known.get(name, Material(name, np.ones(4, np.float32))))
    return np.array(of_face, np.int32)[polygon], tuple(materials)
