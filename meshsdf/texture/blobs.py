"""Bytes for a database: compressed where that helps, with a checksum."""

import zlib
from collections.abc import Iterable, Iterator

from ..kernels.parallel import run_pieces

RAW, ZLIB = 0, 1
Blob = tuple[int, int, bytes]
"""Codec, CRC-32 of the bytes as stored, and these."""


class Damaged(Exception):
    """Something in a file is not what was written; says what."""


def pack(data: bytes) -> Blob:
    """Compress bytes if they get shorter by a tenth or more."""
    smaller = zlib.compress(data, 1)
    if len(smaller) > 0.9 * len(data):
        return RAW, zlib.crc32(data), bytes(data)
    return ZLIB, zlib.crc32(smaller), smaller


def unpack(blob: Blob, what: str) -> bytes:
    """The bytes again; `Damaged` if they are not those."""
    codec, crc, data = blob
    if not isinstance(data, bytes) or zlib.crc32(data) != crc or codec not in (RAW, ZLIB):
        raise Damaged(f"{what} has a wrong checksum")
    try:
        return zlib.decompress(data) if codec == ZLIB else data
    except zlib.error:
        raise Damaged(f"{what} cannot be unpacked") from None


def pack_all(keyed: Iterable[tuple], *, at_once: int = 512, alone: bool = False) -> Iterator[tuple]:
    """``(key, data)`` to ``(key, Blob)``, in order; on all cores but if ``alone``."""
    waiting: list[tuple] = []
    for one in keyed:
        waiting.append(one)
        if len(waiting) == at_once:
            yield from _packed(waiting, 1 if alone else 8)
            waiting = []
    yield from _packed(waiting, 1 if alone else 8)


def _packed(items: list[tuple], most: int) -> list[tuple]:
    out: list = [None] * len(items)
    n_pieces = min(most, len(items))

    def work(piece: int) -> None:
        for i in range(piece, len(items), n_pieces):
            out[i] = (items[i][0], pack(items[i][1]))

    run_pieces(work, n_pieces)
    return out
