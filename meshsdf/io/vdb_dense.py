"""Full grids as grids of a ``.vdb`` file, sparse where they are constant, and back.

Node (i, j, k) of a `Grid` is voxel (i, j, k), whatever its origin. A brick of 8^3 nodes with one
value becomes a tile, and 16^3 such bricks a larger one; a brick without values (NaN), or of the
background of a fog volume, is not stored at all. The shape stands in metadata as
``meshsdf_shape``, so that empty margins come back.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..arrays import BrickCoordinates, BrickMasks, Ijk1
from ..grid import BrickIndex, Grid
from ..grid.brick_grid import node_mask, node_words
from ..grid.brick_index import BRICK, OUTSIDE, PAGE
from .vdb_band import (
    HALF_WIDTH,
    SIGN,
    inner_words,
    placing,
    require_uniform,
    told_inner,
    told_sign,
)
from .vdb_grid import VdbGrid
from .vdb_pages import constant_blocks
from .vdb_stream import UnsuitedError

SHAPE, DOUBTS = "meshsdf_shape", "meshsdf_uncertain_voxels"

GridClass = Literal["level set", "fog volume"]

LEAST_DENSE = 1 << 26
"""A full grid may take this many bytes, or `DENSE_RATIO` times the file, if that is more."""

DENSE_RATIO = 1000

_BRICKS_AT_ONCE = 2048
_FIRST_TILE = -3


@dataclass(frozen=True, eq=False)
class _DenseLeaves:
    """The bricks (b, 8, 8, 8) of a full grid, cut out when asked for."""

    array: np.ndarray
    coordinates: BrickCoordinates
    active: BrickMasks
    background: np.ndarray

    @property
    def dtype(self) -> np.dtype:
        return self.background.dtype

    @property
    def shape(self) -> tuple[int, ...]:
        return (len(self.coordinates), BRICK, BRICK, BRICK)

    def __getitem__(self, slots: np.ndarray) -> np.ndarray:
        nodes = self.coordinates[slots][:, None, :] * BRICK + np.arange(BRICK)[:, None]
        i, j, k = np.minimum(nodes, np.array(self.array.shape) - 1).transpose(2, 0, 1)
        values = self.array[i[:, :, None, None], j[:, None, :, None], k[:, None, None, :]]
        return np.where(node_mask(self.active[slots]), values.astype(self.dtype), self.background)


def dense_to_grid(grid: Grid, name: str, grid_class: GridClass, *, is_half: bool) -> VdbGrid:
    """Return a full grid as bricks and tiles; values are rounded to float32.

    Notes
    -----
    As a level set, every node with a value is active, however far from the surface, and the
    background is the largest distance: nothing is clamped. As a fog volume, the background is 0,
    and nodes that are not 0 are active.

    Raises
    ------
    ValueError
        A fog volume has nodes without a value, or values exceed float32.
    """
    is_fog = grid_class == "fog volume"
    if is_fog and np.isnan(np.min(grid.values, initial=0)):
        raise ValueError("a fog volume has no place for NaN; put 0 where there is nothing")
    largest = max(
        np.fmax.reduce(grid.values, axis=None, initial=0),
        -np.fmin.reduce(grid.values, axis=None, initial=0),
    )
    if largest > np.finfo(np.float32).max:
        raise ValueError(f"values up to {largest:g} do not fit float32")
    background = np.array(0 if is_fog else largest or grid.voxel_size, np.float32)
    table, words, tile_values = _brick_table(grid.values, is_fog=is_fog)
    coordinates = np.argwhere(table >= 0)
    metadata = {SIGN: grid.sign, SHAPE: grid.values.shape}
    if grid.uncertain_voxels is not None:
        metadata[DOUBTS] = grid.uncertain_voxels
    if grid.half_width is not None:
        metadata[HALF_WIDTH] = float(grid.half_width)
    metadata |= inner_words(grid)
    return VdbGrid(
        name,
        _paged(table, coordinates),
        _DenseLeaves(grid.values, coordinates, words, background),
        words,
        background,
        placing(grid.voxel_size, grid.origin),
        grid_class if grid.is_signed or is_fog else "unknown",
        tile_values,
        np.ones(len(tile_values), bool),
        metadata,
        is_half,
    )


def _brick_table(values: np.ndarray, *, is_fog: bool) -> tuple[np.ndarray, BrickMasks, np.ndarray]:
    """Slot or code of every brick, the masks of those stored, the values of tiles."""
    shape = np.array([-(-n // BRICK) for n in values.shape])
    table = np.full(shape, OUTSIDE, np.int32)
    words, constants = [np.empty((0, BRICK), np.uint64)], [np.empty(0, np.float32)]
    padded = np.empty((BRICK, *(shape[1:] * BRICK)), np.float32)
    for x in range(shape[0]):
        plane = values[x * BRICK : (x + 1) * BRICK]
        padded[:] = np.nan
        padded[tuple(slice(n) for n in plane.shape)] = plane
        bricks = padded.reshape(BRICK, shape[1], BRICK, shape[2], BRICK).transpose(1, 3, 0, 2, 4)
        active = ~np.isnan(bricks)
        if is_fog:
            active &= bricks != 0
        # Equal bit by bit: -0.0 is not 0.0
        bits = bricks.view(np.uint32)
        same = active.all(axis=(2, 3, 4)) & (bits == bits[..., :1, :1, :1]).all(axis=(2, 3, 4))
        table[x][same] = _FIRST_TILE
        table[x][~same & active.any(axis=(2, 3, 4))] = 0
        words.append(node_words(active[table[x] == 0]))
        constants.append(bricks[same][:, 0, 0, 0])
    stored = table == 0
    table[stored] = np.arange(np.count_nonzero(stored), dtype=np.int32)
    tiles, which = np.unique(np.concatenate(constants).view(np.uint32), return_inverse=True)
    table[table == _FIRST_TILE] = _FIRST_TILE - which.astype(np.int32)
    return table, np.concatenate(words), tiles.view(np.float32)


def _paged(table: np.ndarray, coordinates: BrickCoordinates) -> BrickIndex:
    """The page table of a full table of slots and codes."""
    coarse, lower = _folded(table)
    root, upper = _folded(coarse)
    root[root >= 0] = np.arange(len(upper), dtype=np.int32)
    upper[upper >= 0] = np.arange(len(upper), len(upper) + len(lower), dtype=np.int32)
    return BrickIndex(coordinates, np.zeros(3, np.int64), root, np.concatenate([upper, lower]))


def _folded(table: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Blocks of 16^3 entries: their one code, or 0; and those with more than one, in order."""
    nx, ny, nz = (-(-n // PAGE) for n in table.shape)
    full = np.full((nx * PAGE, ny * PAGE, nz * PAGE), OUTSIDE, np.int32)
    full[tuple(slice(n) for n in table.shape)] = table
    blocks = full.reshape(nx, PAGE, ny, PAGE, nz, PAGE).transpose(0, 2, 4, 1, 3, 5)
    first = blocks[..., 0, 0, 0]
    is_one = (first < 0) & (blocks == first[..., None, None, None]).all(axis=(3, 4, 5))
    return np.where(is_one, first, 0).astype(np.int32), blocks[~is_one]


def grid_to_dense(grid: VdbGrid, file_bytes: int) -> Grid:
    """Return a grid of scalars on the box of its active voxels, with all it holds there.

    Raises
    ------
    UnsuitedError
        The transform does not suit a `Grid`, or the box is far larger than the file.
    """
    size = require_uniform(grid)
    _, low, high = grid.active_extent()
    shape, is_ours = high - low + 1, False
    told = grid.metadata.get(SHAPE)
    if isinstance(told, tuple) and len(told) == 3 and (low >= 0).all() and (high < told).all():
        low, shape, is_ours = np.zeros(3, np.int64), np.array(told, np.int64), True
    n_bytes, limit = 4 * np.prod(shape.astype(float)), max(LEAST_DENSE, DENSE_RATIO * file_bytes)
    if n_bytes > limit:
        raise UnsuitedError(
            f"the grid {grid.name!r} spans {' x '.join(map(str, shape))} voxels, {n_bytes:.3g} "
            f"bytes as a full grid; {limit:.3g} are allowed for a file of {file_bytes}",
            "read it with read_vdb_grids, which keeps it sparse",
        )
    only_active = is_ours and grid.grid_class != "fog volume"
    with np.errstate(over="ignore"):  # what does not fit becomes infinite, and is refused so
        values = _unpacked(grid, low, shape, only_active=only_active)
    default = "winding" if np.fmin.reduce(values, axis=None, initial=0) < 0 else "unsigned"
    doubts, width = grid.metadata.get(DOUBTS), grid.metadata.get(HALF_WIDTH)
    return Grid(
        values,
        size,
        grid.matrix[:3, 3] + size * low if low.any() else np.ascontiguousarray(grid.matrix[:3, 3]),
        told_sign(grid, default),
        doubts if isinstance(doubts, int) and is_ours else None,
        told_inner(grid) if is_ours else 0,
        half_width=width if isinstance(width, float) and is_ours else None,
    )


def _unpacked(grid: VdbGrid, low: Ijk1, shape: Ijk1, *, only_active: bool) -> np.ndarray:
    """The values in a box; NaN where there is nothing active, if only that is wanted."""
    out = np.full(shape, np.nan if only_active else grid.background, np.float32)
    for places, side, codes in constant_blocks(grid.index):
        start = np.clip(places - low, 0, shape)
        stop = np.clip(places - low + side, 0, shape)
        wanted = (start < stop).all(axis=1)
        if only_active:
            wanted &= grid.code_active[-1 - codes]
        values = grid.code_values[-1 - codes]
        boxes = (start[wanted].tolist(), stop[wanted].tolist(), values[wanted].tolist())
        for (i, j, k), (i1, j1, k1), value in zip(*boxes, strict=True):
            out[i:i1, j:j1, k:k1] = value
    flat = out.reshape(-1)
    offsets = np.indices((BRICK, BRICK, BRICK)).reshape(3, -1).T
    for first in range(0, grid.index.n_bricks, _BRICKS_AT_ONCE):
        chosen = slice(first, first + _BRICKS_AT_ONCE)
        nodes = (grid.index.coordinates[chosen] * BRICK - low)[:, None] + offsets
        wanted = ((nodes >= 0) & (nodes < shape)).all(axis=2)
        if only_active:
            wanted &= node_mask(grid.active[chosen]).reshape(wanted.shape)
        at = np.ravel_multi_index(tuple(nodes[wanted].T), tuple(shape))
        flat[at] = grid.values[chosen].reshape(wanted.shape)[wanted]
    return out
