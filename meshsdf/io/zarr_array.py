"""Arrays of Zarr version 3 in a folder, or in a zip of one, with one file per chunk.

An array is a folder with ``zarr.json`` and files ``c/0/0/0``, ...; a chunk without a file holds the
fill value everywhere. Written are regular chunks, little-endian in C order, packed with gzip. Such
arrays are read here, packed or not, and trusted in nothing; `zarr_package` opens what others packed
otherwise. (Zarr core specification 3.0, zarr-specs.readthedocs.io/en/latest/v3/core.)
"""

import json
import math
import os
import stat
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..kernels.parallel import even_ranges, run_pieces
from .unpacking import check_claim
from .vdb_stream import UnsuitedError, printable
from .zarr_package import read_with_package
from .zarr_zip import Folder, ZipPlace

PLAIN, PACKED = ("bytes",), ("bytes", "gzip")
"""The codecs of chunks that are read here."""

DTYPES = ("float16", "float32", "float64", "int32", "int64", "uint64")

MOST_CHUNKS = 1 << 22
"""An array of 64^3 nodes a chunk has so many at 10 000 nodes a side."""

_PIECES = 64
_LEVEL = 1  # of deflate's 9: exact distances pack little at any
_GZIP = 31  # zlib's number for a gzip frame; without a date in it, so equal chunks are equal files
_SLACK = 1 << 16  # bytes by which a chunk may grow when it does not pack
_LONGEST_METADATA = 1 << 24
_ROWS_BYTES = 1 << 20
_MOST_DIMENSIONS = 8
_SPECIAL = {"NaN": math.nan, "Infinity": math.inf, "-Infinity": -math.inf}


@dataclass(frozen=True)
class ArraySpec:
    """What ``zarr.json`` says of an array.

    Attributes
    ----------
    shape, chunk : tuple of int
        Of the array, and of a chunk; chunks at the end reach beyond the array.
    dtype : dtype
        One of `DTYPES`.
    fill : float or int
        What missing chunks hold.
    codecs : tuple of str
        What chunks are packed with, in order; `PLAIN`, `PACKED`, or others.
    separator : str
        Between the numbers in the name of a chunk.
    """

    shape: tuple[int, ...]
    chunk: tuple[int, ...]
    dtype: np.dtype
    fill: float | int = 0
    codecs: tuple[str, ...] = ("bytes", "gzip")
    separator: str = "/"

    @property
    def n_chunks(self) -> tuple[int, ...]:
        """Chunks along every axis."""
        return tuple(-(-n // c) for n, c in zip(self.shape, self.chunk, strict=True))

    @property
    def n_bytes(self) -> int:
        """Bytes of the whole array."""
        return math.prod(self.shape) * self.dtype.itemsize

    @property
    def chunk_bytes(self) -> int:
        """Bytes of a chunk, unpacked."""
        return math.prod(self.chunk) * self.dtype.itemsize

    def place(self, at: tuple[int, ...]) -> tuple[slice, ...]:
        """Where a chunk lies in the array."""
        return tuple(slice(a * c, (a + 1) * c) for a, c in zip(at, self.chunk, strict=True))

    def chunk_name(self, at: tuple[int, ...]) -> str:
        """Path of a chunk in the array's folder."""
        return self.separator.join(map(str, ("c", *at)))


def write_metadata(folder: Path, spec: ArraySpec, names: tuple[str, ...] = ()) -> None:
    """Make the folder of an array, with what is to be said of it."""
    fill = float(spec.fill) if spec.dtype.kind == "f" else int(spec.fill)
    if isinstance(fill, float) and not math.isfinite(fill):
        fill = next(word for word, value in _SPECIAL.items() if str(value) == str(fill))
    codecs = [
        {"name": "bytes", "configuration": {"endian": "little"}},
        {"name": "gzip", "configuration": {"level": _LEVEL}},
    ]
    metadata = {
        "zarr_format": 3,
        "node_type": "array",
        "shape": list(spec.shape),
        "data_type": spec.dtype.name,
        "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": list(spec.chunk)}},
        "chunk_key_encoding": {"name": "default", "configuration": {"separator": "/"}},
        "fill_value": fill,
        "codecs": codecs,
        "attributes": {},
    }
    if names:
        metadata["dimension_names"] = list(names)
    write_json(folder, metadata)


def write_group(folder: Path, attributes: dict) -> None:
    """Make the folder of a group."""
    write_json(folder, {"zarr_format": 3, "node_type": "group", "attributes": attributes})


