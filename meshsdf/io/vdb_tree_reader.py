"""Read the topology of a ``.vdb`` tree into a page table; `vdb_tree_writer` has the layout.

An upper node (4096 voxels a side) becomes eight upper pages (2048), each of them only if it is not
one block. Sizes are checked before memory is taken: an upper node takes at least 8 KiB of the file
and gives 128 KiB of pages, a lower one 1 KiB and 16, a leaf 129 bytes and, of floats, 2 KiB. So
no file gives more than some twenty times its size, whatever it says.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool

from ..arrays import Ijk, Indices
from ..grid import BrickIndex
from ..grid.brick_index import BRICK, INSIDE, OUTSIDE, PAGE, number_marked
from ..kernels.vdb_read import END
from .vdb_decode import decode_nodes, scan_nodes
from .vdb_leaves import MASK_BYTES
from .vdb_pages import PAGE_NODES, UPPER, UPPER_NODES
from .vdb_stream import VdbReader
from .vdb_values import ValueLayout, same_bits

LEAST_ROOT, PER_NODE, PER_TILE = 1 << 12, 1 << 15, 1 << 6
"""Blocks of 2048^3 voxels that a grid may span, and how many more for each node and root tile."""

_FIRST_TILE = INSIDE - 1
_HALF = UPPER // PAGE  # upper pages along a side of an upper node
_SMALLEST_UPPER = 13 + UPPER**3 // 4
_SMALLEST_LOWER = 1 + PAGE**3 // 4


@dataclass(frozen=True, eq=False)
class Topology:
    """What the first part of a tree says.

    Attributes
    ----------
    index : BrickIndex
        The bricks and tiles.
    slots : (b,) int32
        Slot of every leaf, in the order of the file.
    tile_values, tile_active : (t,) or (t, c) array, (t,) bool
        What the codes -3, -4, … of the index stand for, each pair once.
    """

    index: BrickIndex
    slots: Indices
    tile_values: np.ndarray
    tile_active: Bool[np.ndarray, " t"]


def read_background(reader: VdbReader, dtype: np.dtype, shape: tuple[int, ...]) -> np.ndarray:
    """Read the head of a tree; return the background."""
    n_buffers = reader.number("I")
    if n_buffers != 1:
        raise ValueError(f"a tree has {n_buffers} values per voxel; only 1 can be read")
    n = int(np.prod(shape, dtype=int))
    data = reader.take(n * dtype.itemsize)
    return np.frombuffer(data, dtype.newbyteorder("<")).astype(dtype).reshape(shape)


def read_topology(reader: VdbReader, layout: ValueLayout) -> Topology:
    """Read the tree whose background was just read.

    Raises
    ------
    ValueError
        It is cut off, its nodes overlap or are misplaced, or it spans too much.
    """
    tree = _Tree(reader, layout)
    n_tiles, n_nodes = reader.numbers("2I")
    tile_origins, tile_codes = tree.read_root_tiles(n_tiles)
    reader.expect(n_nodes * _SMALLEST_UPPER, f"{n_nodes} upper nodes")
    nodes = [tree.read_upper() for _ in range(n_nodes)]
    node_origins = np.array([origin for origin, _ in nodes], np.int64).reshape(-1, 3)
    node_codes = np.array([codes for _, codes in nodes], np.int32).reshape(-1, UPPER**3)
    origins = np.concatenate([tile_origins, node_origins])
    if (origins % UPPER_NODES).any():
        raise ValueError("an upper node does not begin at a multiple of 4096")
    places = origins // UPPER_NODES
    if len(np.unique(places, axis=0)) < len(places):
        raise ValueError("two upper nodes or tiles have the same place")
    lower = np.concatenate([np.empty((0, PAGE**3), np.int32), *tree.lower])
    tile_values, tile_active = tree.merge_tiles(tile_codes, node_codes, lower)
    leaves = np.concatenate([np.empty((0, 3), np.int64), *tree.leaves])
    slots = np.empty(len(leaves), np.int32)
    order = np.lexsort(leaves.T[::-1])
    slots[order] = np.arange(len(leaves), dtype=np.int32)
    lower[lower >= 0] = slots[lower[lower >= 0]]
    corners = np.indices((_HALF, _HALF, _HALF)).reshape(3, -1).T
    eighths = (_HALF * places[:, None] + corners).reshape(-1, 3)
    _check_span(places, LEAST_ROOT + PER_NODE * n_nodes + PER_TILE * n_tiles)
    index = _index(leaves[order], eighths, np.repeat(tile_codes, _HALF**3), node_codes, lower)
    return Topology(index, slots, tile_values, tile_active)


def _check_span(places: Ijk, limit: int) -> None:
    """Refuse nodes so far apart that the table of all blocks between them would be too large."""
    if len(places) == 0:
        return
    shape = _HALF * (places.max(axis=0) - places.min(axis=0) + 1)
    if np.prod(shape.astype(float)) > limit:
        raise ValueError(
            f"its nodes span {' x '.join(str(n) for n in shape * PAGE_NODES * PAGE)} voxels; "
            f"{limit} blocks of 2048^3 are allowed for so few"
        )


class _Tree:
    """What has been read of a tree so far.

    Codes below -2 are a running number of tiles until `merge_tiles`; numbers of lower nodes and
    of leaves run in the order of the file.
    """

    def __init__(self, reader: VdbReader, layout: ValueLayout) -> None:
        self.reader, self.layout = reader, layout
        self.lower: list[np.ndarray] = []
        self.leaves: list[np.ndarray] = []
        self.n_lower = self.n_leaves = self.n_tiles = 0
        shape = (0, *layout.background.shape)
        self.tile_values, self.tile_active = [np.empty(shape, layout.dtype)], [np.empty(0, bool)]

    def read_root_tiles(self, n_tiles: int) -> tuple[Ijk, Indices]:
        """Origins and codes of the largest tiles."""
        width, shape = self.layout.width, self.layout.background.shape
        record = np.dtype([("origin", "<i4", 3), ("value", f"V{width}"), ("active", "u1")])
        self.reader.expect(n_tiles * record.itemsize, f"{n_tiles} root tiles")
        tiles = np.frombuffer(self.reader.take(n_tiles * record.itemsize), record)
        values = np.frombuffer(tiles["value"].tobytes(), self.layout.dtype.newbyteorder("<"))
        values = values.astype(self.layout.dtype).reshape(n_tiles, *shape)
        if self.layout.is_half:
            # These alone are not rounded, so the background is not quite itself among them
            rounded = values.astype(self.layout.stored).astype(self.layout.dtype)
            sides = (self.layout.background, self.layout.opposite)
            is_side = same_bits(rounded, sides[0]) | same_bits(rounded, sides[1])
            values[is_side] = rounded[is_side]
        return tiles["origin"].astype(np.int64), self._codes(values, tiles["active"] != 0)

    def read_upper(self) -> tuple[tuple[int, int, int], Indices]:
        """Origin of an upper node, and the numbers of its lower nodes, or codes."""
        origin = self.reader.numbers("3i")
        codes, child = self._read_node(UPPER**3)
        numbers = np.flatnonzero(child)
        self.reader.expect(len(numbers) * _SMALLEST_LOWER, f"{len(numbers)} lower nodes")
        codes[numbers] = np.arange(self.n_lower, self.n_lower + len(numbers))
        self.n_lower += len(numbers)
        first = np.array(origin, np.int64) // (BRICK * PAGE)
        pages = np.empty((len(numbers), PAGE**3), np.int32)
        for page, number in zip(pages, numbers.tolist(), strict=True):
            place = np.array([number >> 10, number >> 5 & 31, number & 31])
            page[:] = self._read_lower(first + place)
        self.lower.append(pages)
        return origin, codes

    def _read_lower(self, place: np.ndarray) -> Indices:
        """Entries of the lower node at a place, in units of lower nodes."""
        codes, child = self._read_node(PAGE**3)
        numbers = np.flatnonzero(child)
        codes[numbers] = np.arange(self.n_leaves, self.n_leaves + len(numbers))
        self.n_leaves += len(numbers)
        local = np.stack([numbers >> 8, numbers >> 4 & 15, numbers & 15], axis=1)
        self.leaves.append(PAGE * place + local)
        # The masks stand here and again before the values; as OpenVDB does, we go by the latter
        self.reader.expect(len(numbers) * MASK_BYTES, f"{len(numbers)} leaves")
        self.reader.seek(self.reader.at + len(numbers) * MASK_BYTES)
        return codes

    def _read_node(self, n: int) -> tuple[Indices, np.ndarray]:
        """Codes of a node's entries, and where it has children; the cursor is behind its values."""
        reader, layout = self.reader, self.layout
        child = np.unpackbits(np.frombuffer(reader.take(n // 8), np.uint8), bitorder="little")
        window = reader.fill(np.empty(min(layout.longest_node(n), reader.left), np.uint8))
        records = scan_nodes(window, n, 1, 0, layout)
        values = np.empty((1, n, *layout.background.shape), layout.dtype)
        words = np.empty((1, n // 64), np.uint64)
        decode_nodes(window, records, layout, values, words, np.zeros(1, np.int32))
        active = np.unpackbits(words.astype("<u8").view(np.uint8), bitorder="little").view(bool)
        reader.seek(reader.at + int(records[0, END]))
        child = child.view(bool)
        return self._codes(values[0], active, child), child

    def _codes(self, values: np.ndarray, active: np.ndarray, child: np.ndarray | None = None):
        """Codes of tiles by their values; those of their own get the next numbers."""
        is_plus = same_bits(values, self.layout.background)
        is_minus = same_bits(values, self.layout.opposite)
        codes = np.where(is_minus & ~is_plus, INSIDE, OUTSIDE).astype(np.int32)
        odd = active | ~(is_plus | is_minus)
        if child is not None:
            odd &= ~child
        n = int(np.count_nonzero(odd))
        codes[odd] = _FIRST_TILE - np.arange(self.n_tiles, self.n_tiles + n, dtype=np.int32)
        self.n_tiles += n
        self.tile_values.append(values[odd])
        self.tile_active.append(active[odd])
        return codes

    def merge_tiles(self, *tables: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Give equal tiles one code in all tables; return the values and states of those left."""
        values, active = np.concatenate(self.tile_values), np.concatenate(self.tile_active)
        if len(values) == 0:
            return values, active
        rows = np.column_stack([values.reshape(len(values), -1).view(np.uint8), active])
        _, first, which = np.unique(rows, axis=0, return_index=True, return_inverse=True)
        merged = (_FIRST_TILE - which.ravel()).astype(np.int32)
        for table in tables:
            is_tile = table <= _FIRST_TILE
            table[is_tile] = merged[_FIRST_TILE - table[is_tile]]
        return values[first], active[first]


def _index(
    leaves: Ijk,
    eighths: np.ndarray,
    tile_codes: np.ndarray,
    node_codes: np.ndarray,
    lower: np.ndarray,
) -> BrickIndex:
    """The page table of sorted leaves.

    ``eighths`` are the places of upper pages, first those of root tiles, whose codes are given,
    then those of upper nodes, whose entries (k, 32^3) are numbers of rows of ``lower`` or codes.
    """
    pages = node_codes.reshape(-1, _HALF, PAGE, _HALF, PAGE, _HALF, PAGE)
    pages = pages.transpose(0, 1, 3, 5, 2, 4, 6).reshape(-1, PAGE**3)
    is_block = (pages[:, 0] < 0) & (pages == pages[:, :1]).all(axis=1)
    codes = np.concatenate([tile_codes, np.where(is_block, pages[:, 0], 0)])
    eighths, codes, pages = eighths[codes != OUTSIDE], codes[codes != OUTSIDE], pages[~is_block]
    low = eighths.min(axis=0) if len(eighths) else np.zeros(3, np.int64)
    shape = eighths.max(axis=0) - low + 1 if len(eighths) else np.zeros(3, np.int64)
    root = np.full(shape, OUTSIDE, np.int32)
    root[tuple((eighths - low).T)] = codes
    n_upper = number_marked(root, 0)
    upper = np.empty_like(pages)
    upper[root[tuple((eighths - low)[codes == 0].T)]] = pages
    used = upper[upper >= 0]
    upper[upper >= 0] = np.arange(n_upper, n_upper + len(used), dtype=np.int32)
    table = np.concatenate([upper, lower[used]]).reshape(-1, PAGE, PAGE, PAGE)
    return BrickIndex(leaves, low * PAGE, root, table)
