"""MetaImage: ``.mha``, values behind the header, and ``.mhd``, values in a file beside it.

ITK, 3D Slicer, ParaView and elastix read it. The header is lines ``Key = Value``, of which
``ElementDataFile`` is the last. Values are at nodes, x fastest: ``Offset`` is where the first node
lies, ``ElementSpacing`` the steps. What else a `Grid` says stands in keys of our own, see
`dense_header`. A file of ours comes back bit-equal.
"""

import io
import os
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np

from ..grid import Grid, NarrowBand
from .atomic import atomic_write
from .dense_form import dense_form
from .dense_header import (
    PREFIX,
    DenseHeader,
    counts_of,
    numbers_of,
    one_spacing,
    told_of,
    unkept_note,
    upright_spacings,
)
from .detached import data_beside, data_name, written_together
from .opened import opened
from .text_rows import numbers
from .unpacking import Inflater, check_claim
from .vdb_stream import UnsuitedError, printable
from .warn import Warn, ignore
from .x_fastest import ZLIB, from_flat, read_values, write_values

LONGEST_HEADER = 1 << 20

_LOCAL = "LOCAL"

_TYPES = {
    "MET_CHAR": "i1",
    "MET_UCHAR": "u1",
    "MET_SHORT": "i2",
    "MET_USHORT": "u2",
    "MET_INT": "i4",
    "MET_UINT": "u4",
    "MET_LONG": "i4",  # 32 bits in files, whatever the machine
    "MET_ULONG": "u4",
    "MET_LONG_LONG": "i8",
    "MET_ULONG_LONG": "u8",
    "MET_FLOAT": "f4",
    "MET_DOUBLE": "f8",
}
_NO_SCALE = 1e-6  # what a matrix may differ from 1 by, written with seven digits
_SIZE_DIGITS = 20  # of a number that is known only once the values are packed


@dataclass(frozen=True, eq=False)
class _Header:
    grid: DenseHeader
    data_file: str  # LOCAL if the values follow the header
    data_at: int  # where they would
    skip: int  # bytes before the values; -1 for all but the last ones
    is_binary: bool
    is_packed: bool
    notes: tuple[str, ...]


_FIELDS = frozenset(
    {
        "ObjectType", "NDims", "DimSize", "ElementType", "ElementDataFile",
        "ElementNumberOfChannels", "BinaryData", "BinaryDataByteOrderMSB", "ElementByteOrderMSB",
        "CompressedData", "CompressedDataSize", "HeaderSize", "TransformMatrix", "Orientation",
        "Rotation", "ElementSpacing", "ElementSize", "Offset", "Position", "Origin",
        "CenterOfRotation", "AnatomicalOrientation",
    }
)  # fmt: skip
"""Fields that are understood, or say nothing beyond those."""


def write_metaimage(
    path: str | os.PathLike,
    volume: NarrowBand | Grid,
    *,
    half: bool = False,
    force: bool = False,
    compressed: bool = True,
    warn: Warn = ignore,
) -> None:
    """Write a volume; a grid reads back bit-equal.

    Parameters
    ----------
    path : path
        A ``.mha`` file, or the header ``.mhd`` of a ``.zraw`` or ``.raw`` file beside it.
    volume : NarrowBand or Grid
        A band becomes a full grid, see `dense_form`.
    half : bool
        There are no 16-bit floats in MetaImage, so the values are written as they are.
    force : bool
        Replace existing files.
    compressed : bool
        Pack the values.
    warn : callable
        Told what the format could not keep.

    Raises
    ------
    IoError
        A file exists, the folder cannot be written, the disk is full, or the volume is none.
    MemoryLimitError
        A band would not fit in memory as a full grid.
    """
    path = Path(path)
    grid = dense_form(path, volume, "MetaImage", half=half, force=force, warn=warn)
    stored = grid.values.dtype.newbyteorder("<")
    packing = ZLIB if compressed else 0
    if path.suffix.lower() != ".mhd":
        with atomic_write(path, force) as temporary, open(temporary, "wb") as file:
            file.write(_header_text(grid, _LOCAL, 0 if compressed else None))
            first = file.tell()
            write_values(file, grid.values, stored, packing)
            n_packed = file.tell() - first
            file.seek(0)
            file.write(_header_text(grid, _LOCAL, n_packed if compressed else None))
        return
    data = data_name(path, ".zraw" if compressed else ".raw")
    with written_together(path, data, force) as (header, body):
        with open(body, "wb") as file:
            write_values(file, grid.values, stored, packing)
            n_packed = file.tell()
        header.write_bytes(_header_text(grid, data.name, n_packed if compressed else None))


