"""Narrow bands and grids of functions that are known everywhere, built without a mesh."""

import numpy as np

from meshsdf.grid import BrickIndex, Grid, NarrowBand
from meshsdf.kernels.brick_lookup import mark_runs_inside


def sphere_distance(points, center=(0.0, 0.0, 0.0), radius=1.0):
    return np.linalg.norm(points - np.asarray(center), axis=-1) - radius


def torus_distance(points, major=1.0, minor=0.4):
    return np.hypot(np.hypot(points[..., 0], points[..., 1]) - major, points[..., 2]) - minor


def nodes_of(lower, shape):
    """(..., 3) integer coordinates of the nodes from ``lower`` on."""
    return np.stack(np.indices(shape), axis=-1) + np.asarray(lower, np.int64)


def band_from_blocks(blocks, lower, half_width, voxel_size=1.0, translation=(0.0, 0.0, 0.0)):
    """A band from (x, y, z, 8, 8, 8) values: a block is missing when it is +-background all over.

    ``lower`` is the brick coordinate of the first block.
    """
    background = np.float32(half_width * voxel_size)
    blocks = np.clip(blocks, -background, background).astype(np.float32)
    n_blocks = blocks.shape[:3]
    flat = blocks.reshape(-1, 8, 8, 8)
    stored = (np.abs(flat) < background).any(axis=(1, 2, 3))
    stored |= flat.min(axis=(1, 2, 3)) != flat.max(axis=(1, 2, 3))
    everywhere = np.argwhere(np.ones(n_blocks, bool)) + np.asarray(lower, np.int64)
    inside = everywhere[~stored & (flat[:, 0, 0, 0] < 0)]
    index = BrickIndex.from_coordinates(everywhere[stored], runs_of(inside))
    values = flat[stored]
    active = np.packbits((np.abs(values) < background).reshape(-1, 8, 64), -1, "little")
    return NarrowBand(
        index,
        values,
        active.view("<u8")[..., 0].astype(np.uint64),
        voxel_size,
        np.asarray(translation, float),
        half_width,
        "parity",
    )


def mark_inside(index, bricks):
    """Enter INSIDE in the page table."""
    mark_runs_inside(index.root, index.pages, runs_of(bricks - index.origin))


def runs_of(bricks):
    """Bricks (n, 3) as runs of one."""
    return np.column_stack([bricks, bricks[:, 2] + 1])


def blocks_from_nodes(values):
    """(8 x, 8 y, 8 z) node values as (x, y, z, 8, 8, 8)."""
    x, y, z = (n // 8 for n in values.shape)
    return values.reshape(x, 8, y, 8, z, 8).transpose(0, 2, 4, 1, 3, 5)


def band_of(distance, lower, n_blocks, voxel_size, half_width=3.0, translation=(0.0, 0.0, 0.0)):
    """The band of ``distance(points)`` over the bricks ``lower ... lower + n_blocks - 1``."""
    ijk = nodes_of(np.asarray(lower) * 8, np.asarray(n_blocks) * 8)
    values = distance(voxel_size * ijk + np.asarray(translation))
    return band_from_blocks(blocks_from_nodes(values), lower, half_width, voxel_size, translation)


def grid_of(distance, lower, shape, voxel_size):
    """The dense grid of ``distance(points)`` at the nodes from ``lower`` on."""
    values = distance(voxel_size * nodes_of(lower, shape))
    return Grid(values, voxel_size, voxel_size * np.asarray(lower, float))
