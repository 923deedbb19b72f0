"""The picture that all visible layers make together, kept and redone only where one changed."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Int32, Int64, UInt64

from ..kernels.parallel import even_ranges, run_pieces
from ..kernels.picture_changes import (
    changed_boxes,
    changed_slots,
    changed_texels,
    mark_dependents,
    unlike_above,
)
from ..kernels.picture_means import drop_means
from ..kernels.texture_lookup import ABSENT
from .compositing import check_layers, compose, shown_texels
from .layer import Layer
from .mip import parents, remake_means, used_channels
from .octree import Entries
from .volume_texture import VolumeTexture

Marks = Bool[np.ndarray, " e"]

ENTRIES_PER_PIECE = 65536  # a millisecond, of those that need no more than a look


@dataclass(frozen=True, eq=False)
class Changes:
    """Where one layer shows other texels since some of its slots changed.

    Attributes
    ----------
    shown : (n,) bool
        Which of the entries with other slots show other texels.
    bits : (n, 8) uint64
        The texels of these entries that matter to what is seen in between.
    row_of : (e,) int32
        Row of ``bits`` that is an entry's, or -1.
    boxes : (n, 6) int64
        Least and most of the nodes in ``bits``, counted in the entry's level.
    reach : (L, 6) int64
        The same of all entries of a level; the least beyond the most if there is none.
    """

    shown: Bool[np.ndarray, " n"]
    bits: UInt64[np.ndarray, "n 8"]
    row_of: Int32[np.ndarray, " e"]
    boxes: Int64[np.ndarray, "n 6"]
    reach: Int64[np.ndarray, "l 6"]


class Flattened:
    """All visible layers composed, with the slots they were composed of.

    Parameters
    ----------
    texture : VolumeTexture
        Whose layers; it holds this object as ``texture.flattened``.

    Attributes
    ----------
    layer : Layer
        The picture. It stores an entry where some visible layer does, in the texture's pool.
    redone : (n,) int32
        Entries of the picture whose texels were made anew when it was last brought up to date, or
        that it stores no longer, in rising order: all others show what they did.
    n_composed : int
        How many entries that took evaluating layers; the rest are means of finer ones.

    Notes
    -----
    The bricks it was composed of are held, so that whoever changes one gets a copy: that a slot is
    the same then means that its texels are, and entries to redo are found by comparing slots.
    Accuracy: the same texels, to the bit, as composing everything anew.
    Cost: of bringing it up to date, comparing the slots of all layers; composing the entries in
    which some layer shows other texels, stored there or made of coarser ones; and the means above.
    An entry of a coarser level whose texels all are means of finer ones is never composed.
    """

    def __init__(self, texture: VolumeTexture) -> None:
        self.texture = texture
        self.layer = empty_layer(texture)
        self.redone: Entries = np.empty(0, np.int32)
        self._recipe: tuple[tuple[int, float, str], ...] | None = None
        self._seen: list[np.ndarray] = []
        self.n_composed = 0
        self._rooted = np.zeros(texture.octree.n_entries, np.uint8)

    def up_to_date(self) -> Layer:
        """The picture of the layers as they are now."""
        layers = visible_layers(self.texture)
        recipe = tuple((layer.number, float(layer.opacity), layer.mode) for layer in layers)
        layers = layers or [_clear(self.texture)]
        stored = np.zeros(self.texture.octree.n_entries, bool)
        is_known, self._recipe = recipe == self._recipe, None  # nothing, if this is broken off
        changes: list[Entries] = []
        if not is_known:
            for layer in layers:
                stored |= layer.slots != ABSENT
            dirty = stored.copy()
        else:
            changes = [
                _changed_entries(seen, layer.slots, stored)
                for seen, layer in zip(self._seen, layers, strict=True)
            ]
            if not any(map(len, changes)):
                self.redone, self.n_composed, self._recipe = np.empty(0, np.int32), 0, recipe
                return self.layer
            dirty = self._dirty(layers, changes, stored)
        gone = np.flatnonzero(~stored & (self.layer.slots != ABSENT)).astype(np.int32)
        self._drop(gone)
        entries = self._to_compose(dirty, stored)
        compose(self.texture, layers, entries, self.layer)
        above = remake_means(self.texture, self.layer, entries)
        self._remember(layers, changes)
        self._recipe = recipe
        self.n_composed = len(entries)
        self.redone = np.unique(np.concatenate([entries, above, gone]))
        return self.layer

    def release(self) -> None:
        """Let go of all bricks."""
        self._drop(np.flatnonzero(self.layer.slots != ABSENT))
        for slots in self._seen:
            self.texture.pool.drop(slots)
        self._seen, self._recipe = [], None

    def _drop(self, entries: np.ndarray) -> None:
        self.texture.pool.drop(self.layer.slots[entries])
        self.layer.slots[entries] = ABSENT

    def _remember(self, layers: Sequence[Layer], changes: Sequence[Entries]) -> None:
        """Hold the slots that were composed, in the place of those from last time."""
        pool = self.texture.pool
        if changes:
            for seen, layer, entries in zip(self._seen, layers, changes, strict=True):
                pool.hold(layer.slots[entries])
                pool.drop(seen[entries])
                seen[entries] = layer.slots[entries]
            return
        for layer in layers:
            pool.hold(layer.slots)
        for seen in self._seen:
            pool.drop(seen)
        self._seen = [layer.slots.copy() for layer in layers]

    def _dirty(self, layers: Sequence[Layer], changes: Sequence[Entries], stored: Marks) -> Marks:
        """Which entries no longer show what they should."""
        before = self.layer.slots
        was = before != ABSENT
        dirty = stored & ~was
        gone = np.flatnonzero(was & ~stored).astype(np.int32)
        if len(gone):  # texels above are no longer means of these
            top = self.texture.octree.level_first[-2]
            above = parents(self.texture, gone[gone < top])
            dirty[above] = True
        for seen, layer, entries in zip(self._seen, layers, changes, strict=True):
            if len(entries):
                found = _changes(self.texture, seen, layer.slots, entries)
                dirty[entries[found.shown]] = True
                self._mark_dependents(seen, layer.slots, found, stored, dirty)
        dirty &= stored
        return dirty

    def _mark_dependents(
        self, before, after, changes: Changes, stored: Marks, dirty: Marks
    ) -> None:
        """Mark entries that a layer does not store and that it shows otherwise now."""
        tables, n = self.texture.octree.tables, len(stored)
        ranges = even_ranges(n, -(-n // ENTRIES_PER_PIECE))
        run_pieces(
            lambda piece: mark_dependents(
                tables, before, after, stored, changes.row_of, changes.bits, changes.boxes,
                changes.reach, self._rooted, *ranges[piece], dirty,
            ),
            len(ranges),
        )  # fmt: skip

    def _to_compose(self, dirty: Marks, stored: Marks) -> Entries:
        """The dirty entries without those that are nothing but means of finer ones."""
        entries = np.flatnonzero(dirty).astype(np.int32)
        wanted = np.ones(len(entries), bool)
        tables = self.texture.octree.tables
        first = np.searchsorted(entries, self.texture.octree.level_first[1])
        drop_means(tables, entries[first:], self.layer.slots, stored, wanted[first:])
        return entries[wanted]


def visible_layers(texture: VolumeTexture) -> list[Layer]:
    """The layers that have a say, bottom first.

    Raises
    ------
    TextureError
        A visible layer's blend mode or opacity makes no sense.
    """
    visible = [layer for layer in texture.layers if layer.visible]
    check_layers(visible)
    return [layer for layer in visible if layer.opacity > 0]


def empty_layer(texture: VolumeTexture) -> Layer:
    """A layer of no list that stores nothing."""
    return Layer(-1, "flattened", np.full(texture.octree.n_entries, ABSENT, np.int32))


def _clear(texture: VolumeTexture) -> Layer:
    """A layer of no list without any paint."""
    layer = empty_layer(texture)
    layer.slots[texture.octree.level_first[-2] :] = texture.tiles.code({})
    return layer


def _changed_entries(before: np.ndarray, after: np.ndarray, stored: Marks) -> Entries:
    found = np.empty(len(after), np.int32)
    return found[: changed_slots(before, after, stored, found)].copy()


def _changes(texture: VolumeTexture, before, after, entries: Entries) -> Changes:
    """What is different in entries whose slots changed."""
    octree, n = texture.octree, len(entries)
    bits, shown = np.zeros((n, 8), np.uint64), np.zeros(n, bool)
    came, gone = before[entries] == ABSENT, after[entries] == ABSENT
    for name in used_channels(texture):
        pool, tiles = texture.pool.use(name), texture.tiles.arrays[name]
        kind = texture.channels[name].kind
        rows = np.flatnonzero(~came & ~gone)
        part, own, some = entries[rows], shown[rows], bits[rows]
        changed_texels(octree.tables.masks, before, after, pool, tiles, part, own, some)
        shown[rows], bits[rows] = own, some
        for which, here, there in ((came, after, before), (gone, before, after)):
            rows = np.flatnonzero(which)
            if len(rows):
                part, own, some = entries[rows], shown[rows], bits[rows]
                seen, first = shown_texels(texture, there, part, name)
                unlike_above(octree.tables, here, pool, tiles, kind, part, first, seen, own, some)
                shown[rows], bits[rows] = own, some
    row_of = np.full(octree.n_entries, -1, np.int32)
    boxes, reach = np.empty((n, 6), np.int64), np.empty((octree.n_levels, 6), np.int64)
    changed_boxes(octree.tables, entries, bits, row_of, boxes, reach)
    return Changes(shown, bits, row_of, boxes, reach)
