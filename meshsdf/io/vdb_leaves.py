"""The values of all leaves of a tree, in the order of its topology: masks, then packed values.

A leaf is its active mask again (64 bytes), then a node's 512 values (see `vdb_values`). Leaves are
written and read in pieces, on all cores, so memory beyond the values themselves stays bounded.
"""

from threading import Lock

import numpy as np

from ..arrays import BrickMasks, Indices
from ..grid.brick_index import BRICK
from ..kernels.parallel import even_ranges, run_pieces
from ..kernels.vdb_read import END
from .vdb_decode import Records, decode_nodes, scan_nodes
from .vdb_encode import encode_nodes
from .vdb_grid import VdbGrid
from .vdb_stream import ByteArray, VdbReader, VdbWriter
from .vdb_values import ValueLayout

LEAF = BRICK**3
MASK_BYTES = LEAF // 8

_PIECE = 1 << 19  # bytes of values that are written as one
_PIECES_AT_ONCE = 64
_LEAVES_PER_PIECE = 512
_WINDOW = 1 << 22
_SMALLEST_LEAF = MASK_BYTES + 1


def write_leaves(writer: VdbWriter, grid: VdbGrid, order: Indices, layout: ValueLayout) -> None:
    """Write the leaves whose slots are given in the order of the topology."""
    # Not by the number of cores, on which the bytes would then depend
    per_piece = max(1, _PIECE // (LEAF * layout.width))
    starts = range(0, len(order), per_piece)
    for first in range(0, len(starts), _PIECES_AT_ONCE):
        some = starts[first : first + _PIECES_AT_ONCE]
        _write_in_turn(writer, [order[at : at + per_piece] for at in some], grid, layout)


def _write_in_turn(writer, pieces: list[np.ndarray], grid: VdbGrid, layout: ValueLayout) -> None:
    """Write pieces in order: whoever has made the next one writes it, and what waits behind it."""
    made: dict[int, ByteArray] = {}
    lock, n_written = Lock(), 0

    def work(piece: int) -> None:
        nonlocal n_written
        data = _encoded(grid, pieces[piece], layout)
        with lock:
            made[piece] = data
            while n_written in made:
                writer.write(made.pop(n_written).data)
                n_written += 1

    run_pieces(work, len(pieces))


def _encoded(grid: VdbGrid, slots: Indices, layout: ValueLayout) -> ByteArray:
    values, rows = grid.values, slots
    if not (isinstance(values, np.ndarray) and values.flags.c_contiguous):
        values, rows = values[slots], np.arange(len(slots), dtype=np.int32)
    active = grid.active[slots]
    return encode_nodes(values, rows, active, None, leaf_masks(active), layout)[0]


def leaf_masks(words: BrickMasks) -> np.ndarray:
    """The active masks of bricks as bytes (k, 64): bit n is voxel (n >> 6, n >> 3 & 7, n & 7)."""
    return words.astype("<u8", copy=False).view(np.uint8)


def read_leaves(
    reader: VdbReader, slots: Indices, layout: ValueLayout
) -> tuple[np.ndarray, BrickMasks]:
    """Read as many leaves as there are slots, each into its slot; return values and masks."""
    n_leaves = len(slots)
    reader.expect(n_leaves * _SMALLEST_LEAF, f"{n_leaves} leaves")
    side = (BRICK, BRICK, BRICK)
    values = np.empty((n_leaves, *side, *layout.background.shape), layout.dtype)
    active = np.empty((n_leaves, BRICK), np.uint64)
    buffer = np.empty(min(_WINDOW, reader.left), np.uint8)
    done = 0
    while done < n_leaves:
        window, records = _next_leaves(reader, n_leaves - done, layout, buffer)
        here = slots[done : done + len(records)]
        pieces = even_ranges(len(records), len(records) // _LEAVES_PER_PIECE + 1)

        def work(piece: int, window=window, records=records, here=here, pieces=pieces) -> None:
            part = slice(*pieces[piece])
            decode_nodes(window, records[part], layout, values, active, here[part])

        run_pieces(work, len(pieces))
        done += len(records)
    return values, active


def skip_leaves(reader: VdbReader, n_leaves: int, layout: ValueLayout) -> None:
    """Move behind the leaves of a tree."""
    buffer = np.empty(min(_WINDOW, reader.left), np.uint8)
    while n_leaves > 0:
        n_leaves -= len(_next_leaves(reader, n_leaves, layout, buffer)[1])


def _next_leaves(
    reader: VdbReader, n_leaves: int, layout: ValueLayout, buffer: ByteArray
) -> tuple[ByteArray, Records]:
    """The next leaves, at least one, and the bytes they stand in; the cursor is behind them."""
    window = reader.fill(buffer)
    # Before the last window, leaves that could reach beyond it wait for the next
    is_last = len(window) == reader.left
    last = len(window) - (0 if is_last else layout.longest_node(LEAF))
    records = scan_nodes(window, LEAF, n_leaves, last, layout)
    if len(records) == 0:
        raise ValueError("it became shorter while it was read")
    reader.seek(reader.at + int(records[-1, END]))
    return window, records
