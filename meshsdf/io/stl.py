"""STL, binary and text: loose triangles, three corners each, nothing welded.

Binary STL holds float32 positions; text STL is read as float64. Colours in the attribute bytes
have no common meaning and are not read.
"""

import re
from pathlib import Path

import numpy as np

from ..errors import IoError
from ..mesh import Mesh
from .text_rows import rows
from .warn import Warn

_HEADER = 84
_LARGEST = float(np.finfo(np.float32).max)
_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_CORNER = re.compile(rb"^\s*vertex\b([^\n]*)", re.MULTILINE | re.IGNORECASE)
_FACET = re.compile(rb"^\s*facet\b", re.MULTILINE | re.IGNORECASE)


def read_stl(path: Path, warn: Warn) -> Mesh:
    """Read an STL file; ValueError says what is wrong with it."""
    data = path.read_bytes()
    if not data:
        raise ValueError("it is empty")
    claimed = int.from_bytes(data[80:_HEADER], "little")
    needed = _HEADER + _RECORD.itemsize * claimed
    is_text = data[:512].lstrip().lower().startswith(b"solid") and needed != len(data)
    if is_text and b"\0" not in data[:_HEADER]:
        vertices = _text_corners(data)
    else:
        vertices = _binary_corners(data, claimed, needed, warn)
    if len(vertices) == 0:
        raise ValueError("it holds no triangles")
    return Mesh(vertices, np.arange(len(vertices), dtype=np.int32).reshape(-1, 3))


def write_stl(path: Path, mesh: Mesh) -> None:
    """Write binary STL: positions rounded to float32, corners repeated for each face."""
    corners = mesh.triangles
    first, second, third = corners[:, 0], corners[:, 1], corners[:, 2]
    normal = np.cross(second - first, third - first)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    records = np.zeros(mesh.n_faces, _RECORD)
    records["normal"] = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0)
    records["corners"] = float32_positions(corners)
    with open(path, "wb") as file:
        file.write(b"binary STL".ljust(80, b" "))
        file.write(np.uint32(mesh.n_faces).astype("<u4").tobytes())
        file.write(records.tobytes())


def float32_positions(positions: np.ndarray) -> np.ndarray:
    """Return the positions as float32; IoError if one is too large for it."""
    largest = float(np.abs(positions).max(initial=0.0))
    if largest > _LARGEST:
        raise IoError(
            f"a coordinate of {largest:g} does not fit the float32 of this format",
            "write_mesh(mesh=...)",
            "scale the mesh, or write .ply, .obj or .off",
        )
    return positions.astype(np.float32)


def _binary_corners(data: bytes, claimed: int, needed: int, warn: Warn) -> np.ndarray:
    if len(data) < _HEADER:
        raise ValueError(f"it is cut off: {len(data)} bytes are fewer than an STL header has")
    if needed > len(data):
        raise ValueError(
            f"it promises {claimed} triangles, which take {needed} bytes, but has {len(data)}"
        )
    if needed < len(data):
        warn(f"{len(data) - needed} bytes behind the last triangle; left out")
    records = np.frombuffer(data, _RECORD, count=claimed, offset=_HEADER)
    return records["corners"].reshape(-1, 3).astype(np.float64)


def _text_corners(data: bytes) -> np.ndarray:
    if b"\n" not in data:
        data = data.replace(b"\r", b"\n")
    last = data.rstrip().rsplit(b"\n", 1)[-1].strip().lower()
    if not last.startswith(b"endsolid"):
        raise ValueError("it is cut off: the last line is not 'endsolid'")
    corners = _CORNER.findall(data)
    n_facets = len(_FACET.findall(data))
    if len(corners) != 3 * n_facets:
        raise ValueError(f"it holds {n_facets} facets but {len(corners)} vertices, not 3 for each")
    if not corners:
        return np.empty((0, 3))
    table = rows(b"\n".join(corners), "vertex")
    if (table.counts != 3).any():
        at = int(np.flatnonzero(table.counts != 3)[0])
        raise ValueError(f"vertex {at + 1} has {table.counts[at]} numbers, not 3")
    return table.numbers.reshape(-1, 3)
