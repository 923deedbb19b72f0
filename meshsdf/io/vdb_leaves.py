"""The values of all leaves of a tree, in the order of its topology: masks, then packed values.

A leaf is its active mask again (64 bytes), then a node's 512 values (see `vdb_values`). Leaves are
written and read some thousand at a time, so memory beyond the values themselves stays bounded.
"""

from itertools import chain

import numpy as np

from ..arrays import BrickMasks
from ..grid.brick_grid import node_mask
from ..grid.brick_index import BRICK
from .vdb_decode import NodeRecords, decode_nodes, scan_nodes
from .vdb_encode import encode_nodes
from .vdb_grid import VdbGrid
from .vdb_stream import VdbReader, VdbWriter
from .vdb_values import ValueLayout

LEAF = BRICK**3
MASK_BYTES = LEAF // 8

_LEAVES_AT_ONCE = 2048
_WINDOW = 1 << 22
_SMALLEST_LEAF = MASK_BYTES + 1


def write_leaves(writer: VdbWriter, grid: VdbGrid, order: np.ndarray, layout: ValueLayout) -> None:
    """Write the leaves whose slots are given in the order of the topology."""
    for first in range(0, len(order), _LEAVES_AT_ONCE):
        slots = order[first : first + _LEAVES_AT_ONCE]
        values = grid.values[slots].reshape(len(slots), LEAF, *layout.background.shape)
        words = grid.active[slots]
        active = node_mask(words).reshape(len(slots), LEAF)
        masks = leaf_masks(words)
        heads, data = encode_nodes(values, active, None, layout)
        writer.write(b"".join(chain.from_iterable(zip(masks, heads, data, strict=True))))


def leaf_masks(words: BrickMasks) -> list[bytes]:
    """The active mask of each brick as bytes: bit n is voxel (n >> 6, n >> 3 & 7, n & 7)."""
    masks = words.astype("<u8").tobytes()
    return [masks[at : at + MASK_BYTES] for at in range(0, len(masks), MASK_BYTES)]


def read_leaves(
    reader: VdbReader, slots: np.ndarray, layout: ValueLayout
) -> tuple[np.ndarray, BrickMasks]:
    """Read as many leaves as there are slots, each into its slot; return values and masks."""
    n_leaves = len(slots)
    reader.expect(n_leaves * _SMALLEST_LEAF, f"{n_leaves} leaves")
    side = (BRICK, BRICK, BRICK)
    values = np.empty((n_leaves, *side, *layout.background.shape), layout.dtype)
    active = np.empty((n_leaves, BRICK), np.uint64)
    done = 0
    while done < n_leaves:
        window, records = _next_leaves(reader, n_leaves - done, layout)
        found, _ = decode_nodes(window, records, LEAF, layout)
        here = slots[done : done + len(found)]
        values[here] = found.reshape(len(here), *values.shape[1:])
        active[here] = np.frombuffer(b"".join(records.masks), "<u8").reshape(-1, BRICK)
        done += len(here)
    return values, active


def skip_leaves(reader: VdbReader, n_leaves: int, layout: ValueLayout) -> None:
    """Move behind the leaves of a tree."""
    while n_leaves > 0:
        n_leaves -= len(_next_leaves(reader, n_leaves, layout)[1].ends)


def _next_leaves(
    reader: VdbReader, n_leaves: int, layout: ValueLayout
) -> tuple[bytes, NodeRecords]:
    """The next leaves, at least one, and the bytes they stand in; the cursor is behind them."""
    window = reader.window(_WINDOW)
    # Before the last window, leaves that could reach beyond it wait for the next
    is_last = len(window) == reader.left
    last = len(window) - (0 if is_last else layout.longest_node(LEAF))
    records = scan_nodes(window, LEAF, min(n_leaves, _LEAVES_AT_ONCE), last, layout)
    reader.seek(reader.at + records.ends[-1])
    return window, records
