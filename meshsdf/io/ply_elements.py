"""The elements of a PLY file: a header that declares them, then their numbers.

What the header claims is held against the size of the file before anything is allocated.
"""

import struct
from dataclasses import dataclass

import numpy as np

from .text_rows import numbers

_TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
    "int64": "i8",
    "uint64": "u8",
}
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_LONGEST_HEADER = 1 << 20


@dataclass(frozen=True, eq=False)
class Property:
    """One declared property; ``size`` is the type of a list's length, None for a number."""

    name: str
    dtype: np.dtype
    size: np.dtype | None


@dataclass(frozen=True, eq=False)
class Declaration:
    """One declared element."""

    name: str
    count: int
    properties: list[Property]


@dataclass(frozen=True, eq=False)
class Header:
    """What stands above ``end_header``; ``order`` is "<", ">" or "" for text."""

    order: str
    declarations: list[Declaration]
    comments: list[str]

    def comments_with(self, word: str) -> list[str]:
        """Return the comments that begin with the word."""
        return [line for line in self.comments if line.startswith(word)]


@dataclass(frozen=True, eq=False)
class List:
    """Lists of numbers, one for each row: their lengths, and all of them in one array."""

    counts: np.ndarray
    values: np.ndarray


@dataclass(frozen=True, eq=False)
class Element:
    """The columns of one element by the names of its properties."""

    count: int
    columns: dict[str, np.ndarray | List]
    types: dict[str, np.dtype]


def header_and_body(data: bytes) -> tuple[Header, bytes]:
    """Split a PLY file; ValueError says what is wrong with its header."""
    if data[:3] != b"ply":
        raise ValueError("it does not begin with 'ply'")
    end = data.find(b"end_header", 0, _LONGEST_HEADER)
    if end < 0:
        raise ValueError("its header has no end_header; it is cut off")
    body = end + len(b"end_header")
    body += 2 if data[body : body + 2] == b"\r\n" else 1
    order, declarations, comments = None, [], []
    for line in data[:end].decode("latin-1").splitlines()[1:]:
        words = line.split()
        if not words:
            continue
        if words[0] == "comment":
            comments.append(line.strip()[len("comment") :].strip())
        elif words[0] == "format" and len(words) > 1:
            order = _ORDERS.get(words[1])
        elif words[0] == "element":
            declarations.append(_declaration(words))
        elif words[0] == "property":
            if not declarations:
                raise ValueError("its header declares a property of no element")
            declarations[-1].properties.append(_property(words, order))
    if order is None:
        raise ValueError("its header names no known format")
    return Header(order, declarations, comments), data[body:]


def read_elements(header: Header, body: bytes) -> dict[str, Element]:
    """Return the elements by name; ValueError if the file holds less than its header promises."""
    read = _binary_element if header.order else _text_element
    rest = memoryview(body) if header.order else body.splitlines()
    elements, at = {}, 0
    for declaration in header.declarations:
        columns, at = read(declaration, rest, at)
        types = {one.name: one.dtype for one in declaration.properties}
        elements[declaration.name] = Element(declaration.count, columns, types)
        if {"vertex", "face"} <= elements.keys():
            break  # what follows is of no use to a mesh
    return elements


def _declaration(words: list[str]) -> Declaration:
    if len(words) != 3 or not words[2].isdecimal() or len(words[2]) > 15:
        raise ValueError(f"its header says {' '.join(words)[:60]!r}")
    return Declaration(words[1], int(words[2]), [])


def _property(words: list[str], order: str | None) -> Property:
    is_list = words[1:2] == ["list"]
    kinds = words[2:4] if is_list else words[1:2]
    if len(words) != (5 if is_list else 3) or not set(kinds) <= _TYPES.keys():
        raise ValueError(f"its header says {' '.join(words)[:60]!r}")
    dtypes = [np.dtype((order or "<") + _TYPES[kind]) for kind in kinds]
    if is_list and dtypes[0].kind == "f":
        raise ValueError("a list in its header has a length that is not whole")
    return Property(words[-1], dtypes[-1], dtypes[0] if is_list else None)


def _check_room(declaration: Declaration, needed: int, left: int, unit: str) -> None:
    if needed > left:
        raise ValueError(
            f"it promises {declaration.count} {declaration.name} elements, which take at least "
            f"{needed} {unit}, but {left} are left"
        )


def _binary_element(declaration: Declaration, body: memoryview, at: int):
    """(columns, place of the next element)."""
    properties, count = declaration.properties, declaration.count
    least = sum((one.size or one.dtype).itemsize for one in properties)
    _check_room(declaration, count * max(least, 1), len(body) - at, "bytes")
    if count == 0:
        return {one.name: _empty(one) for one in properties}, at
    # Rows whose lists are all as long as those of the first row form one table.
    lengths = _lengths_of_row(properties, body, at)
    row = _row_type(properties, lengths)
    if count * row.itemsize <= len(body) - at:
        table = np.frombuffer(body, row, count, at)
        sized = [place for place, one in enumerate(properties) if one.size is not None]
        if all((table[f"n{place}"] == lengths[place]).all() for place in sized):
            columns = {one.name: table[f"v{place}"] for place, one in enumerate(properties)}
            for place in sized:
                counts = np.full(count, lengths[place], np.int64)
                name = properties[place].name
                columns[name] = List(counts, columns[name].reshape(-1))
            return columns, at + count * row.itemsize
    return _walk_rows(declaration, body, at)


