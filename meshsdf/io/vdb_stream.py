"""Numbers and texts of a ``.vdb`` file, in and out, none believed before it is checked.

Everything is little-endian and packed. A text is its length (uint32) and that many bytes of UTF-8.
"""

import hashlib
import struct
import uuid
import zlib
from typing import BinaryIO

import numpy as np
from jaxtyping import UInt8

from ..arrays import Number

ByteArray = UInt8[np.ndarray, "_"]
"""Bytes as kernels take them."""

LONGEST_TEXT = 1 << 16
"""Bytes; names and types are short, and a longer one means that the file is damaged."""

LONGEST_SHOWN = 80

UUID_AT = 21
"""Where a file's 36 letters of uuid stand: after magic number, versions and the offsets flag."""


def printable(text: str) -> str:
    """A text from a file as it may be shown: short, and nothing that a terminal obeys."""
    shown = "".join(c if c.isprintable() else f"\\x{ord(c):02x}" for c in text[:LONGEST_SHOWN])
    return shown + ("..." if len(text) > LONGEST_SHOWN else "")


class UnsuitedError(ValueError):
    """A sound file holds what cannot be read, or read so; ``fix`` says what can be done."""

    def __init__(self, what: str, fix: str) -> None:
        super().__init__(what)
        self.fix = fix


class VdbReader:
    """A cursor in a file of known size. ValueError says what is wrong with the bytes."""

    def __init__(self, file: BinaryIO, size: int) -> None:
        self._file = file
        self.size = size
        self.at = 0

    @property
    def left(self) -> int:
        """Bytes between the cursor and the end of the file."""
        return self.size - self.at

    def seek(self, at: int) -> None:
        """Move the cursor; the place must lie in the file."""
        if not 0 <= at <= self.size:
            raise ValueError(f"it points to byte {at}, but has {self.size}")
        self.at = at

    def part(self, at: int, end: int) -> "VdbReader":
        """A reader of the file from one place to another, for which the file ends there."""
        reader = VdbReader(self._file, end)
        reader.seek(at)
        return reader

    def expect(self, n: int, what: str) -> None:
        """Refuse a claim of ``n`` more bytes that the file does not have."""
        if n > self.left:
            raise ValueError(f"{what} take {n} bytes, but {self.left} are left after {self.at}")

    def window(self, n: int) -> bytes:
        """Return the next ``n`` bytes, or as many as there are; the cursor stays."""
        self._file.seek(self.at)
        return self._file.read(min(n, self.left))

    def fill(self, buffer: ByteArray) -> ByteArray:
        """Fill a buffer as `window` would; return the part that is filled."""
        view = memoryview(buffer)[: min(len(buffer), self.left)]
        self._file.seek(self.at)
        done = 0
        while done < len(view) and (n := self._file.readinto(view[done:])):
            done += n
        return buffer[:done]

    def take(self, n: int) -> bytes:
        """Return the next ``n`` bytes and pass them."""
        # Asked for no more than there is, so that no claim takes memory
        if n > self.size - self.at:
            raise ValueError(f"it is cut off: {n} bytes are missing after byte {self.at}")
        self._file.seek(self.at)
        data = self._file.read(n)
        if len(data) != n:
            raise ValueError(f"it is cut off at byte {self.at + len(data)}")
        self.at += n
        return data

    def numbers(self, layout: str) -> tuple:
        """Return the next numbers, which ``layout`` describes in the letters of `struct`."""
        return struct.unpack(f"<{layout}", self.take(struct.calcsize(f"<{layout}")))

    def number(self, letter: str):
        """Return the next number."""
        return struct.unpack(f"<{letter}", self.take(struct.calcsize(f"<{letter}")))[0]

    def text(self) -> str:
        """Return the next text; bytes that are no UTF-8 are shown, not refused."""
        length = int.from_bytes(self.take(4), "little")
        if length > LONGEST_TEXT:
            raise ValueError(f"a text at byte {self.at - 4} claims {length} bytes")
        return self.take(length).decode("utf-8", "backslashreplace")


class VdbWriter:
    """An output file that counts and digests what is written."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self._digest = hashlib.sha1()
        self.at = 0

    def write(self, data: bytes | memoryview) -> None:
        """Append bytes."""
        # A checksum per piece, digested, sees any change and costs a third of digesting it all.
        self._digest.update(struct.pack("<IQ", zlib.crc32(data), len(data)))
        self._file.write(data)
        self.at += len(data)

    def numbers(self, layout: str, *values: Number) -> None:
        """Append numbers, which ``layout`` describes in the letters of `struct`."""
        self.write(struct.pack(f"<{layout}", *values))

    def text(self, text: str) -> None:
        """Append a text."""
        self.write(encoded_text(text))

    def replace(self, at: int, data: bytes) -> None:
        """Replace bytes written before; what they held was unknown then."""
        self._file.seek(at)
        self._file.write(data)
        self._file.seek(self.at)

    def sign(self) -> None:
        """Give the file a uuid that follows from its content, so equal files are equal."""
        name = uuid.UUID(bytes=self._digest.digest()[:16], version=5)
        self.replace(UUID_AT, str(name).encode())


def encoded_text(text: str) -> bytes:
    """The bytes of a text."""
    data = text.encode("utf-8", "replace")
    return struct.pack("<I", len(data)) + data
