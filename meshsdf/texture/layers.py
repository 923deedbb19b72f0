"""The picture that all visible layers make together, kept and redone only where one changed."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Int32, Int64

from ..errors import TextureError
from ..kernels.composite import changed_nodes, layer_values, mark_dependents
from ..kernels.parallel import even_ranges, run_pieces
from ..kernels.texture_lookup import ABSENT, FIRST_TILE
from .compositing import BLEND_MODES, check_layers, compose
from .layer import Layer
from .mip import update_mips, used_channels
from .octree import Entries
from .procedural_layer import ProceduralLayer, fill
from .refine import family_of
from .volume_texture import VolumeTexture

__all__ = ["BLEND_MODES", "Flattened", "flatten", "merge_down", "shown"]

Marks = Bool[np.ndarray, " e"]

ENTRIES_PER_PIECE = 2048
NO_BOX = np.array([8, 8, 8, -1, -1, -1], np.int64)
ALL_NODES = np.array([0, 0, 0, 7, 7, 7], np.int64)
FAR = np.int64(1) << 60


def shown(texture: VolumeTexture) -> Layer:
    """What is seen of a texture: its only visible layer, or a picture of several.

    A layer that is alone, opaque and without a mask is used as it is, without copying.

    Raises
    ------
    TextureError
        A visible layer's blend mode or opacity makes no sense.
    """
    layers = _visible(texture)
    kept = texture.flattened
    if len(layers) == 1 and layers[0].opacity == 1 and not _has_masks(texture):
        if kept is not None:
            kept.release()
            texture.flattened = None
        return layers[0]
    if kept is None:
        kept = texture.flattened = Flattened(texture)
    return kept.up_to_date()


def flatten(texture: VolumeTexture) -> Layer:
    """Put one layer in the place of all: what is seen. Hidden layers are gone."""
    _evaluate_all(texture, _visible(texture))
    picture = shown(texture)
    slots = picture.slots.copy()
    texture.pool.hold(slots)
    layer = texture.add_layer("flattened")
    texture.pool.drop(layer.slots)
    layer.slots[:] = slots
    for other in texture.layers[:-1]:
        texture.drop_layer(other)
    return layer


def merge_down(texture: VolumeTexture, layer: Layer) -> Layer:
    """Lay a layer over the one below it and keep the two as one, which keeps the lower one's mode.

    The picture stays the same, to the rounding of texels, if both modes are normal; else the upper
    one no longer sees what lies below the two.

    Raises
    ------
    TextureError
        There is none below, or one of the two is hidden.
    """
    place = texture.layers.index(layer)
    if place == 0:
        what = f"{layer.name!r} is the lowest layer"
        raise TextureError(what, "merge_down(layer)", "move it up first")
    below = texture.layers[place - 1]
    for one in (below, layer):
        if not one.visible:
            what = f"layer {one.name!r} is hidden"
            raise TextureError(what, "merge_down(layer)", "show it, or drop it")
    check_layers([below, layer])
    _evaluate_all(texture, [below, layer])
    merged = _empty(texture)
    entries = np.union1d(below.stored, layer.stored).astype(np.int32)
    compose(texture, [below, layer], entries, merged)
    update_mips(texture, merged, entries)
    texture.pool.drop(below.slots)
    below.slots[:] = merged.slots
    below.opacity = 1.0
    if isinstance(below, ProceduralLayer):
        below.function = None
    texture.drop_layer(layer)
    return below


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

    Notes
    -----
    The bricks it was composed of are held, so that whoever changes one gets a copy: that a slot is
    the same then means that its texels are, and entries to redo are found by comparing slots.
    Cost: of bringing it up to date, comparing the slots of all layers, and composing the bricks
    that changed, those above them, and those not stored in a layer that changed beside them.
    """

    def __init__(self, texture: VolumeTexture) -> None:
        self.texture = texture
        self.layer = _empty(texture)
        self.n_composed = 0
        self._recipe: tuple[tuple[int, float, str], ...] | None = None
        self._seen: list[np.ndarray] = []

    def up_to_date(self) -> Layer:
        """The picture of the layers as they are now."""
        layers = _visible(self.texture)
        recipe = tuple((layer.number, float(layer.opacity), layer.mode) for layer in layers)
        layers = layers or [_clear(self.texture)]
        stored = np.zeros(self.texture.octree.n_entries, bool)
        for layer in layers:
            stored |= layer.slots != ABSENT
        if recipe != self._recipe or len(layers) != len(self._seen):
            dirty = stored.copy()
        else:
            dirty = self._dirty(layers, stored)
        self._drop(np.flatnonzero(~stored & (self.layer.slots != ABSENT)))
        entries = np.flatnonzero(dirty).astype(np.int32)
        compose(self.texture, layers, entries, self.layer)
        update_mips(self.texture, self.layer, self._mip_sources(entries, stored))
        self._remember(layers)
        self._recipe = recipe
        self.n_composed = len(entries)
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

    def _remember(self, layers: Sequence[Layer]) -> None:
        """Hold the slots that were composed, in the place of those from last time."""
        pool = self.texture.pool
        if len(self._seen) == len(layers):
            for seen, layer in zip(self._seen, layers, strict=True):
                other = np.flatnonzero(seen != layer.slots)
                pool.hold(layer.slots[other])
                pool.drop(seen[other])
                seen[other] = layer.slots[other]
            return
        for layer in layers:
            pool.hold(layer.slots)
        for seen in self._seen:
            pool.drop(seen)
        self._seen = [layer.slots.copy() for layer in layers]

    def _dirty(self, layers: Sequence[Layer], stored: Marks) -> Marks:
        """Which stored entries no longer show what they should."""
        before = self.layer.slots != ABSENT
        dirty = stored & ~before
        gone = np.flatnonzero(before & ~stored).astype(np.int32)
        if len(gone):
            above = family_of(self.texture, gone)
            dirty[above[above >= 0]] = True
        for seen, layer in zip(self._seen, layers, strict=True):
            changes = _changes(self.texture, seen, layer.slots)
            if changes is not None:
                dirty[changes.entries] = True
                self._mark_dependents(layer, changes, stored, dirty)
        return dirty & stored

    def _mark_dependents(self, layer: Layer, changes: "Changes", stored, dirty: Marks) -> None:
        tables = self.texture.octree.tables
        waiting = np.flatnonzero(stored & ~dirty & (layer.slots == ABSENT)).astype(np.int32)
        ranges = even_ranges(len(waiting), -(-len(waiting) // ENTRIES_PER_PIECE))
        run_pieces(
            lambda piece: mark_dependents(
                tables, layer.slots, changes.box_of, changes.boxes, changes.reach, waiting,
                *ranges[piece], dirty,
            ),
            len(ranges) if len(waiting) else 0,
        )  # fmt: skip

    def _mip_sources(self, entries: Entries, stored: Marks) -> Entries:
        """The entries composed, and those that coarser ones among them are means of."""
        tables = self.texture.octree.tables
        near = np.zeros(len(stored) + 1, bool)  # the last answers for NO_ENTRY
        near[tables.neighbors[entries]] = True
        first = tables.groups[:, 0]
        near[first] |= near[first + 1]
        near[first + 1] |= near[first]
        near[-1] = False
        own = np.zeros(len(stored), bool)
        own[entries] = True
        return np.flatnonzero(stored & (own | near[tables.parents])).astype(np.int32)


@dataclass(frozen=True, eq=False)
class Changes:
    """Where the slots of one layer changed.

    Attributes
    ----------
    entries : (n,) int32
        Whose texels are others than before, or that are stored now and were not, or the reverse.
    box_of : (e,) int32
        Row of ``boxes`` that is an entry's, or -1.
    boxes : (n, 6) int64
        Least and most of the changed nodes, counted in the entry's level.
    reach : (L, 6) int64
        The same of all entries of a level; the least beyond the most if there is none.
    """

    entries: Entries
    box_of: Int32[np.ndarray, " e"]
    boxes: Int64[np.ndarray, "n 6"]
    reach: Int64[np.ndarray, "l 6"]


def _changes(texture: VolumeTexture, before: np.ndarray, after: np.ndarray) -> Changes | None:
    """What is different; None if nothing is."""
    entries = np.flatnonzero(before != after).astype(np.int32)
    old, new = before[entries], after[entries]
    boxes = np.tile(NO_BOX, (len(entries), 1))
    either = (old == ABSENT) | (new == ABSENT)
    boxes[either & ~_equal_tiles(texture, before, after, entries)] = ALL_NODES
    both = np.flatnonzero(~either)
    some = np.tile(NO_BOX, (len(both), 1))
    for name, pool in texture.pool.arrays.items():
        tiles = texture.tiles.arrays[name]
        changed_nodes(texture.octree.tables, entries[both], old[both], new[both], pool, tiles, some)
    boxes[both] = some
    real = boxes[:, 0] <= boxes[:, 3]
    entries, boxes = entries[real], boxes[real]
    if not len(entries):
        return None
    tables = texture.octree.tables
    boxes += np.tile(8 * tables.bricks[entries], (1, 2))
    box_of = np.full(len(before), -1, np.int32)
    box_of[entries] = np.arange(len(entries), dtype=np.int32)
    reach = np.tile(np.repeat([FAR, -FAR], 3), (texture.octree.n_levels, 1))
    np.minimum.at(reach[:, :3], tables.levels[entries], boxes[:, :3])
    np.maximum.at(reach[:, 3:], tables.levels[entries], boxes[:, 3:])
    return Changes(entries, box_of, boxes, reach)


def _evaluate_all(texture: VolumeTexture, layers: Sequence[Layer]) -> None:
    everything = np.arange(texture.octree.n_entries, dtype=np.int32)
    for layer in layers:
        if isinstance(layer, ProceduralLayer) and layer.function is not None:
            fill(texture, layer, everything)


def _equal_tiles(texture: VolumeTexture, before, after, entries: Entries) -> Marks:
    """Entries that are tiles in one of two arrays of slots and show just that in the other.

    Every cell of the level above has its middle among the texels of the level, so a layer that
    shows one colour at all texels of a brick that it does not store shows it in between, too.
    """
    same = np.zeros(len(entries), bool)
    for tile, other in ((before, after), (after, before)):
        rows = np.flatnonzero((tile[entries] <= FIRST_TILE) & (other[entries] == ABSENT))
        if len(rows):
            same[rows] = _shows_tiles(texture, other, entries[rows], tile[entries[rows]])
    return same


def _shows_tiles(texture: VolumeTexture, slots, entries: Entries, codes) -> Marks:
    """Whether each entry shows nothing but its tile, in every channel."""
    tables = texture.octree.tables
    first = np.concatenate([[0], np.cumsum(np.diff(tables.texel_first)[entries])])
    same = np.ones(len(entries), bool)
    for name in used_channels(texture):
        channel, tiles = texture.channels[name], texture.tiles.arrays[name]
        seen = np.empty((first[-1], 4), np.float32)
        pool = texture.pool.use(name)
        layer_values(tables, slots, pool, tiles, channel.kind, entries, first, seen)
        tile = np.repeat(channel.decoded(tiles[FIRST_TILE - codes]), np.diff(first), axis=0)
        same &= np.logical_and.reduceat((seen == tile).all(axis=1), first[:-1])
    return same


def _visible(texture: VolumeTexture) -> list[Layer]:
    """The layers that have a say, bottom first."""
    visible = [layer for layer in texture.layers if layer.visible]
    check_layers(visible)
    return [layer for layer in visible if layer.opacity > 0]


def _has_masks(texture: VolumeTexture) -> bool:
    whole = texture.channels["mask"].nothing
    tiles = texture.tiles.arrays["mask"][: len(texture.tiles)]
    return "mask" in texture.pool.arrays or bool((tiles != whole).any())


def _empty(texture: VolumeTexture) -> Layer:
    """A layer of no list that stores nothing."""
    return Layer(-1, "flattened", np.full(texture.octree.n_entries, ABSENT, np.int32))


def _clear(texture: VolumeTexture) -> Layer:
    """A layer of no list without any paint."""
    layer = _empty(texture)
    layer.slots[texture.octree.level_first[-2] :] = texture.tiles.code({})
    return layer
