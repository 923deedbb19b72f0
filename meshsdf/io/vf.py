"""Unity's ``.vf`` volume files, which become 3D textures for its visual effect graph.

"VF_F" (one number a node) or "VF_V" (three), the counts along x, y and z as uint16, then float32
little-endian, x fastest. That is all: a file has no voxel size, no place and no words.

Unity stretches the texture over a box, whose longest side its own signed distances have as their
unit; a file read here gets that box, centred, with one texel for each node. Its own axes are
left-handed with y up; nothing is turned on the way.
"""

import os
import struct
from pathlib import Path
from typing import BinaryIO

import numpy as np
from jaxtyping import Float32

from ..errors import IoError
from ..grid import Grid, NarrowBand
from .atomic import atomic_write, check_output
from .dense_form import dense_form
from .dense_header import DenseHeader
from .opened import opened
from .unpacking import check_claim
from .vdb_stream import UnsuitedError, printable
from .warn import Warn, ignore
from .x_fastest import read_values, write_values

LARGEST_SIDE = 65535

_HEADER = struct.Struct("<4s3H")
_STORED = np.dtype("<f4")


def write_vf(
    path: str | os.PathLike,
    volume: NarrowBand | Grid,
    *,
    half: bool = False,
    force: bool = False,
    normalized: bool = False,
    warn: Warn = ignore,
) -> None:
    """Write a volume; its values read back bit-equal if they are float32.

    Parameters
    ----------
    path : path
        The ``.vf`` file.
    volume : NarrowBand or Grid
        A band becomes a full grid, see `dense_form`.
    half : bool
        There are no 16-bit floats in the file, so the values are written with 32 bits.
    force : bool
        Replace an existing file.
    normalized : bool
        Divide distances by the longest side of the grid's box, as Unity's own are; else they stay
        in world units.
    warn : callable
        Told what the format could not keep.

    Raises
    ------
    IoError
        The file exists, its folder cannot be written, the disk is full, the volume is none, or has
        more than 65535 nodes along an axis.
    MemoryLimitError
        A band would not fit in memory as a full grid.
    """
    grid = dense_form(path, volume, "Unity volume", half=half, force=force, warn=warn)
    values = grid.values
    if normalized:
        values = values / (grid.voxel_size * max(values.shape))
    header = _header(path, b"VF_F", values.shape)
    with atomic_write(path, force) as temporary, open(temporary, "wb") as file:
        file.write(header)
        write_values(file, values, _STORED)


def write_vf_vectors(
    path: str | os.PathLike, vectors: Float32[np.ndarray, "i j k 3"], *, force: bool = False
) -> None:
    """Write a field of vectors, such as directions to the surface; IoError as `write_vf`."""
    check_output(path, force)
    header = _header(path, b"VF_V", vectors.shape[:3])
    with atomic_write(path, force) as temporary, open(temporary, "wb") as file:
        file.write(header)
        for k in range(vectors.shape[2]):
            plane = np.ascontiguousarray(vectors[:, :, k].transpose(1, 0, 2), _STORED)
            file.write(plane.data)


def read_vf(path: str | os.PathLike, *, warn: Warn = ignore) -> Grid:
    """Read a file of one number a node; the longest side of its box gets length 1.

    Parameters
    ----------
    path : path
        The ``.vf`` file.
    warn : callable
        Told what is assumed.

    Raises
    ------
    IoError
        There is no such file, it is damaged, or holds vectors.
    """
    with opened(path) as (file, _):
        kind, header = _read_header(file)
        if kind != b"VF_F":
            raise UnsuitedError("it holds vectors", "read it with read_vf_vectors")
        grid = header.grid(read_values(file.read, header.shape, header.stored))
    warn(
        "a .vf file has no voxel size and no place: "
        f"its box is centred, its longest side is 1, so the voxel size is {grid.voxel_size:.6g}"
    )
    return grid


def read_vf_vectors(path: str | os.PathLike) -> Float32[np.ndarray, "i j k 3"]:
    """Read a field of vectors; IoError if there is no such file, or it holds none."""
    with opened(path) as (file, _):
        kind, header = _read_header(file)
        if kind != b"VF_V":
            raise UnsuitedError("it holds one number a node", "read it with read_volume")
        data = np.frombuffer(file.read(3 * header.n_bytes), _STORED)
    planes = data.reshape(*header.shape[::-1], 3)
    return np.ascontiguousarray(planes.transpose(2, 1, 0, 3), np.float32)


def probe_vf(path: str | os.PathLike) -> dict:
    """Return what the header says: ``dtype``, ``shape`` and whether it holds ``vectors``."""
    with opened(path) as (file, _):
        kind, header = _read_header(file)
    facts = {name: header.facts()[name] for name in ("kind", "format", "dtype", "shape")}
    return facts | {"vectors": kind == b"VF_V"}


def _header(path: str | os.PathLike, kind: bytes, shape: tuple[int, ...]) -> bytes:
    if max(shape) > LARGEST_SIDE or min(shape) < 1:
        what = f"{' x '.join(map(str, shape))} nodes; a .vf file has 1 to {LARGEST_SIDE} a side"
        raise IoError(what, f"output {Path(path)}", "use larger voxels")
    return _HEADER.pack(kind, *shape)


def _read_header(file: BinaryIO) -> tuple[bytes, DenseHeader]:
    """What the file begins with; ValueError unless the values behind it are all there."""
    data = file.read(_HEADER.size)
    if data[:4] not in (b"VF_F", b"VF_V"):
        shown = printable(data[:4].decode("latin-1"))
        raise ValueError(f"it begins with '{shown}', not with VF_F or VF_V")
    if len(data) != _HEADER.size:
        raise ValueError("it is cut off within its header")
    kind, *shape = _HEADER.unpack(data)
    size = 1 / max(*shape, 1)
    # Nodes are the middles of texels
    origin = np.array([(0.5 - n / 2) * size for n in shape])
    header = DenseHeader("vf", _STORED, tuple(shape), size, origin, {})
    n_bytes = header.n_bytes * (3 if kind == b"VF_V" else 1)
    there = os.fstat(file.fileno()).st_size - _HEADER.size
    check_claim(n_bytes, there, is_packed=False)
    if there != n_bytes:
        raise ValueError(f"it has {there} bytes of values, but its counts tell {n_bytes}")
    return kind, header
