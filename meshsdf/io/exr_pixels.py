"""The pixels of an OpenEXR file, unpacked here: nothing that a damaged file holds reaches a library
that might trust it.

A ZIP chunk is a zlib stream of bytes d with d[i] = t[i] - t[i - 1] + 128 (mod 256), where t holds
first the even bytes of the lines, then the odd ones. A chunk that would not shrink is stored as it
is. (OpenEXR file layout, openexr.com/en/latest/OpenEXRFileLayout.html.)
"""

import threading
import zlib

import numpy as np

from ..kernels.parallel import even_ranges, run_pieces
from .exr_header import Part
from .vdb_stream import VdbReader

_BYTES_AT_ONCE = 1 << 22


def read_images(reader: VdbReader, parts: list[Part], is_multi: bool) -> list[np.ndarray]:
    """Return the pixels of every part; the reader stands at the tables of places.

    Raises
    ------
    ValueError
        A chunk is missing, is damaged, or lies outside the file.
    """
    tables = [np.frombuffer(reader.take(8 * part.n_chunks), "<u8") for part in parts]
    images = [np.empty(part.shape, part.dtype) for part in parts]
    chunks = [(p, c) for p, part in enumerate(parts) for c in range(part.n_chunks)]
    lock = threading.Lock()

    def read(piece: int) -> None:
        for number, chunk in chunks[slice(*ranges[piece])]:
            part = parts[number]
            lines = images[number][chunk * part.lines : (chunk + 1) * part.lines]
            with lock:
                reader.seek(int(tables[number][chunk]))
                data = _chunk(reader, chunk * part.lines, number if is_multi else None, lines)
            lines[:] = np.frombuffer(_unpacked(data, lines, part), part.dtype).reshape(lines.shape)

    n_bytes = sum(part.n_bytes for part in parts)
    ranges = even_ranges(len(chunks), -(-n_bytes // _BYTES_AT_ONCE))
    run_pieces(read, len(ranges))
    return images


def _chunk(reader: VdbReader, line: int, part: int | None, lines: np.ndarray) -> bytes:
    """The packed bytes of the chunk at the cursor, which begins with the given line and part."""
    if part is not None and (told := reader.number("i")) != part:
        raise ValueError(f"a chunk at byte {reader.at - 4} is of part {told}, not {part}")
    told, size = reader.numbers("ii")
    if told != line:
        raise ValueError(f"a chunk at byte {reader.at - 8} begins with line {told}, not {line}")
    if not 0 < size <= lines.nbytes:
        raise ValueError(f"a chunk of {lines.nbytes} bytes claims to take {size}")
    return reader.take(size)


def _unpacked(data: bytes, lines: np.ndarray, part: Part) -> bytes | np.ndarray:
    if len(data) == lines.nbytes:
        return data
    if part.compression == "NONE":
        raise ValueError(f"a chunk takes {len(data)} bytes, not {lines.nbytes}")
    stream = zlib.decompressobj()
    try:
        # One byte more, so that a stream which does not stop there is seen
        found = stream.decompress(data, lines.nbytes + 1)
    except zlib.error as error:
        raise ValueError(f"a chunk is damaged ({error})") from None
    if len(found) != lines.nbytes or not stream.eof or stream.unused_data:
        raise ValueError(f"a chunk does not give the {lines.nbytes} bytes of its lines")
    sums = np.cumsum(np.frombuffer(found, np.uint8), dtype=np.uint8)
    sums[1::2] ^= 128  # each step adds 128 too much, and two of them nothing
    out = np.empty_like(sums)
    half = (len(sums) + 1) // 2
    out[0::2], out[1::2] = sums[:half], sums[half:]
    return out