def read_metaimage(path: str | os.PathLike, *, warn: Warn = ignore) -> Grid:
    """Read a file of three axes and one number a node.

    Parameters
    ----------
    path : path
        A ``.mha`` or ``.mhd`` file, packed or not, of either byte order.
    warn : callable
        Told what was assumed or changed.

    Raises
    ------
    IoError
        There is no such file, it is damaged, its voxels are no cubes along the axes, or its values
        would take over 1000 times the bytes they are packed in (64 MiB are always allowed).
    """
    with opened(path) as (file, path):
        header = _read_header(file)
        if header.data_file == _LOCAL:
            values = _values(header, file, header.data_at)
        else:
            with open(data_beside(path, header.data_file), "rb") as beside:
                values = _values(header, beside, 0)
        grid = header.grid.grid(values)
    for note in header.notes:
        warn(note)
    header.grid.tell_type(warn)
    return grid


def probe_metaimage(path: str | os.PathLike) -> dict:
    """Return what the header says: ``kind``, ``dtype``, ``shape``, ``voxel_size``, ``origin``, …"""
    with opened(path) as (file, _):
        header = _read_header(file)
        facts = header.grid.facts()
    return facts | {"compressed": header.is_packed}


def _header_text(grid: Grid, data_file: str, n_packed: int | None) -> bytes:
    step, is_double = float(grid.voxel_size), grid.values.dtype == np.float64
    size = [] if n_packed is None else [f"CompressedDataSize = {n_packed:0{_SIZE_DIGITS}d}"]
    lines = [
        "ObjectType = Image",
        "NDims = 3",
        "BinaryData = True",
        "BinaryDataByteOrderMSB = False",
        f"CompressedData = {n_packed is not None}",
        *size,
        "TransformMatrix = 1 0 0 0 1 0 0 0 1",
        f"Offset = {' '.join(map(repr, grid.origin.tolist()))}",
        "CenterOfRotation = 0 0 0",
        f"ElementSpacing = {step!r} {step!r} {step!r}",
        f"DimSize = {' '.join(map(str, grid.values.shape))}",
        *(f"{key} = {value}" for key, value in told_of(grid).items()),
        f"ElementType = {'MET_DOUBLE' if is_double else 'MET_FLOAT'}",
        f"ElementDataFile = {data_file}",
        "",
    ]
    return "\n".join(lines).encode()


def _read_header(file: BinaryIO) -> _Header:
    fields, at = {}, 0
    for line in io.BytesIO(file.read(LONGEST_HEADER)):
        at += len(line)
        if not line.strip():
            continue
        name, equals, value = line.decode("utf-8", "replace").partition("=")
        name, value = name.strip(), value.strip()
        if not equals:
            raise ValueError(f"its header holds the line '{printable(name)}'")
        if name in fields:
            raise ValueError(f"its header says '{printable(name)}' twice")
        fields[name] = value
        if name == "ElementDataFile":
            fields[name] = _LOCAL if value.upper() == _LOCAL else value
            return _understood(fields, at)
    raise ValueError("its header does not end with ElementDataFile")


