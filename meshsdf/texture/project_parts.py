"""A project's mesh and octree, as rows of its file."""

import contextlib
import hashlib
import os
import sqlite3
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ..errors import TextureError
from ..mesh import Mesh
from .blobs import Damaged, pack_all, unpack
from .journal_log import KERNEL_VERSION
from .journal_schema import FAULTS, create, forget
from .octree import Octree
from .octree_store import octree_arrays, octree_of_arrays
from .volume_texture import VolumeTexture

PIECE = 1 << 21  # bytes packed at a time
# Types and lengths of rows
PARTS = {
    "vertices": ("<f8", 3),
    "faces": ("<i4", 3),
    "level_first": ("<i8", 1),
    "bricks": ("<i4", 3),
    "masks": ("<u8", 8),
    "sheets": ("<f4", 3),
    "texel_normals": ("|i1", 2),
    "parts": ("<i4", 1),
    "texel_parts": ("|u1", 1),
    "face_parts": ("|u1", 1),
}


def write_new(path: Path, texture: VolumeTexture) -> None:
    """Write a whole new project beside its place, and move it there.

    Raises
    ------
    TextureError
        It cannot be written. However this ends, nothing half written is left.
    """
    beside = path.with_name(f".{path.name}.new")
    try:
        forget(beside)
        with contextlib.closing(create(beside)) as connection:
            connection.execute("BEGIN")
            write_parts(connection, texture)
            connection.execute("COMMIT")
            connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        os.replace(beside, path)
    except (sqlite3.Error, OSError) as error:
        what = f"the project cannot be written: {error}"
        raise TextureError(what, str(path), "check the folder and its free space") from None
    finally:
        forget(beside)


def write_parts(connection: sqlite3.Connection, texture: VolumeTexture, origin: int = 0) -> None:
    """Write what a new project is about, in the caller's transaction."""
    arrays = octree_arrays(texture.octree)
    mesh = texture.surface
    if mesh is not None:
        arrays |= {"vertices": mesh.vertices.astype("<f8"), "faces": mesh.faces.astype("<i4")}
    pieces = (
        ((name, number), data)
        for name, array in arrays.items()
        for number, data in enumerate(_cut(array.tobytes()))
    )
    connection.executemany(
        "INSERT INTO part VALUES (?, ?, ?, ?, ?)",
        ((*key, *blob) for key, blob in pack_all(pieces, at_once=32)),
    )
    counts = (mesh.n_vertices, mesh.n_faces) if mesh is not None else (0, 0)
    row = (texture.octree.texel, texture.base, KERNEL_VERSION, origin, *counts, _sha256(arrays))
    connection.execute("INSERT INTO project VALUES (1, ?, ?, ?, ?, ?, ?, ?)", row)


def read_parts(
    connection: sqlite3.Connection, warn: Callable[[str], None]
) -> tuple[VolumeTexture, int, bool]:
    """The project's texture, without layers; its origin; and whether all of it was as written.

    Raises
    ------
    Damaged
        Neither the octree nor the mesh can be read.
    """
    try:
        row = connection.execute("SELECT * FROM project").fetchone()
        _, texel, base, _, origin, _, n_faces, sha256 = row
    except (TypeError, *FAULTS) as error:
        raise Damaged(f"its first table cannot be read ({error})") from None
    arrays, lost = {}, []
    for name in PARTS:
        try:
            arrays[name] = _read(connection, name)
        except (Damaged, *FAULTS) as error:
            lost.append(str(error))
    mesh = None
    if n_faces and {"vertices", "faces"} <= set(arrays):
        mesh = Mesh(arrays["vertices"].astype(np.float64), arrays["faces"].astype(np.int32))
    if set(PARTS) - {"vertices", "faces"} <= set(arrays):
        octree = octree_of_arrays(texel, arrays)
    elif mesh is not None:
        # Where the numbers of faces are known to be none, sheets were not divided
        divides = "face_parts" not in arrays or len(arrays["face_parts"]) > 0
        octree = Octree.around(mesh, texel=texel, divides=divides)
    else:
        raise Damaged(f"neither mesh nor texels can be found: {'; '.join(lost)}")
    if not lost and _sha256({n: a for n, a in arrays.items() if len(a)}) != sha256:
        lost.append("the SHA-256 of mesh and octree differs from what was written")
    for one in lost:
        warn(one)
    texture = VolumeTexture(octree, base=base)
    texture.surface = mesh
    return texture, origin, not lost


def _cut(data: bytes) -> list[bytes]:
    return [data[begin : begin + PIECE] for begin in range(0, len(data), PIECE)]


def _read(connection: sqlite3.Connection, name: str) -> np.ndarray:
    rows = connection.execute(
        "SELECT codec, crc32, data FROM part WHERE name = ? ORDER BY piece", (name,)
    ).fetchall()
    data = b"".join(unpack(row, f"part {name!r}") for row in rows)
    dtype, width = PARTS[name]
    array = np.frombuffer(data, dtype)
    return array.reshape(-1, width) if width > 1 else array


def _sha256(arrays: dict[str, np.ndarray]) -> str:
    whole = hashlib.sha256()
    for name in sorted(arrays):
        whole.update(name.encode() + arrays[name].tobytes())
    return whole.hexdigest()
