"""Where a texture's bricks are, as bytes for a page: the answer to GET /api/octree.

Everything counts from the wire's origin, a corner of a coarsest brick, so that coordinates are
small and float32 tells texels apart.
"""

import struct

import numpy as np

from ..arrays import Vector3
from ..grid.brick_index import BRICK
from ..texture.octree import Octree
from ..texture.volume_texture import VolumeTexture
from .messages import VERSION
from .plain_json import json_bytes
from .samples import octahedral_codes

NO_NORMAL = -32768
TYPES = {"i32": "<i4", "i16": "<i2", "u8": "|u1"}


def wire_origin(texture: VolumeTexture) -> Vector3:
    """Where coordinates on the wire count from, in the texture's space.

    The middle of the surface's box, rounded to whole coarsest bricks.
    """
    octree = texture.octree
    return _origin_bricks(texture) * (BRICK * octree.spacing(octree.n_levels - 1))


def octree_bytes(texture: VolumeTexture) -> bytes:
    """The page table of all levels: a JSON head and arrays, see `PROTOCOL.md`."""
    octree = texture.octree
    tables = octree.tables
    steps = 2 ** (octree.n_levels - 1 - np.arange(octree.n_levels))
    shifts = _origin_bricks(texture).astype(np.int64) * steps[:, None]
    heads = tables.heads.copy()
    heads[:, :3] -= shifts
    arrays = {
        "heads": ("i32", heads),
        "pages": ("i32", tables.pages),
        "groups": ("i32", tables.groups[:, :2]),
        "sheets": ("i16", _sheet_codes(octree)),
        "parents": ("i32", tables.parents),
        "levels": ("u8", tables.levels),
        "bricks": ("i32", tables.bricks - shifts[tables.levels]),
    }
    places, parts, at = {}, [], 0
    for name, (kind, array) in arrays.items():
        data = np.ascontiguousarray(array).astype(TYPES[kind]).tobytes()
        places[name] = {"type": kind, "shape": list(array.shape), "at": at}
        parts.append(data + bytes(-len(data) % 4))
        at += len(parts[-1])
    head = json_bytes(
        {
            "version": VERSION,
            "texel": octree.texel,
            "origin": wire_origin(texture).tolist(),
            "levels": octree.n_levels,
            "entries": octree.n_entries,
            "level_first": octree.level_first.tolist(),
            "arrays": places,
        }
    )
    head += b" " * (-len(head) % 4)
    return struct.pack("<I", len(head)) + head + b"".join(parts)


def _origin_bricks(texture: VolumeTexture) -> Vector3:
    """Coordinates of the brick of the coarsest level whose first corner is the origin."""
    octree = texture.octree
    if texture.surface is not None:
        box = texture.surface.box
        middle = (box.lower + box.upper) / 2
        return np.round(middle / (BRICK * octree.spacing(octree.n_levels - 1)))
    top = octree.tables.bricks[octree.level_first[-2] :]
    return np.round((top.min(axis=0) + top.max(axis=0) + 1) / 2)


def _sheet_codes(octree: Octree) -> np.ndarray:
    """(e, 2) int16 octahedral codes of the sheets' normals; (-32768, -32768) of none."""
    sheets = octree.tables.sheets.astype(np.float64)
    codes = octahedral_codes(sheets)
    codes[~sheets.any(axis=1)] = NO_NORMAL
    return codes
