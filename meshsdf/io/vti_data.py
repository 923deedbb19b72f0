"""The values of an array of a ``.vti`` file: raw, base64 or text, packed in blocks or not.

Data begin with how long they are, in the file's header type: their bytes; or, packed, the number
of blocks, the bytes of a block before packing, those of the last block if it is shorter (else 0),
and the packed bytes of each. In base64, header and blocks may be encoded apart or together.
"""

import binascii
import io
import os
import re
import zlib
from typing import BinaryIO

import numpy as np

from .dense_header import DenseHeader, counts_of
from .text_rows import numbers
from .unpacking import check_claim
from .vdb_stream import UnsuitedError, printable
from .vti_head import ITEM_TYPES, VtiArray, VtiHead
from .x_fastest import Read, file_planes, from_flat, read_values

ZLIB_NAME = "vtkZLibDataCompressor"

_BLOCK = 1 << 20
_LEVEL = 4
_MOST_FACTS = 64
_LONGEST_FACT = 256
_CHARACTERS = 1 << 18  # of base64 at once; four are three bytes
_PADDED = re.compile(rb"[A-Za-z0-9+/]+=*")


def array_values(file: BinaryIO, head: VtiHead, array: VtiArray, grid: DenseHeader) -> np.ndarray:
    """Return the values [i, j, k] of an array; ValueError if they are not those of the grid."""
    if array.format == "ascii":
        text = "".join(array.texts).encode()
        # A number takes a digit and a blank at least
        check_claim(2 * grid.n_nodes - 1, len(text) + 1, is_packed=False)
        return from_flat(numbers(text, grid.n_nodes, "line"), grid.shape, grid.stored)
    read = _reader(file, head, array, grid.n_bytes)
    return read_values(read, grid.shape, grid.stored)


def fact(file: BinaryIO, head: VtiHead, array: VtiArray) -> str:
    """Return a word or number of the field data as text."""
    (n,) = counts_of(array.attributes.get("NumberOfTuples", "1"), 1, "NumberOfTuples")
    kind = array.attributes.get("type", "")
    if array.format == "ascii":
        words = "".join(array.texts).split()[:_LONGEST_FACT]
        if kind == "String":
            codes = counts_of(" ".join(words), len(words), "a text")
            return "".join(chr(code) for code in codes if 0 < code < 127)
        return words[0] if words else ""
    if not 0 < n <= _MOST_FACTS:
        raise ValueError(f"its {printable(array.name)} has {n} entries")
    if kind == "String":
        # How long it is stands only in the data, which end with a zero byte
        return _text(file, head, array)
    stored = _item_type(head, array)
    data = _reader(file, head, array, stored.itemsize * n)(stored.itemsize)
    return str(np.frombuffer(data, stored)[0].item()) if len(data) == stored.itemsize else ""


