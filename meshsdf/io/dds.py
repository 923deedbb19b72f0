"""DirectDraw surfaces (``.dds``) that hold a 3D texture of floats, as engines and GPU tools load.

A file is "DDS ", a header of 124 bytes, one of 20 bytes that names the type (R32_FLOAT or
R16_FLOAT), and the texels: x fastest, then y, then z. It has no voxel size, no place and no words;
these stand in a JSON file beside it (``ball.dds.json``; ``ball.json`` is read, too), which has the
keys of `raw` and the ``format`` "meshsdf.dds/1". Without it the box of the texels is centred and
its longest side is 1, with a node in the middle of each texel. The older way to name the two types,
by a number in place of four letters, is read, too; of a file with smaller levels the first one is.

Layout: Microsoft, "Programming guide for DDS", learn.microsoft.com/windows/win32/direct3ddds.
"""

import os
import struct
from pathlib import Path
from typing import BinaryIO

import numpy as np

from ..grid import Grid, NarrowBand
from .dense_form import dense_form
from .dense_header import DenseHeader
from .detached import check_words, words_beside, words_there, written_together
from .half import check_half, halved
from .opened import opened, refusing
from .raw import described, read_words, understood
from .registry import checked_input
from .unpacking import check_claim
from .vdb_stream import UnsuitedError, printable
from .warn import Warn, ignore
from .x_fastest import read_values, write_values

FORMAT = "meshsdf.dds/1"

LARGEST_SIDE = 2048
"""Texels along a side of a 3D texture in Direct3D 11 and 12."""

_TYPES = {41: np.dtype("<f4"), 54: np.dtype("<f2")}
_OLD_TYPES = {114: np.dtype("<f4"), 111: np.dtype("<f2")}
_SIZES = (124, 32)  # of the header, and of the part of it that tells the type
_HEAD = struct.Struct("<4s7I44x2I4s20x5I")
_MORE = struct.Struct("<5I")

# What is in a header: caps, height, width, pitch, depth, type
_TELLS = 0x1 | 0x2 | 0x4 | 0x8 | 0x800000 | 0x1000
_BY_LETTERS = 0x4
_CAPS = 0x1000 | 0x8  # a texture, and more than one picture
_VOLUME = 0x200000
_3D = 4
_MISC_CUBE = 0x4


def write_dds(
    path: str | os.PathLike,
    volume: NarrowBand | Grid,
    *,
    half: bool = False,
    force: bool = False,
    warn: Warn = ignore,
) -> None:
    """Write a volume; a float32 grid reads back bit-equal, unless ``half``.

    Parameters
    ----------
    path : path
        The ``.dds`` file; its ``.dds.json`` is written beside it.
    volume : NarrowBand or Grid
        A band becomes a full grid, see `dense_form`.
    half : bool
        Texels of float16; see `write_npz`.
    force : bool
        Replace existing files; a JSON file that is not ours stays, and is refused.
    warn : callable
        Told what the format could not keep, and if engines cannot load so large a texture.

    Raises
    ------
    IoError
        A file exists, the folder cannot be written, the disk is full, the volume is none, or its
        values do not fit float16.
    MemoryLimitError
        A band would not fit in memory as a full grid.
    """
    path = Path(path)
    check_dds_output(path, force=force)
    grid = dense_form(path, volume, "DDS texture", half=half, force=force, warn=warn)
    values = grid.values
    if half:
        check_half(values, f"output {path}")
        values = halved(values)
    stored = np.dtype("<f2" if half else "<f4")
    if max(values.shape) > LARGEST_SIDE:
        n = " x ".join(map(str, values.shape))
        warn(f"{n} texels are written; Direct3D loads up to {LARGEST_SIDE} a side")
    facts = described(grid, values.shape, stored, FORMAT)
    with written_together(words_beside(path), path, force) as (words, body):
        with open(body, "wb") as file:
            file.write(_header(values.shape, stored))
            write_values(file, values, stored)
        words.write_text(facts, encoding="utf-8", newline="\n")


def check_dds_output(path: str | os.PathLike, *, force: bool = False) -> None:
    """Refuse a place that cannot be written; IoError as `write_dds`."""
    check_words(words_beside(path), FORMAT, ".dds", force=force)


def read_dds(path: str | os.PathLike, *, warn: Warn = ignore) -> Grid:
    """Read a 3D texture of one float a texel, and the JSON beside it if there is one.

    Parameters
    ----------
    path : path
        The ``.dds`` file.
    warn : callable
        Told what is assumed, or left out.

    Raises
    ------
    IoError
        There is no such file, it is damaged, does not fit its JSON, or is another texture.
    """
    with opened(path) as (file, _):
        header, n_levels, is_told = _read_header(path, file)
        grid = header.grid(read_values(file.read, header.shape, header.stored))
    if n_levels > 1:
        warn(f"of {n_levels} levels the first, which is the largest, is read")
    if not is_told:
        warn(
            "a .dds file has no voxel size and no place, and no .json of ours is beside it: "
            f"its box is centred, its longest side is 1, so the voxel size is {grid.voxel_size:.6g}"
        )
    return grid


