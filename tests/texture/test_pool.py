"""meshsdf.texture.pool: slots are held, dropped and given again; tiles are kept once."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from meshsdf.errors import TextureError
from meshsdf.texture.channels import channels_with
from meshsdf.texture.pool import FIRST_CAPACITY, BrickPool, TilePool

CHANNELS = channels_with("srgb8")


def test_slots_that_are_taken_are_all_different_and_empty():
    pool = BrickPool(CHANNELS)
    pool.use("mask")
    slots = pool.take(3 * FIRST_CAPACITY)
    assert len(np.unique(slots)) == len(slots) == pool.n_used
    assert (pool.arrays["base"][slots] == 0).all()
    assert (pool.arrays["mask"][slots] == 255).all()
    assert pool.n_bytes == len(slots) * 512 * (4 + 1)


def test_growing_keeps_what_was_written():
    pool = BrickPool(CHANNELS)
    slots = pool.take(FIRST_CAPACITY)
    pool.arrays["base"][slots] = np.arange(FIRST_CAPACITY, dtype=np.uint32)[:, None]
    pool.take(5 * FIRST_CAPACITY)
    assert_array_equal(pool.arrays["base"][slots, 511], np.arange(FIRST_CAPACITY))


def test_a_slot_is_given_again_only_when_the_last_holder_has_dropped_it():
    pool = BrickPool(CHANNELS)
    slots = pool.take(4)
    pool.hold(slots[[0, 0, 1]])
    pool.drop(slots)
    assert pool.n_used == 2
    pool.drop(slots[[0]])
    assert_array_equal(pool.holders[slots], [1, 1, 0, 0])
    pool.drop(np.array([slots[0], -1, -5, slots[1]], np.int32))  # absent and tiles: no slots
    assert pool.n_used == 0
    again = pool.take(4)
    assert set(again.tolist()) == set(slots.tolist())


def test_what_was_written_before_is_gone_from_a_slot_given_again():
    pool = BrickPool(CHANNELS)
    slots = pool.take(2)
    pool.arrays["base"][slots] = 7
    pool.drop(slots)
    assert (pool.arrays["base"][pool.take(2)] == 0).all()


def test_a_channel_used_late_holds_nothing_in_slots_old_and_new():
    pool = BrickPool(CHANNELS)
    old = pool.take(FIRST_CAPACITY // 2)
    for name in ("mask", "normal", "height"):
        assert (pool.use(name)[old] == CHANNELS[name].nothing).all()
        pool.use(name)[old] = 7
    pool.drop(old[:5])
    new = pool.take(7 * FIRST_CAPACITY)
    for name in ("mask", "normal", "height"):
        assert (pool.arrays[name][new] == CHANNELS[name].nothing).all()
        assert (pool.arrays[name][old[5:]] == 7).all()


def test_copies_hold_the_same_texels_in_every_channel_and_are_apart():
    pool = BrickPool(CHANNELS)
    slots = pool.take(2)
    pool.arrays["base"][slots] = np.arange(1024, dtype=np.uint32).reshape(2, 512)
    pool.use("height")[slots] = 5
    copies = pool.copies(slots)
    assert_array_equal(pool.arrays["base"][copies], pool.arrays["base"][slots])
    assert (pool.arrays["height"][copies] == 5).all()
    pool.arrays["base"][copies] = 1
    assert pool.arrays["base"][slots].max() == 1023


def test_the_same_operations_name_the_same_slots():
    def run():
        pool = BrickPool(CHANNELS)
        first = pool.take(100)
        pool.drop(first[10:50])
        return np.concatenate([first, pool.take(70), pool.copies(first[:5])])

    assert_array_equal(run(), run())


def test_a_tile_is_kept_once_and_comes_back():
    tiles = TilePool(CHANNELS)
    codes = [tiles.code({"base": n % 20, "mask": n % 3}) for n in range(120)]
    assert len(set(codes)) == len(tiles) == 60
    assert max(codes) == -2
    for n, code in enumerate(codes):
        assert tiles.texel(code)["base"] == n % 20
        assert tiles.texel(code)["mask"] == n % 3
        assert tiles.texel(code)["height"] == 0
    assert tiles.code({}) == tiles.code({"base": 0, "mask": 255})


def test_a_channel_that_is_not_there_is_refused():
    with pytest.raises(TextureError, match="there is no channel 'colour'"):
        BrickPool(CHANNELS).use("colour")
