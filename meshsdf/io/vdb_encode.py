"""Turn the values of nodes into the bytes of a ``.vdb`` file; `vdb_values` has the layout."""

import zlib

import numpy as np
from jaxtyping import Int64, UInt8, UInt64

from ..arrays import Indices, writable_alias
from ..kernels.blosc_pack import LARGEST_BLOCK, TABLE, pack_frames
from ..kernels.vdb_write import choose_values, join_nodes
from .half import halved
from .vdb_stream import ByteArray
from .vdb_values import ACTIVE_MASK, BLOSC, ValueLayout

Masks = UInt64[np.ndarray, "k w"]


def encode_nodes(
    values: np.ndarray,
    rows: Indices,
    active: Masks,
    child: Masks | None,
    heads: UInt8[np.ndarray, "k h"],
    layout: ValueLayout,
) -> tuple[ByteArray, Int64[np.ndarray, " k"]]:
    """Return the bytes of ``k`` nodes, one after another, and where each ends.

    Parameters
    ----------
    values : (m, ...) array
        Of the layout's dtype; ``n`` values in a row.
    rows : (k,) int32
        The row of each node.
    active : (k, n / 64) uint64
        Bit ``b`` of word ``w`` tells whether value ``64 w + b`` is active.
    child : (k, n / 64) uint64 or None
        Where a node below stands instead of a value; never active.
    heads : (k, h) uint8
        What stands before the code: its masks.
    layout : ValueLayout
        How values are stored.
    """
    k, n_words = active.shape
    codes, told, choices, data, ends = _chosen(values, rows, active, child, layout)
    data = halved(data) if layout.is_half else data.astype(layout.stored, copy=False)
    packed, counts, sizes = _packed(data.view(np.uint8), ends * layout.stored_width, layout)
    shown = _full_width(told, layout).view(np.uint8).reshape(k, 2 * layout.width)
    chosen = choices.astype("<u8", copy=False).view(np.uint8)
    longest = heads.shape[1] + 1 + 2 * layout.width + 8 * n_words + 8
    out = np.empty(k * longest + len(packed), np.uint8)
    numbers = np.array((layout.width, layout.is_packed, layout.is_half), np.int64)
    ends = np.empty(k, np.int64)
    join_nodes(heads, codes, shown, chosen, packed, counts, sizes, numbers, out, ends)
    return out[: ends[-1] if k else 0], ends


def _chosen(values, rows, active, child, layout) -> tuple[np.ndarray, ...]:
    """Codes, what they tell, where the second of two stands; stored values, where each's end."""
    (k, n_words), c = active.shape, layout.width // 4
    words = np.ascontiguousarray(values).reshape(len(values), 64 * n_words * layout.background.size)
    words = writable_alias(words.view(np.uint32))
    sides = layout.sides
    codes, choices = np.empty(k, np.int64), np.zeros((k, n_words), np.uint64)
    told, ends = np.zeros((k, 2, c), np.uint32), np.empty(k, np.int64)
    data = np.empty(c * (64 * n_words * k + 1), np.uint32)
    child = np.zeros_like(active) if child is None else child
    is_sparse = bool(layout.flags & ACTIVE_MASK)
    choose_values(words, rows, active, child, sides, is_sparse, codes, told, choices, data, ends)
    stored = data[: ends[-1] if k else 0].view(layout.dtype)
    return codes, told.view(layout.dtype), choices, stored, ends // c


def _full_width(values: np.ndarray, layout: ValueLayout) -> np.ndarray:
    """Values at full width, but rounded as the data are."""
    rounded = halved(values) if layout.is_half else values
    return rounded.astype(layout.dtype.newbyteorder("<"), copy=False)


def _packed(data: ByteArray, ends: np.ndarray, layout: ValueLayout) -> tuple[np.ndarray, ...]:
    """The data of nodes, packed where that is shorter, how long each is, and what tells that."""
    if layout.flags & BLOSC:
        width, packed = layout.stored_width, np.empty(len(data), np.uint8)
        scratch, table = np.empty(LARGEST_BLOCK, np.uint8), np.empty(TABLE, np.int32)
        sizes = np.empty(len(ends), np.int64)
        last = pack_frames(data, ends, width, scratch, table, packed, sizes)
        return packed[:last], np.abs(sizes), sizes
    sizes = -np.diff(ends, prepend=0)
    if not layout.is_packed:
        return data, -sizes, sizes
    view, pieces, begin = memoryview(data), [], 0
    for number, end in enumerate(ends.tolist()):
        piece = zlib.compress(view[begin:end])
        if len(piece) < end - begin:
            sizes[number] = len(piece)
        pieces.append(piece if sizes[number] > 0 else view[begin:end])
        begin = end
    return np.frombuffer(bytearray().join(pieces), np.uint8), np.abs(sizes), sizes
