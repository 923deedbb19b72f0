"""What a format of full grids makes of a volume.

A narrow band becomes a full grid on the box of its active nodes, +-background beyond the band. The
grid says so itself (`Grid.half_width`), and formats with room for words pass it on.
"""

import os

import numpy as np

from ..arrays import Number
from ..errors import IoError, MemoryLimitError
from ..grid import Grid, NarrowBand
from ..grid.brick_index import BRICK, INSIDE
from .atomic import check_output
from .registry import FORMATS
from .volume_checks import check_volume
from .warn import Warn

_COMPANIONS = {
    "closest_face": "closest faces",
    "hermite": "crossings, normals and features",
    "uncertain": "which nodes have no certain side",
}


def dense_form(
    path: str | os.PathLike,
    volume: NarrowBand | Grid,
    format_name: str,
    *,
    half: bool,
    force: bool,
    warn: Warn,
) -> Grid:
    """Return a volume as the grid that a format can hold, and say what is lost on the way.

    Parameters
    ----------
    path : path
        The file to be written, which is checked first.
    volume : NarrowBand or Grid
        Any.
    format_name : str
        Of the registry, whose ``holds`` decides.
    half : bool
        Whether float16 is wanted.
    force : bool
        Whether an existing file may be replaced.
    warn : callable
        Told what is lost.

    Raises
    ------
    IoError
        The file cannot be written, or the volume makes no sense, or has no place in the format.
    MemoryLimitError
        A band would not fit in memory as a full grid.
    """
    check_output(path, force)
    holds = next(format.holds for format in FORMATS if format.name == format_name)
    where = f"output {path}"
    try:
        check_volume(volume)
    except ValueError as error:
        raise IoError(f"the volume cannot be written: {error}", where, "build it anew") from error
    grid = _clipped(volume, format_name, warn) if isinstance(volume, NarrowBand) else volume
    if grid.values.size == 0:
        what = f"a grid of {' x '.join(map(str, grid.values.shape))} nodes has no place in a file"
        raise IoError(what, where, "write a grid with nodes")
    _require_numbers(grid, holds, format_name, where)
    if grid.values.dtype == np.float64 and "double" not in holds:
        warn(f"{format_name} holds 32-bit floats: the values are rounded")
    if half and "half" not in holds:
        warn(f"{format_name} has no 16-bit floats; written with more")
    if "transform" not in holds:
        place = ", ".join(f"{x:g}" for x in grid.origin)
        warn(f"{format_name} has no place for the voxel size {grid.voxel_size:g}, nor for {place}")
    return grid


def _clipped(band: NarrowBand, format_name: str, warn: Warn) -> Grid:
    grid = full_grid(band)
    nodes = " x ".join(map(str, grid.values.shape))
    warn(
        f"{format_name} has no narrow bands: written as a full grid of {nodes} nodes, "
        f"clipped to +-{grid.background:.6g} beyond {grid.half_width:g} voxels; "
        "--dense (mesh_to_grid) is exact everywhere"
    )
    lost = [word for name, word in _COMPANIONS.items() if getattr(band, name) is not None]
    if lost:
        warn(f"{format_name} has no place for {', '.join(lost)}; left out")
    return grid


def _require_numbers(grid: Grid, holds: frozenset[str], format_name: str, where: str) -> None:
    """IoError if the values cannot stand in the format."""
    n_gaps = 0 if "gaps" in holds else np.count_nonzero(np.isnan(grid.values))
    if n_gaps:
        what = f"{format_name} has no place for NaN, of which there are {n_gaps}"
        raise IoError(what, where, "fill the gaps, or write another format")
    if grid.values.dtype == np.float64 and "double" not in holds:
        largest = max(
            np.fmax.reduce(grid.values, axis=None, initial=0),
            -np.fmin.reduce(grid.values, axis=None, initial=0),
        )
        if largest > np.finfo(np.float32).max:
            what = f"values up to {largest:g} do not fit float32"
            raise IoError(what, where, "scale the volume")


def full_grid(band: NarrowBand, *, max_memory: Number | None = None) -> Grid:
    """Return a band as a full grid on the box of its active nodes, +-background beyond it.

    Parameters
    ----------
    band : NarrowBand
        At least one node is active.
    max_memory : number or None
        Bytes that the grid may take; None for 80 % of what is free.

    Raises
    ------
    GridError
        No node is active.
    MemoryLimitError
        The grid would not fit.

    Examples
    --------
    >>> from meshsdf import mesh_to_band
    >>> from meshsdf.mesh.primitives import box_mesh
    >>> band = mesh_to_band(box_mesh(), voxel_size=0.1)
    >>> grid = full_grid(band)
    >>> grid.values.shape, grid.half_width, round(grid.background, 6)
    ((15, 15, 15), 3.0, 0.3)
    """
    low, high = band.active_box()
    shape = high - low + 1
    _require_room(shape, max_memory)
    values = np.empty(shape, np.float32)
    first = low // BRICK
    span = high // BRICK - first + 1
    rows = np.indices((1, span[1], span[2])).reshape(3, -1).T + first
    for x in range(span[0]):
        # One plane of bricks is put together, then cut to the box
        slots = band.index.lookup(rows + np.array([x, 0, 0]))
        bricks = np.full((len(slots), BRICK, BRICK, BRICK), band.background, np.float32)
        bricks[slots == INSIDE] = -band.background
        bricks[slots >= 0] = band.values[slots[slots >= 0]]
        plane = bricks.reshape(span[1], span[2], BRICK, BRICK, BRICK).transpose(2, 0, 3, 1, 4)
        plane = plane.reshape(BRICK, span[1] * BRICK, span[2] * BRICK)
        skip = low - (first + np.array([x, 0, 0])) * BRICK
        start, stop = np.maximum(skip, 0), np.minimum(skip + shape, plane.shape)
        target = start[0] - skip[0]
        values[target : target + stop[0] - start[0]] = plane[
            start[0] : stop[0], start[1] : stop[1], start[2] : stop[2]
        ]
    return Grid(
        values,
        band.voxel_size,
        band.to_world(low[None])[0],
        band.sign,
        band.uncertain_voxels,
        band.n_inner_faces,
        float(band.half_width),
    )


def _require_room(shape: np.ndarray, max_memory: Number | None) -> None:
    from ..sdf.memory import require_memory  # loaded already wherever a band was made

    where = f"a full grid of {' x '.join(map(str, shape))} nodes"
    try:
        require_memory(4 * float(np.prod(shape.astype(float))), max_memory, where=where)
    except MemoryLimitError as error:
        fix = "lower the resolution, or write .npz or .vdb, which keep bands sparse"
        raise MemoryLimitError(error.what, where, fix) from None
