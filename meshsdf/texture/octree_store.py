"""An octree as arrays, so that a project finds its texels where they were, and soon."""

import numpy as np

from ..kernels.sheets import MAX_SHEETS
from .octree import Octree, _assembled, _Level, _Reach

NAMES = ("level_first", "bricks", "masks", "sheets", "texel_normals")


def octree_arrays(octree: Octree) -> dict[str, np.ndarray]:
    """All that cannot be found out from the rest."""
    tables = octree.tables
    return {
        "level_first": octree.level_first.astype("<i8"),
        "bricks": tables.bricks.astype("<i4"),
        "masks": tables.masks.astype("<u8"),
        "sheets": tables.sheets.astype("<f4"),
        "texel_normals": tables.texel_normals,
    }


def octree_of_arrays(texel: float, arrays: dict[str, np.ndarray]) -> Octree:
    """The octree that `octree_arrays` took apart."""
    bricks = arrays["bricks"].astype(np.int64)
    masks, sheets = arrays["masks"].astype(np.uint64), arrays["sheets"].astype(np.float32)
    normals = arrays["texel_normals"]
    counts = np.bitwise_count(masks).sum(axis=1, dtype=np.int64)
    texels = np.concatenate([[0], np.cumsum(counts)])
    levels = []
    for begin, end in zip(arrays["level_first"][:-1], arrays["level_first"][1:], strict=True):
        own = normals[texels[begin] : texels[end]]
        levels.append(_level(bricks[begin:end], masks[begin:end], sheets[begin:end], own))
    return _assembled(texel, levels)


def _level(bricks, masks, sheets, texel_normals) -> _Level:
    """Entries of one brick lie beside each other; they become rows of sheets."""
    is_first = np.ones(len(bricks), bool)
    is_first[1:] = (bricks[1:] != bricks[:-1]).any(axis=1)
    row = np.cumsum(is_first) - 1
    sheet = np.arange(len(bricks)) - np.flatnonzero(is_first)[row]
    n = int(is_first.sum())
    all_masks = np.zeros((n, MAX_SHEETS, masks.shape[1]), np.uint64)
    means = np.zeros((n, MAX_SHEETS, 3), np.float32)
    all_masks[row, sheet], means[row, sheet] = masks, sheets
    no_faces = np.zeros(0, np.int32)
    reach = _Reach(bricks[is_first], np.zeros(n + 1, np.int64), no_faces)
    n_sheets = np.bincount(row, minlength=n).astype(np.int32)
    return _Level(reach, all_masks, n_sheets, means, texel_normals)
