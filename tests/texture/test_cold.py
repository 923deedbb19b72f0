"""meshsdf.texture.cold: what the history puts by comes back to the byte, and slots are free."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from meshsdf.errors import TextureError
from meshsdf.mesh import icosphere
from meshsdf.texture.blobs import Damaged
from meshsdf.texture.cold import bring_back, put_by
from meshsdf.texture.content import Content, digest
from meshsdf.texture.history import History
from meshsdf.texture.layers import flatten, shown
from meshsdf.texture.refine import refine, texel_mask
from meshsdf.texture.spill import Spill
from meshsdf.texture.volume_texture import VolumeTexture
from meshsdf.texture.watch import Watch

BALL = icosphere(subdivisions=2)
OCTREE = VolumeTexture.around(BALL, resolution=48).octree
LOTS = 2**50
STEPS = 30
CHANNELS = ("base", "base", "base", "mask", "normal", "height")


class Painter:
    """Random edits of a texture, told by numbers, with a history of a kind."""

    def __init__(self, *, dense, budget=LOTS, memory=0):
        self.texture = VolumeTexture(OCTREE)
        self.history = History(self.texture, dense=dense, budget=budget)
        self.history.spill = Spill(memory=memory)
        self.watch, self.content = Watch(self.texture), Content(self.texture)

    def edit(self, seed):
        """One edit that is recorded."""
        rng = np.random.default_rng(seed)
        texture, dice = self.texture, rng.random()
        if not texture.layers or (dice < 0.1 and len(texture.layers) < 4):
            texture.add_layer(color=rng.random(4).astype(np.float32))
            return
        layer = texture.layers[rng.integers(len(texture.layers))]
        if dice < 0.65:
            self.put(rng, layer)
        elif dice < 0.75 and len(texture.layers) < 4:
            texture.duplicate_layer(layer)
        elif dice < 0.82:
            texture.drop_layer(layer)
        elif dice < 0.9:
            layer.visible = not layer.visible
        elif dice < 0.93:
            flatten(texture)
        else:
            layer.opacity = float(rng.random())

    def put(self, rng, layer):
        """Texels in a row of bricks, of one colour in some."""
        begin = int(rng.integers(OCTREE.n_entries - 1))
        entries = np.arange(begin, min(begin + int(rng.integers(1, 60)), OCTREE.n_entries))
        entries = entries.astype(np.int32)
        refine(self.texture, layer, entries)
        n = int(np.diff(OCTREE.tables.texel_first)[entries].sum())
        values = rng.random((n, 4)).astype(np.float32)
        values[rng.random(n) < 0.5] = 0.25
        self.texture.put(layer, entries, values, channel=CHANNELS[rng.integers(len(CHANNELS))])
        self.texture.collapse_uniform(layer, entries)

    def step(self, seed):
        """An edit, or some steps back or forth."""
        history, rng = self.history, np.random.default_rng([seed, 1])
        dice = rng.random()
        if dice < 0.15 and history.n_done:
            for _ in range(int(rng.integers(1, 1 + min(history.n_done, 6)))):
                history.undo()
        elif dice < 0.35 and history.n_done < len(history.steps):
            for _ in range(int(rng.integers(1, 1 + len(history.steps) - history.n_done))):
                history.redo()
        else:
            with history.record("edit"):
                self.edit(seed)

    def digest(self):
        """What the layers hold, as one knows who followed slots all the while."""
        for _ in self.content.update():
            pass
        return self.content.digest()

    def seen(self):
        """The picture's texels, entry by entry."""
        slots, pool = shown(self.texture).slots, self.texture.pool.use("base")
        entries = np.flatnonzero(slots >= 0).astype(np.int32)
        return entries, pool[slots[entries]] * texel_mask(self.texture, entries)

    def end(self):
        """Drop everything that holds slots; whether the pool and the file are empty."""
        self.history.close()
        self.watch.release()
        for layer in list(self.texture.layers):
            self.texture.drop_layer(layer)
        shown(self.texture)
        if self.texture.flattened is not None:
            self.texture.flattened.release()
        assert not self.texture.pool.holders.any()
        assert self.texture.pool.n_used == 0
        assert sorted(self.texture.pool.free) == list(range(len(self.texture.pool.holders)))
        assert (self.history.n_bytes, self.history.n_hot) == (0, 0)


