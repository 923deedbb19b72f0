"""OFF: counts, positions as float64, polygons. Colours, normals and the like are not kept."""

import re
from pathlib import Path

import numpy as np

from ..mesh import Mesh
from .polygons import checked_faces, fan_corners
from .text_rows import rows
from .warn import Warn

_COMMENT = re.compile(rb"#[^\n]*")
_BLANK = re.compile(rb"\n\s*\n")
_KEYWORD = re.compile(rb"^\s*(ST)?(C?N?)(4?n?)(?:OFF|off)\b")


def read_off(path: Path, warn: Warn) -> Mesh:
    """Read an OFF file; ValueError says what is wrong with it."""
    data = path.read_bytes()
    text = _BLANK.sub(b"\n", _COMMENT.sub(b"", data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")))
    keyword = _KEYWORD.match(text)
    if keyword is None:
        raise ValueError("it does not begin with OFF")
    if keyword[3]:
        raise ValueError("its positions have more than three coordinates")
    if text[keyword.end() :].lstrip().lower().startswith(b"binary"):
        raise ValueError("it is a binary OFF file; only text is read")
    if keyword[1] or keyword[2]:
        warn("colours, normals or texture coordinates of its vertices are not read")
    counts_line, _, body = text[keyword.end() :].lstrip().partition(b"\n")
    n_vertices, n_faces = _counts(counts_line)
    lines = body.strip().split(b"\n")
    if len(lines) < n_vertices + n_faces or n_faces == 0:
        n_lines = len(lines) if body.strip() else 0
        raise ValueError(
            f"it promises {n_vertices} vertices and {n_faces} faces, but {n_lines} lines follow"
            if n_faces
            else f"it holds {n_vertices} points, but no faces"
        )
    vertices = rows(b"\n".join(lines[:n_vertices]), "vertex")
    if n_vertices == 0 or (vertices.counts < 3).any():
        raise ValueError("a vertex has fewer than 3 numbers")
    faces = _faces(b"\n".join(lines[n_vertices : n_vertices + n_faces]), n_vertices, warn)
    return Mesh(vertices.column(0, 3), faces)


def write_off(path: Path, mesh: Mesh) -> None:
    """Write text OFF; positions read back bit-equal. Colours and uv are not written."""
    vertices = ("%r %r %r\n" * mesh.n_vertices) % tuple(mesh.vertices.ravel().tolist())
    faces = ("3 %d %d %d\n" * mesh.n_faces) % tuple(mesh.faces.ravel().tolist())
    with open(path, "w", encoding="ascii", newline="\n") as file:
        file.write(f"OFF\n{mesh.n_vertices} {mesh.n_faces} 0\n")
        file.write(vertices)
        file.write(faces)


def _counts(line: bytes) -> tuple[int, int]:
    words = line.split()
    if len(words) < 2 or not all(word.isdigit() and len(word) < 16 for word in words[:2]):
        shown = line[:40].decode("latin-1")
        raise ValueError(f"the counts of vertices and faces are missing; found {shown!r}")
    return int(words[0]), int(words[1])


def _faces(text: bytes, n_vertices: int, warn: Warn) -> np.ndarray:
    table = rows(text, "face")
    sizes = table.numbers[table.starts]
    # The size stands first; colours may stand behind the corners.
    if not (sizes <= table.counts - 1).all():
        raise ValueError("a face has fewer corners than it says, or the file is cut off")
    if not (sizes >= 1).all() or (sizes != np.floor(sizes)).any():
        raise ValueError("a face does not begin with its number of corners")
    if (sizes < 3).any():
        warn(f"{np.count_nonzero(sizes < 3)} faces have fewer than three corners; left out")
    sizes = sizes.astype(np.int64)
    local, polygon = fan_corners(sizes)
    if len(local) == 0:
        raise ValueError("no face has three corners")
    within = local - (np.cumsum(sizes) - sizes)[polygon][:, None]
    corners = table.numbers[(table.starts[polygon] + 1)[:, None] + within]
    if (corners != np.floor(corners)).any() or not (np.abs(corners) < 2**53).all():
        raise ValueError("a face names a vertex by a number that is not whole")
    return checked_faces(corners.astype(np.int64), n_vertices)
