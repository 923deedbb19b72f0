"""What a stroke has covered so far: coverage of texels, and the bricks as they were before it."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, UInt64

from ..kernels.brush import CHANGED, FALLOFFS, WANTED, deposit, same_texels
from ..kernels.brush_reach import ROW, entries_in_reach
from ..kernels.geodesic_gate import connected_texels
from ..kernels.octree_tables import ANY_PART
from ..kernels.parallel import even_ranges, n_threads, run_pieces
from ..kernels.texture_lookup import ABSENT
from .brush import Brush
from .layer import Layer
from .octree import Entries, Parts
from .refine import refine
from .volume_texture import VolumeTexture

Dabs = Float64[np.ndarray, "d 19"]

FIRST_ROWS = 256
PAIRS_FOR_THREADS = 6000  # entries times dabs below which starting threads costs more than it saves
DABS_PER_FLOOD = 16
NOT_TAKEN = np.iinfo(np.int32).min


@dataclass(frozen=True, eq=False)
class Touched:
    """Entries (n,), their rows, and the bits of the texels whose coverage a batch changed."""

    entries: Entries
    rows: Entries
    changed: UInt64[np.ndarray, "n 8"]


class Cover:
    """Coverage of one stroke on one layer.

    Attributes
    ----------
    level : int
        At which texels are painted; where finer ones are stored, they are painted, too.
    coverage : (rows, 512) float32
        One row for every entry that dabs came near.
    base : (rows,) int32
        Slots (or tiles) of what was there before; NOT_TAKEN where nothing was painted yet.
    """

    def __init__(self, texture: VolumeTexture, layer: Layer, brush: Brush) -> None:
        self.texture, self.layer = texture, layer
        octree = texture.octree
        self.level = wanted_level(texture, brush)
        above = octree.level_first[self.level]
        stored = np.flatnonzero(layer.slots[:above] != ABSENT)
        self.finest = int(octree.tables.levels[stored[0]]) if len(stored) else self.level
        # Zeros of memory that is not touched cost nothing
        self.marks = np.zeros((octree.n_entries, 3), np.int32)
        self.coverage = np.zeros((FIRST_ROWS, 512), np.float32)
        self.base = np.full(FIRST_ROWS, NOT_TAKEN, np.int32)
        self.taken: list[Entries] = []
        self._found = np.empty(octree.n_entries, np.int32)
        self._batch = self._n_rows = 0
        self._brush = brush
        self._tip = (
            FALLOFFS.index(brush.falloff), int(brush.build_up), int(brush.stamp is not None),
            int(brush.stencil is not None), int(brush.geodesic),
        )  # fmt: skip
        self._numbers = np.array([brush.hardness, *brush.angle], np.float64)
        self._stamp = _picture(brush.stamp)
        self._stencil = _picture(brush.stencil.picture if brush.stencil else None)
        matrix = brush.stencil.matrix if brush.stencil else np.zeros((3, 4))
        self._matrix = matrix * np.array([octree.texel, octree.texel, octree.texel, 1.0])

    def add(self, dabs: Dabs, copies: int) -> Touched:
        """Let dabs cover texels, and store the entries where they do."""
        if self._brush.geodesic and len(dabs) > DABS_PER_FLOOD * copies:
            step = DABS_PER_FLOOD * copies
            parts = [self.add(dabs[i : i + step], copies) for i in range(0, len(dabs), step)]
            return _joined(parts)
        found = self._reached(dabs)
        changed = np.empty((len(found), 8), np.uint64)
        state = np.empty(len(found), np.uint8)
        parts = self._parts(dabs)
        gates = self._gates(found, dabs, parts)
        octree, slots = self.texture.octree, self.layer.slots

        def work(begin: int, end: int) -> None:
            deposit(
                octree.tables, found, begin, end, slots, self.marks, dabs, parts, copies, self._tip,
                self._numbers, self._stamp, self._stencil, self._matrix, gates, self.coverage,
                changed, state,
            )  # fmt: skip

        run_ranges(work, len(found), len(dabs))
        absent = slots[found] == ABSENT
        if absent.any():
            of_level = octree.tables.levels[found] == self.level
            refine(self.texture, self.layer, found[absent & of_level & (state & WANTED != 0)])
            state[absent & ~of_level] = 0
        hit = np.flatnonzero(state & CHANGED)
        entries = found[hit]
        touched = Touched(entries, self.marks[entries, ROW] - 1, changed[hit])
        self._take(touched)
        return touched

    def finish(self, channel: str) -> Entries:
        """Let go of what was there before; the entries whose texels changed, in rising order."""
        entries = self._entries()
        base = self.base[self.marks[entries, ROW] - 1]
        same = np.empty(len(entries), np.bool_)
        same_texels(
            self.texture.octree.tables.masks, entries, base, self.layer.slots[entries],
            self.texture.pool.use(channel), self.texture.tiles.arrays[channel], same,
        )  # fmt: skip
        self._put_back(entries[same], base[same])
        self.texture.pool.drop(base[~same])
        self.taken = []
        return entries[~same]

    def cancel(self) -> None:
        """Put everything back as it was before the stroke; what was refined stays so."""
        entries = self._entries()
        self._put_back(entries, self.base[self.marks[entries, ROW] - 1])
        self.taken = []

    def _entries(self) -> Entries:
        return np.sort(np.concatenate([np.empty(0, np.int32), *self.taken]))

    def _put_back(self, entries: Entries, base: np.ndarray) -> None:
        self.texture.pool.drop(self.layer.slots[entries])
        self.layer.slots[entries] = base

    def _reached(self, dabs: Dabs) -> Entries:
        octree = self.texture.octree
        self._batch += 1
        n, self._n_rows = entries_in_reach(
            octree.tables, octree.level_first, self.layer.slots, dabs, self.finest, self.level,
            self._brush.geodesic, self._batch, self.marks, self._n_rows, self._found,
        )  # fmt: skip
        if self._n_rows > len(self.base):
            more = max(self._n_rows, 2 * len(self.base)) - len(self.base)
            self.coverage = np.concatenate([self.coverage, np.zeros((more, 512), np.float32)])
            self.base = np.concatenate([self.base, np.full(more, NOT_TAKEN, np.int32)])
        return self._found[:n].copy()

    def _parts(self, dabs: Dabs) -> Parts:
        """(d,) the parts of the surface, as bits, that are nearest to the ends of dabs."""
        octree = self.texture.octree
        if self._brush.through or not self.texture.knows_parts:
            return np.full(len(dabs), ANY_PART, np.int64)
        ends = np.ascontiguousarray(dabs[:, :6].reshape(-1, 3)) * octree.texel
        faces = self.texture.nearest_places(ends)[2]
        return np.bitwise_or.reduce(octree.parts_of(faces).reshape(-1, 2), axis=1)

    def _gates(self, found: Entries, dabs: Dabs, parts: Parts) -> UInt64[np.ndarray, "a b 8"]:
        if not self._brush.geodesic:
            return np.zeros((1, 1, 8), np.uint64)
        gates = np.empty((len(dabs), max(len(found), 1), 8), np.uint64)
        tables = self.texture.octree.tables
        run_ranges(
            lambda begin, end: connected_texels(
                tables, found, len(found), self._batch, self.marks, self.finest, self.level, dabs,
                parts, begin, end, gates,
            ),
            len(dabs), len(found),
        )  # fmt: skip
        return gates

    def _take(self, touched: Touched) -> None:
        """Make slots to write in, and hold those of entries that were not painted yet."""
        new = self.base[touched.rows] == NOT_TAKEN
        if new.any():
            entries = touched.entries[new]
            before = self.layer.slots[entries]
            self.texture.pool.hold(before)
            self.base[touched.rows[new]] = before
            self.taken.append(entries)
        # Those painted before may be held by now, by somebody who looks on
        self.texture.writable(self.layer, touched.entries)


def run_ranges(work, n_items: int, cost: int) -> None:
    """Call ``work(begin, end)`` for ranges of items, on all cores if that pays."""
    if n_items * cost < PAIRS_FOR_THREADS:
        if n_items:
            work(0, n_items)
        return
    ranges = even_ranges(n_items, 4 * n_threads())
    run_pieces(lambda piece: work(*ranges[piece]), len(ranges))


def wanted_level(texture: VolumeTexture, brush: Brush) -> int:
    """The coarsest level whose texels are fine enough for a brush."""
    octree, level = texture.octree, 0
    while level + 1 < octree.n_levels and octree.spacing(level + 1) <= brush.spacing_wanted:
        level += 1
    return level


def _picture(picture: np.ndarray | None) -> np.ndarray:
    """A picture as kernels take it, which are compiled for writable arrays."""
    return np.ones((1, 1), np.float32) if picture is None else np.array(picture, np.float32)


def _joined(parts: list[Touched]) -> Touched:
    """What several batches touched, each entry once."""
    entries, first, back = np.unique(
        np.concatenate([one.entries for one in parts]), return_index=True, return_inverse=True
    )
    changed = np.zeros((len(entries), 8), np.uint64)
    np.bitwise_or.at(changed, back, np.concatenate([one.changed for one in parts]))
    return Touched(entries, np.concatenate([one.rows for one in parts])[first], changed)
