"""Find and open the values of nodes in the bytes of a ``.vdb`` file; `vdb_values` has the layout.

Nodes follow each other without a table, and how long one is stands in itself. So a first pass
walks from node to node, and a second one opens them, in pieces on all cores.
"""

import zlib

import numpy as np
from jaxtyping import Int64

from ..arrays import Indices
from ..kernels import vdb_read
from ..kernels.vdb_read import BAD_CODE, BAD_SIZE, COUNT, DATA, END, FOUND, FULL, PACKED
from .blosc import blosc_decode
from .vdb_stream import ByteArray
from .vdb_values import ACTIVE_MASK, BLOSC, ValueLayout

Records = Int64[np.ndarray, "k 6"]
"""Where the parts of nodes stand in a window of bytes; the columns are those of the kernel."""


def scan_nodes(window: ByteArray, n: int, n_nodes: int, last: int, layout: ValueLayout) -> Records:
    """Find the parts of nodes that follow each other, each an active mask and ``n`` values.

    Parameters
    ----------
    window : (w,) uint8
        They begin at its first byte.
    n, n_nodes : int
        Values of a node; how many nodes to find at most.
    last : int
        No node is looked for that begins after this place.
    layout : ValueLayout
        How values are stored.

    Raises
    ------
    ValueError
        A node makes no sense, or is cut off.
    """
    full_from = FULL if layout.flags & ACTIVE_MASK else 0
    numbers = (layout.width, layout.stored_width, full_from, layout.is_packed, layout.is_half)
    most = min(n_nodes, len(window) // (n // 8 + 1) + 1)
    records, fault = np.empty((most, 6), np.int64), np.zeros(3, np.int64)
    found = vdb_read.find_nodes(window, n, last, np.array(numbers, np.int64), records, fault)
    why, first, second = fault.tolist()
    if why == BAD_CODE:
        raise ValueError(f"a node has the code {first}; there are 0 to {FULL}")
    if why == BAD_SIZE:
        raise ValueError(f"a node claims {first} bytes for {second} bytes of values")
    if why != FOUND:
        raise ValueError("it is cut off within its values")
    return records[:found]


def decode_nodes(
    window: ByteArray,
    records: Records,
    layout: ValueLayout,
    values: np.ndarray,
    active: np.ndarray,
    rows: Indices,
) -> None:
    """Fill the rows that belong to the nodes found; other threads may fill other rows.

    Parameters
    ----------
    window, records : array
        As `scan_nodes` had the one and gave the other.
    layout : ValueLayout
        How values are stored.
    values : (m, ...) array
        Of the layout's dtype; ``n`` values in a row.
    active : (m, n / 64) uint64
        Bit ``b`` of word ``w`` tells whether value ``64 w + b`` is active.
    rows : (k,) int32
        Row of each node.

    Raises
    ------
    ValueError
        Data are damaged.
    """
    n_numbers = active.shape[1] * 64 * layout.background.size
    words = values.reshape(len(values), n_numbers).view(np.uint32)
    full_from = FULL if layout.flags & ACTIVE_MASK else 0
    data = _data(window, records, layout)
    vdb_read.place_values(window, records, full_from, data, layout.sides, words, active, rows)


def _data(window: ByteArray, records: Records, layout: ValueLayout) -> np.ndarray:
    """The stored values of all nodes as words of 32 bits, and room for one value more."""
    places = np.zeros(len(records) + 1, np.int64)
    np.cumsum(records[:, COUNT] * layout.stored_width, out=places[1:])
    data = np.empty(places[-1] + layout.stored_width, np.uint8)
    data[places[-1] :] = 0
    vdb_read.copy_plain(window, records, data, places)
    packed = np.flatnonzero(records[:, PACKED]) if layout.is_packed else ()
    if len(packed):
        spans = records[packed][:, [DATA, END]]
        decode = blosc_decode if layout.flags & BLOSC else _unzip
        decode(window, spans, data, np.stack([places[packed], places[packed + 1]], axis=1))
    # A size that is no whole number of values was refused, as it differs from their number's
    return data.view(layout.stored).astype(layout.dtype, copy=False).view(np.uint32)


def _unzip(window: ByteArray, spans: np.ndarray, target: ByteArray, places: np.ndarray) -> None:
    """Open zlib streams; ValueError unless each gives just as many bytes as it must."""
    for (begin, end), (first, last) in zip(spans.tolist(), places.tolist(), strict=True):
        unzip = zlib.decompressobj()
        try:
            piece = unzip.decompress(window[begin:end], last - first + 1)
        except zlib.error as error:
            raise ValueError(f"zipped values are damaged ({error})") from None
        if len(piece) != last - first or not unzip.eof:
            raise ValueError(f"zipped values do not give the {last - first} bytes they must")
        target[first:last] = np.frombuffer(piece, np.uint8)
