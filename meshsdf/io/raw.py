"""Bare values in a ``.raw`` file, and what they are in a JSON file beside it (``ball.raw.json``).

What engines and scripts read without any library. A JSON file of the same stem (``ball.json``) is
read, too. The JSON object:

- ``format``: "meshsdf.raw/1"
- ``shape``: [ni, nj, nk], nodes along x, y and z
- ``dtype``: "float32", "float64", "float16", or "int8" ... "uint32"
- ``byte_order``: "little", as we write, or "big"
- ``order``: "x_fastest", as we write: node (i, j, k) is number i + ni (j + nj k); or "z_fastest"
- ``origin``: [x, y, z], world position of node (0, 0, 0)
- ``voxel_size``: world units
- ``sign``: how inside was told; values are negative inside
- ``half_width`` and ``background``: voxels and world units from the surface beyond which values
  are clipped, if they are
- ``uncertain_voxels``, ``n_inner_faces``: counts, see `Grid`

``format``, ``shape``, ``dtype`` and ``voxel_size`` are required, and unknown keys are passed over.
"""

import json
import os
from pathlib import Path
from typing import BinaryIO

import numpy as np

from ..errors import IoError
from ..grid import Grid, NarrowBand
from .dense_form import dense_form
from .dense_header import PREFIX, DenseHeader, one_spacing, told_of
from .detached import words_beside, words_there, written_together
from .half import check_half, halved
from .opened import opened
from .registry import checked_input
from .unpacking import check_claim
from .vdb_stream import printable
from .warn import Warn, ignore
from .x_fastest import memory_type, read_values, write_values

FORMAT = "meshsdf.raw/1"

_LONGEST_JSON = 1 << 20
_TYPES = ("float16", "float32", "float64", "int8", "int16", "int32", "uint8", "uint16", "uint32")
_OTHER_HEADERS = (".mhd", ".nhdr")


def write_raw(
    path: str | os.PathLike,
    volume: NarrowBand | Grid,
    *,
    half: bool = False,
    force: bool = False,
    warn: Warn = ignore,
) -> None:
    """Write a volume; a grid reads back bit-equal, unless ``half``.

    Parameters
    ----------
    path : path
        The ``.raw`` file; its ``.raw.json`` is written beside it.
    volume : NarrowBand or Grid
        A band becomes a full grid, see `dense_form`.
    half : bool
        Round the values to float16; see `write_npz`.
    force : bool
        Replace existing files.
    warn : callable
        Told what the format could not keep.

    Raises
    ------
    IoError
        A file exists, the folder cannot be written, the disk is full, the volume is none, or its
        values do not fit float16.
    MemoryLimitError
        A band would not fit in memory as a full grid.
    """
    path = Path(path)
    grid = dense_form(path, volume, "raw with JSON", half=half, force=force, warn=warn)
    values = grid.values
    if half:
        check_half(values, f"output {path}")
        values = halved(values)
    facts = described(grid, values.shape, values.dtype, FORMAT)
    with written_together(words_beside(path), path, force) as (head, body):
        with open(body, "wb") as file:
            write_values(file, values, values.dtype.newbyteorder("<"))
        head.write_text(facts, encoding="utf-8", newline="\n")


def read_raw(path: str | os.PathLike, *, warn: Warn = ignore) -> Grid:
    """Read a ``.raw`` file and the JSON beside it.

    Parameters
    ----------
    path : path
        The ``.raw`` file.
    warn : callable
        Told which type the values got.

    Raises
    ------
    IoError
        One of the two files is missing, they do not fit each other, or make no sense.
    """
    header, is_x_fastest = _read_header(path)
    with opened(path) as (file, _):
        there = os.fstat(file.fileno()).st_size
        check_claim(header.n_bytes, there, is_packed=False)
        if there > header.n_bytes:
            raise ValueError(f"it has {there} bytes, its .json tells {header.n_bytes}")
        read = read_values if is_x_fastest else _read_z_fastest
        grid = header.grid(read(file.read, header.shape, header.stored))
    header.tell_type(warn)
    return grid


def probe_raw(path: str | os.PathLike) -> dict:
    """Return what the JSON says: ``kind``, ``dtype``, ``shape``, ``voxel_size``, …"""
    header, is_x_fastest = _read_header(path)
    order = "x_fastest" if is_x_fastest else "z_fastest"
    return header.facts() | {"order": order, "facts_from": words_there(Path(path)).name}


