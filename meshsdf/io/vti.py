"""VTK's ``.vti``: image data as XML, with the values appended. ParaView and PyVista read it.

Node (i, j, k) lies at ``Origin + Spacing * (i, j, k)``, and values are point data, x fastest. What
else a `Grid` says stands in field data of our own, see `dense_header`. A file of ours comes back
bit-equal.

- `vti_head`: the XML · `vti_data`: the values
"""

import os
from typing import BinaryIO
from xml.sax.saxutils import quoteattr

import numpy as np

from ..errors import IoError
from ..grid import Grid, NarrowBand
from .atomic import atomic_write
from .dense_form import dense_form
from .dense_header import PREFIX, DenseHeader, one_spacing, told_of
from .opened import opened
from .vdb_stream import UnsuitedError, printable
from .vti_data import ZLIB_NAME, array_values, fact, write_blocks
from .vti_head import ITEM_TYPES, VtiArray, VtiHead, read_head
from .warn import Warn, ignore
from .x_fastest import write_values


def write_vti(
    path: str | os.PathLike,
    volume: NarrowBand | Grid,
    *,
    half: bool = False,
    force: bool = False,
    compressed: bool = True,
    name: str = "distance",
    warn: Warn = ignore,
) -> None:
    """Write a volume; a grid reads back bit-equal.

    Parameters
    ----------
    path : path
        The ``.vti`` file.
    volume : NarrowBand or Grid
        A band becomes a full grid, see `dense_form`.
    half : bool
        There are no 16-bit floats in VTK, so the values are written as they are.
    force : bool
        Replace an existing file.
    compressed : bool
        Pack the values.
    name : str
        Of the array.
    warn : callable
        Told what the format could not keep.

    Raises
    ------
    IoError
        The file exists, its folder cannot be written, the disk is full, the volume is none, or the
        name is not printable.
    MemoryLimitError
        A band would not fit in memory as a full grid.
    """
    grid = dense_form(path, volume, "VTK ImageData", half=half, force=force, warn=warn)
    if not (name and name.isprintable()):
        what = f"an array cannot have the name {name!r}"
        raise IoError(what, f"output {path}", "use letters and digits")
    stored = grid.values.dtype.newbyteorder("<")
    with atomic_write(path, force) as temporary, open(temporary, "wb") as file:
        file.write(_opening(grid, name, compressed=compressed).encode())
        if compressed:
            write_blocks(file, grid.values, stored)
        else:
            file.write(np.array(grid.values.nbytes, "<u8").tobytes())
            write_values(file, grid.values, stored)
        file.write(b"\n  </AppendedData>\n</VTKFile>\n")


def read_vti(path: str | os.PathLike, *, grid: str | None = None, warn: Warn = ignore) -> Grid:
    """Read one array of a file of one piece.

    Parameters
    ----------
    path : path
        The ``.vti`` file; values appended (raw or base64) or inline, packed by zlib or not.
    grid : str or None
        Name of the array. None takes the active scalars of the points, else their first array of
        one number a node, else that of the cells, whose values lie half a voxel further in.
    warn : callable
        Told what was left out or changed.

    Raises
    ------
    IoError
        There is no such file or array, it is damaged, its voxels are no cubes along the axes, or
        its values would take over 1000 times the bytes they are packed in (64 MiB are always
        allowed).
    """
    notes: list[str] = []
    with opened(path) as (file, path):
        head = read_head(file)
        array = _chosen(head, grid, f"file {path}", notes)
        header = _grid_header(file, head, array)
        volume = header.grid(array_values(file, head, array, header))
    for note in notes:
        warn(note)
    header.tell_type(warn)
    return volume


def probe_vti(path: str | os.PathLike) -> dict:
    """Return what the XML says: ``kind``, ``dtype``, ``shape``, ``voxel_size``, ``arrays``, …"""
    with opened(path) as (file, path):
        head = read_head(file)
        array = _chosen(head, None, f"file {path}", [])
        facts = _grid_header(file, head, array).facts()
    arrays = [printable(a.name) for a in head.arrays if a.section != "FieldData"]
    return facts | {"array": printable(array.name), "arrays": arrays}


