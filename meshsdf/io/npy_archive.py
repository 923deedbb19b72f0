"""A zip of named arrays, stored without compression: what ``numpy.load`` opens, read safely.

Nothing is believed before it is checked: the directory against the file's length, each array's
header against the length of its entry, both before memory is taken; the bytes against their CRC
when they are read. Pickles and compressed entries are refused.
"""

import math
import re
import struct
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

_NPY = b"\x93NUMPY"
_LONGEST_HEADER = 4096
_HEADER = re.compile(
    rb"\{'descr': '([<|])([A-Za-z])(\d{1,4})', 'fortran_order': False, "
    rb"'shape': \(((?:\d{1,18}(?:, ?\d{1,18})*,?)?)\), \} *\n"
)
_KINDS = {"f": (2, 4, 8), "i": (1, 4, 8), "u": (8,), "U": range(1, 65)}
_MAX_ENTRIES = 64
_CHUNK = 1 << 24

EPOCH = (1980, 1, 1, 0, 0, 0)
"""The date of every entry: the earliest that a zip can tell."""

ZIP_ERRORS = (
    zipfile.BadZipFile,
    zlib.error,
    struct.error,
    EOFError,
    RuntimeError,
    ValueError,
    KeyError,
    IndexError,
    OverflowError,
)
"""What the standard zip reader may raise on bytes that are no archive."""


@dataclass(frozen=True)
class ArrayHeader:
    """Shape, type and place of one array of an archive."""

    dtype: np.dtype
    shape: tuple[int, ...]
    offset: int

    @property
    def n_bytes(self) -> int:
        """Bytes of the array's data."""
        return math.prod(self.shape) * self.dtype.itemsize


class ArchiveReader:
    """An open archive; a context manager. ValueError says what is wrong with the file."""

    def __init__(self, path: Path) -> None:
        self._length = path.stat().st_size
        self._zip = zipfile.ZipFile(path)
        try:
            self.headers = self._read_headers()
        except BaseException:
            self._zip.close()
            raise

    def __enter__(self) -> "ArchiveReader":
        return self

    def __exit__(self, *_: object) -> None:
        self._zip.close()

    def read(self, name: str) -> np.ndarray:
        """Return one array; ValueError if its bytes do not match their checksum."""
        header = self.headers[name]
        out = np.empty(header.shape, header.dtype)
        room = memoryview(out.reshape(-1).view(np.uint8)) if out.size else memoryview(bytearray())
        with self._zip.open(f"{name}.npy") as entry:
            entry.read(header.offset)
            at = 0
            while at < len(room):
                n_read = entry.readinto(room[at : at + _CHUNK])
                if not n_read:
                    raise ValueError(f"the array {name!r} is cut off")
                at += n_read
            entry.read(1)  # reaching the end is what compares the checksum
        return out

    def _read_headers(self) -> dict[str, ArrayHeader]:
        entries = self._zip.infolist()
        if len(entries) > _MAX_ENTRIES:
            raise ValueError(f"it holds {len(entries)} entries, more than a volume has")
        if sum(entry.compress_size for entry in entries) > self._length:
            raise ValueError("its entries are longer than the file")
        headers = {}
        for entry in entries:
            name = entry.filename.removesuffix(".npy")
            if name in headers:
                raise ValueError(f"it holds {name!r} twice")
            if entry.compress_type != zipfile.ZIP_STORED or entry.file_size != entry.compress_size:
                raise ValueError(f"its entry {name!r} is compressed; volumes are stored plainly")
            if entry.flag_bits & 1:
                raise ValueError(f"its entry {name!r} is encrypted")
            headers[name] = self._array_header(entry, name)
        return headers

    def _array_header(self, entry: zipfile.ZipInfo, name: str) -> ArrayHeader:
        with self._zip.open(entry) as file:
            start = file.read(10)
            if len(start) < 10 or start[:8] != _NPY + b"\x01\x00":
                raise ValueError(f"its entry {name!r} is not an array")
            length = int.from_bytes(start[8:], "little")
            text = file.read(min(length, _LONGEST_HEADER))
        match = _HEADER.fullmatch(text)
        if match is None or len(text) != length:
            raise ValueError(f"the array {name!r} has a header that volumes do not have")
        kind, size = match[2].decode(), int(match[3])
        if size not in _KINDS.get(kind, ()):
            raise ValueError(f"the array {name!r} has type {kind}{size}")
        shape = tuple(int(word) for word in match[4].split(b",") if word.strip())
        header = ArrayHeader(np.dtype(f"<{kind}{size}"), shape, 10 + length)
        if header.offset + header.n_bytes != entry.file_size:
            raise ValueError(
                f"the array {name!r} has shape {shape}, which takes {header.n_bytes} bytes, "
                f"but its entry holds {entry.file_size - header.offset}"
            )
        return header


def write_archive(path: Path, arrays: dict[str, np.ndarray]) -> None:
    """Write the arrays in the order given; the same arrays give the same bytes."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED, allowZip64=True) as archive:
        for name, array in arrays.items():
            # Neither the clock nor the operating system may leave a trace.
            info = zipfile.ZipInfo(f"{name}.npy", EPOCH)
            info.create_system, info.external_attr = 3, 0o644 << 16
            array = np.asarray(array, array.dtype.newbyteorder("<"), order="C")
            info.file_size = array.nbytes + _LONGEST_HEADER
            with archive.open(info, "w") as entry:
                np.lib.format.write_array_header_1_0(
                    entry, np.lib.format.header_data_from_array_1_0(array)
                )
                flat = array.reshape(-1).view(np.uint8) if array.size else b""
                for at in range(0, len(flat), _CHUNK):
                    entry.write(memoryview(flat[at : at + _CHUNK]))
