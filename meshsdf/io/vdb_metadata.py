"""The named values that a ``.vdb`` file and each of its grids carry.

A map is its length (uint32), then for each entry: name (text), type (text), the value's size in
bytes (uint32), the value. An entry of a type not listed here is kept as bytes; types whose names
begin with two underscores are OpenVDB's own notes of how it reads, and passed over (Museth 2013,
doi:10.1145/2487228.2487235; layout as OpenVDB 10 writes it).
"""

import struct
from dataclasses import dataclass

import numpy as np

from .vdb_stream import VdbReader, VdbWriter, encoded_text, printable


@dataclass(frozen=True)
class Bytes:
    """A value of a type that is not known here."""

    kind: str
    data: bytes


Metadata = dict[str, bool | int | float | str | tuple | Bytes]
"""Values by name; a tuple holds 2 to 4 ints or floats."""


class Int32(int):
    """An int that a file holds with 32 bits, so that it goes out as it came in."""

    kind = "int32"


class Single(float):
    """A float that a file holds with 32 bits."""

    kind = "float"


class Singles(tuple):
    """Floats that a file holds with 32 bits each."""

    @property
    def kind(self) -> str:
        """The format's name for as many."""
        return f"vec{len(self)}s"


_NARROW = {"int32": Int32, "float": Single, **dict.fromkeys(("vec2s", "vec3s", "vec4s"), Singles)}
_OWN_NOTES = "__"

_LETTERS = {
    "bool": "?",
    "int32": "i",
    "int64": "q",
    "float": "f",
    "double": "d",
    **{
        f"vec{n}{kind}": f"{n}{letter}"
        for n in (2, 3, 4)
        for kind, letter in {"i": "i", "s": "f", "d": "d"}.items()
    },
}
_SMALLEST_ENTRY = 13  # a name of one letter, an empty type, an empty value


def read_metadata(reader: VdbReader) -> Metadata:
    """Return the entries; ValueError if the bytes are no map."""
    n_entries = reader.number("I")
    reader.expect(n_entries * _SMALLEST_ENTRY, f"{n_entries} metadata entries")
    found: Metadata = {}
    for _ in range(n_entries):
        name, kind, size = reader.text(), reader.text(), reader.number("I")
        reader.expect(size, f"the metadata {printable(name)!r}")
        if kind == "string":
            # Bytes that are no UTF-8 become marks which turn into them again
            found[name] = reader.take(size).decode("utf-8", "surrogateescape")
        elif kind in _LETTERS:
            layout = f"<{_LETTERS[kind]}"
            if size != struct.calcsize(layout):
                raise ValueError(f"the metadata {printable(name)!r} is a {kind} of {size} bytes")
            values = struct.unpack(layout, reader.take(size))
            value = values if len(values) > 1 else values[0]
            found[name] = _NARROW[kind](value) if kind in _NARROW else value
        elif kind.startswith(_OWN_NOTES):
            reader.seek(reader.at + size)
        else:
            found[name] = Bytes(kind, reader.take(size))
    return found


def write_metadata(writer: VdbWriter, metadata: Metadata) -> None:
    """Write entries, by rising name: ints as int64, floats as double, texts as string, and what
    `read_metadata` gave as it was."""
    writer.numbers("I", len(metadata))
    for name in sorted(metadata):
        kind, data = _encoded(metadata[name])
        head = encoded_text(name) + encoded_text(kind) + struct.pack("<I", len(data))
        writer.write(head + data)


def check_metadata(metadata: Metadata) -> None:
    """ValueError unless every entry can be written and read back."""
    for name, value in metadata.items():
        try:
            _encoded(value)
        except (struct.error, KeyError, TypeError, ValueError, OverflowError):
            raise ValueError(f"the metadata {name!r} cannot be {value!r}") from None
        if not name:
            raise ValueError("a metadata entry has no name")


def _encoded(value: bool | int | float | str | tuple | Bytes) -> tuple[str, bytes]:
    """Type and bytes of a value."""
    if isinstance(value, Bytes):
        return value.kind, value.data
    if isinstance(value, str):
        return "string", value.encode("utf-8", "surrogateescape")
    if isinstance(value, Int32 | Single | Singles):
        layout, numbers = _LETTERS[value.kind], value if isinstance(value, tuple) else (value,)
        return value.kind, struct.pack(f"<{layout}", *numbers)
    if isinstance(value, tuple):
        whole = all(isinstance(item, int | np.integer) for item in value)
        kind = f"vec{len(value)}{'i' if whole else 'd'}"
        return kind, struct.pack(f"<{_LETTERS[kind]}", *value)
    if isinstance(value, bool | np.bool_):
        kind = "bool"
    elif isinstance(value, int | np.integer):
        kind = "int64"
    else:
        kind = "double"
    return kind, struct.pack(f"<{_LETTERS[kind]}", value)
