"""What edits of a texture changed, so that they can be taken back and done again.

A brick that was there when a recording began is never written again while somebody needs it:
`VolumeTexture.writable` copies it. So a change is a list of slots before and after, undoing it
swaps slots, and what it costs in memory are the bricks that were touched. Of a change that is far
from now the bricks may be put by (`cold`): of one that is done those from before, of one that is
undone those from after; what is on its other side is what the layers hold when its turn comes.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from jaxtyping import Int32

from ..errors import TextureError
from ..kernels.texture_lookup import ABSENT, FIRST_TILE
from .cold import Piece, bring_back, put_by
from .layer import Layer
from .octree import Entries
from .spill import Spill
from .volume_texture import VolumeTexture

Slots = Int32[np.ndarray, " n"]

UNKNOWN = np.iinfo(np.int32).min
"""In the place of a slot: what the layer holds when the change's turn comes."""
BRICKS_AT_ONCE = 4096  # compared in one go, so that little memory is needed


@dataclass(eq=False)
class SlotChange:
    """Entries of one layer whose slots changed; a layer that is not there stores nothing.

    Attributes
    ----------
    layer : Layer
    entries : (n,) int32
        Those of which slots are known; a pool keeps these.
    before, after : (n,) int32
        Slots of the entries; on the side that the layer holds they may be UNKNOWN.
    cold : list of Piece
        The other entries, and what they stored before the change (if it is undone: after it).
    """

    layer: Layer
    entries: Entries
    before: Slots
    after: Slots
    cold: list[Piece] = field(default_factory=list)

    @property
    def n_entries(self) -> int:
        """Entries whose slots changed."""
        return len(self.entries) + sum(piece.n_entries for piece in self.cold)


@dataclass(frozen=True, eq=False)
class LayerState:
    """A layer in the list, with every attribute but its slots."""

    layer: Layer
    attributes: dict[str, Any]

    @classmethod
    def of(cls, layer: Layer) -> "LayerState":
        """What a layer is like now."""
        names = [one.name for one in fields(layer) if one.name != "slots"]
        return cls(layer, {name: getattr(layer, name) for name in names})

    def same(self, other: "LayerState") -> bool:
        """Whether it is the same layer with equal attributes."""
        return self.layer is other.layer and self.attributes == other.attributes


@dataclass(frozen=True, eq=False)
class Stack:
    """The list of layers, and the number that the next one gets."""

    layers: tuple[LayerState, ...]
    next_number: int

    @classmethod
    def of(cls, texture: VolumeTexture) -> "Stack":
        """The list as it is now."""
        return cls(tuple(map(LayerState.of, texture.layers)), texture._next_number)

    def same(self, other: "Stack") -> bool:
        """Whether the lists are alike."""
        if self.next_number != other.next_number or len(self.layers) != len(other.layers):
            return False
        return all(a.same(b) for a, b in zip(self.layers, other.layers, strict=True))

    def restore(self, texture: VolumeTexture) -> None:
        """Make the texture's list like this one."""
        for state in self.layers:
            for name, value in state.attributes.items():
                setattr(state.layer, name, value)
        texture.layers[:] = [state.layer for state in self.layers]
        texture._next_number = self.next_number


