"""OpenEXR images that hold a volume slice by slice: flipbooks for engines, parts for compositors.

Pixels are one channel ``Y``, float32 or float16, packed with ZIP, which every program reads.
`exr_layout` says where a node lies, `exr_facts` what the header and the JSON beside it tell. The
package OpenEXR writes; what it wrote is read by `exr_header` and `exr_pixels`, because a damaged
file must not reach a library in C++. Packings of other programs that are unpacked by it all the
same, such as PIZ, are so in a process of their own: `exr_process`.
"""

import errno
import json
import os
from pathlib import Path
from typing import Literal

import numpy as np

from ..arrays import Number
from ..errors import IoError
from ..grid import Grid, NarrowBand
from .dense_form import dense_form
from .detached import check_words, words_beside, written_together
from .exr_facts import FORMAT, PREFIX, ExrFacts, LayoutName, parse_facts
from .exr_header import Part, read_parts
from .exr_layout import Slicing, Up, nearly_square
from .exr_pixels import read_images
from .exr_process import LOSSY
from .half import check_half
from .opened import opened_reader
from .vdb_stream import VdbReader
from .volume_checks import check_volume
from .warn import Warn, ignore

_LONGEST_SIDE = (1 << 31) - 1  # the corners of an image are 32-bit numbers


def write_exr(
    path: str | os.PathLike,
    volume: NarrowBand | Grid,
    *,
    half: bool = False,
    force: bool = False,
    layout: LayoutName = "atlas",
    columns: int | None = None,
    up: Up = "z",
    remap: Number | Literal["range"] | None = None,
    warn: Warn = ignore,
) -> None:
    """Write a volume as images, and a JSON file of the same stem that tells engines what it is.

    A float32 grid reads back bit-equal, unless ``half`` or ``remap``. A band is written as a full
    grid, clipped beyond the band.

    Parameters
    ----------
    path : path
        The ``.exr`` file; the JSON goes beside it.
    volume : NarrowBand or Grid
        What is written.
    half : bool
        Pixels of float16; see `write_npz`.
    force : bool
        Replace existing files; a JSON file that is not ours stays, and is refused.
    layout : "atlas" or "parts"
        All slices in one image, or each in a part of its own.
    columns : int or None
        Slices beside each other in the atlas; None makes it nearly square.
    up : "z" or "y"
        Along which axis the slices are stacked; see `exr_layout`.
    remap : number, "range" or None
        Map values linearly so that 0 becomes 0.5 and this distance, in world units, becomes 1;
        farther values become 0 or 1. "range" takes the largest distance, so that all lie between.
    warn : callable
        Told what the format could not keep.

    Raises
    ------
    IoError
        A file exists, its folder cannot be written, the disk is full, or the volume cannot be
        said in this format.
    MemoryLimitError
        A band would not fit in memory as a full grid.

    Notes
    -----
    Accuracy: remapped, a value is off by at most 2**-24 of ``remap``, or 2**-11 with ``half``; one
    below 0 stays below 0.
    """
    where = f"output {path}"
    beside = check_exr_output(path, force=force)
    grid = dense_form(path, volume, "OpenEXR", half=half, force=force, warn=warn)
    if half and remap is None:
        check_half(grid.values, where)
    try:
        facts = _facts(grid, half, layout, columns, up, remap)
        attributes = facts.attributes()
    except ValueError as error:
        raise IoError(f"the volume cannot be written so: {error}", where, "change that") from error
    if facts.n_clamped:
        n, limit = facts.n_clamped, facts.remap
        warn(f"{n} values are beyond +-{limit:g}, so they are stored as 0 or 1, and lost")
    with written_together(beside, path, force) as (words, images):
        words.write_text(json.dumps(facts.entries(), indent=2) + "\n")
        write_images(images, _images(grid, facts), attributes)


def check_exr_output(path: str | os.PathLike, *, force: bool = False) -> Path:
    """Return the JSON file beside an ``.exr`` volume.

    Raises
    ------
    IoError
        As `check_output`, of that file; or it holds something else, even with ``force``.
    """
    place = words_beside(path)
    check_words(place, FORMAT, ".exr", force=force)
    return place


def read_exr(path: str | os.PathLike, *, warn: Warn = ignore) -> Grid:
    """Read a grid that `write_exr` wrote; the JSON beside it is not needed.

    Another program may have saved it again, in any packing that was known before OpenEXR 3.4.

    Parameters
    ----------
    path : path
        The ``.exr`` file.
    warn : callable
        Told if its packing changes values.

    Raises
    ------
    IoError
        There is no such file, or it is damaged, cut off, or a picture. Nothing larger than the
        file can unpack to is ever allocated.
    """
    with opened_reader(path) as reader:
        parts, is_multi, facts = _headers(reader)
        lossy = {p.compression for p in parts if p.dtype.name in LOSSY.get(p.compression, ())}
        if lossy:
            warn(f"its pixels are packed with {', '.join(sorted(lossy))}, which changes values")
        images = read_images(reader, parts, is_multi)
        values = np.empty(facts.slicing.shape, np.float32)
        slices = facts.slicing.slices_of(values)
        for number, cell in enumerate(facts.slicing.cells_of(images)):
            slices[number] = facts.values(cell)
        grid = Grid(
            values,
            facts.voxel_size,
            np.array(facts.origin),
            facts.sign,
            facts.uncertain_voxels,
            facts.n_inner_faces,
            facts.half_width,
        )
        check_volume(grid)
    return grid


