"""Packed values, unpacked piece by piece, so that a small file cannot take a large memory.

Deflate packs at most 1032 to 1, bzip2 far more; what is refused, and stated, is a claim of more
than `LARGEST_RATIO` times the bytes there are, beyond `LEAST_UNPACKED`.
"""

import zlib
from typing import BinaryIO

LARGEST_RATIO = 1000
"""Values may take this many times the bytes that they are packed in."""

LEAST_UNPACKED = 1 << 26
"""Values of this many bytes are always allowed."""

_ANY_FRAME = 47  # zlib's number for: a frame of zlib or of gzip, whichever is found
_MOST_MEMBERS = 4096
_CHUNK = 1 << 16


def check_claim(n_bytes: int, n_there: int, *, is_packed: bool) -> None:
    """ValueError if values cannot take so many bytes in a file that has so many left."""
    if not is_packed:
        if n_bytes > n_there:
            raise ValueError(f"its values take {n_bytes} bytes, but {max(n_there, 0)} are there")
        return
    limit = max(LEAST_UNPACKED, LARGEST_RATIO * n_there)
    if n_bytes > limit:
        raise ValueError(
            f"its values take {n_bytes:.3g} bytes; {limit:.3g} are allowed for {n_there} packed"
        )


class Inflater:
    """A stream of deflate in frames of zlib or gzip; ValueError or zlib.error if it is damaged."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self._packed = b""
        self._n_members = 0
        self._engine = zlib.decompressobj(_ANY_FRAME)

    def read(self, n: int) -> bytes:
        """Return the next ``n`` bytes, or what there is before the end."""
        pieces, left = [], n
        while left:
            if self._engine.eof and not self._next_member():
                break
            pieces.append(self._piece(left))
            left -= len(pieces[-1])
        return b"".join(pieces)

    def finish(self) -> None:
        """Read on to the end, where the checksum stands; ValueError if there are more values."""
        while not self._engine.eof:
            if self._piece(1):
                raise ValueError("it holds more values than it says")

    def _piece(self, most: int) -> bytes:
        packed = self._packed or self._file.read(_CHUNK)
        piece = self._engine.decompress(packed, most)
        self._packed = self._engine.unconsumed_tail
        if not (packed or piece or self._engine.eof):
            raise ValueError("it is cut off within its packed values")
        return piece

    def _next_member(self) -> bool:
        """Some programs pack in several frames, one after the other."""
        packed = self._engine.unused_data or self._file.read(_CHUNK)
        if not packed:
            return False
        self._n_members += 1
        if self._n_members > _MOST_MEMBERS:
            raise ValueError(f"it is packed in more than {_MOST_MEMBERS} frames")
        self._packed, self._engine = packed, zlib.decompressobj(_ANY_FRAME)
        return True
