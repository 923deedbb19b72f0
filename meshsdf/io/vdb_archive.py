"""A ``.vdb`` file as a whole: a header, then grids, each with a header of its own.

File: int64 magic number, uint32 format version, uint32 library version major and minor, uint8
whether offsets of grids are known, uuid as 36 letters, metadata, int32 number of grids. Grid: name
(text; equal names are told apart by "\\x1e" and a number), type (text), name of the grid whose tree
it shares (text, mostly empty), int64 offsets of what follows, of its leaves' values and of its
end, uint32 compression flags, metadata, transform, tree. The type is "Tree_float_5_4_3", where 5,
4 and 3 are the logarithms of the nodes' sides, with "_HalfFloat" appended if values are float16.
A file from a stream has offsets of zero: its next grid is found by reading through this one.

Layout: OpenVDB 10 (Museth 2013, doi:10.1145/2487228.2487235), format versions 222 to 225.
"""

import re
from dataclasses import dataclass, replace
from typing import BinaryIO

import numpy as np

from ..arrays import Matrix4
from .vdb_grid import CLASSES, VALUE_TYPES, VdbGrid
from .vdb_leaves import read_leaves, skip_leaves, write_leaves
from .vdb_metadata import Metadata, read_metadata, write_metadata
from .vdb_stream import UnsuitedError, VdbReader, VdbWriter, printable
from .vdb_transform import read_transform, write_transform
from .vdb_tree_reader import read_background, read_topology
from .vdb_tree_writer import write_topology
from .vdb_values import ACTIVE_MASK, BLOSC, ZIP, ValueLayout, compression_words

MAGIC = 0x56444220
KNOWN_VERSIONS = range(222, 226)

_WRITTEN_VERSION = 224  # of OpenVDB 6.2 to 12
_WRITTEN_LIBRARY = (10, 0)
_TYPE = re.compile(r"Tree_(\w+?)_5_4_3(_HalfFloat)?")
_SMALLEST_GRID = 40
_SEPARATOR = "\x1e"


@dataclass(frozen=True, eq=False)
class GridHeader:
    """What a file says of a grid before its values.

    Attributes
    ----------
    name : str
        Its name, as other programs know it.
    label : str
        The name, or "density[1]" for the second of that name.
    value_type : str
        "float", "vec3s", …
    problem : str
        Why it cannot be read; empty if it can.
    matrix : (4, 4) float64 or None
        From index to world, if affine.
    metadata : dict
        The entries of known types.
    layout : ValueLayout or None
        How its values are stored, with the background; None if it cannot be read.
    tree_at, tree_end, end : int
        Where its tree goes on after the background, and the latest place where it may end; where
        the next grid begins (0: unknown).
    """

    name: str
    label: str
    value_type: str
    problem: str
    matrix: Matrix4 | None
    metadata: Metadata
    layout: ValueLayout | None
    tree_at: int
    tree_end: int
    end: int

    @property
    def grid_class(self) -> str:
        """ "level set", "fog volume", "staggered" or "unknown"."""
        told = self.metadata.get("class")
        return told if told in CLASSES else "unknown"


@dataclass(frozen=True, eq=False)
class FileHeader:
    """What a file says of itself and of its grids.

    ``lost`` says why grids after those listed cannot be found; it is empty if there are none.
    """

    version: int
    library: str
    metadata: Metadata
    grids: list[GridHeader]
    lost: str


def read_headers(reader: VdbReader) -> FileHeader:
    """Read the headers of a file and of all its grids.

    Raises
    ------
    ValueError
        It is no ``.vdb`` file, of another version, cut off or damaged.
    """
    if reader.number("q") != MAGIC:
        raise ValueError("it does not begin as a .vdb file does")
    version, major, minor, has_offsets = reader.numbers("IIIB")
    if version not in KNOWN_VERSIONS:
        raise ValueError(
            f"its format version is {version}; known are "
            f"{KNOWN_VERSIONS.start} to {KNOWN_VERSIONS.stop - 1}"
        )
    reader.take(36)
    metadata = read_metadata(reader)
    n_grids = reader.number("i")
    if n_grids < 0:
        raise ValueError(f"it claims {n_grids} grids")
    reader.expect(n_grids * _SMALLEST_GRID, f"{n_grids} grids")
    grids: list[GridHeader] = []
    by_label: dict[str, GridHeader] = {}
    lost = ""
    for number in range(n_grids):
        grid = _read_grid_header(reader, by_label)
        grids.append(grid)
        by_label[grid.label] = grid
        if has_offsets:
            # Forwards only, so that reading ends however the offsets are chosen
            reader.seek(max(grid.end, reader.at))
        elif number < n_grids - 1 and grid.layout is None:
            lost = (
                f"{n_grids - 1 - number} grids after {grid.label!r} cannot be found: {grid.problem}"
            )
            break
        elif number < n_grids - 1 and grid.tree_at == reader.at:
            topology = read_topology(reader, grid.layout)
            skip_leaves(reader, len(topology.slots), grid.layout)
    return FileHeader(version, f"{major}.{minor}", metadata, grids, lost)


