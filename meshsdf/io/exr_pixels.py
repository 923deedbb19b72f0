"""The pixels of an OpenEXR file, unpacked here: nothing that a damaged file holds reaches a library
that might trust it.

A ZIP chunk is a zlib stream of bytes d with d[i] = t[i] - t[i - 1] + 128 (mod 256), where t holds
first the even bytes of the lines, then the odd ones. An RLE chunk has the same bytes d in runs: a
signed byte n, then -n bytes if it is negative, else one byte for n + 1. A chunk that would not
shrink is stored as it is. What is packed otherwise goes to `exr_process`. (OpenEXR file layout,
openexr.com/en/latest/OpenEXRFileLayout.html.)
"""

import threading
import zlib

import numpy as np

from ..kernels.parallel import even_ranges, run_pieces
from .exr_header import Part
from .exr_process import unpacked_apart
from .vdb_stream import VdbReader

UNPACKED_HERE = ("NONE", "RLE", "ZIPS", "ZIP")

_BYTES_AT_ONCE = 1 << 22


def read_images(reader: VdbReader, parts: list[Part], is_multi: bool) -> list[np.ndarray]:
    """Return the pixels of every part; the reader stands at the tables of places.

    Raises
    ------
    ValueError
        A chunk is missing, is damaged, or lies outside the file.
    """
    tables = [np.frombuffer(reader.take(8 * part.n_chunks), "<u8") for part in parts]
    if any(part.compression not in UNPACKED_HERE for part in parts):
        return unpacked_apart(parts, _packed_chunks(reader, parts, tables, is_multi))
    images = [np.empty(part.shape, part.dtype) for part in parts]
    chunks = [(p, c) for p, part in enumerate(parts) for c in range(part.n_chunks)]
    lock = threading.Lock()

    def read(piece: int) -> None:
        for number, chunk in chunks[slice(*ranges[piece])]:
            part = parts[number]
            lines = images[number][chunk * part.lines : (chunk + 1) * part.lines]
            with lock:
                reader.seek(int(tables[number][chunk]))
                line, of_part = chunk * part.lines, number if is_multi else None
                data = _chunk(reader, line, of_part, lines.nbytes)
            lines[:] = np.frombuffer(_unpacked(data, lines, part), part.dtype).reshape(lines.shape)

    n_bytes = sum(part.n_bytes for part in parts)
    ranges = even_ranges(len(chunks), -(-n_bytes // _BYTES_AT_ONCE))
    run_pieces(read, len(ranges))
    return images


def _packed_chunks(
    reader: VdbReader, parts: list[Part], tables: list[np.ndarray], is_multi: bool
) -> list[list[bytes]]:
    """The packed bytes of every chunk of every part."""
    found, left = [], reader.size
    for number, (part, table) in enumerate(zip(parts, tables, strict=True)):
        chunks = []
        for chunk, at in enumerate(table.tolist()):
            reader.seek(at)
            n_lines = min(part.lines, part.shape[0] - chunk * part.lines)
            n_bytes = n_lines * part.shape[1] * part.dtype.itemsize
            line, of_part = chunk * part.lines, number if is_multi else None
            chunks.append(_chunk(reader, line, of_part, n_bytes))
            left -= len(chunks[-1])
            if left < 0:
                raise ValueError("its chunks overlap")
        found.append(chunks)
    return found


def _chunk(reader: VdbReader, line: int, part: int | None, n_bytes: int) -> bytes:
    """The packed bytes of the chunk at the cursor, which begins with the given line and part."""
    if part is not None and (told := reader.number("i")) != part:
        raise ValueError(f"a chunk at byte {reader.at - 4} is of part {told}, not {part}")
    told, size = reader.numbers("ii")
    if told != line:
        raise ValueError(f"a chunk at byte {reader.at - 8} begins with line {told}, not {line}")
    if not 0 < size <= n_bytes:
        raise ValueError(f"a chunk of {n_bytes} bytes claims to take {size}")
    return reader.take(size)


def _unpacked(data: bytes, lines: np.ndarray, part: Part) -> bytes | np.ndarray:
    if len(data) == lines.nbytes:
        return data
    if part.compression == "NONE":
        raise ValueError(f"a chunk takes {len(data)} bytes, not {lines.nbytes}")
    unpack = _runs if part.compression == "RLE" else _inflated
    found = unpack(data, lines.nbytes)
    if len(found) != lines.nbytes:
        raise ValueError(f"a chunk does not give the {lines.nbytes} bytes of its lines")
    sums = np.cumsum(np.frombuffer(found, np.uint8), dtype=np.uint8)
    sums[1::2] ^= 128  # each step adds 128 too much, and two of them nothing
    out = np.empty_like(sums)
    half = (len(sums) + 1) // 2
    out[0::2], out[1::2] = sums[:half], sums[half:]
    return out


def _inflated(data: bytes, n_bytes: int) -> bytes:
    """What a zlib stream gives; empty if it does not end where the bytes do."""
    stream = zlib.decompressobj()
    try:
        # One byte more, so that a stream which does not stop there is seen
        found = stream.decompress(data, n_bytes + 1)
    except zlib.error as error:
        raise ValueError(f"a chunk is damaged ({error})") from None
    return found if stream.eof and not stream.unused_data else b""


def _runs(data: bytes, n_bytes: int) -> bytes:
    """What runs give: more than is wanted, or less, if they are damaged."""
    found, at = bytearray(), 0
    while at < len(data) and len(found) <= n_bytes:
        n = data[at]
        if n > 127:
            end = at + 1 + 256 - n
            found += data[at + 1 : end]
            # A run that is cut off is a fault, too
            at = end if end <= len(data) else len(data) + 1
        else:
            found += data[at + 1 : at + 2] * (n + 1)
            at += 2
    return bytes(found) if at == len(data) else b""
