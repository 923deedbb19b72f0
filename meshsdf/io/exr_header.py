"""The headers of an OpenEXR file, read with no trust in them: what images it holds, and where.

A file is: magic number; version and flags; for every part a list of attributes (name, type, size,
bytes) that ends with an empty name, and an empty list if it is a multi-part file; for every part a
table with the place of each chunk; the chunks. A chunk holds 1 to 256 lines.
(OpenEXR file layout, openexr.com/en/latest/OpenEXRFileLayout.html.)
"""

from dataclasses import dataclass

import numpy as np

from .vdb_stream import UnsuitedError, VdbReader, printable

MAGIC = bytes.fromhex("762f3101")

TILED, LONG_NAMES, DEEP, MULTIPART = 0x200, 0x400, 0x800, 0x1000
"""Flags beside the version number, which is 2."""

COMPRESSIONS = ("NONE", "RLE", "ZIPS", "ZIP", "PIZ", "PXR24", "B44", "B44A", "DWAA", "DWAB")
LINES_OF_CHUNK = {
    "NONE": 1,
    "RLE": 1,
    "ZIPS": 1,
    "ZIP": 16,
    "PIZ": 32,
    "PXR24": 16,
    "B44": 32,
    "B44A": 32,
    "DWAA": 32,
    "DWAB": 256,
}
"""Those that are read, with the lines of a chunk."""

PIXEL_TYPES = {1: np.dtype("<f2"), 2: np.dtype("<f4")}

MOST_PARTS = 1 << 16
DEFLATE_RATIO = 1032
"""No deflate stream grows by more (258 bytes of output for 2 bits)."""

_LONGEST_HEAD = 2 * 256 + 4  # of an attribute: two names of up to 255 letters, and a size


@dataclass(frozen=True)
class Part:
    """One image of the file.

    Attributes
    ----------
    texts : dict
        The attributes that are texts, by name.
    shape : tuple of 2 int
        Lines, and pixels of a line.
    dtype : dtype
        Of a pixel.
    compression : str
        A key of `LINES_OF_CHUNK`.
    channels : bytes
        The list of channels as it stands there, with the one that is known.
    """

    texts: dict[str, str]
    shape: tuple[int, int]
    dtype: np.dtype
    compression: str
    channels: bytes

    @property
    def lines(self) -> int:
        """Lines of a chunk; the last one may have fewer."""
        return LINES_OF_CHUNK[self.compression]

    @property
    def n_chunks(self) -> int:
        """Number of chunks."""
        return -(-self.shape[0] // self.lines)

    @property
    def n_bytes(self) -> int:
        """Bytes of all pixels."""
        return self.shape[0] * self.shape[1] * self.dtype.itemsize


def read_parts(reader: VdbReader, required: str) -> tuple[list[Part], bool]:
    """Return the parts, and whether chunks begin with the number of theirs; the tables follow.

    Parameters
    ----------
    reader : VdbReader
        At the beginning of the file.
    required : str
        Name of a text attribute that the first part must have.

    Raises
    ------
    ValueError
        The bytes are no such file, or are damaged.
    UnsuitedError
        It is another picture: without the attribute, tiled, deep, of other channels or packing.
    """
    if reader.take(4) != MAGIC:
        raise ValueError("it does not begin as an .exr file does")
    version = reader.number("I")
    if version & 0xFF != 2 or version & ~0xFF & ~(TILED | LONG_NAMES | DEEP | MULTIPART):
        raise ValueError(f"its version and flags are {version:#x}")
    is_multi = bool(version & MULTIPART)
    first = _attributes(reader)
    if first.get(required, ("", b""))[0] != "string":
        raise UnsuitedError(
            "this is a picture, not a volume: its header has no meshsdf attributes",
            "make a volume with: meshsdf convert MESH OUT.exr",
        )
    if version & (TILED | DEEP):
        raise UnsuitedError("it is tiled or deep", "save it as scan lines")
    parts = [_part(first)]
    while is_multi and (attributes := _attributes(reader)):
        parts.append(_part(attributes))
        if len(parts) > MOST_PARTS:
            raise ValueError(f"it has more than {MOST_PARTS} parts")
    n_bytes = sum(part.n_bytes for part in parts)
    if n_bytes > DEFLATE_RATIO * reader.size:
        raise ValueError(f"its pixels take {n_bytes} bytes, more than {reader.size} can hold")
    reader.expect(8 * sum(part.n_chunks for part in parts), "the places of its chunks")
    return parts, is_multi


def _attributes(reader: VdbReader) -> dict[str, tuple[str, bytes]]:
    """Type and bytes of every attribute of the next header, by name."""
    found = {}
    while True:
        name, end, rest = reader.window(_LONGEST_HEAD).partition(b"\0")
        if end and not name:
            reader.take(1)
            return found
        kind, second_end, rest = rest.partition(b"\0")
        if not (end and second_end and len(rest) >= 4):
            raise ValueError(f"an attribute at byte {reader.at} is cut off, or its name has no end")
        shown, size = _text(name), int.from_bytes(rest[:4], "little", signed=True)
        if size < 0:
            raise ValueError(f"its attribute {printable(shown)} takes {size} bytes")
        if shown in found:
            raise ValueError(f"it has the attribute {printable(shown)} twice")
        reader.take(len(name) + len(kind) + 6)
        found[shown] = (_text(kind), reader.take(size))


def _text(data: bytes) -> str:
    return data.decode("utf-8", "backslashreplace")


def _part(attributes: dict[str, tuple[str, bytes]]) -> Part:
    texts = {name: _text(data) for name, (kind, data) in attributes.items() if kind == "string"}
    if texts.get("type", "scanlineimage") != "scanlineimage":
        raise UnsuitedError("it is tiled or deep", "save it as scan lines")
    number = _value(attributes, "compression", "compression", 1)[0]
    name = COMPRESSIONS[number] if number < len(COMPRESSIONS) else f"method {number}"
    if name not in LINES_OF_CHUNK:
        raise UnsuitedError(f"its pixels are packed with {name}", "save it with ZIP compression")
    window = np.frombuffer(_value(attributes, "dataWindow", "box2i", 16), "<i4").astype(np.int64)
    width, height = (window[2:] - window[:2] + 1).tolist()
    if window[:2].any() or width < 1 or height < 1:
        raise ValueError(f"its data window is {window.tolist()}")
    dtype = _pixel_type(attributes)
    part = Part(texts, (height, width), dtype, name, attributes["channels"][1])
    if "chunkCount" in attributes:
        told = int.from_bytes(_value(attributes, "chunkCount", "int", 4), "little", signed=True)
        if told != part.n_chunks:
            raise ValueError(f"it claims {told} chunks, not {part.n_chunks}")
    return part


def _pixel_type(attributes: dict[str, tuple[str, bytes]]) -> np.dtype:
    """That of the one channel, Y."""
    data = _value(attributes, "channels", "chlist")
    name, _, rest = data.partition(b"\0")
    number = int.from_bytes(rest[:4], "little")
    is_right = name == b"Y" and len(rest) == 17 and number in PIXEL_TYPES
    if not is_right or rest[8:] != b"\1\0\0\0\1\0\0\0\0":  # one sample per pixel, and no more
        raise ValueError("its channels are not the one, Y, that a volume has")
    return PIXEL_TYPES[number]


def _value(
    attributes: dict[str, tuple[str, bytes]], name: str, kind: str, size: int | None = None
) -> bytes:
    found, data = attributes.get(name, ("", b""))
    if found != kind or size not in (None, len(data)):
        raise ValueError(f"its header has no sound {name}")
    return data
