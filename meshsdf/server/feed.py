"""What one page is still to be told of the bricks: the latest of each, nearest to the cursor first.

There is no queue. A feed knows which version of every brick its page has, in every picture;
whenever it may send, it takes those of one picture that are out of date and most wanted. Slow pages
skip versions, and cost no memory.
"""

from collections.abc import Callable

import numpy as np

from ..arrays import Values, Vector3
from ..texture.octree import Entries
from .messages import COMPLETE, PICTURE_SHIFT, Type, encode
from .wire_bricks import FIRST_VERSION, WireBricks
from .wire_picture import Picture
from .wire_records import bricks_payload

MOST_BYTES = 256 * 1024  # of a message, header included
MOST_UNDER_WAY = 2  # messages that the page has not shown yet
HEADS = 16 + 4  # bytes of the frame's header and the count
AT_ONCE = 512  # bricks resolved in one go
MOST_RECORDS = 8192  # of one message

Send = Callable[[bytes], None]
Away = Callable[[Entries], Values]  # how far the bricks of entries are from where the page looks


class Told:
    """What a page was told of one picture.

    Parameters
    ----------
    picture : Picture
    since : int
        The page has what is not newer.

    Attributes
    ----------
    sent : (e,) uint32
        Version of every brick that was sent last.
    changed, new : (n,) int32
        What was out of date at the last `look`: what the page has, and what it never had.
    """

    def __init__(self, picture: Picture, since: int) -> None:
        self.picture = picture
        self.sent = np.where(picture.versions <= since, picture.versions, 0).astype(np.uint32)
        self.changed = self.new = np.empty(0, np.int32)
        self._plan = np.empty(0, np.int32)  # of what the page never had, what comes next

    def look(self) -> int:
        """See what is out of date; how many bricks that are."""
        versions = self.picture.versions
        dirty = np.flatnonzero(self.sent != versions).astype(np.int32)
        is_new = (self.sent[dirty] == 0) & (versions[dirty] == FIRST_VERSION)
        self.changed, self.new = dirty[~is_new], dirty[is_new]
        return len(dirty)

    def forget_plan(self) -> None:
        """The page looks elsewhere."""
        self._plan = self._plan[:0]

    def wanted_changed(self, away: Away) -> Entries:
        """What changed, nearest first."""
        return _least(self.changed, away(self.changed))

    def wanted_new(self, away: Away) -> Entries:
        """What the page never had, coarse levels before fine ones."""
        # What is new may be everything; it is put in order for many messages at once
        versions = self.picture.versions[self._plan]
        self._plan = self._plan[(self.sent[self._plan] == 0) & (versions == FIRST_VERSION)]
        if len(self.new) and not len(self._plan):
            octree = self.picture.texture.octree
            far = away(self.new)
            rank = octree.n_levels - octree.tables.levels[self.new]
            self._plan = _least(self.new, rank + far / (1 + far))
        return self._plan

    def records(self, entries: Entries, n_bytes: int) -> tuple[list[bytes], int]:
        """Records of the first of these entries that fit, in parts, and how many these are."""
        parts, n = [], 0
        while n < min(len(entries), MOST_RECORDS) and n_bytes > 0:
            some = np.ascontiguousarray(entries[n : min(n + AT_ONCE, MOST_RECORDS)])
            found = self.picture.resolved(some)
            fit = int(np.searchsorted(np.cumsum(found.sizes), n_bytes, side="right"))
            versions = self.picture.versions[some]
            parts.append(found.records(versions, fit))
            self.sent[some[:fit]] = versions[:fit]
            n_bytes -= len(parts[-1])
            n += fit
            if fit < len(some):
                break
        return parts, n


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
    """

    def __init__(
        self, bricks: WireBricks, send: Send, *, run_is_known: bool = False, since: int = 0
    ) -> None:
        self.bricks, self.send = bricks, send
        self._since = since if run_is_known else 0
        self._told: tuple[Told, ...] = ()
        self._meet_pictures()
        self._last = 0
        self._under_way: set[int] = set()
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
        for told in self._told:
            told.forget_plan()

    def shown(self, seq: int) -> None:
        """The page has put a message onto its graphics card."""
        self._under_way.discard(seq)

    def refill(self) -> None:
        """Send what is out of date, as much as may be under way."""
        while self.may_send and self._complete_at != self.bricks.revision:
            self._meet_pictures()
            n_dirty = sum([told.look() for told in self._told])
            told, entries = self._wanted()
            parts, n = told.records(entries, MOST_BYTES - HEADS)
            self._send(told.picture, bricks_payload(n, parts), is_complete=n == n_dirty)

    def _send(self, picture: Picture, payload: bytes, *, is_complete: bool) -> None:
        self._last += 1
        self._under_way.add(self._last)
        if is_complete:
            self._complete_at = self.bricks.revision
        flags = picture.number << PICTURE_SHIFT | (COMPLETE if is_complete else 0)
        self.send(encode(Type.BRICKS, self._last, payload, flags))

    def _meet_pictures(self) -> None:
        """Pictures that were begun since are in their place, and nothing of them was told."""
        pictures = self.bricks.pictures.values()
        if len(pictures) != len(self._told):
            known = {told.picture: told for told in self._told}
            self._told = tuple(known.get(one) or Told(one, self._since) for one in pictures)

    def _wanted(self) -> tuple[Told, Entries]:
        """The picture and its entries that come next, the most wanted first.

        That is what changed, then what the page never had; colours before relief.
        """
        lively = [told for told in self._told if len(told.changed)]
        if len(lively) > 1:
            return lively[0], lively[0].wanted_changed(self._away)
        fresh = [told for told in self._told if len(told.new)]
        told = (lively or fresh or self._told)[0]
        changed, new = told.wanted_changed(self._away), told.wanted_new(self._away)
        return told, np.concatenate([changed, new])

    def _away(self, entries: Entries) -> Values:
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
