"""One picture of a texture, brick by brick, as it goes over the wire; and what changed in it."""

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from jaxtyping import UInt8

from ..kernels.parallel import even_ranges, run_pieces
from ..kernels.wire_bricks import NO_PRINT, resolve
from ..kernels.wire_codes import PICTURES
from ..kernels.wire_nodes import NODES, PRESENT, SIDE
from ..texture.octree import Entries
from ..texture.watch import Watch
from .wire_records import Resolved, brick_records, bricks_digest, bricks_payload

ENTRIES_PER_PIECE = 256  # for fewer it is not worth to start threads
MOST_COMPARED = 8192  # bricks that are compared with what they were, and kept
ENTRIES_AT_ONCE = 1024

MadeOf = UInt8[np.ndarray, " e"]


class Picture(ABC):
    """What pages should show of one channel.

    Parameters
    ----------
    name : str
        One of `kernels.wire_codes.PICTURES`: the channel.
    watch : Watch
        Whose layer is shown.
    made_of : (e,) uint8
        Of what kind of nodes bricks are made, which is the same in all pictures.

    Attributes
    ----------
    texture : VolumeTexture
    name, number : str, int
    versions : (e,) uint32
        At which revision of all pictures an entry's brick became what it is; 0 if there never was
        one.
    """

    def __init__(self, name: str, watch: Watch, made_of: MadeOf) -> None:
        n = watch.texture.octree.n_entries
        self.name, self.number = name, PICTURES.index(name)
        self.versions = np.zeros(n, np.uint32)
        self.texture, self._watch, self._made_of = watch.texture, watch, made_of
        self._prints = np.full(n, NO_PRINT, np.uint64)
        self._latest: Resolved | None = None  # what was found when bricks changed last

    @property
    @abstractmethod
    def present(self) -> Entries:
        """Entries that have a brick to send."""

    @abstractmethod
    def follow(self, affected: Entries) -> Entries:
        """Look again at bricks that may be others now; those that are, in rising order."""

    def resolved(self, entries: Entries) -> Resolved:
        """The bricks of entries as of the last `follow`."""
        latest = self._latest
        if latest is not None and len(latest.entries):
            rows = np.minimum(np.searchsorted(latest.entries, entries), len(latest.entries) - 1)
            if (latest.entries[rows] == entries).all():
                return latest.rows(rows)
        found, _ = self._made(entries)
        self._prints[entries] = found.prints
        return found

    def payload(self, entries: Entries) -> bytes:
        """The payload of a BRICKS message that holds all of these entries."""
        parts = []
        for first in range(0, len(entries), ENTRIES_AT_ONCE):
            some = np.ascontiguousarray(entries[first : first + ENTRIES_AT_ONCE])
            parts.append(self.resolved(some).records(self.versions[some]))
        return bricks_payload(len(entries), parts)

    def digest(self) -> str:
        """SHA-256 of all bricks: see `bricks_digest`."""

        def bricks() -> Iterator[tuple[int, bytes]]:
            present = self.present
            for first in range(0, len(present), ENTRIES_AT_ONCE):
                payload = self.payload(present[first : first + ENTRIES_AT_ONCE])
                yield from ((entry, brick) for entry, _, brick in brick_records(payload))

        return bricks_digest(bricks())

    def _made(self, entries: Entries) -> tuple[Resolved, MadeOf]:
        """The bricks of entries made anew, and what they are made of."""
        found = Resolved.room(np.ascontiguousarray(entries))
        made_of = np.zeros(len(entries), np.uint8)
        self._resolve(found, made_of, with_codes=True)
        return found, made_of

    def _inspected(self, entries: Entries) -> MadeOf:
        """Of what kind of nodes the bricks of entries are made."""
        made_of = np.zeros(len(entries), np.uint8)
        found = replace(Resolved.room(entries[:1]), entries=entries)
        self._resolve(found, made_of, with_codes=False)
        return made_of

    def _resolve(self, found: Resolved, made_of: MadeOf, *, with_codes: bool) -> None:
        texture, n = self.texture, len(found.entries)
        kind = texture.channels[self.name].kind
        pool, tiles = texture.pool.use(self.name), texture.tiles.arrays[self.name]
        slots = self._watch.layer.slots
        ranges = even_ranges(n, -(-n // ENTRIES_PER_PIECE))

        def work(piece: int) -> None:
            rows = np.empty((2, SIDE, SIDE), np.int64)
            grid, origin = np.empty(NODES, np.uint32), np.empty(NODES, np.uint8)
            holders = np.empty(NODES, np.int64)
            resolve(
                texture.octree.tables, slots, pool, tiles, kind, self.number, found.entries,
                *ranges[piece], with_codes, grid, origin, holders, rows[0], rows[1], made_of,
                found.states, found.counts, found.prints, found.masks, found.codes,
            )  # fmt: skip

        run_pieces(work, len(ranges) if n else 0)


class Colors(Picture):
    """The base colour: every brick that is made of something stored is sent."""

    def __init__(self, watch: Watch, made_of: MadeOf) -> None:
        super().__init__("base", watch, made_of)
        made_of[:] = self._inspected(np.arange(len(made_of), dtype=np.int32))

    @property
    def present(self) -> Entries:
        return np.flatnonzero(self._made_of & PRESENT).astype(np.int32)

    def follow(self, affected: Entries) -> Entries:
        """As `Picture.follow`, and bring ``made_of`` up to date.

        Of many bricks also some are told that are the same.
        """
        if len(affected) > MOST_COMPARED:
            now = self._inspected(affected)
            other = (now | self._made_of[affected]) & PRESENT != 0
            self._made_of[affected], self._prints[affected] = now, NO_PRINT
            self._latest = None
            return affected[other]
        found, now = self._made(affected)
        seen = (now | self._made_of[affected]) & PRESENT != 0
        other = seen & (self._prints[affected] != found.prints)
        self._made_of[affected], self._prints[affected] = now, found.prints
        self._latest = found.rows(other)
        return affected[other]