@settings(max_examples=10)
@given(st.integers(0, 2**32), st.sampled_from([0, 20_000, LOTS]))
def test_nothing_is_told_apart_from_a_history_that_puts_nothing_by(seed, memory):
    plain, cold = Painter(dense=LOTS), Painter(dense=0, memory=memory)
    rng = np.random.default_rng(seed)
    for number in range(STEPS):
        for one in (plain, cold):
            one.step([seed, number])
        if rng.random() < 0.5:
            cold.history.put_some_by(float(rng.choice([0, 1])))
        if rng.random() < 0.3:
            assert_array_equal(plain.watch.changed(), cold.watch.changed())
        assert plain.digest() == cold.digest()
    assert cold.digest() == digest(cold.texture)
    for mine, other in zip(cold.seen(), plain.seen(), strict=True):
        assert_array_equal(mine, other)
    spill = cold.history.spill
    assert spill.n_in_memory + spill.n_in_file > 0
    while cold.history.n_done:
        for one in (plain, cold):
            one.history.undo()
        assert plain.digest() == cold.digest()
    while cold.history.n_done < len(cold.history.steps):
        for one in (plain, cold):
            one.history.redo()
        assert plain.digest() == cold.digest()
    assert plain.history.spill.n_in_memory == 0
    cold.end()
    assert spill.n_in_memory == spill.n_in_file == 0
    plain.end()


def painted(base="srgb8", n=150):
    """A texture whose finest bricks hold random texels in every channel, and some none in one."""
    texture = VolumeTexture(OCTREE, base=base)
    layer, dice = texture.add_layer(), np.random.default_rng(0)
    entries = np.sort(dice.choice(OCTREE.n_entries, n, replace=False)).astype(np.int32)
    slots = texture.writable(layer, entries)
    for name, channel in texture.channels.items():
        size = (len(slots), 512)
        texels = dice.integers(0, np.iinfo(channel.dtype).max, size, channel.dtype)
        texels[dice.random(len(slots)) < 0.3] = channel.nothing
        texture.pool.use(name)[slots] = texels
    return texture, layer, entries


@pytest.mark.parametrize("base", ["srgb8", "half"])
def test_all_texels_that_exist_come_back_in_every_channel_and_so_do_tiles_and_gaps(base):
    texture, layer, bricks = painted(base)
    exists = texel_mask(texture, bricks)
    before = {name: array[layer.slots[bricks]] for name, array in texture.pool.arrays.items()}
    spill, entries = Spill(), np.arange(OCTREE.n_entries, dtype=np.int32)[::-1].copy()
    pieces = put_by(texture, entries, layer.slots[entries], spill)
    assert sum(piece.n_bytes for piece in pieces) == spill.n_in_memory + spill.n_in_file
    texture.pool.drop(layer.slots)
    for array in texture.pool.arrays.values():
        array[:] = 77
    found, slots = bring_back(texture, pieces)
    assert_array_equal(found, entries)
    assert_array_equal(np.minimum(slots, 0), np.minimum(layer.slots[entries], 0))
    assert (texture.pool.holders[slots[slots >= 0]] == 1).all()
    slots = slots[::-1][bricks]
    for name, array in texture.pool.arrays.items():
        assert_array_equal(array[slots][exists], before[name][exists])
        assert (array[slots][~exists] == texture.channels[name].nothing).all()


def test_a_third_of_a_brick_exists_and_smooth_paint_takes_a_tenth_of_that():
    texture, layer, bricks = painted()
    for name in texture.channels.keys() - {"base"}:
        del texture.pool.arrays[name]
    pieces = put_by(texture, bricks, layer.slots[bricks], Spill())
    noise = sum(piece.n_bytes for piece in pieces)
    assert noise <= 1.05 * 4 * texel_mask(texture, bricks).sum()
    texture.pool.arrays["base"][:] = np.uint32(0xFF8040C0)
    smooth = sum(piece.n_bytes for piece in put_by(texture, bricks, layer.slots[bricks], Spill()))
    assert smooth < noise / 10


