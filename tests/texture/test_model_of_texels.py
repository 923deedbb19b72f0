"""The store of texels beside a plain dict of texels, through long random runs of operations."""

import itertools

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from meshsdf.mesh.primitives import icosphere
from meshsdf.mesh.sampling import sample_surface
from meshsdf.texture.refine import coarsen, refine, texel_mask
from meshsdf.texture.volume_texture import VolumeTexture

from .texture_twins import ABSENT

BALL = icosphere(subdivisions=2)
POINTS = sample_surface(BALL, 200, seed=0).points
OCTREE = VolumeTexture.around(BALL, resolution=40).octree
EXISTS = texel_mask(VolumeTexture(OCTREE), np.arange(OCTREE.n_entries, dtype=np.int32))
RUNS, STEPS = 20, 130
COLORS = np.array([0xFF0000FF, 0xFF00FF00, 0x80FF0000, 0x00000000], np.uint32)
DONE = {"operations": 0}


def around(entry):
    """Entries of the 27 bricks around the parent of an entry, found by their coordinates."""
    level = int(OCTREE.tables.levels[entry]) + 1
    if level == OCTREE.n_levels:
        return []
    x, y, z = (OCTREE.tables.bricks[entry] // 2).tolist()
    steps = itertools.product((-1, 0, 1), repeat=3)
    wanted = ((level, x + a, y + b, z + c) for a, b, c in steps)
    return [ENTRY_OF[key] for key in wanted if key in ENTRY_OF]


ENTRY_OF = {
    (level, *brick): e
    for e, (level, brick) in enumerate(
        zip(OCTREE.tables.levels.tolist(), OCTREE.tables.bricks.tolist(), strict=True)
    )
}


class Model:
    """Layers as dicts: entry -> its texels, one number each; entries not in it are not stored."""

    def __init__(self, random):
        self.random = random
        self.texture = VolumeTexture(OCTREE)
        self.layers = []
        self.kept = []  # slots that somebody else holds, and the texels they must keep
        self.add_layer()

    def add_layer(self):
        layer = self.texture.add_layer(color=(0.0, 1.0, 0.0, 1.0))
        top = range(int(OCTREE.level_first[-2]), OCTREE.n_entries)
        green = np.uint32(0xFF00FF00)
        self.layers.append((layer, {e: np.full(EXISTS[e].sum(), green) for e in top}))

    def some(self, stored):
        """A random part of the entries of a layer: of the stored ones, or of all."""
        among = np.array(sorted(stored)) if len(stored) else np.arange(0)
        n = min(len(among), int(self.random.integers(1, 80)))
        return np.sort(self.random.choice(among, n, False)).astype(np.int32)

    def put(self, layer, texels):
        entries = self.some(texels)
        for e in entries.tolist():
            if self.random.random() < 0.3:
                texels[e] = np.full(len(texels[e]), self.random.choice(COLORS))
            else:
                texels[e] = self.random.choice(COLORS, len(texels[e]))
        numbers = np.concatenate([texels[e] for e in entries.tolist()])
        self.texture.put(layer, entries, self.texture.channels["base"].decoded(numbers))
        return len(entries)

    def write(self, layer, texels):
        """One texel, straight into the pool."""
        entries = self.some(texels)
        slots = self.texture.writable(layer, entries)
        for e, slot in zip(entries.tolist(), slots.tolist(), strict=True):
            n = int(self.random.integers(0, len(texels[e])))
            texels[e][n] = self.random.choice(COLORS)
            self.texture.pool.arrays["base"][slot, np.flatnonzero(EXISTS[e])[n]] = texels[e][n]
        return len(entries)

    def collapse(self, layer, texels):
        entries = self.some(texels)
        self.texture.collapse_uniform(layer, entries)
        for e in entries.tolist():
            assert (layer.slots[e] < ABSENT) == (len(np.unique(texels[e])) == 1)
        return len(entries)

    def refine(self, layer, texels):
        wanted = set(self.some(range(OCTREE.n_entries)).tolist())
        n = len(wanted)
        before = self.texture.colors(POINTS, layer=layer)
        new = refine(self.texture, layer, np.array(sorted(wanted), np.int32))
        for level in range(OCTREE.n_levels):
            here = {e for e in wanted if OCTREE.tables.levels[e] == level and e not in texels}
            wanted |= set(itertools.chain.from_iterable(around(e) for e in here))
        assert set(new.tolist()) == {e for e in wanted if e not in texels}
        for e in new.tolist():
            texels[e] = self.stored(layer, e)
        after = self.texture.colors(POINTS, layer=layer)
        # Half a step of alpha, and of linear light where sRGB is steepest
        assert np.abs(after[:, 3] - before[:, 3]).max() <= 0.501 / 255
        light = after[:, :3] * after[:, 3:] - before[:, :3] * before[:, 3:]
        assert np.abs(light).max() <= (2.4 / 1.055 + 1) * 0.501 / 255
        return n + len(new)

    def coarsen(self, layer, texels):
        before = self.texture.colors(POINTS, layer=layer)
        gone = coarsen(self.texture, layer)
        assert_array_equal(self.texture.colors(POINTS, layer=layer), before)
        for e in gone.tolist():
            above = np.concatenate([texels[e], *(texels[a] for a in around(e))])
            assert len(np.unique(above)) == 1
        for e in gone.tolist():
            del texels[e]
        return len(layer.slots)

    def hold(self, layer, texels):
        self.texture.pool.hold(layer.slots)
        self.kept.append((layer.slots.copy(), {e: t.copy() for e, t in texels.items()}))
        return len(texels)

    def drop(self, layer, texels):
        if not self.kept:
            return 0
        slots, _ = self.kept.pop(int(self.random.integers(0, len(self.kept))))
        self.texture.pool.drop(slots)
        return len(slots)

    def give_back(self, layer, texels):
        """What undo does: the layer gets slots that were kept."""
        if not self.kept:
            return 0
        slots, old = self.kept[int(self.random.integers(0, len(self.kept)))]
        self.texture.pool.hold(slots)
        self.texture.pool.drop(layer.slots)
        layer.slots[:] = slots
        texels.clear()
        texels.update({e: t.copy() for e, t in old.items()})
        return len(slots)

    def duplicate(self, layer, texels):
        if len(self.layers) == 3:
            gone, _ = self.layers.pop(int(self.random.integers(0, 3)))
            self.texture.drop_layer(gone)
        else:
            twin = self.texture.duplicate_layer(layer)
            self.layers.append((twin, {e: t.copy() for e, t in texels.items()}))
        return len(layer.slots)

    def stored(self, layer, e):
        slot = int(layer.slots[e])
        if slot < ABSENT:
            return np.full(EXISTS[e].sum(), self.texture.tiles.texel(slot)["base"])
        return self.texture.pool.arrays["base"][slot][EXISTS[e]]

    def check(self):
        """All that is stored is what the dicts say, and every slot is held as often as named."""
        held = np.zeros(len(self.texture.pool.holders), int)
        shown = [(layer.slots, texels) for layer, texels in self.layers] + self.kept
        for slots, texels in shown:
            np.add.at(held, slots[slots >= 0], 1)
            stored = np.flatnonzero(slots != ABSENT)
            assert stored.tolist() == sorted(texels)
            bricks = stored[slots[stored] >= 0]
            found = self.texture.pool.arrays["base"][slots[bricks]][EXISTS[bricks]]
            wanted = [texels[e] for e in bricks.tolist()]
            assert_array_equal(found, np.concatenate([found[:0], *wanted]))
            for e in stored[slots[stored] < 0].tolist():
                number = self.texture.tiles.arrays["base"][-2 - slots[e]]
                assert (texels[e] == number).all()
        assert_array_equal(held, self.texture.pool.holders)
        assert self.texture.pool.n_used == np.count_nonzero(held)


OPERATIONS = [
    Model.put, Model.put, Model.write, Model.collapse, Model.refine, Model.coarsen, Model.hold,
    Model.drop, Model.drop, Model.give_back, Model.duplicate,
]  # fmt: skip


@settings(max_examples=RUNS)
@given(st.integers(0, 2**32))
def test_the_store_does_what_a_dict_of_texels_does(seed):
    random = np.random.default_rng(seed)
    model = Model(random)
    for step in range(STEPS):
        layer, texels = model.layers[int(random.integers(0, len(model.layers)))]
        operation = OPERATIONS[int(random.integers(0, len(OPERATIONS)))]
        DONE["operations"] += operation(model, layer, texels)
        if step % 5 == 0:
            model.check()
    model.check()
    while model.kept:
        model.drop(*model.layers[0])
    for layer, _ in model.layers:
        model.texture.drop_layer(layer)
    assert model.texture.pool.n_used == 0  # nothing is lost


def test_these_were_a_hundred_thousand_operations_on_bricks():
    if DONE["operations"] == 0:
        test_the_store_does_what_a_dict_of_texels_does()
    assert OCTREE.n_entries > 100
    assert DONE["operations"] >= 100_000
