"""A texture's colours as grids of a ``.vdb`` file: bricks become leaves, texels voxels."""

import os
from dataclasses import dataclass

import numpy as np

from ..grid.brick_index import BrickIndex
from ..texture.volume_texture import VolumeTexture
from .vdb import Compression, write_vdb_grids
from .vdb_grid import VdbGrid


@dataclass(frozen=True, eq=False)
class _Colors:
    """Colours (or alpha) of bricks that are looked up when they are written."""

    texture: VolumeTexture
    level: int
    index: BrickIndex
    alpha: bool

    @property
    def dtype(self) -> np.dtype:
        return np.dtype(np.float32)

    @property
    def shape(self) -> tuple[int, ...]:
        n = self.index.n_bricks
        return (n, 8, 8, 8) if self.alpha else (n, 8, 8, 8, 3)

    def __getitem__(self, slots: np.ndarray) -> np.ndarray:
        octree = self.texture.octree
        bricks = self.index.coordinates[slots]
        entries = octree.find(self.level, bricks)
        entries, brick = _with_other_sheets(octree, entries)
        points, normals = self.texture.places(entries)
        spacing = octree.spacing(self.level)
        parts = self.texture.texel_parts(entries)
        colors = self.texture.colors(points, normals, spacing, parts=parts)
        first = octree.tables.texel_first
        owner = np.repeat(brick, first[entries + 1] - first[entries])
        node = np.rint(points / spacing).astype(np.int64) - 8 * bricks[owner]
        out = np.zeros((len(bricks), *self.shape[1:]), np.float32)
        values = colors[:, 3] if self.alpha else colors[:, :3]
        # The first sheet of a brick has the last word
        for sheet in (True, False):
            of = np.repeat(_is_other(entries, brick), first[entries + 1] - first[entries]) == sheet
            out[(owner[of], *node[of].T)] = values[of]
        return out


def write_vdb_texture(
    path: str | os.PathLike,
    texture: VolumeTexture,
    *,
    level: int = 0,
    half: bool = False,
    force: bool = False,
    compression: Compression = "active",
) -> None:
    """Write the grids "Cd" (vec3s, linear RGB) and, unless all is opaque, "alpha" (float).

    Parameters
    ----------
    path : path
        The ``.vdb`` file.
    texture : VolumeTexture
        What it shows, all visible layers together.
    level : int
        Which level's texels become voxels; 0 is the finest.
    half, force, compression
        As for `write_vdb`.

    Raises
    ------
    IoError
        As `write_vdb_grids`.

    Notes
    -----
    Where two sides of something thin share a voxel, the file holds the colour of one.
    """
    octree = texture.octree
    index = octree.index(level)
    masks = np.zeros((index.n_bricks, 8), np.uint64)
    entries = octree.find(level, index.coordinates)
    entries, brick = _with_other_sheets(octree, entries)
    np.bitwise_or.at(masks, brick, octree.tables.masks[entries])
    matrix = np.diag([*[octree.spacing(level)] * 3, 1.0])
    grids = [_grid("Cd", _Colors(texture, level, index, False), index, masks, matrix, half)]
    alpha = _Colors(texture, level, index, True)
    if not _is_opaque(alpha, masks):
        grids.append(_grid("alpha", alpha, index, masks, matrix, half))
    write_vdb_grids(path, grids, force=force, compression=compression)


def _grid(name, values, index, masks, matrix, half: bool) -> VdbGrid:
    background = np.zeros(values.shape[4:], np.float32)
    metadata = {"vector_type": "invariant"} if name == "Cd" else {}
    return VdbGrid(
        name, index, values, masks, background, matrix, "unknown", metadata=metadata, is_half=half
    )


def _is_opaque(alpha: _Colors, masks: np.ndarray) -> bool:
    bits = np.unpackbits(masks.astype("<u8").view(np.uint8), bitorder="little").view(bool)
    needed = bits.reshape(-1, 8, 8, 8)
    for start in range(0, len(masks), 1024):
        part = slice(start, start + 1024)
        slots = np.arange(len(masks))[part]
        if (alpha[slots][needed[part]] != 1).any():
            return False
    return True


def _with_other_sheets(octree, entries: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """All entries of the bricks of which one entry each is given, and which brick each has."""
    groups = octree.tables.groups
    brick = np.arange(len(entries))
    if len(groups) == 0:
        return entries, brick
    order = np.searchsorted(groups[:, 0], entries, side="right") - 1
    first, count = groups[order, 0], groups[order, 1]
    inside = np.flatnonzero((order >= 0) & (entries < first + count))
    row = np.repeat(inside, count[inside])
    begin = np.repeat(np.cumsum(count[inside]) - count[inside], count[inside])
    all_sheets = first[row] + np.arange(len(row)) - begin
    other = all_sheets != entries[row]
    return (
        np.concatenate([entries, all_sheets[other]]).astype(np.int32),
        np.concatenate([brick, brick[row[other]]]),
    )


def _is_other(entries: np.ndarray, brick: np.ndarray) -> np.ndarray:
    """Which entries were added by `_with_other_sheets`."""
    later = np.zeros(len(entries), bool)
    later[int(brick.max(initial=-1)) + 1 :] = True
    return later
