"""NRRD: ``.nrrd``, values behind the header, and ``.nhdr``, values in a file beside it.

3D Slicer, ITK, ParaView and Teem read it. Values are at nodes, x fastest, as float32 or float64;
what else a `Grid` says stands in keys of our own, see `dense_header`. A file of ours comes back
bit-equal. Its space is called left-posterior-superior, so that ITK takes the numbers as they are.
"""

import bz2
import os
from pathlib import Path
from typing import BinaryIO, Literal

import numpy as np

from ..grid import Grid, NarrowBand
from .atomic import atomic_write
from .dense_form import dense_form
from .detached import data_beside, data_name, written_together
from .nrrd_header import NrrdHeader, header_text, read_header
from .opened import opened
from .text_rows import numbers
from .unpacking import LEAST_UNPACKED, Inflater, check_claim
from .warn import Warn, ignore
from .x_fastest import GZIP, from_flat, read_values, write_values

Encoding = Literal["gzip", "raw"]

_LONGEST_LINE = 1 << 20


def write_nrrd(
    path: str | os.PathLike,
    volume: NarrowBand | Grid,
    *,
    half: bool = False,
    force: bool = False,
    encoding: Encoding = "gzip",
    warn: Warn = ignore,
) -> None:
    """Write a volume; a grid reads back bit-equal.

    Parameters
    ----------
    path : path
        A ``.nrrd`` file, or the header ``.nhdr`` of a ``.raw.gz`` or ``.raw`` file beside it.
    volume : NarrowBand or Grid
        A band becomes a full grid, see `dense_form`.
    half : bool
        There are no 16-bit floats in NRRD, so the values are written as they are.
    force : bool
        Replace existing files.
    encoding : "gzip" or "raw"
        Packed or not.
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
    grid = dense_form(path, volume, "NRRD", half=half, force=force, warn=warn)
    stored = grid.values.dtype.newbyteorder("<")
    packing = GZIP if encoding == "gzip" else 0
    if path.suffix.lower() != ".nhdr":
        with atomic_write(path, force) as temporary, open(temporary, "wb") as file:
            file.write(header_text(grid, encoding, "").encode())
            write_values(file, grid.values, stored, packing)
        return
    data = data_name(path, ".raw.gz" if packing else ".raw")
    with written_together(path, data, force) as (header, body):
        with open(body, "wb") as file:
            write_values(file, grid.values, stored, packing)
        header.write_text(header_text(grid, encoding, data.name), encoding="utf-8", newline="\n")


def read_nrrd(path: str | os.PathLike, *, warn: Warn = ignore) -> Grid:
    """Read a file of three axes of space and one number a node.

    Parameters
    ----------
    path : path
        A ``.nrrd`` or ``.nhdr`` file; encodings raw, gzip, bzip2, text and hex, either byte order.
    warn : callable
        Told what was assumed or changed.

    Raises
    ------
    IoError
        There is no such file, it is damaged, its voxels are no cubes along the axes, or its values
        would take over 1000 times the bytes they are packed in (64 MiB are always allowed).
    """
    with opened(path) as (file, path):
        header = read_header(file)
        if header.data_file:
            with open(data_beside(path, header.data_file), "rb") as beside:
                values = _values(header, beside, 0)
        else:
            values = _values(header, file, header.data_at)
        grid = header.grid.grid(values)
    for note in header.notes:
        warn(note)
    header.grid.tell_type(warn)
    return grid


def probe_nrrd(path: str | os.PathLike) -> dict:
    """Return what the header says: ``kind``, ``dtype``, ``shape``, ``voxel_size``, ``origin``, …"""
    with opened(path) as (file, _):
        header = read_header(file)
        facts = header.grid.facts()
    return facts | {"encoding": header.encoding}


def _values(header: NrrdHeader, file: BinaryIO, at: int) -> np.ndarray:
    grid, size = header.grid, os.fstat(file.fileno()).st_size
    file.seek(at)
    for _ in range(header.line_skip):
        if not file.readline(_LONGEST_LINE).endswith(b"\n"):
            raise ValueError(f"it has no {header.line_skip} lines to skip before the values")
    if header.encoding in ("text", "hex"):
        file.seek(header.byte_skip, os.SEEK_CUR)
        return _spelled(header, file.read())
    there = size - file.tell()
    if header.encoding == "raw":
        check_claim(grid.n_bytes, there - max(header.byte_skip, 0), is_packed=False)
        last = there - grid.n_bytes
        file.seek(last if header.byte_skip < 0 else header.byte_skip, os.SEEK_CUR)
        return read_values(file.read, grid.shape, grid.stored)
    check_claim(grid.n_bytes, there, is_packed=True)
    if header.byte_skip > LEAST_UNPACKED:
        raise ValueError(f"it skips {header.byte_skip} bytes")
    stream = bz2.BZ2File(file) if header.encoding == "bzip2" else Inflater(file)
    stream.read(header.byte_skip)
    values = read_values(stream.read, grid.shape, grid.stored)
    if isinstance(stream, Inflater):
        stream.finish()
    return values


def _spelled(header: NrrdHeader, text: bytes) -> np.ndarray:
    """Values written as decimal numbers, or as hexadecimal digits of their bytes."""
    grid = header.grid
    if header.encoding == "hex":
        data = bytes.fromhex(text.decode("ascii"))
        check_claim(grid.n_bytes, len(data), is_packed=False)
        return from_flat(np.frombuffer(data, grid.stored, grid.n_nodes), grid.shape, grid.stored)
    # A number takes a digit and a blank at least
    check_claim(2 * grid.n_nodes - 1, len(text), is_packed=False)
    return from_flat(numbers(text, grid.n_nodes, "line"), grid.shape, grid.stored)
