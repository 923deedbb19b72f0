"""meshsdf.texture.mip: coarser levels are means of the finer, in linear light."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf.errors import TextureError
from meshsdf.kernels import parallel
from meshsdf.mesh import Mesh
from meshsdf.mesh.primitives import icosphere
from meshsdf.mesh.sampling import sample_surface
from meshsdf.srgb import linear_from_srgb, srgb_from_linear
from meshsdf.texture.mip import bake, update_mips
from meshsdf.texture.refine import refine_to, texel_mask
from meshsdf.texture.volume_texture import VolumeTexture

from .texture_twins import ABSENT, half_painted, half_pattern, mean_below, random_texture
from .texture_twins import stored_nodes as nodes_of

BALL = icosphere(subdivisions=3, center=(0.13, -0.2, 0.31))
SQUARE = Mesh(
    np.array([[0.0, 0, 0], [64, 0, 0], [64, 64, 0], [0, 64, 0]]),
    np.array([[0, 1, 2], [0, 2, 3]], np.int32),
)


def premultiplied(values):
    return np.append(values[:3] * values[3], values[3])


@pytest.mark.parametrize(("base", "step"), [("half", 2.0**-11), ("srgb8", 2.3 * 0.5 / 255)])
def test_every_texel_above_is_the_mean_that_the_plain_twin_takes(base, step):
    texture, layer = random_texture(BALL, 40, 3, base=base)
    refine_to(texture, layer, 1)
    fine = layer.stored[texture.octree.tables.levels[layer.stored] == 0]
    assert 0 < len(fine) < texture.octree.level_first[1]
    before = nodes_of(texture, layer)
    update_mips(texture, layer, layer.stored)
    after = nodes_of(texture, layer)
    n_kept = n_new = 0
    for level in range(1, texture.octree.n_levels):
        for node, value in after[level].items():
            wanted = mean_below(after, level, node)
            if wanted is None:
                assert_array_equal(value, before[level][node])
                n_kept += 1
            else:
                slack = step * max(1.0, wanted[3]) + 1e-6
                assert_allclose(premultiplied(value), premultiplied(wanted), atol=2 * slack)
                n_new += 1
    assert n_kept > 100
    assert n_new > 1000


def test_black_and_white_squares_are_half_the_light_from_afar():
    texture = VolumeTexture.around(SQUARE, texel=1.0)
    layer = texture.add_layer()

    def checker(points):
        white = np.rint(points[:, :2].sum(axis=1)) % 2
        return np.stack([white, white * 0.6, 1 - white, np.ones(len(points))], axis=1)

    bake(texture, layer, checker)
    inside = np.random.default_rng(0).uniform(12, 52, (2000, 3)) * [1, 1, 0]
    wanted = srgb_from_linear(np.array([0.5, 0.3, 0.5]))
    for level in (1, 2):
        found = srgb_from_linear(texture.colors(inside, footprint=2.0**level)[:, :3])
        assert np.abs(found - wanted).max() <= 1 / 255
    # Half of the codes, which is what a mean in sRGB gives, would be far too dark
    assert linear_from_srgb(np.array(0.5)) < 0.22


def test_an_edit_updates_what_a_whole_build_does():
    texture, layer = half_painted(BALL, 100)
    other, whole = half_painted(BALL, 100)
    random = np.random.default_rng(0)
    first = texture.octree.level_first[1]
    some = np.sort(random.choice(first, 12, False)).astype(np.int32)
    values = random.random((len(texture.places(some)[0]), 4)).astype(np.float32)
    for one, where in ((texture, layer), (other, whole)):
        one.put(where, some, values)
    changed = update_mips(texture, layer, some)
    update_mips(other, whole, np.arange(first, dtype=np.int32))
    points = sample_surface(BALL, 20_000, seed=3).points
    for width in (0.0, 0.05, 0.1, 0.3, 1.0):
        assert_array_equal(
            texture.colors(points, footprint=width), other.colors(points, footprint=width)
        )
    assert 0 < len(changed) < texture.octree.n_entries - first
    assert len(update_mips(texture, layer, some)) == 0  # all is up to date


def test_other_channels_have_their_means_too():
    texture, layer = random_texture(BALL, 40, 4, base="srgb8", channel="height")
    refine_to(texture, layer, 0)
    update_mips(texture, layer, layer.stored)
    nodes = nodes_of(texture, layer, "height")
    for node, value in nodes[1].items():
        assert_allclose(value[0], mean_below(nodes, 1, node)[0], atol=2.0**-11)
    assert np.ptp([value[0] for value in nodes[1].values()]) > 0.3


def test_a_constant_stays_the_same_number_at_all_levels():
    for code in (0x80FF1234, 0x01000307, 0xFF7F7F7F):
        texture = VolumeTexture.around(BALL, resolution=64)
        layer = texture.add_layer()
        color = texture.channels["base"].decoded(np.array([code], np.uint32))
        bake(texture, layer, lambda points, color=color: np.repeat(color, len(points), axis=0))
        assert texture.pool.n_used == 0
        assert len(np.unique(layer.slots)) == 1
        assert texture.tiles.texel(int(layer.slots[0]))["base"] == code


def test_one_thread_and_two_give_the_same_texels(monkeypatch):
    found = []
    for threads in (1, 2):
        monkeypatch.setattr(parallel, "n_threads", lambda threads=threads: threads)
        texture, layer = half_painted(BALL, 128)
        slots = layer.slots[layer.slots >= 0]
        found.append((layer.slots.tobytes(), texture.pool.arrays["base"][slots].tobytes()))
    assert found[0] == found[1]


def test_a_function_gets_normals_and_footprint_if_it_asks():
    texture = VolumeTexture.around(BALL, resolution=64, base="half")
    layer = texture.add_layer()
    seen = []

    def by_normal(points, normals):
        return np.concatenate([0.5 + 0.5 * normals, np.ones((len(points), 1))], axis=1)

    def by_width(points, footprint=0.0):
        seen.append(footprint)
        return np.full((len(points), 4), 0.25)

    def by_both(points, *, normals, footprint):
        seen.append((footprint, np.linalg.norm(normals, axis=1).min() > 0.9))
        return np.full((len(points), 4), 0.75)

    bake(texture, layer, by_normal)
    on = sample_surface(BALL, 5000, seed=1)
    apart = np.abs(texture.colors(on.points)[:, :3] - (0.5 + 0.5 * on.normals)).max()
    assert apart < 0.15  # faces of 9 degrees, codes of 0.9
    for function in (by_width, by_both):
        bake(texture, layer, function, level=1)
    assert seen == [texture.octree.spacing(1), (texture.octree.spacing(1), True)]
    assert (layer.slots[: texture.octree.level_first[1]] == ABSENT).all()
    assert_array_equal(texture.colors(on.points), 0.75)


def test_baking_fills_one_channel_and_says_how_far_it_is():
    texture, layer = half_painted(BALL, 64)
    before = texture.colors(BALL.vertices)
    told = []
    bake(
        texture, layer, lambda points: points[:, [0, 0, 0, 0]] * [1, 0, 0, 0] + [0, 0, 0, 1],
        channel="height", progress=lambda stage, share: told.append((stage, share)),
    )  # fmt: skip
    found = texture.colors(BALL.vertices, channel="height")[:, 0]
    assert_allclose(found, BALL.vertices[:, 0], atol=2.0**-11)
    assert_array_equal(texture.colors(BALL.vertices), before)
    assert told[-1] == ("bake", 1.0)
    assert texel_mask(texture, layer.stored).any(axis=1).all()


def test_what_is_no_texture_function_is_refused():
    texture = VolumeTexture.around(BALL, resolution=16)
    layer = texture.add_layer()
    with pytest.raises(TextureError, match=r"gave float64 of the shape \(\d+, 3\)"):
        bake(texture, layer, lambda points: points)
    with pytest.raises(TextureError, match="there is no level 7"):
        bake(texture, layer, half_pattern, level=7)
    with pytest.raises(TextureError, match="there is no channel 'gloss'"):
        bake(texture, layer, half_pattern, channel="gloss")
    with pytest.raises(TextureError, match="entries 99999 to 99999"):
        update_mips(texture, layer, np.array([99999], np.int32))
