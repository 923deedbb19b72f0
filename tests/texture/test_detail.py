"""meshsdf.texture.detail: as fine as what is written asks for, and no finer."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from meshsdf.errors import TextureError
from meshsdf.kernels.texture_lookup import ABSENT
from meshsdf.mesh import box_mesh, icosphere
from meshsdf.srgb import srgb_rgba
from meshsdf.texture.detail import STEP, bake_detail
from meshsdf.texture.mip import bake, update_mips
from meshsdf.texture.octree import Octree
from meshsdf.texture.operations import Operation, perform
from meshsdf.texture.procedural import procedural
from meshsdf.texture.refine import family_of
from meshsdf.texture.volume_texture import VolumeTexture

BALL = Octree.around(icosphere(subdivisions=4), resolution=128)
PLATE = Octree.around(box_mesh((1.0, 1.0, 0.02)), resolution=96)  # two sheets


def both(function, octree=BALL, **options):
    """A texture with a layer of all detail, and one of what is needed."""
    texture = VolumeTexture(octree)
    full, thin = texture.add_layer("full"), texture.add_layer("thin")
    bake(texture, full, function)
    bake_detail(texture, thin, function, **options)
    return texture, full, thin


def finest(texture):
    return np.arange(texture.octree.level_first[1], dtype=np.int32)


def farthest(texture, full, thin):
    """The most by which the two differ at any finest texel, in sRGB times alpha."""
    points, normals = texture.places(finest(texture))
    a, b = (srgb_rgba(texture.colors(points, normals, layer=one)) for one in (full, thin))
    apart = np.abs(a[:, :3] * a[:, 3:] - b[:, :3] * b[:, 3:]).max(axis=1)
    return np.maximum(apart, np.abs(a[:, 3] - b[:, 3]))


def waves(points):
    """Opaque, with the detail of all levels somewhere, and transparent in one place."""
    x, y, z = points.T
    out = np.ones((len(points), 4))
    out[:, 0] = 0.5 + 0.5 * np.sin(30 * x * (1 + x))
    out[:, 1] = 0.5 + 0.5 * np.sin(2 * y)
    out[:, 2] = z > 0.6
    out[:, 3] = np.clip(5 * (y + 0.8), 0, 1)
    return out


@pytest.mark.parametrize("octree", [BALL, PLATE])
@pytest.mark.parametrize("tolerance", [STEP, 8 * STEP])
def test_no_finest_texel_is_farther_from_all_detail_than_the_tolerance(octree, tolerance):
    texture, full, thin = both(waves, octree, tolerance=tolerance)
    apart = farthest(texture, full, thin)
    assert 0.2 * tolerance < apart.max() <= tolerance + 1e-6  # rounding of float32
    assert (thin.slots >= 0).sum() < (full.slots >= 0).sum()


def test_a_texture_of_low_frequency_takes_far_fewer_bricks():
    def slow(points):
        return np.column_stack([0.5 + 0.25 * points, np.ones(len(points))])

    texture, full, thin = both(slow)
    assert 20 * (thin.slots >= 0).sum() < (full.slots >= 0).sum()
    assert farthest(texture, full, thin).max() <= STEP + 1e-6
    # On the surface between texels, too: what is seen there is a mean of places that keep the bound
    points = icosphere(subdivisions=5).vertices
    a, b = (srgb_rgba(texture.colors(points, points, layer=one)) for one in (full, thin))
    assert np.abs(a - b).max() <= STEP + 1e-6


def test_a_checker_is_fine_along_its_edges_alone():
    checker = procedural("checker", side=0.5, scale=1.0)
    texture, full, thin = both(checker)
    tables = BALL.tables
    stored = finest(texture)[thin.slots[: BALL.level_first[1]] != ABSENT]
    middle = (8 * tables.bricks[stored] + 3.5) * BALL.texel
    from_edge = np.abs(middle / 0.5 - np.round(middle / 0.5)).min(axis=1) * 0.5
    # Half a brick and the filter of two texels; the plane's trace on the ball may come in aslant
    assert (from_edge <= 6 * BALL.texel).all()
    assert 50 < len(stored) < 0.8 * BALL.level_first[1]
    assert farthest(texture, full, thin).max() <= STEP + 1e-6


def test_one_colour_takes_no_brick_at_all():
    texture, full, thin = both(lambda points: np.tile([0.2, 0.4, 0.6, 1.0], (len(points), 1)))
    assert (thin.slots >= 0).sum() == 0
    top = BALL.level_first[-2]
    assert (thin.slots[:top] == ABSENT).all()
    assert farthest(texture, full, thin).max() == 0


def test_what_is_left_is_in_balance_and_coarser_texels_are_means_where_all_finer_ones_are_left():
    texture, full, thin = both(waves)
    stored = thin.stored
    family = family_of(texture, stored[stored < BALL.level_first[-2]])
    assert (thin.slots[family[family >= 0]] != ABSENT).all()
    assert len(update_mips(texture, thin, stored)) == 0
    bricks = stored[(stored < BALL.level_first[1]) & (thin.slots[stored] >= 0)]
    assert len(bricks) > 50
    pool = texture.pool.arrays["base"]
    assert_array_equal(pool[thin.slots[bricks]], pool[full.slots[bricks]])


def test_bricks_that_went_are_free_again_and_other_channels_stay():
    texture = VolumeTexture(BALL)
    layer = texture.add_layer()
    bake(texture, layer, waves, channel="height")
    points, normals = texture.places(finest(texture))
    before = texture.colors(points, normals, channel="height", layer=layer)
    bake_detail(texture, layer, lambda points: np.full((len(points), 4), 0.5))
    after = texture.colors(points, normals, channel="height", layer=layer)
    assert_array_equal(after, before)
    assert texture.pool.n_used == (layer.slots >= 0).sum()


def test_as_an_operation_auto_is_for_the_asking_and_numbers_mean_what_they_did():
    for level in (None, 0, 1, "auto"):
        texture = VolumeTexture(BALL)
        layer = texture.add_layer()
        params = {"layer": 0, "texture_kind": "clouds", "scale": "40.0"}
        if level is not None:
            params["level"] = level
        perform(texture, Operation("bake", params))
        n_finest = int((layer.slots[: BALL.level_first[1]] != ABSENT).sum())
        assert n_finest == {0: BALL.level_first[1], 1: 0}.get(level or 0, n_finest)
        if level == "auto":
            assert n_finest < 0.2 * BALL.level_first[1]


def test_what_makes_no_sense_is_said():
    texture = VolumeTexture(BALL)
    layer = texture.add_layer()
    with pytest.raises(TextureError, match="tolerance of -1 makes no sense"):
        bake_detail(texture, layer, waves, tolerance=-1)
    for level in ("fine", 1.5, True):
        operation = Operation("bake", {"layer": 0, "texture_kind": "clouds", "level": level})
        with pytest.raises(TextureError, match=r"no level .*"):
            perform(texture, operation)
