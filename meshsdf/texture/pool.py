"""Bricks of texels, all channels side by side under one slot number, counted by who needs them."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Int32

from ..errors import TextureError
from ..kernels.texture_lookup import FIRST_TILE
from .channels import Channel

Slots = Int32[np.ndarray, " n"]

TEXELS = 512
FIRST_CAPACITY = 64


class BrickPool:
    """Slots of 512 texels. A channel takes memory from when it is first used.

    Attributes
    ----------
    channels : mapping of str to Channel
        Which there may be.
    arrays : dict of str to (capacity, 512) array
        The channels that are used.
    holders : (capacity,) int32
        How many need each slot; those that none needs are free.
    born : (capacity,) int64
        In which generation each slot was taken; a generation begins with every recording.
    generation : int
        The one that lasts.
    """

    def __init__(self, channels: Mapping[str, Channel]) -> None:
        self.channels = dict(channels)
        self.holders = np.zeros(FIRST_CAPACITY, np.int32)
        self.born = np.zeros(FIRST_CAPACITY, np.int64)
        self.generation = 0
        self._recordings: list[int] = []  # generations that began them, outermost first
        self._waiting: set[int] = set()  # slots that none needs, but that recordings may ask for
        self.arrays: dict[str, np.ndarray] = {}
        self._free = np.arange(FIRST_CAPACITY - 1, -1, -1, dtype=np.int32)  # the next is last
        self._n_free = FIRST_CAPACITY
        self._first_clean = 0  # in slots from here on nothing was ever written
        self.use("base")

    @property
    def n_used(self) -> int:
        """Slots that somebody needs."""
        return len(self.holders) - self._n_free

    @property
    def free(self) -> Slots:
        """The slots that none needs; the last is taken first."""
        return self._free[: self._n_free]

    @property
    def n_bytes(self) -> int:
        """Memory of the used slots."""
        return self.n_used * sum(array[0].nbytes for array in self.arrays.values())

    def use(self, name: str) -> np.ndarray:
        """The (capacity, 512) texels of a channel, which takes memory from now on.

        Raises
        ------
        TextureError
            There is no such channel.
        """
        if name not in self.channels:
            what = f"there is no channel {name!r}"
            raise TextureError(what, "channel=...", f"use one of {', '.join(self.channels)}")
        if name not in self.arrays:
            array = _room_for_bricks(len(self.holders), self.channels[name])
            array[: self._first_clean] = self.channels[name].nothing
            self.arrays[name] = array
        return self.arrays[name]

    def take(self, n: int) -> Slots:
        """Return n free slots, held once, in which nothing was ever written."""
        self.reserve(n)
        self._n_free -= n
        slots = self._free[self._n_free : self._n_free + n][::-1].copy()
        self.holders[slots] = 1
        self.born[slots] = self.generation
        used_before = slots[slots < self._first_clean]
        for name, array in self.arrays.items():
            nothing = self.channels[name].nothing
            array[used_before if nothing == 0 else slots] = nothing
        self._first_clean = max(self._first_clean, int(slots.max(initial=-1)) + 1)
        return slots

    def reserve(self, n: int) -> None:
        """Make room for n slots, growing at most once."""
        if self._n_free < n:
            self._grow(n - self._n_free)

    def copies(self, slots: Slots) -> Slots:
        """Return new slots, held once, with the texels of others."""
        taken = self.take(len(slots))
        for array in self.arrays.values():
            array[taken] = array[slots]
        return taken

    def hold(self, slots: Slots) -> None:
        """One more needs each of those that are slots (>= 0); an array may name one repeatedly."""
        np.add.at(self.holders, slots[slots >= 0], np.int32(1))

    def drop(self, slots: Slots) -> None:
        """One fewer needs each of those that are slots; what none needs is free again.

        While a recording lasts, slots from before it keep their texels.
        """
        dropped = slots[slots >= 0]
        np.subtract.at(self.holders, dropped, np.int32(1))
        unneeded = np.unique(dropped[self.holders[dropped] == 0])[::-1]
        known = self._is_known(unneeded)
        free = unneeded[~known]
        if self._recordings:
            self._waiting.update(unneeded[known].tolist())
            # Known to a recording within one that is not over
            self._waiting.difference_update(free.tolist())
        self._give_back(free)

    def is_shared(self, slots: Slots) -> np.ndarray:
        """Whether others hold the slots, too, or the texels are from before a recording."""
        return (self.holders[slots] > 1) | self._is_known(slots)

    def begin_recording(self) -> None:
        """From now on keep the texels of every slot that is held."""
        self.generation += 1
        self._recordings.append(self.generation)

    def end_recording(self) -> None:
        """End the latest recording; what it wants to keep must be held by now."""
        self._recordings.pop()
        if not self._recordings:
            waiting = np.array(sorted(self._waiting, reverse=True), np.int64)
            self._give_back(waiting[self.holders[waiting] == 0])
            self._waiting = set()

    def _is_known(self, slots: Slots) -> np.ndarray:
        if not self._recordings:
            return np.zeros(len(slots), bool)
        return self.born[slots] < self._recordings[-1]

    def _grow(self, least: int) -> None:
        before = len(self.holders)
        more = before
        while more < least:
            more = 2 * more + before  # capacities are powers of two times the first
        self.holders = np.concatenate([self.holders, np.zeros(more, np.int32)])
        self.born = np.concatenate([self.born, np.zeros(more, np.int64)])
        for name, array in self.arrays.items():
            grown = _room_for_bricks(before + more, self.channels[name])
            grown[: self._first_clean] = array[: self._first_clean]
            self.arrays[name] = grown
        free = np.empty(before + more, np.int32)
        free[:more] = np.arange(before + more - 1, before - 1, -1)
        free[more : more + self._n_free] = self.free
        self._free, self._n_free = free, more + self._n_free

    def _give_back(self, slots: np.ndarray) -> None:
        """They are taken before those that were never used."""
        self._free[self._n_free : self._n_free + len(slots)] = slots
        self._n_free += len(slots)


def _room_for_bricks(n: int, channel: Channel) -> np.ndarray:
    """(n, 512) texels that take memory only when they are written; zeros if that is nothing."""
    if channel.nothing == 0:
        return np.zeros((n, TEXELS), channel.dtype)
    return np.empty((n, TEXELS), channel.dtype)


class TilePool:
    """Colours that whole bricks have: each kept once, named by its code (-2 and below).

    Attributes
    ----------
    arrays : dict of str to (capacity,) array
        Every channel of every tile.
    """

    def __init__(self, channels: Mapping[str, Channel]) -> None:
        self.channels = dict(channels)
        self.arrays = {c.name: np.empty(0, c.dtype) for c in channels.values()}
        self._codes: dict[bytes, int] = {}

    def __len__(self) -> int:
        return len(self._codes)

    def code(self, texel: Mapping[str, int | np.integer]) -> int:
        """The code of a tile of these texels; channels left out hold nothing."""
        stored = {
            c.name: np.asarray(texel.get(c.name, c.nothing), c.dtype)
            for c in self.channels.values()
        }
        key = b"".join(value.tobytes() for value in stored.values())
        if key not in self._codes:
            row = len(self._codes)
            self._codes[key] = FIRST_TILE - row
            if row == len(self.arrays["base"]):
                for name, array in self.arrays.items():
                    room = np.zeros(max(16, row), array.dtype)
                    self.arrays[name] = np.concatenate([array, room])
            for name, value in stored.items():
                self.arrays[name][row] = value
        return self._codes[key]

    def texel(self, code: int) -> dict[str, np.integer]:
        """The texel of a tile in every channel."""
        return {name: array[FIRST_TILE - code] for name, array in self.arrays.items()}