def _row_type(properties: list[Property], lengths: list[int]) -> np.dtype:
    """The bytes of one row: v<place> holds the values of a property, n<place> a list's length."""
    fields = []
    for place, (one, length) in enumerate(zip(properties, lengths, strict=True)):
        if one.size is None:
            fields.append((f"v{place}", one.dtype))
        else:
            fields += [(f"n{place}", one.size), (f"v{place}", one.dtype, (length,))]
    return np.dtype(fields)


def _lengths_of_row(properties: list[Property], body: memoryview, at: int) -> list[int]:
    """How long each property's list is in the row that begins at byte ``at``; 1 for numbers."""
    lengths = []
    for one in properties:
        length = 1
        if one.size is not None:
            length = _length(one, body, at)
            at += one.size.itemsize
        lengths.append(length)
        at += length * one.dtype.itemsize
    return lengths


def _length(one: Property, body: memoryview, at: int) -> int:
    _check_inside(at + one.size.itemsize, body)
    length = int(np.frombuffer(body, one.size, 1, at)[0])
    if length < 0:
        raise ValueError(f"a list {one.name} has length {length}")
    _check_inside(at + one.size.itemsize + length * one.dtype.itemsize, body)
    return length


def _check_inside(end: int, body: memoryview) -> None:
    if end > len(body):
        raise ValueError(f"it is cut off: an element ends {end - len(body)} bytes behind the file")


def _walk_rows(declaration: Declaration, body: memoryview, at: int):
    """Rows of different lengths, one by one."""
    properties = declaration.properties
    pieces: list[list] = [[] for _ in properties]
    sizes = [one.size and struct.Struct(_code(one.size)) for one in properties]
    widths = [one.dtype.itemsize for one in properties]
    counts: list[list[int]] = [[] for _ in properties]
    for _ in range(declaration.count):
        for place, size in enumerate(sizes):
            length = 1
            if size is not None:
                _check_inside(at + size.size, body)
                length = size.unpack_from(body, at)[0]
                if length < 0:
                    raise ValueError(f"a list {properties[place].name} has length {length}")
                at += size.size
                counts[place].append(length)
            end = at + length * widths[place]
            _check_inside(end, body)
            pieces[place].append(body[at:end])
            at = end
    columns: dict[str, np.ndarray | List] = {}
    for place, one in enumerate(properties):
        values = np.frombuffer(b"".join(pieces[place]), one.dtype)
        if one.size is not None:
            values = List(np.array(counts[place], np.int64), values)
        columns[one.name] = values
    return columns, at


def _code(dtype: np.dtype) -> str:
    """The struct code of an integer type, byte order first."""
    letter = {1: "b", 2: "h", 4: "i", 8: "q"}[dtype.itemsize]
    order = ">" if dtype.byteorder == ">" else "<"
    return order + (letter.upper() if dtype.kind == "u" else letter)


def _text_element(declaration: Declaration, lines: list[bytes], at: int):
    """(columns, number of the next element's first line)."""
    count, properties = declaration.count, declaration.properties
    _check_room(declaration, count, len(lines) - at, "lines")
    words = [line.split() for line in lines[at : at + count]]
    table = numbers(b"\n".join(lines[at : at + count]), sum(map(len, words)), declaration.name)
    widths = np.array([len(line) for line in words], np.int64)
    cursor = np.cumsum(widths) - widths
    ends = cursor + widths
    columns: dict[str, np.ndarray | List] = {}
    for one in properties:
        if one.size is None:
            _check_line(declaration, cursor + 1, ends)
            columns[one.name] = table[cursor]
            cursor = cursor + 1
            continue
        _check_line(declaration, cursor + 1, ends)
        lengths = table[cursor]
        if not ((lengths >= 0) & (lengths == np.floor(lengths)) & (lengths < 2**31)).all():
            raise ValueError(f"a list {one.name} has a length that is no count")
        lengths = lengths.astype(np.int64)
        _check_line(declaration, cursor + 1 + lengths, ends)
        within = np.arange(lengths.sum()) - np.repeat(np.cumsum(lengths) - lengths, lengths)
        columns[one.name] = List(lengths, table[np.repeat(cursor + 1, lengths) + within])
        cursor = cursor + 1 + lengths
    return columns, at + count


def _check_line(declaration: Declaration, needed: np.ndarray, ends: np.ndarray) -> None:
    short = np.flatnonzero(needed > ends)
    if len(short):
        raise ValueError(f"line {short[0] + 1} of its {declaration.name} elements is too short")


def _empty(one: Property) -> np.ndarray | List:
    values = np.empty(0, one.dtype)
    return values if one.size is None else List(np.empty(0, np.int64), values)
