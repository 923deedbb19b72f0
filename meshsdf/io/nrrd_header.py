"""The header of an NRRD file: lines of text, up to an empty one.

A line is ``field: what it says``, ``key:=value`` of one's own, or a comment after ``#``. Fields in
reach here are those of three axes of space and one number a node; see Kindlmann's definition of the
format (teem.sourceforge.net/nrrd/format.html, version 5).

World positions are those of the file's own space, whatever it calls its axes. A file may tell them
in two ways: ``space directions`` and ``space origin``, which is where the first node lies; or
``spacings`` with ``axis mins``, which for cells is half a voxel before it.
"""

import re
from dataclasses import dataclass
from typing import BinaryIO

import numpy as np

from ..grid import Grid
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
from .vdb_stream import UnsuitedError, printable

LONGEST_HEADER = 1 << 20

ENCODINGS = {"gz": "gzip", "bz2": "bzip2", "txt": "text", "ascii": "text"}
ENCODINGS |= {name: name for name in ("raw", "gzip", "bzip2", "text", "hex")}

_MAGIC = re.compile(rb"NRRD000[1-5]\r?\n")
OUR_CONTENT = "distance"
_MEANT = ("content", "labels", "units", "space units", "sample units", "measurement frame")
"""Fields that tell people something, and that a `Grid` has no place for."""

_OLD_NAMES = {
    "datafile": "data file",
    "lineskip": "line skip",
    "byteskip": "byte skip",
    "axismins": "axis mins",
    "axismaxs": "axis maxs",
    "centers": "centerings",
}
_NAMES = {
    "i1": ("signed char", "int8", "int8_t"),
    "u1": ("uchar", "unsigned char", "uint8", "uint8_t"),
    "i2": ("short", "short int", "signed short", "signed short int", "int16", "int16_t"),
    "u2": ("ushort", "unsigned short", "unsigned short int", "uint16", "uint16_t"),
    "i4": ("int", "signed int", "int32", "int32_t"),
    "u4": ("uint", "unsigned int", "uint32", "uint32_t"),
    "i8": ("longlong", "long long", "long long int", "signed long long", "int64", "int64_t"),
    "u8": ("ulonglong", "unsigned long long", "unsigned long long int", "uint64", "uint64_t"),
    "f4": ("float",),
    "f8": ("double",),
}
_TYPES = {name: code for code, names in _NAMES.items() for name in names}
_TYPES["signed long long int"] = "i8"


@dataclass(frozen=True, eq=False)
class NrrdHeader:
    """A header, and where the values are.

    Attributes
    ----------
    grid : DenseHeader
        What it says of the grid.
    encoding : str
        "raw", "gzip", "bzip2", "text" or "hex".
    data_file : str
        Name of the file with the values; empty if they follow the header.
    data_at : int
        Byte of the header's own file where they would follow.
    line_skip, byte_skip : int
        What to pass over before the values, once unpacked; -1 bytes for all but the last ones.
    notes : tuple of str
        What had to be assumed.
    """

    grid: DenseHeader
    encoding: str
    data_file: str
    data_at: int
    line_skip: int
    byte_skip: int
    notes: tuple[str, ...]


def read_header(file: BinaryIO) -> NrrdHeader:
    """Read the header; ValueError says what is wrong with it."""
    data = file.read(LONGEST_HEADER)
    magic = _MAGIC.match(data)
    if magic is None:
        raise ValueError("it does not begin with NRRD0001 to NRRD0005")
    fields, told, data_at, is_closed = _lines(data, magic.end())
    if not is_closed and (len(data) == LONGEST_HEADER or "data file" not in fields):
        raise ValueError("its header does not end")
    return _understood(fields, told, data_at)


def header_text(grid: Grid, encoding: str, data_file: str) -> str:
    """The header of a file with our values, little-endian."""
    step, (x, y, z) = float(grid.voxel_size), grid.origin.tolist()
    lines = [
        "NRRD0005",
        f"content: {OUR_CONTENT}",
        f"type: {'double' if grid.values.dtype == np.float64 else 'float'}",
        "dimension: 3",
        "space: left-posterior-superior",
        f"sizes: {' '.join(map(str, grid.values.shape))}",
        f"space directions: ({step!r},0,0) (0,{step!r},0) (0,0,{step!r})",
        "centerings: node node node",
        "kinds: domain domain domain",
        "endian: little",
        f"encoding: {encoding}",
        f"space origin: ({x!r},{y!r},{z!r})",
    ]
    lines += [f"{key}:={value}" for key, value in told_of(grid).items()]
    # Last, so that a header which is cut off names no data
    lines += [f"data file: {data_file}"] if data_file else []
    return "\n".join([*lines, "", ""])


def _lines(data: bytes, at: int) -> tuple[dict[str, str], dict[str, str], int, bool]:
    """Fields, keys with values, the byte behind them, and whether an empty line ends them."""
    fields, told = {}, {}
    while (end := data.find(b"\n", at)) >= 0:
        line = data[at:end].rstrip(b"\r").decode("utf-8", "replace")
        at = end + 1
        if not line:
            return fields, told, at, True
        if line.startswith("#"):
            continue
        name, colon, value = line.partition(":")
        if not colon:
            raise ValueError(f"its header holds the line '{printable(line)}'")
        if value.startswith("="):
            told[name] = value[1:].strip()
            continue
        name = name.strip().lower()
        name = _OLD_NAMES.get(name, name)
        if name in fields:
            raise ValueError(f"its header says '{printable(name)}' twice")
        fields[name] = value.strip()
    return fields, told, at, False


