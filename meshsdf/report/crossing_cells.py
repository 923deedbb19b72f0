"""The cells of a volume in which it takes a level, and the values at nodes around them."""

import numpy as np
from jaxtyping import Float64

from ..arrays import Ijk, Number
from ..errors import ReportError
from ..grid import Grid, NarrowBand
from ..kernels.marching_cubes import count_bricks
from ..kernels.special_cells import collect_bricks
from ..surface.brick_field import field_of_band, field_of_grid, in_ranges

Blocks = Float64[np.ndarray, "n s s s"]

LAYERS_AT_ONCE = 256  # of bricks, or of a grid: bounds the memory of float64 copies

_CORNERS = np.indices((2, 2, 2)).reshape(3, 8).T
# Of every sign pattern: no faces, and one cell to be collected where both signs occur
_MIXED = np.array([[0, 0 < pattern < 255] for pattern in range(256)], np.int64)


def crossing_cells(volume: NarrowBand | Grid, level: Number) -> Ijk:
    """Return the lowest nodes of the cells with a corner below the level and one not below.

    Index coordinates of a band, places in the values of a grid. Cells with a corner that is NaN
    or infinite have no interpolant and are left out.

    Raises
    ------
    ReportError
        The level is not finite, not above 0 for unsigned values, or beyond a band's background.
    """
    check_level(volume, level)
    if isinstance(volume, NarrowBand):
        field = field_of_band(volume, float(level))
    else:
        field = field_of_grid(volume, float(level), "open")
    n = len(field.corners)
    signs = field.inside, field.valid, field.near
    crossings, counts = np.empty((n, 24), np.uint64), np.empty((n, 2), np.int64)
    in_ranges(lambda start, stop: count_bricks(*signs, _MIXED, start, stop, crossings, counts), n)
    first = np.concatenate([[0], np.cumsum(counts[:, 1], dtype=np.int64)])
    cells, values = np.empty((first[-1], 3), np.int64), np.empty((first[-1], 8))
    is_mixed = _MIXED[:, 1].astype(np.uint8)
    in_ranges(
        lambda start, stop: collect_bricks(
            field.values, *signs, field.corners, field.background, is_mixed, first, start, stop,
            cells, values,
        ),
        n,
    )  # fmt: skip
    return cells[np.isfinite(values).all(axis=1)]


def cells_near_level(volume: NarrowBand | Grid, level: Number, delta: Number) -> Ijk:
    """Return the cells in which values come within ``delta`` of the level, in order.

    Those have corners on both sides of it, or a corner so near to it.
    """
    cells = crossing_cells(volume, level)
    near = []
    for start in range(0, len(volume.values), LAYERS_AT_ONCE):
        layers = volume.values[start : start + LAYERS_AT_ONCE]
        near.append(np.argwhere(np.abs(layers - np.float64(level)) <= delta))
        near[-1][:, 0] += start
    near = np.concatenate(near)
    if isinstance(volume, NarrowBand):
        near = volume.index.coordinates[near[:, 0]] * 8 + near[:, 1:]
    more = (near[:, None, :] - _CORNERS).reshape(-1, 3)
    more = np.unique(more, axis=0)
    values = node_blocks(volume, more, 0, level)
    more = more[np.isfinite(values).all(axis=(1, 2, 3))]
    return np.unique(np.concatenate([cells, more]), axis=0)


def node_blocks(volume: NarrowBand | Grid, cells: Ijk, ring: int, level: Number) -> Blocks:
    """Return value - level at the nodes of each cell and of so many rings of cells around it.

    (n, s, s, s) with s = 2 + 2 ring; NaN beyond a grid.
    """
    side = 2 + 2 * ring
    offsets = np.indices((side, side, side)).reshape(3, -1).T - ring
    nodes = (cells[:, None, :] + offsets).reshape(-1, 3)
    if isinstance(volume, NarrowBand):
        values = volume.value_at(nodes)
    else:
        shape = np.array(volume.values.shape)
        values = volume.values[tuple(np.clip(nodes, 0, shape - 1).T)].astype(np.float64)
        values[((nodes < 0) | (nodes >= shape)).any(axis=1)] = np.nan
    return (values - float(level)).reshape(len(cells), side, side, side)


def place_of_nodes(volume: NarrowBand | Grid) -> np.ndarray:
    """Return (4,) voxel size and world position of node (0, 0, 0)."""
    origin = volume.translation if isinstance(volume, NarrowBand) else volume.origin
    return np.array([volume.voxel_size, *origin])


def check_level(volume: NarrowBand | Grid, level: Number) -> None:
    """Refuse levels that no surface can have; ReportError."""
    if not np.isfinite(level):
        what = f"the level is {level}"
    elif not volume.is_signed and level <= 0:
        what = f"the level is {level:g}, but the volume is unsigned: no value lies below 0"
    elif isinstance(volume, NarrowBand) and abs(level) >= volume.background:
        what = f"the level is {level:g}, but the band ends at {volume.background:g}"
    elif isinstance(volume, Grid) and min(volume.values.shape) < 2:
        what = f"the grid has {' x '.join(map(str, volume.values.shape))} nodes, so it has no cell"
    else:
        return
    fix = "pass a level that values lie on both sides of"
    raise ReportError(what, "volume, level=...", fix)