def probe_dds(path: str | os.PathLike) -> dict:
    """Return what the header and the JSON say: ``kind``, ``dtype``, ``shape``, ``voxel_size``, …

    What a file without JSON does not say is left out.
    """
    with opened(path) as (file, _):
        header, n_levels, is_told = _read_header(path, file)
    facts = header.facts() | {"levels": n_levels}
    if is_told:
        return facts | {"facts_from": words_there(Path(path)).name}
    del facts["voxel_size"], facts["origin"]
    name = words_beside(path).name
    return facts | {"facts_from": f"no {name} is here, so no voxel size: the longest side is 1"}


def _header(shape: tuple[int, int, int], stored: np.dtype) -> bytes:
    nx, ny, nz = shape
    number = next(number for number, dtype in _TYPES.items() if dtype == stored)
    sizes = (_SIZES[0], _TELLS, ny, nx, nx * stored.itemsize, nz, 1)
    kind = (_SIZES[1], _BY_LETTERS, b"DX10")
    return _HEAD.pack(b"DDS ", *sizes, *kind, _CAPS, _VOLUME, 0, 0, 0) + _MORE.pack(
        number, _3D, 0, 1, 0
    )


def _read_header(path: str | os.PathLike, file: BinaryIO) -> tuple[DenseHeader, int, bool]:
    """What a file and the JSON beside it say, of how many levels, and whether there is a JSON."""
    shape, stored, n_levels = _texture(file)
    n_bytes = int(np.prod(shape, dtype=object)) * stored.itemsize
    there = os.fstat(file.fileno()).st_size - file.tell()
    check_claim(n_bytes, there, is_packed=False)
    expected = _level_bytes(shape, n_levels, stored)
    if there != expected:
        raise ValueError(f"it has {there} bytes of texels, but its counts tell {expected}")
    beside = words_there(checked_input(path))
    words = None if beside is None else _words(beside)
    if beside is None or words is None:
        size = 1 / max(shape)
        origin = np.array([(0.5 - n / 2) * size for n in shape])
        return DenseHeader("dds", stored, shape, size, origin, {}), n_levels, False
    with refusing(beside):
        header, _ = understood(words, FORMAT)
        header.facts()  # what is wrong with these is wrong with the JSON
        if (header.shape, header.stored) != (shape, stored):
            told = " x ".join(map(str, header.shape))
            there = " x ".join(map(str, shape))
            what = f"it tells {told} {header.stored.name}, the .dds holds {there} {stored.name}"
            raise ValueError(what)
    return header, n_levels, True


def _words(beside: Path) -> dict | None:
    """What a JSON file tells, or None if it tells of something else than a texture."""
    with opened(beside) as (file, _):
        words = read_words(file)
    told = words.get("format")
    return words if isinstance(told, str) and told.startswith(FORMAT.split("/")[0]) else None


def _texture(file: BinaryIO) -> tuple[tuple[int, int, int], np.dtype, int]:
    """Shape, type and number of levels; UnsuitedError if it is another texture."""
    data = file.read(_HEAD.size)
    if data[:4] != b"DDS ":
        raise ValueError(f"it begins with '{printable(data[:4].decode('latin-1'))}', not with DDS")
    if len(data) != _HEAD.size:
        raise ValueError("it is cut off within its header")
    _, size, _, ny, nx, _, nz, n_levels, kind_size, kind_flags, letters, *caps = _HEAD.unpack(data)
    if (size, kind_size) != _SIZES:
        raise ValueError(f"its headers take {size} and {kind_size} bytes, not {_SIZES}")
    fix = "write it as a 3D texture of R32_FLOAT or R16_FLOAT"
    number, types, is_volume = (
        int.from_bytes(letters, "little"),
        _OLD_TYPES,
        bool(caps[1] & _VOLUME),
    )
    if kind_flags & _BY_LETTERS and letters == b"DX10":
        more = file.read(_MORE.size)
        if len(more) != _MORE.size:
            raise ValueError("it is cut off within its header")
        number, dimension, misc, n_textures, _ = _MORE.unpack(more)
        types, is_volume = _TYPES, dimension == _3D
        if n_textures != 1 or misc & _MISC_CUBE:
            raise UnsuitedError("it is a cube or a list of textures", fix)
    elif not kind_flags & _BY_LETTERS:
        raise UnsuitedError("its texels are no floats", fix)
    if not is_volume:
        raise UnsuitedError("it is a flat texture, not a 3D one", fix)
    if number not in types:
        raise UnsuitedError(f"its texels are of type {number}, not one float each", fix)
    if min(nx, ny, nz) < 1:
        raise ValueError(f"it claims {nx} x {ny} x {nz} texels")
    if n_levels > max(nx, ny, nz).bit_length():
        raise ValueError(f"it claims {n_levels} levels of {nx} x {ny} x {nz} texels")
    return (nx, ny, nz), types[number], max(n_levels, 1)


def _level_bytes(shape: tuple[int, int, int], n_levels: int, stored: np.dtype) -> int:
    """Bytes of all levels, each half as long as the one before, and at least 1."""
    sides = [[max(n >> level, 1) for n in shape] for level in range(n_levels)]
    return sum(nx * ny * nz * stored.itemsize for nx, ny, nz in sides)
