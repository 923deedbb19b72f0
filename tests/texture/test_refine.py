"""meshsdf.texture.refine: finer bricks change no picture, and those that show no more may go."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from meshsdf.errors import TextureError
from meshsdf.mesh.primitives import icosphere
from meshsdf.mesh.sampling import sample_surface
from meshsdf.srgb import srgb_rgba
from meshsdf.texture.mip import bake, update_mips
from meshsdf.texture.refine import coarsen, refine, refine_to, seen_above, seen_from
from meshsdf.texture.volume_texture import VolumeTexture

from .texture_twins import ABSENT, half_painted, half_pattern, random_texture

BALL = icosphere(subdivisions=4, center=(0.13, -0.2, 0.31))
FACETED = icosphere(subdivisions=1, center=(0.13, -0.2, 0.31))  # of large triangles
ON_BALL = sample_surface(BALL, 100_000, seed=1)


def steps(a, b):
    """Largest difference of premultiplied colours and of alpha, in 255ths of sRGB."""
    a, b = srgb_rgba(a), srgb_rgba(b)
    a[:, :3] *= a[:, 3:]
    b[:, :3] *= b[:, 3:]
    return 255 * np.abs(a - b).max()


def entries_left_of(texture, level, x):
    """Entries of a level whose brick begins left of x."""
    first, last = texture.octree.level_first[level : level + 2]
    entries = np.arange(first, last, dtype=np.int32)
    return entries[8 * texture.octree.tables.bricks[entries, 0] * texture.octree.spacing(level) < x]


def across_faces(mesh, side, apart, n, seed):
    """Pairs of points of the surface, a little to both sides of planes of a lattice."""
    random = np.random.default_rng(seed)
    corners = mesh.vertices[mesh.faces[random.integers(0, mesh.n_faces, n)]]
    ends = np.einsum("enk,nkd->end", random.dirichlet(np.ones(3), (2, n)), corners)
    axis = random.integers(0, 3, n)
    a, b = ends[0, np.arange(n), axis] / side, ends[1, np.arange(n), axis] / side
    plane = np.ceil(np.minimum(a, b))
    cut = (plane < np.maximum(a, b)) & (np.abs(a - b) > 1e-3)
    share = ((plane - a)[cut] / (b - a)[cut])[:, None]
    middle = ends[0][cut] + share * (ends[1] - ends[0])[cut]
    step = (ends[1] - ends[0])[cut]
    step *= apart / np.linalg.norm(step, axis=1, keepdims=True)
    return np.stack([middle - step, middle + step])


def is_balanced(texture, layer):
    """Whether the 27 bricks around the parents of stored bricks are stored."""
    octree = texture.octree
    for level in range(octree.n_levels - 1):
        stored = layer.stored[octree.tables.levels[layer.stored] == level]
        wanted = octree.tables.bricks[stored] // 2
        around = (wanted[:, None] + np.indices((3, 3, 3)).reshape(3, 27).T - 1).reshape(-1, 3)
        first, last = octree.level_first[level + 1 : level + 3]
        above = {tuple(b): layer.slots[first + n] for n, b in
                 enumerate(octree.tables.bricks[first:last].tolist())}  # fmt: skip
        if any(
            above.get(tuple(brick), 0) == ABSENT for brick in np.unique(around, axis=0).tolist()
        ):
            return False
    return True


def coarse_grid_texture(base):
    """Texels of level 2 that are multiples of 1/16, so that finer ones are exact in halves."""
    texture = VolumeTexture.around(BALL, resolution=100, base=base)
    layer = texture.add_layer()
    random = np.random.default_rng(0)

    def function(points):
        colors = random.integers(0, 17, (len(points), 4)) / 16
        colors[:, 3] = 1
        return colors

    bake(texture, layer, function, level=2)
    return texture, layer


def test_refining_changes_nothing_where_halves_can_hold_the_values():
    texture, layer = coarse_grid_texture("half")
    before = texture.colors(ON_BALL.points)
    refine(texture, layer, entries_left_of(texture, 0, 0.3))
    assert (layer.slots[: texture.octree.level_first[1]] >= 0).sum() > 300
    # Sums of eight products in float32, twice
    assert np.abs(texture.colors(ON_BALL.points) - before).max() <= 5e-7
    exact = np.round(ON_BALL.points / texture.octree.texel) * texture.octree.texel
    unrefined, _ = coarse_grid_texture("half")
    nodes = np.abs(texture.colors(exact) - unrefined.colors(exact))
    assert nodes.max() == 0


@pytest.mark.parametrize("base", ["half", "srgb8"])
def test_what_is_seen_above_is_what_lookups_give_there(base):
    texture, layer = coarse_grid_texture(base)
    refine(texture, layer, entries_left_of(texture, 1, 0.3))
    for level in (0, 1):
        entries = np.arange(*texture.octree.level_first[level : level + 2], dtype=np.int32)
        seen = seen_above(texture, layer, entries, "base")
        looked_up = seen_from(texture, layer, entries, "base", level + 1)
        assert np.ptp(looked_up) > 0.9
        np.testing.assert_allclose(seen, looked_up, rtol=0, atol=5e-7)


def test_refining_changes_eight_bit_colours_by_half_a_step_over_all_levels_at_once():
    texture, layer = coarse_grid_texture("srgb8")
    before = texture.colors(ON_BALL.points)
    refine(texture, layer, entries_left_of(texture, 0, 0.3))
    assert 0 < steps(texture.colors(ON_BALL.points), before) <= 0.501
    update_mips(texture, layer, entries_left_of(texture, 0, 0.3))
    assert steps(texture.colors(ON_BALL.points), before) <= 0.501  # the rest is left as it was
    before = texture.colors(ON_BALL.points)
    refine_to(texture, layer, 0)
    assert steps(texture.colors(ON_BALL.points), before) <= 0.501


def test_a_layer_of_one_colour_stays_tiles_at_any_level():
    texture = VolumeTexture.around(BALL, resolution=64)
    layer = texture.add_layer(color=(0.3, 0.5, 0.1, 0.7))
    before = texture.colors(ON_BALL.points)
    new = refine_to(texture, layer, 0)
    assert texture.pool.n_used == 0
    assert (layer.slots < ABSENT).all()
    assert len(new) == texture.octree.n_entries - np.diff(texture.octree.level_first)[-1]
    assert_array_equal(texture.colors(ON_BALL.points), before)
    assert_array_equal(coarsen(texture, layer), new)
    assert_array_equal(texture.colors(ON_BALL.points), before)


def test_all_channels_are_refined():
    texture, layer = random_texture(BALL, 64, 3, base="srgb8", channel="height")
    before = [texture.colors(ON_BALL.points, channel=c) for c in ("base", "height", "mask")]
    refine_to(texture, layer, 0)
    after = [texture.colors(ON_BALL.points, channel=c) for c in ("base", "height", "mask")]
    assert steps(after[0], before[0]) <= 0.501
    assert np.abs(after[1] - before[1]).max() <= 2.0**-12 + 1e-6
    assert_array_equal(after[2], before[2])
    assert np.ptp(before[1][:, 0]) > 0.5


@pytest.mark.parametrize("seed", range(3))
def test_bricks_stay_in_balance(seed):
    random = np.random.default_rng(seed)
    texture = VolumeTexture.around(BALL, resolution=200)
    layer = texture.add_layer(color=(0.1, 0.2, 0.3))
    assert is_balanced(texture, layer)
    for _ in range(3):
        some = random.integers(0, texture.octree.n_entries, 20).astype(np.int32)
        new = refine(texture, layer, some)
        assert (layer.slots[some] != ABSENT).all()
        assert (layer.slots[new] != ABSENT).all()
        assert is_balanced(texture, layer)
        painted = random.choice(layer.stored, 10, False)
        n = len(texture.places(painted)[0])
        texture.put(layer, painted, random.random((n, 4)).astype(np.float32))
        assert is_balanced(texture, layer)
        for tolerance in (0.0, 0.2):
            coarsen(texture, layer, tolerance)
            assert is_balanced(texture, layer)
    layer.slots[entries_left_of(texture, 1, 9.0)[:40]] = ABSENT
    refined = refine(texture, texture.add_layer(), entries_left_of(texture, 0, 9.0)[:3])
    assert len(refined) > 3
    texture.layers[1].slots[refined[-3:]] = ABSENT
    assert not is_balanced(texture, texture.layers[1])  # the check itself finds a fault


def test_coarsening_by_nothing_leaves_every_bit_and_makes_tiles():
    texture, layer = half_painted(BALL, 200)
    refine(texture, layer, np.arange(100, dtype=np.int32))
    spread = np.random.default_rng(5).uniform(-2, 2, ON_BALL.points.shape) * texture.octree.texel
    asked = [
        (ON_BALL.points, 0.0),
        (ON_BALL.points, texture.octree.texel * 3.3),
        (ON_BALL.points + spread, 0.0),
        (ON_BALL.points + spread, texture.octree.texel * 2.0),
    ]
    before = [texture.colors(points, footprint=width) for points, width in asked]
    n_used = texture.pool.n_used
    refine_to(texture, layer, 0)
    gone = coarsen(texture, layer)
    for (points, width), colors in zip(asked, before, strict=True):
        assert_array_equal(texture.colors(points, footprint=width), colors)
    level0 = layer.slots[: texture.octree.level_first[1]]
    grey = texture.octree.tables.bricks[: len(level0), 0] < -1
    assert (level0[grey] < 0).all()  # half of the ball holds no texels
    assert (level0[grey] == ABSENT).mean() > 0.7
    assert len(gone) == (layer.slots == ABSENT).sum()
    assert texture.pool.n_used <= n_used
    assert coarsen(texture, layer).size == 0


def test_bricks_of_one_number_become_tiles_and_no_bit_changes():
    texture = VolumeTexture.around(BALL, resolution=100)
    layer = texture.add_layer()
    bake(texture, layer, half_pattern)
    before = texture.colors(ON_BALL.points)
    tiles = layer.stored[layer.slots[layer.stored] < ABSENT]
    assert len(tiles) > 100
    texture.writable(layer, tiles)  # bricks again
    assert (layer.slots >= 0).all()
    assert_array_equal(texture.colors(ON_BALL.points), before)
    texture.collapse_uniform(layer, layer.stored)
    assert_array_equal(texture.colors(ON_BALL.points), before)
    assert (layer.slots[tiles] < ABSENT).all()


def test_coarsening_by_a_tolerance_keeps_to_it_for_every_level_that_goes():
    texture, layer = half_painted(BALL, 200)
    before = texture.colors(ON_BALL.points)
    gone = coarsen(texture, layer, 4 / 255)
    change = steps(texture.colors(ON_BALL.points), before)
    n_levels = len(np.unique(texture.octree.tables.levels[gone]))
    assert len(gone) > 100
    assert 0.5 < change <= 4 * n_levels + 0.01


@pytest.mark.parametrize("base", ["half", "srgb8"])
def test_there_is_no_jump_across_bricks_nor_where_levels_meet(base):
    texture, _ = random_texture(FACETED, 200, 11, base=base)
    for level in range(texture.octree.n_levels - 1):
        spacing = texture.octree.spacing(level)
        # A millionth of a texel to both sides of faces between bricks of that level
        pair = across_faces(FACETED, 8 * spacing, 1e-6 * texture.octree.texel, 200_000, level)
        a, b = texture.colors(pair[0]), texture.colors(pair[1])
        a[:, :3] *= a[:, 3:]
        b[:, :3] *= b[:, 3:]
        assert len(a) > 10_000
        assert 255 * np.abs(a - b).max() <= 0.05
    assert np.ptp(a[:, 0]) > 0.3  # there is something to see


def test_refining_leaves_what_another_layer_shares():
    texture, layer = half_painted(BALL, 64)
    coarsen(texture, layer)
    twin = texture.duplicate_layer(layer)
    before = texture.colors(ON_BALL.points, layer=twin)
    slots = twin.slots.copy()
    refine_to(texture, layer, 0)
    coarsen(texture, layer, 1.0)
    assert_array_equal(twin.slots, slots)
    assert_array_equal(texture.colors(ON_BALL.points, layer=twin), before)


def test_bad_wishes_are_refused():
    texture, layer = half_painted(BALL, 16)
    n = texture.octree.n_entries
    with pytest.raises(TextureError, match=f"entries -1 to 3, where 0 to {n - 1}"):
        refine(texture, layer, np.array([3, -1], np.int32))
    with pytest.raises(TextureError, match="there is no level 99"):
        refine_to(texture, layer, 99)
    with pytest.raises(TextureError, match=r"a tolerance of -0.1"):
        coarsen(texture, layer, -0.1)
