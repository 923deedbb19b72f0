"""Write the topology of a ``.vdb`` tree: which nodes there are, and the tiles between them.

It begins with uint32 1, the background at full width, the number of root tiles and of upper nodes
(uint32). A root tile is its origin (3 int32), value and active flag (1 byte). An upper node is its
origin, a multiple of 4096, then a node. A node is a child mask, an active mask, values (see
`vdb_values`), then its children: of 32^3 entries for an upper node, of 16^3 for a lower one. A
leaf is only its active mask here, 64 bytes. Entries count z fastest, and so do the bits of masks.

Upper nodes are 4096 voxels a side, the upper pages of a `BrickIndex` 2048, and these may begin at
any multiple of 128. So every upper node gathers the codes of its 32^3 lower pages.
"""

import struct

import numpy as np

from ..arrays import Ijk, Indices
from ..grid import BrickIndex
from ..grid.brick_index import INSIDE, OUTSIDE, PAGE
from .vdb_encode import encode_nodes
from .vdb_grid import VdbGrid
from .vdb_leaves import leaf_masks
from .vdb_pages import UPPER, UPPER_NODES, find_pages
from .vdb_stream import ByteArray, VdbWriter
from .vdb_values import ValueLayout, full_width

_NODES_AT_ONCE = 128


def write_topology(writer: VdbWriter, grid: VdbGrid, layout: ValueLayout) -> Indices:
    """Write the tree of a grid down to the masks of its leaves; return their slots in order."""
    tiles, nodes = [], []
    for place in _upper_places(grid.index):
        codes = find_pages(grid.index, UPPER * place + _LOCAL)
        origin = struct.pack("<3i", *(place * UPPER_NODES).tolist())
        if (codes == codes[0]).all() and codes[0] < 0:
            tiles.append((origin, codes[0]))
        else:
            nodes.append((origin, codes))
    writer.numbers("I", 1)
    writer.write(full_width(layout.background, layout))
    writer.numbers("2I", len(tiles), len(nodes))
    for origin, code in tiles:
        value = grid.code_values[-1 - code]
        # As OpenVDB does, the values of tiles are not rounded here, but the background is
        value = full_width(value, layout) if code >= INSIDE else value.tobytes()
        writer.write(origin + value + bytes([int(grid.code_active[-1 - code])]))
    order = [np.empty(0, np.int32)]
    for origin, codes in nodes:
        writer.write(origin + _encoded(codes[None], grid, layout)[0].tobytes())
        numbers = codes[codes >= 0]
        for first in range(0, len(numbers), _NODES_AT_ONCE):
            chosen = numbers[first : first + _NODES_AT_ONCE]
            entries = grid.index.pages[chosen].reshape(len(chosen), -1)
            order.append(entries[entries >= 0])
            writer.write(_lower_nodes(entries, grid, layout))
    return np.concatenate(order)


_LOCAL = np.indices((UPPER, UPPER, UPPER)).reshape(3, -1).T


def _upper_places(index: BrickIndex) -> Ijk:
    """Places, in units of upper nodes, of those that may hold something; x slowest."""
    first = index.page_origin + PAGE * np.argwhere(index.root != OUTSIDE)
    last = first + PAGE - 1
    corners = [np.where(corner, last, first) // UPPER for corner in np.ndindex(2, 2, 2)]
    places = np.unique(np.concatenate(corners), axis=0)
    reaches = [(find_pages(index, UPPER * p + _LOCAL) != OUTSIDE).any() for p in places]
    return places[np.array(reaches, bool)]


def _lower_nodes(entries: np.ndarray, grid: VdbGrid, layout: ValueLayout) -> bytes:
    """Lower nodes (k, 4096), each followed by the masks of its leaves."""
    nodes, ends = _encoded(entries, grid, layout)
    masks = leaf_masks(grid.active[entries[entries >= 0]])
    last = np.cumsum(np.count_nonzero(entries >= 0, axis=1))
    parts = zip(np.split(nodes, ends[:-1]), np.split(masks, last[:-1]), strict=True)
    return b"".join([part.tobytes() for pair in parts for part in pair])


def _encoded(codes: np.ndarray, grid: VdbGrid, layout: ValueLayout) -> tuple[ByteArray, np.ndarray]:
    """Masks and values of ``k`` nodes whose (k, n) entries are numbers of children or codes."""
    child = codes >= 0
    tile = np.where(child, 0, -1 - codes)
    values = grid.code_values[tile]
    values[child] = 0
    masks = [child, grid.code_active[tile] & ~child]
    heads = [np.packbits(mask, axis=1, bitorder="little") for mask in masks]
    children, active = (head.view("<u8").astype(np.uint64, copy=False) for head in heads)
    rows = np.arange(len(codes), dtype=np.int32)
    return encode_nodes(values, rows, active, children, np.concatenate(heads, axis=1), layout)