def described(grid: Grid, shape: tuple[int, ...], dtype: np.dtype, format: str) -> str:
    """Return the JSON that tells what values of this shape and type, x fastest, are."""
    facts = {
        "format": format,
        "shape": list(shape),
        "dtype": dtype.name,
        "byte_order": "little",
        "order": "x_fastest",
        "origin": grid.origin.tolist(),
        "voxel_size": float(grid.voxel_size),
    }
    for key, text in told_of(grid).items():
        name = key.removeprefix(PREFIX)
        facts[name] = text if name == "sign" else json.loads(text)
    return json.dumps(facts, indent=2) + "\n"


def _read_z_fastest(read, shape: tuple[int, int, int], stored: np.dtype) -> np.ndarray:
    flat = np.frombuffer(read(int(np.prod(shape)) * stored.itemsize), stored)
    return flat.reshape(shape).astype(memory_type(stored))


def _read_header(path: str | os.PathLike) -> tuple[DenseHeader, bool]:
    """What the JSON beside a file says, and whether x is fastest."""
    path = checked_input(path)
    beside = words_there(path)
    if beside is None:
        others = [path.with_suffix(suffix) for suffix in _OTHER_HEADERS]
        other = next((str(header) for header in others if header.is_file()), None)
        fix = f"read {other}" if other else f"write {words_beside(path).name} beside it"
        what = f"there is no {words_beside(path).name} that tells what is in {path.name}"
        raise IoError(what, f"file {path}", fix)
    with opened(beside) as (file, _):
        header, is_x_fastest = understood(read_words(file), FORMAT)
        header.facts()  # what is wrong with these is wrong with the JSON
    return header, is_x_fastest


def read_words(file: BinaryIO) -> dict:
    """Return the JSON object in a file; ValueError if there is none."""
    data = file.read(_LONGEST_JSON + 1)
    if len(data) > _LONGEST_JSON:
        raise ValueError(f"it is longer than {_LONGEST_JSON} bytes")
    found = json.loads(data)
    if not isinstance(found, dict):
        raise ValueError("it holds no JSON object")
    return found


def understood(facts: dict, format: str) -> tuple[DenseHeader, bool]:
    """Return what `described` tells, and whether x is fastest; ValueError if it makes no sense."""
    if facts.get("format") != format:
        raise ValueError(f"its format is {_shown(facts.get('format'))}, not {format!r}")
    shape = facts.get("shape")
    if not (isinstance(shape, list) and len(shape) == 3 and all(type(n) is int for n in shape)):
        raise ValueError(f"its shape is {_shown(shape)}, not three whole numbers")
    if facts.get("dtype") not in _TYPES:
        raise ValueError(f"its dtype is {_shown(facts.get('dtype'))}")
    order = facts.get("order", "x_fastest")
    if order not in ("x_fastest", "z_fastest"):
        raise ValueError(f"its order is {_shown(order)}, not 'x_fastest' or 'z_fastest'")
    byte_order = facts.get("byte_order", "little")
    if byte_order not in ("little", "big"):
        raise ValueError(f"its byte_order is {_shown(byte_order)}, not 'little' or 'big'")
    stored = np.dtype(facts["dtype"]).newbyteorder("<" if byte_order == "little" else ">")
    origin = facts.get("origin", [0, 0, 0])
    if not (isinstance(origin, list) and len(origin) == 3 and all(map(_is_number, origin))):
        raise ValueError(f"its origin is {_shown(origin)}, not three numbers")
    if not _is_number(facts.get("voxel_size")):
        raise ValueError(f"its voxel_size is {_shown(facts.get('voxel_size'))}")
    told = {
        PREFIX + name: str(facts[name])
        for name in ("sign", "half_width", "uncertain_voxels", "n_inner_faces")
        if facts.get(name) is not None
    }
    size = one_spacing([float(facts["voxel_size"])])
    place = np.array([float(x) for x in origin])
    name = format.split(".")[1].split("/")[0]
    return DenseHeader(name, stored, tuple(shape), size, place, told), order == "x_fastest"


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _shown(value: object) -> str:
    return printable(json.dumps(value))
