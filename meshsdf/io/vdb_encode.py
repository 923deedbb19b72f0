"""Turn the values of nodes into the bytes of a ``.vdb`` file; `vdb_values` has the layout."""

import struct
import zlib
from collections.abc import Callable

import numpy as np

from ..kernels.parallel import even_ranges, run_pieces
from .blosc import blosc_encoder, without_blosc_threads
from .half import halved
from .vdb_values import ACTIVE_MASK, BLOSC, FULL, ValueLayout, full_width, same_bits

NODES_PER_TASK = 256


def encode_nodes(
    values: np.ndarray, active: np.ndarray, child: np.ndarray | None, layout: ValueLayout
) -> tuple[list[bytes], list[bytes | memoryview]]:
    """Return, for each of ``m`` nodes, its code with what follows it, and its data.

    Parameters
    ----------
    values : (m, n) or (m, n, c)
        Of the layout's dtype.
    active : (m, n) bool
        Which values are active.
    child : (m, n) bool or None
        Where a node below stands instead of a value; never active.
    layout : ValueLayout
        How they are stored.
    """
    heads = [bytes([FULL])] * len(values)
    keep = np.ones_like(active)
    if layout.flags & ACTIVE_MASK:
        inactive = ~active if child is None else ~(active | child)
        heads, keep = _inactive_heads(values, inactive, layout)
        keep |= active
    stored = values[keep]
    stored = halved(stored) if layout.is_half else stored.astype(layout.stored, copy=False)
    data = memoryview(stored.reshape(-1).view(np.uint8))
    ends = (np.cumsum(np.count_nonzero(keep, axis=1)) * layout.stored_width).tolist()
    pieces = [data[a:b] for a, b in zip([0, *ends[:-1]], ends, strict=True)]
    if layout.is_packed:
        pieces = _all_packed(pieces, layout)
    return heads, pieces


def _all_packed(pieces: list[memoryview], layout: ValueLayout) -> list[bytes]:
    """The data of many nodes behind their sizes; zlib lets other threads run."""
    if layout.flags & BLOSC:  # so quick that threads would wait for each other
        with without_blosc_threads():
            encode = blosc_encoder(layout.stored_width)
            return [_packed(piece, layout, encode) for piece in pieces]
    packed = [b""] * len(pieces)
    ranges = even_ranges(len(pieces), len(pieces) // NODES_PER_TASK + 1)

    def work(task: int) -> None:
        for n in range(*ranges[task]):
            packed[n] = _packed(pieces[n], layout, zlib.compress)

    run_pieces(work, len(ranges))
    return packed


def _packed(piece: memoryview, layout: ValueLayout, encode: Callable[[memoryview], bytes]) -> bytes:
    """A node's data behind their size."""
    if not piece:
        return b"" if layout.is_half else bytes(8)
    packed = encode(piece)
    if len(packed) < len(piece):
        return struct.pack("<q", len(packed)) + packed
    return struct.pack("<q", -len(piece)) + piece


def _inactive_heads(
    values: np.ndarray, inactive: np.ndarray, layout: ValueLayout
) -> tuple[list[bytes], np.ndarray]:
    """Code and what follows it for every node, and which inactive values must be stored."""
    is_plus = inactive & same_bits(values, layout.background)
    is_minus = inactive & ~is_plus & same_bits(values, layout.opposite)
    any_minus = is_minus.any(axis=1)
    codes = np.where(any_minus, np.where(is_plus.any(axis=1), 3, 1), 0)
    heads = [bytes([code]) for code in codes.tolist()]
    rows = np.flatnonzero(codes == 3)
    masks = np.packbits(is_plus[rows], axis=1, bitorder="little").tobytes()
    size = values.shape[1] // 8
    for number, row in enumerate(rows.tolist()):
        heads[row] += masks[number * size : (number + 1) * size]
    keep = np.zeros_like(inactive)
    odd = (inactive & ~is_plus & ~is_minus).any(axis=1)
    for row in np.flatnonzero(odd).tolist():
        heads[row] = _odd_head(values[row], inactive[row], layout)
        keep[row] = heads[row][0] == FULL
    return heads, keep


def _odd_head(values, inactive, layout) -> bytes:
    """The head of a node with an inactive value that is neither bg nor -bg."""
    first = int(np.argmax(inactive))
    rest = inactive & ~same_bits(values, values[first])
    if not rest.any():
        return bytes([2]) + full_width(values[first], layout)
    second = int(np.argmax(rest))
    is_second = inactive & same_bits(values, values[second])
    if (rest & ~is_second).any():
        return bytes([FULL])
    if same_bits(layout.background, values[second]):
        code, told = 4, full_width(values[first], layout)
    elif same_bits(layout.background, values[first]):
        code, told = 4, full_width(values[second], layout)
        is_second = inactive & ~is_second
    else:
        code = 5
        told = full_width(values[first], layout) + full_width(values[second], layout)
    return bytes([code]) + told + np.packbits(is_second, bitorder="little").tobytes()
