"""Find and open the values of nodes in the bytes of a ``.vdb`` file; `vdb_values` has the layout.

Nodes follow each other without a table, and how long one is stands in itself. So a first pass
walks from node to node, and a second one opens all of them together.
"""

import struct
import zlib
from dataclasses import dataclass

import numpy as np

from .blosc import blosc_decode
from .vdb_values import ACTIVE_MASK, BLOSC, FULL, HAS_MASK, N_TOLD, SLACK, ValueLayout


@dataclass(frozen=True)
class NodeRecords:
    """Where the parts of some nodes stand in a window of bytes, one entry for each node.

    Attributes
    ----------
    masks : list of bytes
        Active masks.
    codes, told, data, ends : list of int
        The codes; where what they tell begins; where the data begin and end.
    n_data : list of int
        How many values the data are.
    is_packed : list of bool
        Whether they are packed.
    """

    masks: list[bytes]
    codes: list[int]
    told: list[int]
    data: list[int]
    ends: list[int]
    n_data: list[int]
    is_packed: list[bool]


def scan_nodes(window: bytes, n: int, n_nodes: int, last: int, layout: ValueLayout) -> NodeRecords:
    """Find the parts of nodes that follow each other, each an active mask and ``n`` values.

    Parameters
    ----------
    window : bytes
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
    records = NodeRecords([], [], [], [], [], [], [])
    mask_bytes, width, at = n // 8, layout.stored_width, 0
    heads = [
        1 + told * layout.width + mask_bytes * has_mask
        for told, has_mask in zip(N_TOLD, HAS_MASK, strict=True)
    ]
    full_from = FULL if layout.flags & ACTIVE_MASK else 0
    while len(records.ends) < n_nodes and at <= last:
        mask = window[at : at + mask_bytes]
        at += mask_bytes
        if at >= len(window):
            raise ValueError("it is cut off within its values")
        code, is_packed = window[at], False
        if code > FULL:
            raise ValueError(f"a node has the code {code}; there are 0 to {FULL}")
        n_data = n if code >= full_from else int.from_bytes(mask, "little").bit_count()
        data, size = at + heads[code], n_data * width
        if layout.is_packed and (n_data or not layout.is_half):
            is_packed, size = _packed_size(window, data, size)
            data += 8
        if data + size > len(window):
            raise ValueError("it is cut off within its values")
        records.masks.append(mask)
        records.codes.append(code)
        records.told.append(at + 1)
        records.data.append(data)
        records.n_data.append(n_data)
        records.is_packed.append(is_packed)
        at = data + size
        records.ends.append(at)
    return records


def _packed_size(window: bytes, at: int, size: int) -> tuple[bool, int]:
    """Whether the data at a place are packed, and their bytes there; ``size`` if they are not."""
    if at + 8 > len(window):
        raise ValueError("it is cut off within its values")
    told = struct.unpack_from("<q", window, at)[0]
    # A packing is only written when it is shorter, so a longer one is no honest claim
    if told > size + SLACK or (told <= 0 and told != -size):
        raise ValueError(f"a node claims {told} bytes for {size} bytes of values")
    return told > 0, abs(told)


def decode_nodes(window: bytes, records: NodeRecords, n: int, layout: ValueLayout):
    """Return the values (m, n) or (m, n, c) of nodes, and where (m, n) they are active."""
    masks = np.frombuffer(b"".join(records.masks), np.uint8)
    active = np.unpackbits(masks, bitorder="little").view(bool).reshape(-1, n)
    codes = np.array(records.codes, np.int8)
    data = np.frombuffer(_unpacked(window, records, layout), layout.stored)
    data = data.reshape(-1, *layout.background.shape)
    if not layout.flags & ACTIVE_MASK:
        return data.astype(layout.dtype).reshape(*active.shape, *data.shape[1:]), active
    keep = active | (codes == FULL)[:, None] if (codes == FULL).any() else active
    values = _inactive_values(window, records, codes, n, layout)
    values[keep] = data
    return values, active


def _inactive_values(window, records, codes, n, layout) -> np.ndarray:
    """Values (m, n) or (m, n, c): the one or two that the code of a node tells."""
    first = np.where((codes == 0)[:, None], layout.background.ravel(), layout.opposite.ravel())
    second = np.broadcast_to(layout.background.ravel(), first.shape).copy()
    n_told = np.array(N_TOLD)[codes]
    for place, told in enumerate((first, second)):
        rows = np.flatnonzero(n_told > place)
        starts = [records.told[r] + place * layout.width for r in rows.tolist()]
        pieces = [window[at : at + layout.width] for at in starts]
        full = layout.dtype.newbyteorder("<")
        told[rows] = np.frombuffer(b"".join(pieces), full).reshape(told[rows].shape)
    shape = (len(codes), 1, *layout.background.shape)
    first, second = first.reshape(shape), second.reshape(shape)
    rows = np.flatnonzero(np.array(HAS_MASK)[codes])
    starts = [records.told[r] + int(n_told[r]) * layout.width for r in rows.tolist()]
    masks = np.frombuffer(b"".join([window[at : at + n // 8] for at in starts]), np.uint8)
    chosen = np.unpackbits(masks, bitorder="little").view(bool).reshape(len(rows), n)
    chosen = chosen.reshape(*chosen.shape, *(1 for _ in layout.background.shape))
    if len(rows) == len(codes):
        return np.where(chosen, second, first)
    values = np.empty((len(codes), n, *layout.background.shape), layout.dtype)
    values[:] = first
    values[rows] = np.where(chosen, second[rows], first[rows])
    return values


def _unpacked(window: bytes, records: NodeRecords, layout: ValueLayout) -> bytes:
    """The data of all nodes, each of just the size that they must have."""
    spans = list(zip(records.data, records.ends, strict=True))
    if not any(records.is_packed):
        return b"".join([window[a:b] for a, b in spans])
    sizes = [n * layout.stored_width for n in records.n_data]
    parts = zip(spans, sizes, records.is_packed, strict=True)
    if layout.flags & BLOSC:
        packed = [(span, size) for span, size, is_packed in parts if is_packed]
        opened = blosc_decode(window, [span for span, _ in packed], [size for _, size in packed])
        if len(packed) == len(sizes):
            return opened
        at, pieces = 0, []
        for (a, b), size, is_packed in zip(spans, sizes, records.is_packed, strict=True):
            pieces.append(opened[at : at + size] if is_packed else window[a:b])
            at += size if is_packed else 0
        return b"".join(pieces)
    return b"".join(
        [
            _unzipped(window[a:b], size) if is_packed else window[a:b]
            for (a, b), size, is_packed in parts
        ]
    )


def _unzipped(piece: bytes, size: int) -> bytes:
    """A zlib stream opened; ValueError unless it gives just that many bytes."""
    unzip = zlib.decompressobj()
    try:
        data = unzip.decompress(piece, size + 1)
    except zlib.error as error:
        raise ValueError(f"zipped values are damaged ({error})") from None
    if len(data) != size or not unzip.eof:
        raise ValueError(f"zipped values do not give the {size} bytes they must")
    return data
