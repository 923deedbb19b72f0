"""What one page is still to be told of the bricks: the latest of each, nearest to the cursor first.

There is no queue. A feed knows which version of every brick its page has; whenever it may send, it
takes those that are out of date and most wanted. Slow pages skip versions, and cost no memory.
"""

import struct
from collections.abc import Callable

import numpy as np

from ..arrays import Vector3
from ..texture.octree import Entries
from .messages import COMPLETE, Type, encode
from .wire_bricks import FIRST_VERSION, WireBricks

MOST_BYTES = 256 * 1024  # of a message, header included
MOST_UNDER_WAY = 2  # messages that the page has not shown yet
HEADS = 16 + 4  # bytes of the frame's header and the count
AT_ONCE = 512  # bricks resolved in one go
MOST_RECORDS = 8192  # of one message

Send = Callable[[bytes], None]


class Feed:
    """The bricks of one page.

    Parameters
    ----------
    bricks : WireBricks
        All calls are made by the thread that updates it.
    send : callable
        Called with frames; it must not wait.
    run_is_known, since : bool, int
        Whether the page has the bricks of this run already, and up to which version.

    Attributes
    ----------
    sent : (e,) uint32
        Version of every brick that was sent last.
    """

    def __init__(
        self, bricks: WireBricks, send: Send, *, run_is_known: bool = False, since: int = 0
    ) -> None:
        self.bricks, self.send = bricks, send
        versions = bricks.versions
        known = (versions <= since) if run_is_known else np.zeros(len(versions), bool)
        self.sent = np.where(known, versions, 0).astype(np.uint32)
        self._last = 0
        self._under_way: set[int] = set()
        self._plan = np.empty(0, np.int32)  # of what the page never had, what comes next
        self._eye: Vector3 | None = None
        self._cursor: Vector3 | None = None
        self._complete_at = -1  # revision up to which the page was sent everything

    @property
    def may_send(self) -> bool:
        """Whether the page keeps up."""
        return len(self._under_way) < MOST_UNDER_WAY

    def look(self, eye: Vector3, cursor: Vector3 | None) -> None:
        """What the page looks at, in the texture's space."""
        self._eye, self._cursor = eye, cursor
        self._plan = self._plan[:0]

    def shown(self, seq: int) -> None:
        """The page has put a message onto its graphics card."""
        self._under_way.discard(seq)

    def refill(self) -> None:
        """Send what is out of date, as much as may be under way."""
        while self.may_send and self._complete_at != self.bricks.revision:
            dirty = np.flatnonzero(self.sent != self.bricks.versions).astype(np.int32)
            if not len(dirty):
                self._send([], 0, is_complete=True)
                return
            self._send_some(self._wanted(dirty), len(dirty))

    def _send_some(self, entries: Entries, n_dirty: int) -> None:
        """Send the first of these entries that fit into a message."""
        parts, n_bytes, n = [], HEADS, 0
        while n < min(len(entries), MOST_RECORDS) and n_bytes < MOST_BYTES:
            some = np.ascontiguousarray(entries[n : min(n + AT_ONCE, MOST_RECORDS)])
            found = self.bricks.resolved(some)
            fit = int(np.searchsorted(np.cumsum(found.sizes), MOST_BYTES - n_bytes, side="right"))
            fit = min(fit, len(some))
            versions = self.bricks.versions[some]
            parts.append(found.records(versions, fit))
            self.sent[some[:fit]] = versions[:fit]
            n_bytes += len(parts[-1])
            n += fit
            if fit < len(some):
                break
        self._send(parts, n, is_complete=n == n_dirty)

    def _send(self, parts: list[bytes], n: int, *, is_complete: bool) -> None:
        self._last += 1
        self._under_way.add(self._last)
        if is_complete:
            self._complete_at = self.bricks.revision
        payload = struct.pack("<I", n) + b"".join(parts)
        self.send(encode(Type.BRICKS, self._last, payload, COMPLETE if is_complete else 0))

    def _wanted(self, dirty: Entries) -> Entries:
        """Of what is out of date some, those first that the page wants most.

        That is what changed, nearest first; then what it never had, coarse levels before fine ones.
        """
        is_new = (self.sent[dirty] == 0) & (self.bricks.versions[dirty] == FIRST_VERSION)
        changed, new = dirty[~is_new], dirty[is_new]
        changed = _least(changed, self._away(changed))
        # What is new may be everything; it is put in order for many messages at once
        versions = self.bricks.versions[self._plan]
        self._plan = self._plan[(self.sent[self._plan] == 0) & (versions == FIRST_VERSION)]
        if len(new) and not len(self._plan):
            octree = self.bricks.texture.octree
            away = self._away(new)
            rank = octree.n_levels - octree.tables.levels[new]
            self._plan = _least(new, rank + away / (1 + away))
        return np.concatenate([changed, self._plan])

    def _away(self, entries: Entries) -> np.ndarray:
        """How far the bricks of entries are from where the page looks."""
        place = self._eye if self._cursor is None else self._cursor
        if place is None:
            return np.zeros(len(entries))
        octree = self.bricks.texture.octree
        size = 8 * octree.texel * np.exp2(octree.tables.levels[entries])[:, None]
        low = octree.tables.bricks[entries] * size
        apart = np.maximum(np.maximum(low - place, place - low - size), 0)
        return np.sqrt(np.einsum("ni,ni->n", apart, apart))


def _least(entries: Entries, key: np.ndarray) -> Entries:
    """Up to `MOST_RECORDS` entries of the least keys, in order."""
    if len(entries) > MOST_RECORDS:
        some = np.argpartition(key, MOST_RECORDS)[:MOST_RECORDS]
        entries, key = entries[some], key[some]
    return entries[np.lexsort([entries, key])]
