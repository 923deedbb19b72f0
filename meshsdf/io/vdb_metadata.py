"""The named values that a ``.vdb`` file and each of its grids carry.

A map is its length (uint32), then for each entry: name (text), type (text), the value's size in
bytes (uint32), the value. An entry of a type not listed here is passed over by its size; types
whose names begin with two underscores are OpenVDB's own notes (Museth 2013,
doi:10.1145/2487228.2487235; layout as OpenVDB 10 writes it).
"""

import struct

import numpy as np

from .vdb_stream import VdbReader, VdbWriter, encoded_text, printable

Metadata = dict[str, bool | int | float | str | tuple]
"""Values by name; a tuple holds 2 to 4 ints or floats."""

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
    """Return the entries of known types; ValueError if the bytes are no map."""
    n_entries = reader.number("I")
    reader.expect(n_entries * _SMALLEST_ENTRY, f"{n_entries} metadata entries")
    found: Metadata = {}
    for _ in range(n_entries):
        name, kind, size = reader.text(), reader.text(), reader.number("I")
        reader.expect(size, f"the metadata {printable(name)!r}")
        if kind == "string":
            found[name] = reader.take(size).decode("utf-8", "backslashreplace")
        elif kind in _LETTERS:
            layout = f"<{_LETTERS[kind]}"
            if size != struct.calcsize(layout):
                raise ValueError(f"the metadata {printable(name)!r} is a {kind} of {size} bytes")
            values = struct.unpack(layout, reader.take(size))
            found[name] = values if len(values) > 1 else values[0]
        else:
            reader.seek(reader.at + size)
    return found


def write_metadata(writer: VdbWriter, metadata: Metadata) -> None:
    """Write entries, by rising name: ints as int64, floats as double, texts as string."""
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
        except (struct.error, KeyError, TypeError, OverflowError):
            raise ValueError(f"the metadata {name!r} cannot be {value!r}") from None
        if not name:
            raise ValueError("a metadata entry has no name")


def _encoded(value: bool | int | float | str | tuple) -> tuple[str, bytes]:
    """Type and bytes of a value."""
    if isinstance(value, str):
        return "string", value.encode("utf-8", "replace")
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
