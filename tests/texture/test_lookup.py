"""meshsdf.texture.lookup: what a texture shows, beside a plain twin of its definition."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf.errors import TextureError
from meshsdf.mesh.primitives import box_mesh, icosphere
from meshsdf.mesh.sampling import sample_surface
from meshsdf.texture.lookup import look_up
from meshsdf.texture.mip import bake
from meshsdf.texture.refine import refine_to, texel_mask
from meshsdf.texture.volume_texture import VolumeTexture

from .texture_twins import half_painted, half_pattern, random_texture, shown, stored_nodes

BALL = icosphere(subdivisions=3, center=(0.13, -0.2, 0.31))
ROUNDING = 3e-6  # 8 products and sums of float32, twice where levels meet
STEP_OF_HALF = 2.0**-11


def mixed(a, b, share):
    """Between two colours, by their alpha."""
    w0, w1 = (1 - share) * a[:, 3:], share * b[:, 3:]
    alpha = w0 + w1
    rgb = np.divide(w0 * a[:, :3] + w1 * b[:, :3], alpha, out=a[:, :3].copy(), where=alpha > 0)
    return np.concatenate([rgb, alpha], axis=1)


@pytest.mark.parametrize("base", ["half", "srgb8"])
def test_every_level_shows_what_the_plain_twin_says(base):
    texture, layer = random_texture(BALL, 40, 3, base=base)
    nodes = stored_nodes(texture, layer)
    on = sample_surface(BALL, 150, seed=1).points
    # Beside the surface, too: there corners are missing
    random = np.random.default_rng(2)
    near = on + random.uniform(-2, 2, on.shape) * texture.octree.texel
    for points in (on, near):
        for level in range(texture.octree.n_levels):
            spacing = texture.octree.spacing(level)
            found = texture.colors(points, footprint=spacing * (1 + 1e-12))
            wanted = np.array([shown(nodes, level, p / spacing) for p in points])
            found[:, :3] *= found[:, 3:]
            wanted[:, :3] *= wanted[:, 3:]
            assert_allclose(found, wanted, atol=ROUNDING)


def test_footprints_between_levels_mix_the_two_by_their_logarithm_and_alpha():
    texture, _ = random_texture(BALL, 40, 5)
    points = sample_surface(BALL, 2000, seed=1).points
    random = np.random.default_rng(0)
    detail = random.uniform(-1, texture.octree.n_levels + 1, len(points))
    found = texture.colors(points, footprint=texture.octree.texel * 2**detail)
    top = texture.octree.n_levels - 1
    levels = [texture.colors(points, footprint=texture.octree.spacing(n)) for n in range(top + 1)]
    detail = detail.clip(0, top)
    for n, d in enumerate(detail):
        low = int(d)
        pair = levels[low][n : n + 1], levels[min(low + 1, top)][n : n + 1]
        assert_allclose(found[n : n + 1], mixed(*pair, d - low), atol=1e-5)


def test_a_trilinear_function_comes_back_to_the_rounding_of_texels():
    def trilinear(points):
        x, y, z = points.T
        colors = np.ones((len(points), 4))
        colors[:, 0] = 2 + 0.3 * x - 0.4 * y + 0.2 * z
        colors[:, 1] = 2 + x * y + y * z - 0.5 * x * y * z
        colors[:, 2] = 2 - x * z
        return colors

    texture = VolumeTexture.around(BALL, resolution=100, base="half")
    bake(texture, texture.add_layer(), trilinear)
    points = sample_surface(BALL, 20_000, seed=4).points
    wanted = trilinear(points)
    # The products of two and three coordinates are trilinear in every cell
    assert_allclose(texture.colors(points), wanted, rtol=STEP_OF_HALF * 1.01)


def test_texels_that_do_not_exist_never_bleed():
    texture, layer = half_painted(BALL, 64)
    points = sample_surface(BALL, 20_000, seed=4).points
    random = np.random.default_rng(0)
    points += random.uniform(-2, 2, points.shape) * texture.octree.texel
    widths = texture.octree.texel * 2 ** random.uniform(0, 4, len(points))
    before = texture.colors(points, footprint=widths)
    entries = layer.stored[layer.slots[layer.stored] >= 0]
    texels = texture.pool.arrays["base"]
    block = texels[layer.slots[entries]]
    block[~texel_mask(texture, entries)] = 0xFF0000FF
    texels[layer.slots[entries]] = block
    assert_array_equal(texture.colors(points, footprint=widths), before)


def test_colour_is_weighed_by_alpha():
    texture = VolumeTexture.around(box_mesh((4, 4, 4)), texel=1.0, base="half")
    layer = texture.add_layer()

    def red_or_clear_green(points):
        red = points[:, :1] < 0.5
        return np.where(red, [[1.0, 0, 0, 1]], [[0, 1.0, 0, 0]])

    bake(texture, layer, red_or_clear_green)
    for share in (0.1, 0.5, 0.9):
        found = texture.colors(np.array([[share, 0.0, 2.0]]))
        assert_allclose(found, [[1, 0, 0, 1 - share]], atol=1e-6)


def test_points_that_are_not_finite_give_nan_and_the_others_their_colours():
    texture, _ = half_painted(BALL, 32)
    points = sample_surface(BALL, 5000, seed=1).points
    wanted = texture.colors(points)
    broken = points.copy()
    broken[::7, 1] = np.nan
    broken[1::7, 2] = np.inf
    broken[2::7, 0] = -1e300
    for footprint in (0.0, 0.2):
        found = texture.colors(broken, footprint=footprint)
        hit = np.isnan(found).all(axis=1)
        assert_array_equal(np.flatnonzero(hit), np.flatnonzero(np.arange(5000) % 7 < 3))
    assert_array_equal(texture.colors(broken)[~hit], wanted[~hit])


def test_order_and_pieces_change_no_bit():
    texture, _ = random_texture(BALL, 100, 7, base="srgb8")
    points = sample_surface(BALL, 150_000, seed=1).points
    random = np.random.default_rng(0)
    widths = texture.octree.texel * 2 ** random.uniform(-1, 5, len(points))
    whole = texture.colors(points, footprint=widths)
    order = random.permutation(len(points))
    assert_array_equal(texture.colors(points[order], footprint=widths[order]), whole[order])
    few = [texture.colors(p[None], footprint=w) for p, w in zip(points[:99], widths, strict=False)]
    assert_array_equal(np.concatenate(few), whole[:99])


def test_nearest_is_the_texel_at_the_nearest_node_of_the_finest_stored_level():
    texture, layer = random_texture(BALL, 40, 9)
    nodes = stored_nodes(texture, layer)
    points = sample_surface(BALL, 500, seed=2).points
    kind = texture.channels["base"]
    found = look_up(
        texture.octree, layer.slots, texture.pool.arrays["base"], texture.tiles.arrays["base"],
        kind.kind, points, interpolate=False,
    )  # fmt: skip
    for point, color in zip(points, found, strict=True):
        for level, at_level in enumerate(nodes):
            node = np.floor(point / texture.octree.spacing(level) + 0.5).astype(int)
            value = at_level.get((*node.tolist(),))
            if value is not None:
                assert_allclose(color, value, atol=1e-6)
                break


def test_nearest_lookups_tell_sides_apart_and_know_no_order_nor_what_is_not_finite():
    texture = VolumeTexture.around(box_mesh((20.0, 14.0, 0.3), center=(0.3, 0.2, 0.4)), texel=1.0)
    layer = texture.add_layer()

    def by_side(points, normals):
        return np.where(normals[:, 2:] > 0, [1.0, 0, 0, 1], [0, 0, 1.0, 1])

    bake(texture, layer, by_side)
    random = np.random.default_rng(3)
    points = random.uniform([-8.7, -5.8, 0.25], [9.3, 6.2, 0.55], (5000, 3))
    normals = np.zeros((5000, 3))
    normals[:, 2] = random.choice([-1.0, 1.0], 5000)
    points[::9] *= np.array([1, np.nan, 1])
    wanted = by_side(points, normals)
    wanted[::9] = np.nan

    def nearest(points, normals):
        return look_up(
            texture.octree, layer.slots, texture.pool.arrays["base"],
            texture.tiles.arrays["base"], texture.channels["base"].kind, points, normals,
            interpolate=False,
        )  # fmt: skip

    assert_array_equal(nearest(points, normals), wanted)
    order = random.permutation(5000)
    assert_array_equal(nearest(points[order], normals[order]), wanted[order])
    few = [nearest(points[n : n + 7], normals[n : n + 7]) for n in range(0, 700, 7)]
    assert_array_equal(np.concatenate(few), wanted[:700])


def test_half_and_srgb8_agree_to_the_step_of_eight_bits():
    points = sample_surface(BALL, 10_000, seed=2).points
    shown_by = [half_painted(BALL, 64, base=base)[0].colors(points) for base in ("half", "srgb8")]
    slope = 2.4 / 1.055  # of linear light by sRGB, at most, below 1
    assert np.abs(shown_by[0] - shown_by[1]).max() <= slope * 0.5 / 255 + 1e-3
    assert np.abs(shown_by[0] - half_pattern(points)).max() < 0.5  # and it is no constant
    assert np.ptp(shown_by[0][:, 0]) > 0.5


def test_a_level_without_texels_of_its_own_shows_the_next():
    texture = VolumeTexture.around(BALL, resolution=64)
    layer = texture.add_layer()
    bake(texture, layer, half_pattern, level=2)
    points = sample_surface(BALL, 3000, seed=2).points
    assert_array_equal(
        texture.colors(points), texture.colors(points, footprint=texture.octree.spacing(2))
    )
    refine_to(texture, layer, 2)
    assert (layer.slots[: texture.octree.level_first[2]] == -1).all()


def test_a_negative_footprint_is_refused():
    texture, _ = half_painted(BALL, 16)
    with pytest.raises(TextureError, match="negative or not a number"):
        texture.colors(np.zeros((1, 3)), footprint=-1.0)