@dataclass(eq=False)
class Change:
    """What a recording changed; it is filled when the recording ends.

    Attributes
    ----------
    slots : list of SlotChange
        Layer by layer; the texture's pool keeps them, before and after.
    before, after : Stack
        The list of layers and their attributes.
    is_done : bool
        False after `undo`, until `redo`.
    """

    before: Stack
    after: Stack
    slots: list[SlotChange] = field(default_factory=list)
    is_done: bool = True

    @property
    def is_empty(self) -> bool:
        """Whether nothing changed."""
        return not self.slots and self.before.same(self.after)

    @property
    def n_entries(self) -> int:
        """Entries whose slots changed, over all layers."""
        return sum(one.n_entries for one in self.slots)

    def undo(self, texture: VolumeTexture) -> None:
        """Put everything back as it was before; changes made later must be undone first.

        Raises
        ------
        TextureError
            It is undone already.
        Damaged
            Bricks that were put by cannot be read; then nothing has changed.
        """
        self._require(True, "undone")
        self._thaw(texture)
        for one in self.slots:
            _swap(texture, one.layer, one.entries, one.before)
        self.before.restore(texture)
        self.is_done = False

    def redo(self, texture: VolumeTexture) -> None:
        """Make the change again after `undo`.

        Raises
        ------
        TextureError
            It is not undone.
        Damaged
            Bricks that were put by cannot be read; then nothing has changed.
        """
        self._require(False, "done")
        self._thaw(texture)
        for one in self.slots:
            _swap(texture, one.layer, one.entries, one.after)
        self.after.restore(texture)
        self.is_done = True

    def n_hot_bytes(self, texture: VolumeTexture) -> int:
        """Memory that only this change needs: bricks of the other side of it, and the lists."""
        per_brick = sum(array[0].nbytes for array in texture.pool.arrays.values())
        bricks = sum(int(np.count_nonzero(self._sides(one)[0] >= 0)) for one in self.slots)
        lists = sum(one.entries.nbytes + one.before.nbytes + one.after.nbytes for one in self.slots)
        return per_brick * bricks + lists

    def n_bytes(self, texture: VolumeTexture) -> int:
        """The same, and what was put by, as it is there."""
        cold = sum(piece.n_bytes for one in self.slots for piece in one.cold)
        return self.n_hot_bytes(texture) + cold

    def put_by(
        self, texture: VolumeTexture, spill: Spill, needed: Int32[np.ndarray, " c"], most: int
    ) -> int:
        """Put by entries whose bricks changes alone need, and forget what the layers hold.

        Parameters
        ----------
        texture : VolumeTexture
        spill : Spill
            Where to.
        needed : (c,) int32
            How often changes name each slot of the pool; it is kept up to date.
        most : int
            At most so many entries.

        Returns
        -------
        n : int
            How many were put by.
        """
        n = 0
        for one in self.slots:
            kept, known = self._sides(one)
            _drop(texture, known, needed)
            known[:] = UNKNOWN
            slots = np.maximum(kept, 0)
            alone = (kept < 0) | (texture.pool.holders[slots] == needed[slots])
            rows = np.flatnonzero(alone)[: most - n]
            if len(rows):
                one.cold += put_by(texture, one.entries[rows], kept[rows], spill)
                _drop(texture, kept[rows], needed)
                one.entries, one.before, one.after = (
                    np.delete(array, rows) for array in (one.entries, one.before, one.after)
                )
                n += len(rows)
        return n

    def release(self, texture: VolumeTexture) -> None:
        """Let go of the bricks; the change can be neither undone nor redone afterwards."""
        for one in self.slots:
            texture.pool.drop(one.before)
            texture.pool.drop(one.after)
            for piece in one.cold:
                piece.free()
        self.slots = []

    def _sides(self, one: SlotChange) -> tuple[Slots, Slots]:
        """The slots that the layer does not have now, and those that it has."""
        return (one.before, one.after) if self.is_done else (one.after, one.before)

    def _thaw(self, texture: VolumeTexture) -> None:
        """Bring back what was put by, and know again what the layers hold."""
        found = []
        try:
            for one in self.slots:
                found.append(bring_back(texture, one.cold))
        except BaseException:
            for _, slots in found:
                texture.pool.drop(slots)
            raise
        for one, (entries, slots) in zip(self.slots, found, strict=True):
            kept, known = self._sides(one)
            kept = np.concatenate([kept, slots])
            known = np.concatenate([known, np.full_like(slots, UNKNOWN)])
            one.entries = np.concatenate([one.entries, entries])
            unknown = np.flatnonzero(known == UNKNOWN)
            known[unknown] = one.layer.slots[one.entries[unknown]]
            texture.pool.hold(known[unknown])
            one.before, one.after = (kept, known) if self.is_done else (known, kept)
            for piece in one.cold:
                piece.free()
            one.cold = []

    def _require(self, done: bool, word: str) -> None:
        if self.is_done is not done:
            what = f"the change is {word} already"
            raise TextureError(what, "Change", "undo and redo a change in turn")


@contextmanager
def recording(texture: VolumeTexture) -> Iterator[Change]:
    """Record what the body changes in layers' slots, in their list and in their attributes.

    The change is complete when the body has ended. If it raises, everything is put back as it was.
    Recordings may be nested. Bricks that end with the texels they began with count as unchanged.

    Notes
    -----
    Cost: copying and comparing the slots of all layers, 4 bytes each, and comparing the texels of
    touched bricks.

    Examples
    --------
    >>> from meshsdf.mesh import icosphere
    >>> texture = VolumeTexture.around(icosphere(subdivisions=2), resolution=16)
    >>> with recording(texture) as change:
    ...     layer = texture.add_layer("paint", color=(1.0, 0.0, 0.0))
    >>> change.undo(texture)
    >>> texture.layers
    []
    """
    stack = Stack.of(texture)
    slots = {layer: layer.slots.copy() for layer in texture.layers}
    change = Change(stack, stack)
    texture.pool.begin_recording()
    try:
        try:
            yield change
        except BaseException:
            _collect(texture, change, slots)
            change.undo(texture)
            change.release(texture)
            raise
        _collect(texture, change, slots)
    finally:
        texture.pool.end_recording()


