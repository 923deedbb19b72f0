"""Bricks as the records of BRICKS messages, and back."""

import hashlib
import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Int32, UInt8, UInt32, UInt64

from ..kernels.parallel import even_ranges, run_pieces
from ..kernels.wire_bricks import FLAT, HEAD_BYTES, MASK_BYTES, NOTHING, TEXELS, write_records
from ..kernels.wire_nodes import NODES
from ..texture.octree import Entries

ENTRIES_PER_PIECE = 256  # for fewer it is not worth to start threads


@dataclass(frozen=True, eq=False)
class Resolved:
    """Wire bricks that are not yet bytes.

    Attributes
    ----------
    entries : (n,) int32
    states : (n,) uint8
        NOTHING, FLAT or TEXELS of `kernels.wire_bricks`.
    counts : (n,) int32
        Codes of those of many.
    prints : (n,) uint64
        Bricks with the same number are the same.
    masks : (n, 92) uint8
        Which nodes they are.
    codes : (n, 729) uint32
        What the nodes say, as `kernels.wire_codes` packs it.
    """

    entries: Entries
    states: UInt8[np.ndarray, " k"]
    counts: Int32[np.ndarray, " k"]
    prints: UInt64[np.ndarray, " k"]
    masks: UInt8[np.ndarray, "k 92"]
    codes: UInt32[np.ndarray, "k 729"]

    @classmethod
    def room(cls, entries: Entries) -> "Resolved":
        """Where the bricks of entries are going to be."""
        n = len(entries)
        numbers = np.zeros(n, np.uint8), np.zeros(n, np.int32), np.zeros(n, np.uint64)
        masks = np.zeros((n, MASK_BYTES), np.uint8)
        return cls(entries, *numbers, masks, np.empty((n, NODES), np.uint32))

    def rows(self, rows: np.ndarray) -> "Resolved":
        """Some of them."""
        return Resolved(*(array[rows] for array in vars(self).values()))

    @property
    def sizes(self) -> np.ndarray:
        """(n,) int64 bytes that every record takes."""
        extra = np.where(self.states == TEXELS, MASK_BYTES + 4 * self.counts, 0)
        return HEAD_BYTES + extra + np.where(self.states == FLAT, 4, 0).astype(np.int64)

    def records(self, versions: UInt32[np.ndarray, " n"], n: int | None = None) -> bytes:
        """The first n of them (or all), as records of a BRICKS message."""
        n = len(self.entries) if n is None else n
        starts = np.concatenate([[0], np.cumsum(self.sizes[:n])]).astype(np.int64)
        out = np.empty(starts[-1], np.uint8)
        ranges = even_ranges(n, -(-n // ENTRIES_PER_PIECE))
        run_pieces(
            lambda piece: write_records(
                self.entries, versions, self.states, self.counts, self.masks, self.codes, starts,
                *ranges[piece], out,
            ),
            len(ranges) if n else 0,
        )  # fmt: skip
        return out.tobytes()


def bricks_payload(n: int, parts: list[bytes]) -> bytes:
    """The payload of a BRICKS message of n records."""
    return struct.pack("<I", n) + b"".join(parts)


def brick_records(payload: bytes) -> Iterator[tuple[int, int, bytes]]:
    """Entry, version and brick of every record of a BRICKS message's payload.

    The brick is the record from its state on: state, 0, number of codes, and what follows.

    Raises
    ------
    ServerError
        The payload is cut short, or goes on after the last record.
    """
    (n,) = struct.unpack_from("<I", payload)
    at = 4
    for _ in range(n):
        entry, version, state, count = struct.unpack_from("<IIBxH", payload, at)
        extra = {NOTHING: 0, FLAT: 4}.get(state, MASK_BYTES + 4 * count)
        yield entry, version, payload[at + 8 : at + HEAD_BYTES + extra]
        at += HEAD_BYTES + extra


def bricks_digest(bricks: Iterable[tuple[int, bytes]]) -> str:
    """SHA-256 over bricks in rising order of their entries; those of state 0 do not count.

    Of each: its entry (u32) and the record from its state on.
    """
    whole = hashlib.sha256()
    for entry, brick in bricks:
        if brick[0] != NOTHING:
            whole.update(struct.pack("<I", entry) + brick)
    return whole.hexdigest()
