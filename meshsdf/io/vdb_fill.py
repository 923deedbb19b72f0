"""Turn the tiles of a level set into what a band can say: inside, outside, or bricks."""

from dataclasses import replace

import numpy as np

from ..grid import BrickIndex
from ..grid.brick_index import BRICK, INSIDE, OUTSIDE, PAGE
from .vdb_grid import VdbGrid
from .vdb_pages import page_places
from .vdb_stream import UnsuitedError

LEAST_FILL = 1 << 14
"""Active tiles may become this many bricks (32 MiB of floats), or four for every leaf, if more."""


def fill_tiles(grid: VdbGrid) -> tuple[VdbGrid, int]:
    """Return the grid without tiles of its own, and how many of them lost their value.

    Active tiles become bricks. Inactive ones become inside where they are negative and outside
    elsewhere, which loses their value unless it is the background's.

    Raises
    ------
    UnsuitedError
        There are too many active tiles.
    """
    if grid.tile_values is None or len(grid.tile_values) == 0:
        return grid, 0
    index = grid.index
    n_upper = int(np.count_nonzero(index.root >= 0))
    is_active = grid.code_active
    large = _has_active(index.root, is_active)
    coarse = _has_active(index.pages[:n_upper], is_active)
    fine = _has_active(index.pages[n_upper:], is_active)
    n_new = large.sum() * PAGE**6 + coarse.sum() * PAGE**3 + fine.sum()
    limit = max(LEAST_FILL, 4 * index.n_bricks)
    if n_new > limit:
        raise UnsuitedError(
            f"active tiles of the level set {grid.name!r} would become {n_new} bricks of 8^3; "
            f"{limit} are allowed beside its {index.n_bricks} leaves",
            "deactivate or prune them where it was made, or read it with read_vdb_grids",
        )
    side = np.where(grid.code_values < 0, INSIDE, OUTSIDE).astype(np.int32)
    is_odd = ~is_active & (np.abs(grid.code_values) != grid.background)
    tables = (index.root, index.pages)
    n_odd = sum(int(is_odd[-1 - table[table < 0]].sum()) for table in tables)
    return _filled(grid, coarse, fine, n_upper, side), n_odd


def _has_active(table: np.ndarray, is_active: np.ndarray) -> np.ndarray:
    return is_active[np.maximum(-1 - table, 0)] & (table < 0)


def _filled(grid, coarse, fine, n_upper, side) -> VdbGrid:
    """Bricks in place of active tiles; ``coarse`` and ``fine`` mark them in the page table."""
    index = grid.index
    pages = np.concatenate([index.pages, np.empty((coarse.sum(), PAGE, PAGE, PAGE), np.int32)])
    upper = pages[:n_upper]
    # A tile of 128^3 becomes a page of which every brick is a tile of 8^3
    pages[len(index.pages) :] = upper[coarse][:, None, None, None]
    upper[coarse] = np.arange(len(index.pages), len(pages), dtype=np.int32)
    lower = pages[n_upper:]
    tiles = np.concatenate([fine, np.ones((coarse.sum(), PAGE, PAGE, PAGE), bool)])
    codes = -1 - lower[tiles]
    lower[tiles] = np.arange(index.n_bricks, index.n_bricks + len(codes), dtype=np.int32)
    root = index.root.copy()
    for table in (root, pages):
        table[table < 0] = side[-1 - table[table < 0]]
    whole = BrickIndex(index.coordinates, index.page_origin, root, pages)
    places = page_places(whole)[1]
    at = np.argwhere(lower >= 0)
    coordinates = np.empty((index.n_bricks + len(codes), 3), np.int64)
    coordinates[lower[lower >= 0]] = PAGE * places[at[:, 0]] + at[:, 1:]
    order = np.lexsort(coordinates.T[::-1])
    rank = np.empty(len(order), np.int32)
    rank[order] = np.arange(len(order), dtype=np.int32)
    lower[lower >= 0] = rank[lower[lower >= 0]]
    values, active = grid.values, grid.active
    if len(codes):
        shape = (len(codes), BRICK, BRICK, BRICK)
        new = np.broadcast_to(grid.code_values[codes][:, None, None, None], shape)
        everywhere = np.full((len(codes), BRICK), ~np.uint64(0))
        values = np.concatenate([values, new])[order]
        active = np.concatenate([active, everywhere])[order]
    index = BrickIndex(coordinates[order], index.page_origin, root, pages)
    none = {"tile_values": None, "tile_active": None}
    return replace(grid, index=index, values=values, active=active, **none)
