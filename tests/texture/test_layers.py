"""meshsdf.texture.layers: what layers show together, and that only what changed is redone."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf.errors import TextureError
from meshsdf.kernels.texture_lookup import ABSENT, FIRST_TILE
from meshsdf.mesh import box_mesh, icosphere
from meshsdf.texture.change import recording
from meshsdf.texture.layers import BLEND_MODES, Flattened, flatten, merge_down, shown
from meshsdf.texture.mip import bake, update_mips
from meshsdf.texture.octree import Octree
from meshsdf.texture.refine import coarsen, refine, refine_to
from meshsdf.texture.volume_texture import VolumeTexture
from tests.texture.compositing_twin import MODES, over

BALL = Octree.around(icosphere(subdivisions=3), resolution=40)
PLATE = Octree.around(box_mesh((1.0, 1.0, 0.02)), resolution=40)  # two sheets
HALF = 2.0**-10  # rounding to half precision below 1, twice: of a layer and of the picture
SRGB = 1.0 / 255


def texels(texture, layer, entries, channel="base"):
    """(n, 4) values of what is stored in entries, texel by texel."""
    bits = texture.octree.tables.masks[entries].view(np.uint8)
    needed = np.unpackbits(bits, axis=1, bitorder="little").astype(bool)
    slots = layer.slots[entries]
    pool, tiles = texture.pool.use(channel), texture.tiles.arrays[channel]
    rows = np.where(
        (slots >= 0)[:, None], pool[slots], tiles[np.maximum(FIRST_TILE - slots, 0)][:, None]
    )
    return texture.channels[channel].decoded(rows[needed])


def finest(texture):
    return np.arange(texture.octree.level_first[1], dtype=np.int32)


def random_values(rng, n):
    values = rng.uniform(size=(n, 4)).astype(np.float32)
    values[rng.uniform(size=n) < 0.3, 3] = 1
    values[rng.uniform(size=n) < 0.2, 3] = 0
    return values


def with_random_layers(n, *, base="half", seed=0, masks=False):
    """A texture with n layers of random texels, and these as (n, t, 4) and masks (n, t)."""
    texture, rng = VolumeTexture(BALL, base=base), np.random.default_rng(seed)
    entries = finest(texture)
    n_texels = BALL.n_texels(0)
    values, shares = [], []
    for number in range(n):
        layer = texture.add_layer()
        refine_to(texture, layer, 0)
        texture.put(layer, entries, random_values(rng, n_texels))
        if masks and number:
            texture.put(layer, entries, random_values(rng, n_texels), channel="mask")
        update_mips(texture, layer, entries)
        values.append(texels(texture, layer, entries))
        shares.append(texels(texture, layer, entries, "mask")[:, 0] if masks else None)
    return texture, values, shares


def picture(texture, layer):
    """All texels of all entries of a layer, and which are stored."""
    stored = layer.stored
    return stored, *(texels(texture, layer, stored, name) for name in texture.pool.arrays)


def same_as_composed_anew(texture):
    layer = shown(texture)
    anew = Flattened(texture)
    expected = picture(texture, anew.up_to_date())
    for mine, other in zip(picture(texture, layer), expected, strict=True):
        assert_array_equal(mine, other)
    anew.release()


def test_the_modes_are_the_nineteen_that_files_name():
    assert list(BLEND_MODES) == MODES


@pytest.mark.parametrize("mode", MODES)
def test_two_plain_colours_blend_by_the_formula(mode):
    texture, rng = VolumeTexture(BALL, base="half"), np.random.default_rng(3)
    below, above = texture.add_layer(), texture.add_layer()
    above.mode = mode
    ends = [np.array([0.0, 0.5, 1.0, 1.0]), np.array([1.0, 0.0, 0.25, 0.5])]
    for _ in range(12):
        pair = [rng.uniform(size=4) if rng.uniform() < 0.7 else ends[rng.integers(2)]
                for _ in range(2)]  # fmt: skip
        for layer, color in zip((below, above), pair, strict=True):
            code = texture.tiles.code({"base": texture.encoded_color(color.astype(np.float32))})
            layer.slots[BALL.level_first[-2] :] = code
        above.opacity = float(rng.choice([1.0, 0.3]))
        b, s = (texture.colors(np.array([[0.0, 0, 1]]), layer=each)[0] for each in (below, above))
        found = texture.colors(np.array([[0.0, 0, 1]]))[0]
        expected = over(mode, b, s, above.opacity)
        # Dividing by a small number magnifies the rounding of float32 alone: by 1 / 0.01 at most
        assert_allclose(found, expected, atol=HALF * max(1.0, expected.max()))


@pytest.mark.parametrize(("base", "error"), [("half", HALF), ("srgb8", SRGB)])
def test_texels_of_three_layers_with_masks_are_those_of_the_plain_twin(base, error):
    texture, values, shares = with_random_layers(3, base=base, masks=True)
    modes, opacities = ["normal", "multiply", "screen"], [1.0, 0.75, 0.5]
    for layer, mode, opacity in zip(texture.layers, modes, opacities, strict=True):
        layer.mode, layer.opacity = mode, opacity
    found = texels(texture, shown(texture), finest(texture))
    some = np.random.default_rng(1).integers(len(found), size=500)
    for n in some:
        expected = np.zeros(4)
        for value, share, mode, opacity in zip(values, shares, modes, opacities, strict=True):
            expected = over(mode, expected, value[n], opacity * share[n])
        # Colours count with their alpha: where there is little of it they are of little account
        assert_allclose(found[n, 3], expected[3], atol=error)
        assert_allclose(found[n, :3] * found[n, 3], expected[:3] * expected[3], atol=2 * error)


def test_heights_add_up_and_normals_cover_what_is_below():
    texture, rng = VolumeTexture(BALL), np.random.default_rng(5)
    entries, n = finest(texture), BALL.n_texels(0)
    heights, orms, bumps = [], [], []
    for opacity in (1.0, 0.5):
        layer = texture.add_layer()
        layer.opacity = opacity
        refine_to(texture, layer, 0)
        texture.put(layer, entries, random_values(rng, n) - 0.5, channel="height")
        texture.put(layer, entries, random_values(rng, n), channel="orm")
        bump = (random_values(rng, n) - [0.5, 0.5, 0.5, 0]).astype(np.float32)
        texture.put(layer, entries, bump, channel="normal")
        heights.append(texels(texture, layer, entries, "height")[:, 0])
        orms.append(texels(texture, layer, entries, "orm"))
        bumps.append(texels(texture, layer, entries, "normal"))
    layer = shown(texture)
    found = texels(texture, layer, entries, "height")[:, 0]
    assert_allclose(found, heights[0] + 0.5 * heights[1], atol=HALF)
    found, bump = texels(texture, layer, entries, "orm"), texels(texture, layer, entries, "normal")
    for n in range(0, len(found), 97):
        below = over("normal", np.zeros(4), orms[0][n])
        expected = over("normal", below, orms[1][n], 0.5)
        assert_allclose(found[n, :3] * found[n, 3], expected[:3] * expected[3], atol=2 * SRGB)
        below = over("normal", np.zeros(4), bumps[0][n])
        expected = over("normal", below, bumps[1][n], 0.5)
        length = np.linalg.norm(expected[:3])
        if length > 0.1 and expected[3] > 0:
            assert_allclose(bump[n, :3], expected[:3] / length, atol=1e-3)


@pytest.mark.parametrize("hide", ["visible", "opacity"])
def test_a_layer_that_is_hidden_or_has_no_opacity_changes_no_bit(hide):
    texture, _, _ = with_random_layers(3, base="srgb8")
    points = icosphere(subdivisions=4).vertices
    top = texture.layers[2]
    texture.layers.remove(top)
    without = texture.colors(points)
    texture.layers.insert(1, top)
    setattr(top, hide, 0.0 if hide == "opacity" else False)
    top.mode = "difference"
    assert_array_equal(texture.colors(points), without)
    texture.layers[0].visible = False
    assert shown(texture) is texture.layers[2]


def test_a_layer_that_is_alone_is_used_without_copying():
    texture, _, _ = with_random_layers(1)
    used = texture.pool.n_used
    assert shown(texture) is texture.layers[0]
    other = texture.add_layer()
    shown(texture)
    assert texture.pool.n_used > used
    texture.drop_layer(other)
    assert shown(texture) is texture.layers[0]
    assert texture.pool.n_used == used


def test_no_visible_layer_shows_nothing():
    texture, _, _ = with_random_layers(1)
    texture.layers[0].visible = False
    assert_array_equal(texture.colors(icosphere().vertices), 0)


def test_an_empty_layer_above_changes_no_texel_that_can_be_seen():
    texture, _, _ = with_random_layers(1, base="srgb8")
    stored, before = picture(texture, texture.layers[0])
    texture.add_layer()
    found, after = picture(texture, shown(texture))
    assert_array_equal(found, stored)
    assert_array_equal(after, np.where(before[:, 3:] > 0, before, 0))


def test_coarser_levels_of_the_picture_are_means_of_it():
    texture, _, _ = with_random_layers(2)
    texture.layers[1].mode = "multiply"
    layer = shown(texture)
    entries = np.flatnonzero(BALL.tables.levels == 1).astype(np.int32)
    before = texels(texture, layer, entries)
    update_mips(texture, layer, finest(texture))
    assert_array_equal(texels(texture, layer, entries), before)


def test_merging_down_keeps_the_picture_of_normal_layers():
    for place in (1, 2):
        texture, _, _ = with_random_layers(3)
        texture.layers[place].opacity = 0.6
        before = texels(texture, shown(texture), finest(texture))
        n_layers = len(texture.layers)
        merge_down(texture, texture.layers[place])
        after = texels(texture, shown(texture), finest(texture))
        assert len(texture.layers) == n_layers - 1
        # (a over b) over c = a over (b over c), but for one rounding to half precision more
        assert_allclose(after[:, 3], before[:, 3], atol=2 * HALF)
        weight = before[:, 3:]
        assert_allclose(after[:, :3] * weight, before[:, :3] * weight, atol=2 * HALF)


def test_flattening_keeps_every_bit_and_can_be_undone():
    texture, _, _ = with_random_layers(3, base="srgb8")
    texture.layers[1].mode, texture.layers[2].visible = "screen", False
    points = icosphere(subdivisions=4).vertices
    before, layers = texture.colors(points), list(texture.layers)
    with recording(texture) as change:
        flatten(texture)
    assert len(texture.layers) == 1
    assert_array_equal(texture.colors(points), before)
    change.undo(texture)
    assert texture.layers == layers
    assert_array_equal(texture.colors(points), before)


def test_moving_layers_changes_which_lies_on_which():
    texture = VolumeTexture(BALL)
    red = texture.add_layer("red", color=(1.0, 0.0, 0.0))
    blue = texture.add_layer("blue", color=(0.0, 0.0, 1.0))
    point = np.array([[0.0, 0.0, 1.0]])
    assert_array_equal(texture.colors(point), [[0, 0, 1, 1]])
    texture.move_layer(red, -1)
    assert texture.layers == [blue, red]
    assert_array_equal(texture.colors(point), [[1, 0, 0, 1]])
    with pytest.raises(TextureError, match="no place 2 among 2 layers"):
        texture.move_layer(red, 2)


def test_a_duplicate_shares_texels_until_one_of_the_two_is_painted():
    texture, values, _ = with_random_layers(1)
    used = texture.pool.n_used
    layer = texture.layers[0]
    twin = texture.duplicate_layer(layer)
    assert texture.pool.n_used == used
    assert texture.layers == [layer, twin]
    assert twin.number != layer.number
    texture.put(twin, finest(texture), np.zeros((BALL.n_texels(0), 4), np.float32))
    assert_array_equal(texels(texture, layer, finest(texture)), values[0])


EDITS = st.lists(
    st.tuples(st.integers(0, 7), st.integers(0, 2), st.integers(0, 2**32 - 1)), min_size=1,
    max_size=6,
)  # fmt: skip


@settings(max_examples=12)
@given(EDITS, st.sampled_from([BALL, PLATE]))
def test_what_is_redone_after_edits_equals_all_composed_anew(edits, octree):
    texture = VolumeTexture(octree)
    for color in ((0.5, 0.2, 0.1), (0.0, 0.0, 0.0, 0.0), (0.0, 0.4, 0.0, 0.5)):
        texture.add_layer(color=color)
    bake(texture, texture.layers[0], lambda p: np.abs(np.sin(9 * p @ np.ones((3, 4)))), level=1)
    for kind, number, seed in edits:
        edit(texture, texture.layers[number], kind, np.random.default_rng(seed))
        same_as_composed_anew(texture)


def edit(texture, layer, kind, rng):
    """Paint a few bricks (0 ... 4), coarsen, mask, or change how the layer lies."""
    if kind == 5:
        coarsen(texture, layer, 0.2)
    elif kind == 6:
        layer.opacity, layer.mode = float(rng.uniform()), str(rng.choice(MODES))
    else:
        n = texture.octree.n_entries
        near = rng.integers(n)
        entries = np.unique(rng.integers(near, min(near + 4, n), size=3)).astype(np.int32)
        refine(texture, layer, entries)
        n_texels = len(texture.places(entries)[0])
        values = random_values(rng, n_texels)
        if kind == 1:
            values[:] = values[0]
        if kind == 2:  # all but a few texels stay as they were
            values = np.where(
                np.arange(n_texels)[:, None] < n_texels - 3, texels(texture, layer, entries), values
            )
        texture.put(layer, entries, values, channel="mask" if kind == 7 else "base")
        texture.collapse_uniform(layer, entries)
        update_mips(texture, layer, entries)


def test_painting_a_brick_composes_what_is_near_and_no_more():
    octree = Octree.around(icosphere(subdivisions=3), resolution=100)
    texture = VolumeTexture(octree)
    ground, paint = texture.add_layer(), texture.add_layer()
    bake(texture, ground, lambda p: np.abs(np.sin(9 * p @ np.ones((3, 4)))))
    brick = np.array([0], np.int32)
    refine(texture, paint, brick)
    shown(texture)
    values = np.ones((len(texture.places(brick)[0]), 4), np.float32)
    texture.put(paint, brick, values)
    update_mips(texture, paint, brick)
    shown(texture)
    # The brick, those above it, and what lies at the rim of the 27 bricks that are stored beside
    assert texture.flattened.n_composed < 0.06 * octree.n_entries
    same_as_composed_anew(texture)


def test_what_makes_no_sense_is_said():
    texture, _, _ = with_random_layers(2)
    top = texture.layers[1]
    top.mode = "overlap"
    with pytest.raises(TextureError, match="unknown blend mode 'overlap'"):
        texture.colors(np.zeros((1, 3)))
    top.mode, top.opacity = "normal", 1.5
    with pytest.raises(TextureError, match=r"has the opacity 1\.5"):
        texture.colors(np.zeros((1, 3)))
    top.opacity = 1.0
    with pytest.raises(TextureError, match="is the lowest layer"):
        merge_down(texture, texture.layers[0])
    texture.layers[0].visible = False
    with pytest.raises(TextureError, match="is hidden"):
        merge_down(texture, top)
    assert (top.slots != ABSENT).any()
