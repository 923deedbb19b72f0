"""meshsdf.texture.change: edits that are recorded can be taken back and done again."""

from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from meshsdf.errors import TextureError
from meshsdf.mesh import icosphere
from meshsdf.texture.change import recording
from meshsdf.texture.volume_texture import VolumeTexture


@pytest.fixture
def texture():
    """A sphere with one white layer."""
    texture = VolumeTexture.around(icosphere(subdivisions=2), resolution=32)
    texture.add_layer("white", color=(1.0, 1.0, 1.0))
    return texture


def fill(texture, entries, value, channel="base", layer=0):
    entries = np.asarray(entries, np.int32)
    n = int(np.diff(texture.octree.tables.texel_first)[entries].sum())
    values = np.full((n, 4), value, np.float32)
    texture.put(texture.layers[layer], entries, values, channel=channel)


def picture(texture):
    """All that is stored, entry by entry: plain copies of texels, nothing of slots."""
    out = []
    for layer in texture.layers:
        bricks = {
            (name, e): array[s].copy()
            for name, array in texture.pool.arrays.items()
            for e, s in enumerate(layer.slots)
            if s >= 0 and (array[s] != texture.channels[name].nothing).any()
        }
        out.append((layer.name, layer.opacity, layer.visible, layer.slots < 0, bricks))
    return out


def same(a, b):
    return len(a) == len(b) and all(
        one[:3] == other[:3]
        and (one[3] == other[3]).all()
        and one[4].keys() == other[4].keys()
        and all((one[4][key] == other[4][key]).all() for key in one[4])
        for one, other in zip(a, b, strict=True)
    )


def test_texels_attributes_and_layers_go_back_and_forth(texture):
    states, changes = [picture(texture)], []
    fill_later = [
        lambda: fill(texture, range(40), 0.5),
        lambda: fill(texture, range(20, 60), 0.25),
        lambda: fill(texture, range(10), 0.5, channel="orm"),
        lambda: texture.add_layer("top", color=(1.0, 0.0, 0.0)),
        lambda: setattr(texture.layers[1], "opacity", 0.5),
        lambda: texture.layers.reverse(),
        lambda: texture.drop_layer(texture.layers[1]),
    ]
    for edit in fill_later:
        with recording(texture) as change:
            edit()
        changes.append(change)
        states.append(picture(texture))
    assert not any(same(a, b) for a, b in pairwise(states))
    for _ in range(2):
        for change, state in zip(changes[::-1], states[-2::-1], strict=True):
            change.undo(texture)
            assert same(picture(texture), state)
        for change, state in zip(changes, states[1:], strict=True):
            change.redo(texture)
            assert same(picture(texture), state)


def test_nothing_changed_is_an_empty_change(texture):
    fill(texture, range(10), 0.5)
    slots = texture.layers[0].slots.copy()
    n_used = texture.pool.n_used
    with recording(texture) as change:
        fill(texture, range(10), 0.5)  # bricks that end as they began
        fill(texture, range(10, 20), 0.75)
        fill(texture, range(10, 20), 1.0)
        texture.layers[0].opacity = 0.5
        texture.layers[0].opacity = 1.0
    # Entries 10 ... 19 were not stored, and are now: that is a change
    assert [list(one.entries) for one in change.slots] == [list(range(10, 20))]
    change.undo(texture)
    change.release(texture)
    assert_array_equal(texture.layers[0].slots, slots)
    assert texture.pool.n_used == n_used
    with recording(texture) as change:
        fill(texture, range(10), 0.5)
    assert change.is_empty
    assert texture.pool.n_used == n_used


def test_a_tile_painted_in_its_own_colour_stays_a_tile(texture):
    top = texture.octree.n_entries - 1
    assert texture.layers[0].slots[top] < -1
    with recording(texture) as change:
        fill(texture, [top], 1.0)
    assert change.is_empty
    assert texture.layers[0].slots[top] < -1


def test_an_error_puts_everything_back(texture):
    fill(texture, range(30), 0.5)
    before, n_used = picture(texture), texture.pool.n_used
    layer = texture.layers[0]

    def go_wrong():
        with recording(texture):
            fill(texture, range(15, 60), 0.25)
            texture.add_layer("other")
            layer.name = "changed"
            texture.drop_layer(layer)
            raise KeyError

    with pytest.raises(KeyError):
        go_wrong()
    assert same(picture(texture), before)
    assert texture.layers == [layer]
    assert texture.pool.n_used == n_used


def test_memory_is_that_of_touched_bricks(texture):
    fill(texture, range(60), 0.5)
    n_used = texture.pool.n_used
    with recording(texture) as change:
        fill(texture, range(20), 0.25)
    assert texture.pool.n_used == n_used + 20
    assert 20 * 512 * 4 <= change.n_bytes(texture) <= 1.1 * 20 * 512 * 4
    change.release(texture)
    assert texture.pool.n_used == n_used


def test_a_change_keeps_its_texels_whatever_is_written_later(texture):
    fill(texture, range(20), 0.5)
    before = picture(texture)
    with recording(texture) as change:
        fill(texture, range(20), 0.25)
    after = picture(texture)
    fill(texture, range(20), 0.75)  # not recorded
    change.undo(texture)
    assert same(picture(texture), before)
    change.redo(texture)
    assert same(picture(texture), after)


def test_recordings_within_recordings_keep_no_slot_twice(texture):
    fill(texture, range(20), 0.5)
    before, n_used = picture(texture), texture.pool.n_used
    with recording(texture) as outer:
        for value in (0.1, 0.2, 0.3, 0.4):
            with recording(texture) as inner:
                fill(texture, range(20), value)
            inner.release(texture)
    free = texture.pool.free.tolist()
    assert len(set(free)) == len(free)
    held = np.flatnonzero(texture.pool.holders)
    assert not set(held) & set(free)
    assert len(held) == n_used + 20
    outer.undo(texture)
    assert same(picture(texture), before)


def test_undo_and_redo_take_turns(texture):
    with recording(texture) as change:
        fill(texture, range(5), 0.5)
    with pytest.raises(TextureError, match="done already"):
        change.redo(texture)
    change.undo(texture)
    with pytest.raises(TextureError, match="undone already"):
        change.undo(texture)


def test_a_layer_that_comes_back_is_the_same_object(texture):
    with recording(texture) as added:
        layer = texture.add_layer("new")
    added.undo(texture)
    assert layer not in texture.layers
    added.redo(texture)
    assert texture.layers[1] is layer
    with recording(texture) as dropped:
        texture.drop_layer(layer)
    dropped.undo(texture)
    assert texture.layers[1] is layer