def _understood(fields: dict[str, str], data_at: int) -> _Header:
    missing = {"NDims", "DimSize", "ElementType"} - fields.keys()
    if missing:
        raise ValueError(f"its header lacks {', '.join(sorted(missing))}")
    if fields.get("ObjectType", "Image") != "Image":
        raise ValueError(f"it holds the object '{printable(fields['ObjectType'])}', no image")
    (n_axes,) = counts_of(fields["NDims"], 1, "NDims")
    channels = fields.get("ElementNumberOfChannels", "1")
    if n_axes != 3 or channels != "1":
        fix = "write three axes of space, and one number a node"
        raise UnsuitedError(f"it has {n_axes} axes and {printable(channels)} numbers a node", fix)
    code = _TYPES.get(fields["ElementType"])
    if code is None:
        raise ValueError(f"its values are of type '{printable(fields['ElementType'])}'")
    is_big = _flag(fields, "BinaryDataByteOrderMSB", "ElementByteOrderMSB")
    foreign = [name for name in fields if name not in _FIELDS and not name.startswith(PREFIX)]
    notes = [unkept_note(foreign)] if foreign else []
    grid = DenseHeader(
        "metaimage",
        np.dtype((">" if is_big else "<") + code),
        counts_of(fields["DimSize"], 3, "DimSize"),
        _voxel_size(fields, notes),
        np.array(_origin(fields, notes)),
        {key: value for key, value in fields.items() if key.startswith(PREFIX)},
    )
    data_file = fields["ElementDataFile"]
    if data_file.split()[:1] == ["LIST"] or "%" in data_file:
        raise UnsuitedError("its values stand in several files", "join them where they were made")
    (skip,) = counts_of(fields.get("HeaderSize", "0"), 1, "HeaderSize")
    is_binary = "BinaryData" not in fields or _flag(fields, "BinaryData")
    is_packed = _flag(fields, "CompressedData")
    return _Header(grid, data_file, data_at, skip, is_binary, is_packed, tuple(notes))


def _voxel_size(fields: dict[str, str], notes: list[str]) -> float:
    for name in ("TransformMatrix", "Orientation", "Rotation"):
        if name in fields:
            turn = np.array(numbers_of(fields[name], 9, name)).reshape(3, 3)
            steps = upright_spacings(turn.tolist())
            if max(abs(step - 1) for step in steps) > _NO_SCALE:
                fix = "write the scale as ElementSpacing"
                raise UnsuitedError(f"its {name} scales by {max(steps):g}", fix)
    for name in ("ElementSpacing", "ElementSize"):
        if name in fields:
            return one_spacing(numbers_of(fields[name], 3, name))
    notes.append("it tells no spacing; the voxel size is taken as 1")
    return 1.0


def _origin(fields: dict[str, str], notes: list[str]) -> list[float]:
    for name in ("Offset", "Position", "Origin"):
        if name in fields:
            return numbers_of(fields[name], 3, name)
    notes.append("it tells no origin; the first node is taken to lie at (0, 0, 0)")
    return [0.0, 0.0, 0.0]


def _flag(fields: dict[str, str], *names: str) -> bool:
    words = [fields[name] for name in names if name in fields]
    return bool(words) and words[0][:1] in ("T", "t", "1")


def _values(header: _Header, file: BinaryIO, at: int) -> np.ndarray:
    grid = header.grid
    there = os.fstat(file.fileno()).st_size - at
    file.seek(at)
    if header.skip < 0 and not header.is_packed:
        check_claim(grid.n_bytes, there, is_packed=False)
        file.seek(there - grid.n_bytes, os.SEEK_CUR)
    elif header.skip > 0:
        there -= header.skip
        file.seek(header.skip, os.SEEK_CUR)
    if not header.is_binary:
        # A number takes a digit and a blank at least
        check_claim(2 * grid.n_nodes - 1, there, is_packed=False)
        flat = numbers(file.read(), grid.n_nodes, "line")
        return from_flat(flat, grid.shape, grid.stored)
    check_claim(grid.n_bytes, there, is_packed=header.is_packed)
    if not header.is_packed:
        return read_values(file.read, grid.shape, grid.stored)
    stream = Inflater(file)
    values = read_values(stream.read, grid.shape, grid.stored)
    stream.finish()
    return values