def test_a_piece_that_was_harmed_is_told_and_takes_no_slots():
    texture, layer, bricks = painted()
    spill = Spill(memory=0)
    pieces = put_by(texture, bricks, layer.slots[bricks], spill)
    spill._file.seek(100)
    spill._file.write(b"something else")
    used = texture.pool.n_used
    with pytest.raises(Damaged, match="a piece that was put by has a wrong checksum"):
        bring_back(texture, pieces)
    assert texture.pool.n_used == used


def strokes(history, n, *, begin=0):
    """Steps that each change the same forty bricks; the digests after each."""
    texture, found = history.texture, []
    entries = np.arange(40, dtype=np.int32)
    n_texels = int(np.diff(OCTREE.tables.texel_first)[entries].sum())
    for number in range(begin, begin + n):
        values = np.random.default_rng(number).random((n_texels, 4)).astype(np.float32)
        with history.record("stroke"):
            texture.put(texture.layers[0], entries, values)
        found.append(digest(texture))
    return found


def one_layer(**options):
    texture = VolumeTexture(OCTREE)
    texture.add_layer()
    return History(texture, **options)


def test_the_pool_does_not_grow_while_one_paints_for_ever():
    history = one_layer(dense=0)
    strokes(history, 10)
    while history.put_some_by():
        pass
    pool, n_bytes = history.texture.pool, history.spill.n_in_memory
    used, room = pool.n_used, len(pool.holders)
    strokes(history, 60, begin=10)
    while history.put_some_by():
        pass
    assert (pool.n_used, len(pool.holders)) == (used, room)
    assert used == 80  # what is shown, and what undoing would show
    assert history.spill.n_in_memory == pytest.approx(60 / 8 * n_bytes + n_bytes, rel=0.1)


def test_steps_near_to_now_stay_in_the_pool_and_more_than_twice_as_many_never_do():
    brick = 512 * 4 + 12
    history = one_layer(dense=5 * 40 * brick)
    strokes(history, 5)
    assert history.spill.n_in_memory == 0
    strokes(history, 20, begin=5)
    assert history.n_hot <= 10 * 40 * brick
    assert [step.n_hot > 0 for step in history.steps] == [False] * 15 + [True] * 10
    while history.put_some_by():
        pass
    assert [step.n_hot > 0 for step in history.steps] == [False] * 20 + [True] * 5
    for _ in range(25):
        history.undo()
    while history.put_some_by():
        pass
    assert [step.n_hot > 0 for step in history.steps] == [True] * 5 + [False] * 20


def test_bricks_that_a_layer_shows_stay_where_they_are():
    history = one_layer(dense=0)
    before = strokes(history, 1)
    with history.record("twin"):
        twin = history.texture.duplicate_layer(history.texture.layers[0])
    kept = twin.slots.copy()
    after = strokes(history, 1, begin=1)
    strokes(history, 2, begin=2)
    assert not history.put_some_by()
    assert history.spill.n_in_memory > 0
    # The second stroke took away the bricks that the twin still shows
    assert_array_equal(history.steps[2].change.slots[0].before, kept[:40])
    with history.record("drop"):
        history.texture.drop_layer(twin)
    strokes(history, 2, begin=4)
    while history.put_some_by():
        pass
    assert len(history.steps[2].change.slots[0].before) == 0
    for _ in range(5):
        history.undo()
    assert digest(history.texture) == after[0]
    history.undo()
    history.undo()
    assert digest(history.texture) == before[0]


def test_a_step_that_cannot_be_read_back_is_let_go_and_nothing_has_changed():
    history = one_layer(dense=0)
    history.spill = Spill(memory=0)
    strokes(history, 3)
    last = strokes(history, 1, begin=3)[0]
    while history.put_some_by():
        pass
    history.undo()
    history.redo()
    history.spill._file.truncate(0)
    history.undo()
    now = digest(history.texture)
    assert now != last
    with pytest.raises(TextureError, match="step 'stroke' is lost for now: a piece"):
        history.undo()
    assert digest(history.texture) == now
    with pytest.raises(TextureError, match="was let go"):
        history.undo()
    history.redo()
    assert digest(history.texture) == last
