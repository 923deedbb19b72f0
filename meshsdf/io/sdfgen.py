"""The text grids of Christopher Batty's SDFGen, ``.sdf``.

Numbers with blanks between: the counts along x, y and z; the position of node (0, 0, 0); the voxel
size; then the values at the nodes, x fastest, one a line. There is no room for more. (Robot models
and molecules are called ``.sdf``, too; these are no grids.)
"""

import os
import re
from typing import BinaryIO

import numpy as np

from ..grid import Grid, NarrowBand
from .atomic import atomic_write
from .dense_form import dense_form
from .dense_header import DenseHeader, counts_of, numbers_of, one_spacing
from .opened import opened
from .text_rows import numbers
from .unpacking import check_claim
from .warn import Warn, ignore
from .x_fastest import file_planes, from_flat

_STORED = np.dtype("<f4")
_LONGEST_HEADER = 4096
_SEVEN_WORDS = re.compile(rb"\s*(?:\S{1,40}\s+){7}")


def write_sdfgen(
    path: str | os.PathLike,
    volume: NarrowBand | Grid,
    *,
    half: bool = False,
    force: bool = False,
    warn: Warn = ignore,
) -> None:
    """Write a volume; values read back bit-equal if they are float32.

    Parameters
    ----------
    path : path
        The ``.sdf`` file.
    volume : NarrowBand or Grid
        A band becomes a full grid, see `dense_form`.
    half : bool
        The values are text, so they are not rounded.
    force : bool
        Replace an existing file.
    warn : callable
        Told what the format could not keep.

    Raises
    ------
    IoError
        The file exists, its folder cannot be written, the disk is full, the volume is none, or has
        nodes without a value.
    MemoryLimitError
        A band would not fit in memory as a full grid.
    """
    grid = dense_form(path, volume, "SDFGen grid", half=half, force=force, warn=warn)
    counts = " ".join(map(str, grid.values.shape))
    place = " ".join(map(repr, grid.origin.tolist()))
    with atomic_write(path, force) as temporary, open(temporary, "wb") as file:
        file.write(f"{counts}\n{place}\n{float(grid.voxel_size)!r}\n".encode())
        for planes in file_planes(grid.values, _STORED):
            for rows in planes:
                # Nine digits tell every float32 from its neighbours
                flat = rows.ravel().tolist()
                file.write((("%.9g\n" * len(flat)) % tuple(flat)).encode())


def read_sdfgen(path: str | os.PathLike, *, warn: Warn = ignore) -> Grid:
    """Read a text grid, as float32.

    Parameters
    ----------
    path : path
        The ``.sdf`` file.
    warn : callable
        Told nothing yet.

    Raises
    ------
    IoError
        There is no such file, or it is no such grid.
    """
    with opened(path) as (file, _):
        header, at = _read_header(file)
        file.seek(at)
        # In memory a number takes 8 bytes, in the file a digit and a blank at least
        flat = numbers(file.read(), header.n_nodes, "line")
        return header.grid(from_flat(flat, header.shape, header.stored))


def probe_sdfgen(path: str | os.PathLike) -> dict:
    """Return what the first numbers say: ``shape``, ``voxel_size``, ``origin``, …"""
    with opened(path) as (file, _):
        header, _ = _read_header(file)
        return header.facts()


def _read_header(file: BinaryIO) -> tuple[DenseHeader, int]:
    """The first seven numbers, and the byte behind them."""
    match = _SEVEN_WORDS.match(file.read(_LONGEST_HEADER))
    words = match[0].decode("latin-1").split() if match else []
    try:
        shape = counts_of(" ".join(words[:3]), 3, "the counts")
        origin = numbers_of(" ".join(words[3:6]), 3, "the origin")
        step = numbers_of(" ".join(words[6:]), 1, "the voxel size")
    except ValueError as error:
        what = f"it does not begin as a grid of SDFGen: {error}" if words else "it is no text grid"
        raise ValueError(what) from None
    header = DenseHeader("sdfgen", _STORED, shape, one_spacing(step), np.array(origin), {})
    there = os.fstat(file.fileno()).st_size - match.end()
    check_claim(2 * header.n_nodes - 1, there, is_packed=False)
    return header, match.end()