def write_json(folder: Path, metadata: dict) -> None:
    """Make a folder with this ``zarr.json``."""
    folder.mkdir(exist_ok=True)
    text = json.dumps(metadata, indent=2, allow_nan=False) + "\n"
    (folder / "zarr.json").write_bytes(text.encode())


def pack(chunk: np.ndarray) -> bytes:
    """The bytes that stand for a chunk."""
    packer = zlib.compressobj(_LEVEL, zlib.DEFLATED, _GZIP)
    data = np.ascontiguousarray(chunk, chunk.dtype.newbyteorder("<"))
    return packer.compress(data.data.cast("B") if data.size else b"") + packer.flush()


def store(folder: Path, spec: ArraySpec, at: tuple[int, ...], packed: bytes) -> None:
    """Write the file of a chunk."""
    path = folder / spec.chunk_name(at)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(packed)


def write_rows(folder: Path, array: np.ndarray) -> None:
    """Write a whole array, in chunks of some rows of its first axis."""
    row = max(1, math.prod(array.shape[1:]))
    rows = min(max(1, _ROWS_BYTES // (row * array.itemsize)), max(1, len(array)))
    chunk = (rows, *(max(1, n) for n in array.shape[1:]))
    spec = ArraySpec(array.shape, chunk, array.dtype)
    write_metadata(folder, spec)
    for number in range(spec.n_chunks[0] if array.size else 0):
        part = array[number * rows : (number + 1) * rows]
        whole = np.zeros(chunk, array.dtype)
        whole[: len(part)] = part
        store(folder, spec, (number, *[0] * (array.ndim - 1)), pack(whole))


def read_metadata(folder: Folder) -> dict:
    """Return what ``zarr.json`` says; ValueError if it makes no sense."""
    path = folder / "zarr.json"
    if not path.is_file() and (folder / ".zattrs").exists():
        fix = "write it anew in version 3, as zarr 3 and OME-Zarr 0.5 do"
        raise UnsuitedError("it is of version 2 of Zarr", fix)
    data = _file_bytes(path, _LONGEST_METADATA)
    if data is None:
        raise ValueError(f"{_shown(folder)} has no zarr.json")
    try:
        found = json.loads(data)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{_shown(path)} is damaged ({printable(str(error))})") from None
    if not isinstance(found, dict) or found.get("zarr_format") != 3:
        raise ValueError(f"{_shown(path)} does not say zarr_format 3")
    return found


def read_spec(folder: Folder) -> ArraySpec:
    """Return what is said of an array.

    Raises
    ------
    ValueError
        It makes no sense.
    UnsuitedError
        Its type, chunks or codecs are others than those read here.
    """
    found = read_metadata(folder)
    if found.get("node_type") != "array":
        raise ValueError(f"{_shown(folder)} is not an array")
    shape = _sides(found.get("shape"), 0, folder)
    grid = _named(found.get("chunk_grid"), "regular", "chunk grid")
    chunk = _sides(grid.get("chunk_shape"), 1, folder)
    if len(chunk) != len(shape):
        raise ValueError(f"{_shown(folder)} has chunks of {len(chunk)} axes, and {len(shape)}")
    keys = _named(found.get("chunk_key_encoding"), "default", "names of chunks")
    separator = keys.get("separator", "/")
    kind = found.get("data_type")
    if kind not in DTYPES or separator not in ("/", "."):
        what = f"{_shown(folder)} holds {printable(str(kind))}"
        raise UnsuitedError(what, f"write it as one of {', '.join(DTYPES)}")
    if found.get("storage_transformers"):
        raise UnsuitedError("it has storage transformers", "write it without")
    dtype = np.dtype(kind)
    fill = _fill(found.get("fill_value"), dtype, folder)
    return ArraySpec(shape, chunk, dtype, fill, _codecs(found.get("codecs")), separator)


def read_chunk(folder: Folder, spec: ArraySpec, at: tuple[int, ...]) -> np.ndarray | None:
    """Return a chunk of a `PLAIN` or `PACKED` array; None if it is missing: all is fill value."""
    path = folder / spec.chunk_name(at)
    data = _file_bytes(path, spec.chunk_bytes + (spec.chunk_bytes >> 10) + _SLACK)
    if data is None:
        return None
    check_claim(spec.chunk_bytes, len(data), is_packed=spec.codecs == PACKED)
    if spec.codecs == PACKED:
        stream = zlib.decompressobj(_GZIP)
        try:
            # One byte more, so that a stream which does not stop there is seen
            data = stream.decompress(data, spec.chunk_bytes + 1)
        except zlib.error as error:
            raise ValueError(f"chunk {_shown(path)} is damaged ({error})") from None
        if len(data) > spec.chunk_bytes:
            raise ValueError(f"chunk {_shown(path)} holds more than {spec.chunk_bytes} bytes")
        if not stream.eof or stream.unused_data:
            raise ValueError(f"chunk {_shown(path)} does not end where it should")
    if len(data) != spec.chunk_bytes:
        raise ValueError(f"chunk {_shown(path)} holds {len(data)} bytes, not {spec.chunk_bytes}")
    return np.frombuffer(data, spec.dtype.newbyteorder("<")).reshape(spec.chunk)


def read_whole(
    folder: Folder, spec: ArraySpec, n_there: int, *, is_full: bool = False
) -> np.ndarray:
    """Return the whole array.

    Parameters
    ----------
    folder, spec : Folder, ArraySpec
        The array.
    n_there : int
        Bytes of the whole volume, for which so much is allowed; see `check_claim`.
    is_full : bool
        Whether every chunk must be there.
    """
    check_claim(spec.n_bytes, n_there, is_packed=True)
    if spec.codecs not in (PLAIN, PACKED):
        return read_with_package(folder, spec.codecs)
    out = np.full(spec.shape, spec.fill, spec.dtype)

    def read(at: tuple[int, ...]) -> None:
        chunk = read_chunk(folder, spec, at)
        if chunk is not None:
            target = out[spec.place(at)]
            target[...] = chunk[tuple(slice(n) for n in target.shape)]
        elif is_full:
            raise ValueError(f"chunk {_shown(folder / spec.chunk_name(at))} is missing")

    for_all_chunks(spec, read)
    return out


def for_all_chunks(spec: ArraySpec, work: Callable[[tuple[int, ...]], None]) -> None:
    """Call ``work`` with the numbers of every chunk, on all cores.

    Raises
    ------
    ValueError
        There are more chunks than `MOST_CHUNKS`.
    """
    n = math.prod(spec.n_chunks)
    if n > MOST_CHUNKS:
        raise ValueError(f"it has {n} chunks; {MOST_CHUNKS} are allowed")
    ranges = even_ranges(n, _PIECES) if n else []

    def run(piece: int) -> None:
        for number in range(*ranges[piece]):
            work(tuple(map(int, np.unravel_index(number, spec.n_chunks))))

    run_pieces(run, len(ranges))


def _file_bytes(path: Folder, most: int) -> bytes | None:
    """The bytes of a plain file of a likely size; None if there is none."""
    if isinstance(path, ZipPlace):
        return path.folder.read(path.name, most)
    try:
        status = os.stat(path)
    except FileNotFoundError:
        return None
    if not stat.S_ISREG(status.st_mode) or status.st_size > most:
        raise ValueError(f"{_shown(path)} is no plain file of up to {most} bytes")
    return path.read_bytes()


def _sides(found: object, least: int, folder: Folder) -> tuple[int, ...]:
    is_list = isinstance(found, list) and 0 < len(found) <= _MOST_DIMENSIONS
    if not is_list or not all(type(n) is int and least <= n < 1 << 40 for n in found):
        raise ValueError(f"{_shown(folder)} claims the shape {printable(str(found))}")
    return tuple(found)


def _named(found: object, name: str, what: str) -> dict:
    """The configuration of an extension point, which must be of the one name that is known."""
    if isinstance(found, str):
        found = {"name": found}
    if not isinstance(found, dict) or found.get("name") != name:
        raise UnsuitedError(f"its {what} is not {name!r}", "write it so")
    configuration = found.get("configuration", {})
    if not isinstance(configuration, dict):
        raise ValueError(f"its {what} is damaged")
    return configuration


def _codecs(found: object) -> tuple[str, ...]:
    if not isinstance(found, list) or not found:
        raise ValueError("it has no list of codecs")
    names = tuple(str(c.get("name") if isinstance(c, dict) else c) for c in found)
    if names in (PLAIN, PACKED) and isinstance(found[0], dict):
        order = _named(found[0], "bytes", "first codec").get("endian", "little")
        return names if order == "little" else (*names, "big-endian")
    return tuple(map(printable, names))


def _fill(found: object, dtype: np.dtype, folder: Folder) -> float | int:
    if dtype.kind == "f":
        found = _SPECIAL.get(found, found) if isinstance(found, str) else found
        is_number = isinstance(found, int | float)
        if is_number and (found != found or abs(found) <= float(np.finfo(dtype).max)):
            return float(found)
    elif type(found) is int and np.iinfo(dtype).min <= found <= np.iinfo(dtype).max:
        return found
    raise ValueError(f"{_shown(folder)} has the fill value {printable(str(found))}")


def _shown(path: Folder) -> str:
    return printable("/".join(path.parts[-4:]))
