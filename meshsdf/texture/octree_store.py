"""An octree as arrays, so that a project finds its texels where they were, and soon."""

import numpy as np

from ..kernels.octree_tables import ANY_PART, FIRST_BITS
from .octree import Octree, assembled
from .octree_levels import Level, Reach

NAMES = ("level_first", "bricks", "masks", "sheets", "texel_normals")
PARTS = ("parts", "texel_parts", "face_parts")


def octree_arrays(octree: Octree) -> dict[str, np.ndarray]:
    """All that cannot be found out from the rest; `PARTS` only where sheets are divided."""
    tables = octree.tables
    arrays = {
        "level_first": octree.level_first.astype("<i8"),
        "bricks": tables.bricks.astype("<i4"),
        "masks": tables.masks.astype("<u8"),
        "sheets": tables.sheets.astype("<f4"),
        "texel_normals": tables.texel_normals,
    }
    if octree.is_divided:
        arrays["parts"] = _entry_parts(octree).astype("<i4")
        arrays["texel_parts"] = tables.texel_parts
        arrays["face_parts"] = octree.face_parts
    return arrays


def octree_of_arrays(texel: float, arrays: dict[str, np.ndarray]) -> Octree:
    """The octree that `octree_arrays` took apart."""
    bricks = arrays["bricks"].astype(np.int64)
    masks, sheets = arrays["masks"].astype(np.uint64), arrays["sheets"].astype(np.float32)
    normals = arrays["texel_normals"]
    parts, texel_parts, face_parts = (arrays.get(name, np.empty(0)) for name in PARTS)
    if not len(face_parts):
        parts, texel_parts = np.full(len(bricks), ANY_PART), texel_parts[:0]
    counts = np.bitwise_count(masks).sum(axis=1, dtype=np.int64)
    texels = np.concatenate([[0], np.cumsum(counts)])
    levels = []
    for begin, end in zip(arrays["level_first"][:-1], arrays["level_first"][1:], strict=True):
        of, own = slice(begin, end), slice(texels[begin], texels[end])
        n_sheets, reach = _reach(bricks[of])
        of_faces = parts[of].astype(np.int32), texel_parts[own].astype(np.uint8)
        levels.append(Level(reach, n_sheets, masks[of], sheets[of], normals[own], *of_faces))
    return assembled(texel, levels, face_parts.astype(np.uint8))


def _reach(bricks: np.ndarray) -> tuple[np.ndarray, Reach]:
    """How many entries, which lie beside each other, every brick has, and the bricks."""
    is_first = np.ones(len(bricks), bool)
    is_first[1:] = (bricks[1:] != bricks[:-1]).any(axis=1)
    n = int(is_first.sum())
    n_sheets = np.bincount(np.cumsum(is_first) - 1, minlength=n).astype(np.int32)
    no_faces = np.zeros(0, np.int32)
    return n_sheets, Reach(bricks[is_first], np.zeros(n + 1, np.int64), no_faces)


def _entry_parts(octree: Octree) -> np.ndarray:
    """(e,) int32 bits of the parts of every entry."""
    parts = np.full(octree.n_entries, ANY_PART, np.int32)
    for row in octree.tables.groups:
        parts[row[0] : row[0] + row[1]] = row[FIRST_BITS : FIRST_BITS + row[1]]
    return parts