def _opening(grid: Grid, name: str, *, compressed: bool) -> str:
    """All of the file before its data."""
    extent = " ".join(f"0 {n - 1}" for n in grid.values.shape)
    kind = "Float64" if grid.values.dtype == np.float64 else "Float32"
    packed = f' compressor="{ZLIB_NAME}"' if compressed else ""
    size = repr(float(grid.voxel_size))
    origin = " ".join(map(repr, grid.origin.tolist()))
    facts = "\n".join(_fact_element(key, text) for key, text in told_of(grid).items())
    return f"""<?xml version="1.0"?>
<VTKFile type="ImageData" version="1.0" byte_order="LittleEndian" header_type="UInt64"{packed}>
  <ImageData WholeExtent="{extent}" Origin="{origin}"
             Spacing="{size} {size} {size}" Direction="1 0 0 0 1 0 0 0 1">
    <FieldData>
{facts}
    </FieldData>
    <Piece Extent="{extent}">
      <PointData Scalars={quoteattr(name)}>
        <DataArray type="{kind}" Name={quoteattr(name)} format="appended" offset="0"/>
      </PointData>
    </Piece>
  </ImageData>
  <AppendedData encoding="raw">
   _"""


def _fact_element(key: str, text: str) -> str:
    """A word as the codes of its letters, ended by 0; a number as it is."""
    start = f'Name="{key}" NumberOfTuples="1" format="ascii">'
    if key == f"{PREFIX}sign":
        codes = " ".join(str(ord(letter)) for letter in text)
        return f'      <Array type="String" {start}{codes} 0</Array>'
    kind = "Int64" if text.isdigit() else "Float64"
    return f'      <DataArray type="{kind}" {start}{text}</DataArray>'


def _chosen(head: VtiHead, name: str | None, where: str, notes: list[str]) -> VtiArray:
    """The array that is meant; notes say what else there is."""
    points = [a for a in head.arrays if a.section == "PointData"]
    cells = [a for a in head.arrays if a.section == "CellData"]
    listed = ", ".join(f"'{printable(a.name)}' ({a.n_components})" for a in (points + cells)[:20])
    if name is not None:
        named = [a for a in points + cells if a.name == name]
        if not named:
            raise IoError(f"there is no array {name!r}", where, f"choose one of {listed or 'none'}")
        if named[0].n_components != 1:
            what = f"the array {name!r} holds {named[0].n_components} numbers a node, not one"
            raise IoError(what, where, f"choose one of {listed}")
        return named[0]
    single = [a for a in points + cells if a.n_components == 1]
    if not single:
        fix = "write point data of one number a node"
        raise UnsuitedError(f"no array of one number a node; there are {listed or 'none'}", fix)
    active = head.active.get("PointData", "")
    array = next((a for a in single if a.section == "PointData" and a.name == active), single[0])
    if len(points) + len(cells) > 1:
        notes.append(f"read the array '{printable(array.name)}'; there are {listed}")
    if array.section == "CellData":
        notes.append("its values stand in cells; their middles become nodes")
    return array


def _grid_header(file: BinaryIO, head: VtiHead, array: VtiArray) -> DenseHeader:
    spacings, first, steps = head.place()
    size = one_spacing(spacings)
    kind = ITEM_TYPES.get(array.attributes.get("type", ""))
    if kind is None:
        raise ValueError(f"its values are '{printable(array.attributes.get('type', ''))}'")
    if array.section == "CellData":
        first = [start + step / 2 for start, step in zip(first, spacings, strict=True)]
        shape = tuple(steps)
    else:
        shape = tuple(n + 1 for n in steps)
    ours = [a for a in head.arrays if a.section == "FieldData" and a.name.startswith(PREFIX)]
    told = {a.name: fact(file, head, a) for a in ours}
    stored = np.dtype(head.byte_order + kind)
    return DenseHeader("vti", stored, shape, size, np.array(first), told)
