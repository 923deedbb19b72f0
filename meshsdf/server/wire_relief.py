"""The pictures of normals and heights, which are nothing almost everywhere.

A brick whose nodes all are nothing is not sent, but where it hides what a coarser brick says.
"""

import numpy as np
from jaxtyping import UInt8

from ..kernels.texture_lookup import ABSENT, FIRST_TILE
from ..kernels.wire_blanks import SAYING, SILENT, UNSENT, mark_below, silent_above
from ..kernels.wire_bricks import BLANK_PRINT, EMPTY_PRINT, FLAT, NOTHING
from ..kernels.wire_codes import BLANK
from ..kernels.wire_nodes import PRESENT
from ..texture.octree import Entries
from ..texture.volume_texture import VolumeTexture
from ..texture.watch import Watch
from .wire_picture import MOST_COMPARED, MadeOf, Picture
from .wire_records import Resolved

SLOTS_AT_ONCE = 4096


class Relief(Picture):
    """A picture of which only what was painted is sent.

    Parameters
    ----------
    name, watch, made_of
        As of `Picture`. It begins without any paint: `follow` the entries around those that
        `painted` tells.
    """

    def __init__(self, name: str, watch: Watch, made_of: MadeOf) -> None:
        super().__init__(name, watch, made_of)
        self._prints[:] = EMPTY_PRINT
        self._kinds = np.where(made_of & PRESENT, SILENT, UNSENT).astype(np.uint8)

    @property
    def present(self) -> Entries:
        return np.flatnonzero(self._prints != EMPTY_PRINT).astype(np.int32)

    def follow(self, affected: Entries) -> Entries:
        prints, kinds = np.empty(len(affected), np.uint64), np.empty(len(affected), np.uint8)
        found = None
        for first in range(0, len(affected), MOST_COMPARED):
            part = slice(first, first + MOST_COMPARED)
            found, _ = self._made(affected[part])
            prints[part], kinds[part] = found.prints, self._kinds_of(found)
        turned = affected[kinds != self._kinds[affected]]
        self._kinds[affected] = kinds
        everything = np.union1d(affected, self._silent_below(turned)).astype(np.int32)
        now, own = self._prints[everything], np.searchsorted(everything, affected)
        now[own] = prints
        rows = np.flatnonzero(self._kinds[everything] == SILENT)
        needless = np.empty(len(rows), bool)
        tables = self.texture.octree.tables
        silent_above(tables, self._kinds, everything[rows], needless)
        now[rows] = np.where(needless, EMPTY_PRINT, BLANK_PRINT)
        other = now != self._prints[everything]
        self._prints[everything] = now
        is_kept = found is not None and len(affected) <= MOST_COMPARED
        self._latest = found.rows(other[own] & (kinds == SAYING)) if is_kept else None
        return everything[other]

    def resolved(self, entries: Entries) -> Resolved:
        kinds = self._kinds[entries]
        says = kinds == SAYING
        part = super().resolved(entries[says])
        if says.all():
            return part
        found = Resolved.room(np.ascontiguousarray(entries))
        for whole, some in zip(vars(found).values(), vars(part).values(), strict=True):
            whole[says] = some
        prints = self._prints[entries[~says]]
        found.prints[~says] = prints
        found.states[~says] = np.where(prints == BLANK_PRINT, FLAT, NOTHING)
        found.codes[~says, 0] = BLANK[self.number]
        return found

    def _kinds_of(self, found: Resolved) -> UInt8[np.ndarray, " n"]:
        is_silent = (found.states == FLAT) & (found.codes[:, 0] == BLANK[self.number])
        kinds = np.where(is_silent, SILENT, SAYING)
        return np.where(found.states == NOTHING, UNSENT, kinds).astype(np.uint8)

    def _silent_below(self, turned: Entries) -> Entries:
        """Silent bricks that may have to be sent, or need it no longer, as others turned."""
        tables, n = self.texture.octree.tables, len(self._kinds)
        marked = np.zeros(n, bool)
        while len(turned):
            parted = np.zeros(n, bool)
            mark_below(tables, self._kinds, turned, marked, parted)
            turned = np.flatnonzero(parted).astype(np.int32)
        return np.flatnonzero(marked).astype(np.int32)


def painted(texture: VolumeTexture, slots: np.ndarray, channel: str) -> Entries:
    """Entries that store something other than nothing in a channel, in rising order."""
    nothing = texture.channels[channel].nothing
    says = np.zeros(len(slots), bool)
    tiles = np.flatnonzero(slots <= FIRST_TILE)
    says[tiles] = texture.tiles.arrays[channel][FIRST_TILE - slots[tiles]] != nothing
    pool = texture.pool.arrays.get(channel)
    bricks = np.flatnonzero(slots > ABSENT) if pool is not None else tiles[:0]
    for first in range(0, len(bricks), SLOTS_AT_ONCE):
        some = bricks[first : first + SLOTS_AT_ONCE]
        says[some] = (pool[slots[some]] != nothing).any(axis=1)
    return np.flatnonzero(says).astype(np.int32)