def changed_since(texture: VolumeTexture, layer: Layer, slots: Slots) -> Change:
    """What became of one layer since its slots were these, which the caller held all the while."""
    stack = Stack.of(texture)
    change = Change(stack, stack)
    _collect_layer(texture, change, layer, slots)
    return change


def put_back(texture: VolumeTexture, layer: Layer, slots: Slots) -> None:
    """Let a layer store what it stored when its slots were these, held by the caller since."""
    entries = np.flatnonzero(layer.slots != slots).astype(np.int32)
    _swap(texture, layer, entries, slots[entries])


def _collect(texture: VolumeTexture, change: Change, before: dict[Layer, Slots]) -> None:
    """Fill the change, and hold its slots."""
    change.after = Stack.of(texture)
    for layer in dict.fromkeys([*before, *texture.layers]):
        old = before[layer] if layer in before else np.full_like(layer.slots, ABSENT)
        _collect_layer(texture, change, layer, old)


def _collect_layer(texture: VolumeTexture, change: Change, layer: Layer, old: Slots) -> None:
    entries = np.flatnonzero(old != layer.slots).astype(np.int32)
    entries = _really_changed(texture, layer, entries, old)
    if len(entries):
        one = SlotChange(layer, entries, old[entries], layer.slots[entries])
        texture.pool.hold(one.before)
        texture.pool.hold(one.after)
        change.slots.append(one)


def _really_changed(texture: VolumeTexture, layer: Layer, entries: Entries, old: Slots) -> Entries:
    """Those of the entries whose texels differ; the others get their old slots back."""
    new = layer.slots
    bricks = entries[new[entries] >= 0]
    bricks = bricks[old[bricks] != ABSENT]
    same = same_texels(texture, bricks, old[bricks], new[bricks])
    _swap(texture, layer, bricks[same], old[bricks[same]])
    return entries[~np.isin(entries, bricks[same])]


def same_texels(
    texture: VolumeTexture, entries: Entries, old: Slots, new: Slots, channel: str | None = None
) -> np.ndarray:
    """(n,) bool: whether entries hold the same as bricks or tiles, where texels exist.

    In all channels, or in one.
    """
    same = np.ones(len(entries), bool)
    for begin in range(0, len(entries), BRICKS_AT_ONCE):
        part = slice(begin, begin + BRICKS_AT_ONCE)
        bits = texture.octree.tables.masks[entries[part]].view(np.uint8)
        unneeded = np.unpackbits(bits, axis=1, bitorder="little") == 0
        any_tile = bool((old[part] < 0).any() or (new[part] < 0).any())
        names = [channel] if channel else texture.tiles.arrays if any_tile else texture.pool.arrays
        for name in names:
            before, after = (_texels(texture, name, slots[part]) for slots in (old, new))
            same[part] &= ((before == after) | unneeded).all(axis=1)
    return same


def _texels(texture: VolumeTexture, name: str, slots: Slots) -> np.ndarray:
    """(n, 512) texels of a channel in bricks or tiles."""
    tiles, channel = texture.tiles.arrays[name], texture.channels[name]
    is_tile = slots < 0
    pool = texture.pool.arrays.get(name)
    if pool is None:
        texels = np.full((len(slots), 512), channel.nothing, channel.dtype)
    else:
        texels = pool[np.maximum(slots, 0)]
    texels[is_tile] = tiles[FIRST_TILE - slots[is_tile]][:, None]
    return texels


def _swap(texture: VolumeTexture, layer: Layer, entries: Entries, slots: Slots) -> None:
    """Let a layer store other slots, which somebody holds or held when the recording began."""
    texture.pool.hold(slots)
    texture.pool.drop(layer.slots[entries])
    layer.slots[entries] = slots


def _drop(texture: VolumeTexture, slots: Slots, needed: Int32[np.ndarray, " c"]) -> None:
    """Changes need slots no longer."""
    texture.pool.drop(slots)
    np.subtract.at(needed, slots[slots >= 0], np.int32(1))