def _understood(fields: dict[str, str], told: dict[str, str], data_at: int) -> NrrdHeader:
    missing = {"dimension", "type", "sizes", "encoding"} - fields.keys()
    if missing:
        raise ValueError(f"its header lacks {', '.join(map(repr, sorted(missing)))}")
    (dimension,) = counts_of(fields["dimension"], 1, "dimension")
    if dimension != 3:
        fix = "write three axes of space, and one number a node"
        raise UnsuitedError(f"it has {dimension} axes, not three of space", fix)
    shape = counts_of(fields["sizes"], 3, "sizes")
    encoding = ENCODINGS.get(fields["encoding"].lower())
    if encoding is None:
        raise ValueError(f"its encoding is '{printable(fields['encoding'])}'")
    foreign = [name for name in told if not name.startswith(PREFIX)]
    foreign += [name for name in _MEANT if name in fields and fields[name] != OUR_CONTENT]
    notes = [unkept_note(foreign)] if foreign else []
    told = {name: value for name, value in told.items() if name.startswith(PREFIX)}
    steps = _steps(fields, shape, notes)
    origin = _first(fields, steps, notes)
    stored = _stored(fields, encoding)
    line_skip, byte_skip = (
        counts_of(fields.get(name, "0"), 1, name)[0] for name in ("line skip", "byte skip")
    )
    if line_skip < 0 or byte_skip < (-1 if encoding == "raw" else 0):
        raise ValueError(f"it skips {line_skip} lines and {byte_skip} bytes")
    grid = DenseHeader("nrrd", stored, shape, one_spacing(steps), np.array(origin), told)
    data_file = fields.get("data file", "")
    if data_file.split()[:1] == ["LIST"] or "%" in data_file:
        fix = "join them where they were made"
        raise UnsuitedError("its values stand in several files", fix)
    return NrrdHeader(grid, encoding, data_file, data_at, line_skip, byte_skip, tuple(notes))


def _stored(fields: dict[str, str], encoding: str) -> np.dtype:
    code = _TYPES.get(" ".join(fields["type"].lower().split()))
    if code is None:
        raise ValueError(f"its values are of type '{printable(fields['type'])}'")
    order = {"little": "<", "big": ">"}.get(fields.get("endian", "").lower())
    if order is None and code[1] != "1" and encoding != "text":
        raise ValueError(f"its byte order is '{printable(fields.get('endian', ''))}'")
    return np.dtype(f"{order or '<'}{code}")


def _steps(fields: dict[str, str], shape: tuple[int, ...], notes: list[str]) -> list[float]:
    """Steps along the axes; notes what is assumed."""
    if "space directions" in fields:
        text = fields["space directions"]
        vectors = re.findall(r"\(([^()]*)\)|(\S+)", text)
        if len(vectors) != 3 or any(word for _, word in vectors):
            fix = "write three axes of space, and one number a node"
            raise UnsuitedError(f"its axes run along '{printable(text)}'", fix)
        rows = [numbers_of(inner.replace(",", " "), 3, "a direction") for inner, _ in vectors]
        return upright_spacings(rows)
    if "spacings" in fields:
        return numbers_of(fields["spacings"], 3, "spacings")
    if "axis mins" in fields and "axis maxs" in fields:
        low = numbers_of(fields["axis mins"], 3, "axis mins")
        high = numbers_of(fields["axis maxs"], 3, "axis maxs")
        # Between nodes there is one step less than there are nodes
        counts = [n if cell else n - 1 for n, cell in zip(shape, _is_cell(fields), strict=True)]
        return [(b - a) / max(n, 1) for a, b, n in zip(low, high, counts, strict=True)]
    notes.append("it tells no spacing; the voxel size is taken as 1")
    return [1.0, 1.0, 1.0]


def _first(fields: dict[str, str], steps: list[float], notes: list[str]) -> list[float]:
    """Where the first node lies; notes what is assumed."""
    if "space origin" in fields:
        text = fields["space origin"]
        if not (text.startswith("(") and text.endswith(")")):
            raise ValueError(f"its space origin is '{printable(text)}'")
        return numbers_of(text[1:-1].replace(",", " "), 3, "space origin")
    if "axis mins" in fields and "space directions" not in fields:
        low = numbers_of(fields["axis mins"], 3, "axis mins")
        cells = zip(low, steps, _is_cell(fields), strict=True)
        return [a + step / 2 if cell else a for a, step, cell in cells]
    notes.append("it tells no origin; the first node is taken to lie at (0, 0, 0)")
    return [0.0, 0.0, 0.0]


def _is_cell(fields: dict[str, str]) -> list[bool]:
    words = fields.get("centerings", "").lower().split()
    return [word == "cell" for word in words] if len(words) == 3 else [False] * 3