def write_blocks(file: BinaryIO, values: np.ndarray, stored: np.dtype) -> None:
    """Append values, x fastest, packed in blocks, with their header of UInt64."""
    n_bytes = values.size * stored.itemsize
    n_blocks = -(-n_bytes // _BLOCK)
    first = file.tell()
    sizes = np.zeros(3 + n_blocks, "<u8")
    sizes[:3] = n_blocks, _BLOCK, n_bytes % _BLOCK
    file.write(sizes.data)
    rest, number = b"", 3
    for planes in file_planes(values, stored):
        data = rest + planes.tobytes()
        whole = len(data) - len(data) % _BLOCK
        for at in range(0, whole, _BLOCK):
            sizes[number] = file.write(zlib.compress(data[at : at + _BLOCK], _LEVEL))
            number += 1
        rest = data[whole:]
    if rest:
        sizes[number] = file.write(zlib.compress(rest, _LEVEL))
    last = file.tell()
    file.seek(first)
    file.write(sizes.data)
    file.seek(last)


def _item_type(head: VtiHead, array: VtiArray) -> np.dtype:
    code = ITEM_TYPES.get(array.attributes.get("type", ""))
    if code is None:
        kind = printable(array.attributes.get("type", ""))
        raise ValueError(f"its array '{printable(array.name)}' holds values of type '{kind}'")
    return np.dtype(head.byte_order + code)


def _reader(file: BinaryIO, head: VtiHead, array: VtiArray, n_bytes: int) -> Read:
    """What reads the bytes of an array, of which there must be so many."""
    read, there = _stream(file, head, array)
    number = _header_type(head)
    compressor = head.file.get("compressor", "")
    if not compressor:
        check_claim(n_bytes, there, is_packed=False)
        (told,) = _numbers(read, number, 1)
        if told != n_bytes:
            raise ValueError(f"its values take {told} bytes, but its extent tells {n_bytes}")
        return read
    if compressor != ZLIB_NAME:
        what = f"its values are packed by {printable(compressor)}"
        raise UnsuitedError(what, f"write it with {ZLIB_NAME}, or not packed")
    check_claim(n_bytes, there, is_packed=True)
    n_blocks, size, last = _numbers(read, number, 3)
    # A block takes 8 bytes at the least, besides its entry here
    check_claim(n_blocks * (number.itemsize + 8), there, is_packed=False)
    sizes = _numbers(read, number, n_blocks)
    lengths = [size] * n_blocks
    if n_blocks and last:
        lengths[-1] = last
    if sum(lengths) != n_bytes or sum(sizes) > there:
        raise ValueError(
            f"its {n_blocks} blocks give {sum(lengths)} bytes, but its extent tells {n_bytes}"
        )
    return _Blocks(read, lengths, sizes).read


def _header_type(head: VtiHead) -> np.dtype:
    kind = head.file.get("header_type", "UInt32")
    if kind not in ("UInt32", "UInt64"):
        raise ValueError(f"its header_type is '{printable(kind)}'")
    return np.dtype(head.byte_order + ITEM_TYPES[kind])


def _stream(file: BinaryIO, head: VtiHead, array: VtiArray) -> tuple[Read, int]:
    """What reads the data of an array, header first, and how many bytes there are at most."""
    if array.format == "binary":
        text = "".join(array.texts).strip().encode("ascii", "replace")
        return _Base64(io.BytesIO(text).read).read, len(text)
    if array.format != "appended" or head.appended_at < 0:
        what = f"its array '{printable(array.name)}' is '{printable(array.format)}'"
        raise ValueError(f"{what}, but there are no such data")
    (offset,) = counts_of(array.attributes.get("offset", "0"), 1, "an offset")
    size = os.fstat(file.fileno()).st_size
    start = head.appended_at + offset
    if not head.appended_at <= start <= size:
        raise ValueError(f"its array '{printable(array.name)}' begins beyond the end")
    file.seek(start)
    if head.appended_as == "raw":
        return file.read, size - start
    return _Base64(file.read).read, size - start


def _numbers(read: Read, kind: np.dtype, count: int) -> list[int]:
    data = read(count * kind.itemsize)
    if len(data) != count * kind.itemsize:
        raise ValueError("it is cut off before its values")
    return np.frombuffer(data, kind).tolist()


def _text(file: BinaryIO, head: VtiHead, array: VtiArray) -> str:
    read, there = _stream(file, head, array)
    number = _header_type(head)
    if head.file.get("compressor", ""):
        n_blocks, _, _ = _numbers(read, number, 3)
        check_claim(n_blocks * number.itemsize, there, is_packed=False)
        sizes = _numbers(read, number, n_blocks)
        packed = read(min(sizes[0] if sizes else 0, there))
        data = zlib.decompressobj().decompress(packed, _LONGEST_FACT)
    else:
        data = read(min(_numbers(read, number, 1)[0], _LONGEST_FACT))
    return data.split(b"\0")[0].decode("ascii", "replace")


class _Blocks:
    """Packed blocks, read as if they were not."""

    def __init__(self, read: Read, lengths: list[int], sizes: list[int]) -> None:
        self._read = read
        self._blocks = iter(zip(lengths, sizes, strict=True))
        self._rest = b""

    def read(self, n: int) -> bytes:
        """Return the next ``n`` bytes, or what there is before the end."""
        pieces, left = [], n
        while left:
            if not self._rest:
                block = next(self._blocks, None)
                if block is None:
                    break
                self._rest = self._unpacked(*block)
            pieces.append(self._rest[:left])
            self._rest = self._rest[left:]
            left -= len(pieces[-1])
        return b"".join(pieces)

    def _unpacked(self, length: int, size: int) -> bytes:
        packed = self._read(size)
        engine = zlib.decompressobj()
        data = engine.decompress(packed, length + 1)
        if len(packed) != size or len(data) != length or not engine.eof:
            raise ValueError(f"a packed block of {size} bytes does not give its {length}")
        return data


class _Base64:
    """Base64, read as the bytes it stands for; it ends at the first letter of something else."""

    def __init__(self, read: Read) -> None:
        self._read = read
        self._bytes = bytearray()

    def read(self, n: int) -> bytes:
        """Return the next ``n`` bytes, or what there is before the end."""
        while len(self._bytes) < n and self._more():
            pass
        data = bytes(self._bytes[:n])
        del self._bytes[:n]
        return data

    def _more(self) -> bool:
        text = self._read(_CHARACTERS)
        at, is_whole = 0, bool(text)
        # Parts that were encoded apart end with "=", and each is whole groups of four
        while match := _PADDED.match(text, at):
            at = match.end()
            part = match[0]
            self._bytes += binascii.a2b_base64(part[: len(part) - len(part) % 4])
        return is_whole and at == len(text)