def probe_exr(path: str | os.PathLike) -> dict:
    """Return what the header says, see `exr_facts`, and that the ``kind`` is "grid"."""
    with opened_reader(path) as reader:
        return {"kind": "grid", **_headers(reader)[2].entries()}


def write_images(path: Path, images: list[np.ndarray], attributes: dict[str, str]) -> None:
    """Write one image as a plain file, more as the parts of one; the first has the attributes.

    Parameters
    ----------
    path : Path
        Written as it stands; see `atomic_write`.
    images : list of (h, w) float32 or float16
        Contiguous: OpenEXR writes noise from anything else.
    attributes : dict
        Texts for the header.

    Raises
    ------
    OSError
        The file cannot be written.
    """
    import OpenEXR

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    if len(images) == 1:
        file = OpenEXR.File(header | attributes, {"Y": images[0]})
    else:
        parts = [
            OpenEXR.Part(header | (attributes if number == 0 else {}), {"Y": image}, name)
            for number, image in enumerate(images)
            for name in [f"slice.{number:05d}"]
        ]
        file = OpenEXR.File(parts)
    try:
        file.write(str(path))
    except RuntimeError as error:  # it tells the reason in words alone
        numbers = (errno.ENOSPC, errno.EDQUOT, errno.EACCES, errno.EROFS)
        number = next((n for n in numbers if os.strerror(n) in str(error)), errno.EIO)
        raise OSError(number, str(error)) from error


def _facts(
    grid: Grid,
    half: bool,
    layout: LayoutName,
    columns: int | None,
    up: Up,
    remap: Number | Literal["range"] | None,
) -> ExrFacts:
    """What will be said of the file; ValueError if there can be no such file."""
    shape = grid.values.shape
    low, high = np.fmin.reduce(grid.values, axis=None), np.fmax.reduce(grid.values, axis=None)
    value_range = None if np.isnan(low) else (float(low), float(high))
    largest = float(max(-low, high)) if value_range else 0.0
    if remap == "range":
        remap = largest or grid.voxel_size
    if remap is not None and not 0 < remap < np.inf:
        raise ValueError(f"remap is {remap}, not a length above 0")
    plain = Slicing(shape, up, None)
    if layout == "parts" and columns is not None:
        raise ValueError(f"{columns} columns make no sense where every slice is a part")
    if layout == "atlas" and columns is None:
        columns = nearly_square(plain.width, plain.height, plain.n_slices)
    if columns is not None and not 1 <= columns <= plain.n_slices:
        raise ValueError(f"there are {columns} columns for {plain.n_slices} slices")
    slicing = Slicing(shape, up, columns)
    if max(map(max, slicing.image_shapes)) > _LONGEST_SIDE:
        raise ValueError(f"an image of {slicing.image_shapes[0]} pixels is too large")
    return ExrFacts(
        slicing,
        float(grid.voxel_size),
        tuple(grid.origin.tolist()),
        "float16" if half else "float32",
        None if remap is None else float(remap),
        0 if remap is None else int(np.count_nonzero(np.abs(grid.values) > remap)),
        value_range,
        largest if grid.background is None else grid.background,
        grid.sign,
        grid.uncertain_voxels,
        grid.n_inner_faces,
        None if grid.half_width is None else float(grid.half_width),
    )


def _images(grid: Grid, facts: ExrFacts) -> list[np.ndarray]:
    """The pixels of every image, each contiguous."""
    slices = facts.slicing.slices_of(grid.values)
    if facts.slicing.columns is None:
        return [facts.pixels(one) for one in slices]
    empty = facts.pixels(np.array([facts.background], np.float32))
    atlas = np.full(facts.slicing.image_shapes[0], empty[0])
    for cell, one in zip(facts.slicing.cells_of([atlas]), slices, strict=True):
        cell[:] = facts.pixels(one)
    return [atlas]


def _headers(reader: VdbReader) -> tuple[list[Part], bool, ExrFacts]:
    """The parts of a file, and its facts, which agree."""
    parts, is_multi = read_parts(reader, PREFIX + "format")
    facts = parse_facts(parts[0].texts)
    slicing = facts.slicing
    n_images = slicing.n_slices if slicing.columns is None else 1
    if n_images != len(parts):
        raise ValueError(f"it has {len(parts)} parts, not {n_images}")
    for part, shape in zip(parts, slicing.image_shapes, strict=True):
        if part.shape != shape or part.dtype.name != facts.dtype:
            raise ValueError(f"it has {part.dtype.name} pixels {part.shape}, not {shape}")
    return parts, is_multi, facts