def _read_grid_header(reader: VdbReader, earlier: dict[str, GridHeader]) -> GridHeader:
    unique, kind, parent = reader.text(), reader.text(), _label(reader.text())
    name, label = unique.partition(_SEPARATOR)[0], _label(unique)
    start, _, end = reader.numbers("3q")
    if end and not (start == reader.at and start < end <= reader.size):
        raise ValueError(f"the grid {label!r} claims to lie at bytes {start} to {end}")
    flags = reader.number("I")
    metadata = read_metadata(reader)
    match = _TYPE.fullmatch(kind)
    value_type = match[1] if match else printable(kind)
    problem, matrix, layout = "", None, None
    if flags > (ZIP | ACTIVE_MASK | BLOSC):
        problem = f"the compression {flags} is unknown"
    elif match is None or value_type not in VALUE_TYPES:
        problem = f"grids of type {printable(kind)!r} cannot be read"
    try:
        matrix = read_transform(reader)
    except UnsuitedError as error:
        problem = problem or str(error)
    places = (reader.at, end or reader.size, end)
    header = GridHeader(name, label, value_type, problem, matrix, metadata, None, *places)
    if problem:
        return header
    if parent:
        source = earlier.get(parent)
        if source is None or source.layout is None or source.value_type != value_type:
            return replace(header, problem=f"it shares the tree of {parent!r}, which is unknown")
        tree = {"tree_at": source.tree_at, "tree_end": source.tree_end}
        return replace(header, layout=source.layout, **tree)
    dtype, shape = VALUE_TYPES[value_type]
    is_half = bool(match[2]) and dtype.kind == "f"
    layout = ValueLayout(read_background(reader, dtype, shape), is_half, flags)
    return replace(header, layout=layout, tree_at=reader.at)


def _label(unique_name: str) -> str:
    """A grid's name as people are shown it, and as they ask for it."""
    name, separator, number = unique_name.partition(_SEPARATOR)
    return printable(name) + (f"[{printable(number)}]" if separator else "")


def read_grid(reader: VdbReader, header: GridHeader) -> VdbGrid:
    """Read the tree of a grid without a problem; ValueError if it is damaged."""
    layout = header.layout
    # Trees do not overlap, so all grids together give no more than the file can
    reader = reader.part(header.tree_at, header.tree_end)
    topology = read_topology(reader, layout)
    values, active = read_leaves(reader, topology.slots, layout)
    tiles = (topology.tile_values, topology.tile_active)
    if len(topology.tile_active) == 0:
        tiles = (None, None)
    grid = VdbGrid(
        header.name, topology.index, values, active, layout.background, header.matrix,
        header.grid_class, *tiles, header.metadata, layout.is_half,
    )  # fmt: skip
    return grid


def write_archive(file: BinaryIO, grids: list[VdbGrid], metadata: Metadata, flags: int) -> None:
    """Write a file; the same grids give the same bytes. Nothing is checked."""
    writer = VdbWriter(file)
    writer.numbers("qIIIB", MAGIC, _WRITTEN_VERSION, *_WRITTEN_LIBRARY, 1)
    writer.write(bytes(36))
    write_metadata(writer, metadata)
    writer.numbers("i", len(grids))
    names = [grid.name for grid in grids]
    for number, grid in enumerate(grids):
        suffix = f"{_SEPARATOR}{names[:number].count(grid.name)}"
        writer.text(grid.name + (suffix if names.count(grid.name) > 1 else ""))
        _write_grid(writer, grid, flags)
    writer.sign()


def _write_grid(writer: VdbWriter, grid: VdbGrid, flags: int) -> None:
    layout = ValueLayout(grid.background, grid.is_half, flags)
    writer.text(f"Tree_{grid.value_type}_5_4_3{'_HalfFloat' if grid.is_half else ''}")
    writer.text("")
    offsets_at = writer.at
    writer.numbers("3q", 0, 0, 0)
    start = writer.at
    writer.numbers("I", flags)
    write_metadata(writer, _full_metadata(grid, flags))
    write_transform(writer, grid.matrix)
    order = write_topology(writer, grid, layout)
    leaves_at = writer.at
    write_leaves(writer, grid, order, layout)
    writer.replace(offsets_at, np.array([start, leaves_at, writer.at], "<i8").tobytes())


def _full_metadata(grid: VdbGrid, flags: int) -> Metadata:
    """The grid's own entries, and those by which other programs know what they have."""
    count, low, high = grid.active_extent()
    n_bytes = 512 * int(np.prod(grid.values.shape[4:], dtype=int)) * grid.values.dtype.itemsize
    return grid.metadata | {
        "name": grid.name,
        "class": grid.grid_class,
        "is_saved_as_half_float": grid.is_half,
        "file_bbox_min": tuple(low.tolist()),
        "file_bbox_max": tuple(high.tolist()),
        "file_voxel_count": count,
        "file_mem_bytes": len(grid.active) * (n_bytes + 64) + grid.index.pages.nbytes,
        "file_compression": compression_words(flags),
    }
