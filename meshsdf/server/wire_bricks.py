"""What is shown of a texture, brick by brick, as it goes over the wire; and what changed."""

import hashlib
import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Int32, UInt8, UInt32, UInt64

from ..kernels.parallel import even_ranges, run_pieces
from ..kernels.wire_bricks import (
    FLAT,
    HEAD_BYTES,
    MASK_BYTES,
    NO_PRINT,
    NOTHING,
    TEXELS,
    resolve,
    write_records,
)
from ..kernels.wire_nodes import DEEP, NODES, PRESENT, SIDE, mark_affected
from ..texture.octree import Entries
from ..texture.volume_texture import VolumeTexture
from ..texture.watch import Watch

ENTRIES_PER_PIECE = 256  # for fewer it is not worth to start threads
MOST_COMPARED = 8192  # bricks that are compared with what they were
ENTRIES_AT_ONCE = 1024
FIRST_VERSION = 1  # of what is there when the watching begins; 0 is what never was


@dataclass(frozen=True, eq=False)
class Resolved:
    """Wire bricks that are not yet bytes.

    Attributes
    ----------
    entries : (n,) int32
    states : (n,) uint8
        NOTHING, FLAT or TEXELS of `kernels.wire_bricks`.
    counts : (n,) int32
        Colours of those of many.
    prints : (n,) uint64
        Bricks with the same number are the same.
    masks : (n, 92) uint8
        Which nodes they are.
    codes : (n, 729) uint32
        Colours, RGBA, premultiplied, red in the lowest bits.
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


class WireBricks:
    """The bricks that pages should show, kept up with a texture.

    Parameters
    ----------
    texture : VolumeTexture
        Edits must be recorded or made of `writable` slots, as `Watch` asks for.

    Attributes
    ----------
    versions : (e,) uint32
        At which revision an entry's brick became what it is; 0 if there never was one.
    revision : int
        Counts the calls of `update` that found something.
    """

    def __init__(self, texture: VolumeTexture) -> None:
        self.texture = texture
        n = texture.octree.n_entries
        self._watch = Watch(texture)
        self._made_of = np.zeros(n, np.uint8)
        self._prints = np.zeros(n, np.uint64)
        self._latest: Resolved | None = None  # what the last update found
        self.versions = np.zeros(n, np.uint32)
        self.revision = FIRST_VERSION
        everything = np.arange(n, dtype=np.int32)
        self._watch.changed()
        self._made_of[:] = self._inspected(everything)
        self._deep = np.flatnonzero(self._made_of & DEEP).astype(np.int32)
        self.versions[self._made_of & PRESENT != 0] = FIRST_VERSION

    @property
    def present(self) -> Entries:
        """Entries that have a brick to send."""
        return np.flatnonzero(self._made_of & PRESENT).astype(np.int32)

    def update(self) -> Entries:
        """Entries whose wire brick is another than at the last call, in rising order.

        After many changes at once, also some whose brick is the same.
        """
        changed = self._watch.changed()
        if not len(changed):
            return changed
        marked = np.zeros(self.texture.octree.n_entries, np.bool_)
        mark_affected(self.texture.octree.tables, self._made_of, self._deep, changed, marked)
        affected = np.flatnonzero(marked).astype(np.int32)
        if len(affected) <= MOST_COMPARED:
            other = self._compared(affected)
        else:
            now = self._inspected(affected)
            other = (now | self._made_of[affected]) & PRESENT != 0
            self._made_of[affected], self._prints[affected] = now, NO_PRINT
            self._latest = None
        self._deep = np.flatnonzero(self._made_of & DEEP).astype(np.int32)
        affected = affected[other]
        if len(affected):
            self.revision += 1
            self.versions[affected] = self.revision
        return affected

    def resolved(self, entries: Entries) -> Resolved:
        """The bricks of entries as of the last `update`."""
        latest = self._latest
        if latest is not None and len(latest.entries):
            rows = np.minimum(np.searchsorted(latest.entries, entries), len(latest.entries) - 1)
            if (latest.entries[rows] == entries).all():
                return latest.rows(rows)
        found = Resolved.room(np.ascontiguousarray(entries))
        self._resolve(found, np.empty(len(entries), np.uint8), with_colors=True)
        self._prints[entries] = found.prints
        return found

    def payload(self, entries: Entries) -> bytes:
        """The payload of a BRICKS message that holds all of these entries."""
        parts = [struct.pack("<I", len(entries))]
        for first in range(0, len(entries), ENTRIES_AT_ONCE):
            some = np.ascontiguousarray(entries[first : first + ENTRIES_AT_ONCE])
            parts.append(self.resolved(some).records(self.versions[some]))
        return b"".join(parts)

    def range_payload(self, first: int, last: int) -> bytes:
        """The payload of a BRICKS message of the entries first ... last - 1 that have a brick."""
        present = self.present
        return self.payload(present[(present >= first) & (present < last)])

    def digest(self) -> str:
        """SHA-256 of all bricks: see `bricks_digest`."""

        def bricks() -> Iterator[tuple[int, bytes]]:
            present = self.present
            for first in range(0, len(present), ENTRIES_AT_ONCE):
                payload = self.payload(present[first : first + ENTRIES_AT_ONCE])
                yield from ((entry, brick) for entry, _, brick in brick_records(payload))

        return bricks_digest(bricks())

    def release(self) -> None:
        """Let go of the texture's bricks."""
        self._watch.release()

    def _compared(self, affected: Entries) -> np.ndarray:
        """Resolve what may be other bricks now; which of them are."""
        found = Resolved.room(affected)
        now = np.zeros(len(affected), np.uint8)
        self._resolve(found, now, with_colors=True)
        seen = (now | self._made_of[affected]) & PRESENT != 0
        other = seen & (self._prints[affected] != found.prints)
        self._made_of[affected], self._prints[affected] = now, found.prints
        self._latest = found.rows(other)
        return other

    def _inspected(self, entries: Entries) -> np.ndarray:
        """(n,) uint8: of what kind of nodes the bricks of entries are made."""
        made_of = np.zeros(len(entries), np.uint8)
        found = replace(Resolved.room(entries[:1]), entries=entries)
        self._resolve(found, made_of, with_colors=False)
        return made_of

    def _resolve(self, found: Resolved, made_of: np.ndarray, *, with_colors: bool) -> None:
        texture, n = self.texture, len(found.entries)
        channel = texture.channels["base"]
        pool, tiles = texture.pool.use("base"), texture.tiles.arrays["base"]
        slots = self._watch.layer.slots
        ranges = even_ranges(n, -(-n // ENTRIES_PER_PIECE))

        def work(piece: int) -> None:
            rows = np.empty((2, SIDE, SIDE), np.int64)
            grid, origin = np.empty(NODES, np.uint32), np.empty(NODES, np.uint8)
            holders = np.empty(NODES, np.int64)
            resolve(
                texture.octree.tables, slots, pool, tiles, channel.kind, found.entries,
                *ranges[piece], with_colors, grid, origin, holders, rows[0], rows[1], made_of,
                found.states, found.counts, found.prints, found.masks, found.codes,
            )  # fmt: skip

        run_pieces(work, len(ranges) if n else 0)


def brick_records(payload: bytes) -> Iterator[tuple[int, int, bytes]]:
    """Entry, version and brick of every record of a BRICKS message's payload.

    The brick is the record from its state on: state, 0, number of colours, and what follows.

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
