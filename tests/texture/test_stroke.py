"""meshsdf.texture.stroke: a stroke is what its definition says, however it is given."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf.errors import TextureError
from meshsdf.kernels import parallel
from meshsdf.mesh import icosphere
from meshsdf.texture import stroke_cover
from meshsdf.texture.brush import Brush
from meshsdf.texture.change import recording
from meshsdf.texture.stroke import Stroke, paint
from meshsdf.texture.symmetry import Symmetry
from meshsdf.texture.volume_texture import VolumeTexture

from .paint_twin import (
    arc,
    code_distance,
    coverage,
    everything,
    finest,
    over,
    painted_layer,
    stored_texels,
    stored_values,
)

BALL = icosphere(subdivisions=4)
TEXEL = 1 / 32
RED = (1.0, 0.0, 0.0, 1.0)
GREY = (0.5, 0.5, 0.5, 1.0)
BYTE = 1 / 255


@pytest.fixture
def texture() -> VolumeTexture:
    return VolumeTexture.around(BALL, texel=TEXEL)


BRUSHES = {
    "band": Brush(0.2, color=RED, detail=TEXEL),
    "hard": Brush(0.2, color=RED, detail=TEXEL, hardness=1.0, opacity=0.5),
    "linear": Brush(0.2, color=(0.0, 1.0, 0.5, 0.5), detail=TEXEL, falloff="linear", flow=0.75),
    "round": Brush(0.2, color=RED, detail=TEXEL, falloff="round", hardness=0.0),
    "build-up": Brush(0.2, color=RED, detail=TEXEL, build_up=True, flow=0.125, spacing=0.25),
    "pressure": Brush(
        0.25, color=RED, detail=TEXEL, pressure_radius=((0.0, 0.2), (1.0, 1.0)),
        pressure_flow=((0.0, 0.0), (0.5, 0.75), (1.0, 1.0)),
    ),
    "mirrors": Brush(0.2, color=RED, detail=TEXEL, symmetry=Symmetry("xy"), flow=0.5),
    "turns": Brush(
        0.3, color=RED, detail=TEXEL, symmetry=Symmetry(radial=3, axis="z"), flow=0.25,
        build_up=True,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", BRUSHES)
@pytest.mark.parametrize("color", [(1.0, 1.0, 1.0, 1.0), (0.2, 0.4, 0.6, 0.5), (0.0,) * 4])
def test_a_stroke_is_its_definition_at_every_texel(texture, name, color):
    brush, layer = BRUSHES[name], painted_layer(texture, color)
    points, normals = arc(4)
    pressures = np.array([0.1, 1.0, 0.3, 0.7])
    places, looks = texture.places(finest(texture))
    before = stored_values(texture, layer).astype(np.float64)
    paint(texture, layer, brush, points, 3 * normals, pressures)
    k = brush.opacity * coverage(brush, places, looks, points, normals, pressures)
    # Texels at the rim of a hard dab are in or out by rounding alone
    sure = np.ones(len(k), bool)
    if brush.hardness == 1:
        wider, tighter = (
            coverage(
                Brush(0.2 * factor, detail=TEXEL, hardness=1.0), places, looks, points, normals
            )
            for factor in (1 + 1e-5, 1 - 1e-5)
        )
        sure = wider == tighter
    want = over(before, np.array(brush.color), k)
    assert 0.1 < k.max() <= brush.opacity
    assert 20 < (k > 0).sum() < len(k) / 2
    assert sure.mean() > 0.99
    assert code_distance(texture, stored_texels(texture, layer)[sure], want[sure]) <= 1


def test_erasing_takes_away_alpha_alone(texture):
    layer = painted_layer(texture, (0.2, 0.4, 0.6, 0.5))
    brush = Brush(0.2, kind="erase", detail=TEXEL, opacity=0.5)
    points, normals = arc(2)
    places, looks = texture.places(finest(texture))
    want = stored_values(texture, layer).astype(np.float64)
    paint(texture, layer, brush, points, normals)
    want[:, 3] *= 1 - 0.5 * coverage(brush, places, looks, points, normals)
    assert code_distance(texture, stored_texels(texture, layer), want) <= 1
    paint(texture, layer, Brush(0.2, kind="erase", hardness=1.0, detail=TEXEL), points, normals)
    assert texture.colors(points, normals, layer=layer).max() == 0


@pytest.mark.parametrize(
    ("channel", "value", "before", "half"),
    [("height", 2.0, 0.0, 1.0), ("mask", 0.0, 1.0, 0.5)],
)
def test_heights_and_masks_are_painted_as_values(texture, channel, value, before, half):
    layer = painted_layer(texture)
    point = np.array([[0.0, 0, 1]])
    brush = Brush(0.3, channel=channel, value=value, opacity=0.5, detail=TEXEL)
    paint(texture, layer, brush, point, point)
    at = np.concatenate([point, -point])
    seen = texture.colors(at, at, channel=channel, layer=layer)[:, 0]
    assert_allclose(seen, [half, before], atol=BYTE)
    full = Brush(0.3, kind="erase", channel=channel, detail=TEXEL)
    paint(texture, layer, full, point, point)
    seen = texture.colors(at, at, channel=channel, layer=layer)[:, 0]
    assert_allclose(seen, before, atol=BYTE)


def test_blending_is_with_what_was_there_before_the_stroke(texture):
    layer = painted_layer(texture, (0.5, 0.25, 0.75, 1.0))
    brush = Brush(0.3, color=(0.5, 0.5, 0.5, 1.0), blend="multiply", detail=TEXEL)
    points, normals = arc(8, 0, 0.1)  # eight times over the same texels
    paint(texture, layer, brush, points, normals)
    seen = texture.colors(points[:1], normals[:1], layer=layer)[0]
    assert_allclose(seen, [0.25, 0.125, 0.375, 1.0], atol=2 * BYTE)


@pytest.mark.parametrize("build_up", [False, True])
def test_fast_strokes_have_no_gaps(texture, build_up):
    layer = painted_layer(texture, (0.0,) * 4)
    brush = Brush(0.15, color=RED, detail=TEXEL, flow=0.5, build_up=build_up)
    points, normals = arc(3, 0, 1.5)  # 5 radii apart, along chords of the ball
    paint(texture, layer, brush, points[:2], normals[:2])
    t = np.linspace(0.05, 0.95, 100)[:, None]
    way = points[0] + t * (points[1] - points[0])
    places, looks = texture.places(finest(texture))
    k = stored_values(texture, layer)[:, 3]
    # Chords sink into the ball, so coverage is compared where the distance is the same
    axis = np.linalg.norm(np.cross(places - points[0], points[1] - points[0]), axis=1)
    axis /= np.linalg.norm(points[1] - points[0])
    along = (places - points[0]) @ (points[1] - points[0])
    along /= ((points[1] - points[0]) ** 2).sum()
    core = (axis < 0.07) & (along > 0.25) & (along < 0.75) & (looks @ normals[0] > 0.5)
    assert core.sum() > 50
    assert k[core].min() >= 0.99 * k[core].max() - BYTE
    assert k[core].max() > 0.49
    assert len(way) == 100


def test_opacity_caps_what_builds_up(texture):
    layer = painted_layer(texture, (0.0,) * 4)
    brush = Brush(0.2, color=RED, detail=TEXEL, build_up=True, flow=0.5, opacity=0.25)
    points, normals = arc(2)
    there_and_back = np.concatenate([points, points[::-1], points])
    paint(texture, layer, brush, there_and_back, there_and_back)
    alpha = stored_values(texture, layer)[:, 3]
    assert 0.25 - 2 * BYTE <= alpha.max() <= 0.25 + BYTE
    paint(texture, layer, brush, points, normals)  # a second stroke adds to the first
    assert stored_values(texture, layer)[:, 3].max() > 0.4


def test_copies_that_overlap_do_not_double(texture):
    point = np.array([[0.0, 0, 1]])
    once, twice = painted_layer(texture, (0.0,) * 4), painted_layer(texture, (0.0,) * 4)
    for layer, symmetry in ((once, Symmetry()), (twice, Symmetry("xy", 4, "z"))):
        brush = Brush(0.2, color=RED, detail=TEXEL, build_up=True, flow=0.25, symmetry=symmetry)
        paint(texture, layer, brush, point, point)
    one, two = (stored_values(texture, layer)[:, 3] for layer in (once, twice))
    assert one.max() < 0.26
    assert_allclose(two, one, atol=BYTE)


def test_a_mirrored_stroke_is_the_stroke_in_a_mirror(texture):
    left, right = painted_layer(texture), painted_layer(texture)
    points, normals = arc(4, 0.2, 0.9, tilt=0.3)
    paint(
        texture, left, Brush(0.15, color=RED, detail=TEXEL, symmetry=Symmetry("x")), points, normals
    )
    flip = np.array([-1.0, 1, 1])
    for side in (1.0, flip):
        paint(texture, right, Brush(0.15, color=RED, detail=TEXEL), points * side, normals * side)
    assert everything(texture, left) == everything(texture, right)


@pytest.mark.parametrize("kind", ["paint", "erase", "blur", "smudge", "clone"])
@pytest.mark.parametrize("build_up", [False, True])
def test_batches_do_not_matter(kind, build_up):
    points, normals = arc(9)
    brush = Brush(
        0.2, kind=kind, color=RED, build_up=build_up, flow=0.5, offset=(0.0, 0.3, 0.0),
        pressure_radius=((0.0, 0.5), (1.0, 1.0)), symmetry=Symmetry("y"),
    )  # fmt: skip
    seen = set()
    for cuts in ([], [4], range(1, 9), [1, 2, 7]):
        texture = VolumeTexture.around(BALL, texel=TEXEL)
        layer = texture.add_layer(color=GREY)
        for n, spot in enumerate(arc(5, -0.2, 1.2, tilt=0.2)[0]):
            color = (*np.random.default_rng(n).random(3), 1.0)
            dot = Brush(0.2, color=color, hardness=0.9)
            paint(texture, layer, dot, spot[None], spot[None])
        stroke = Stroke(texture, layer, brush)
        parts = [np.split(array, list(cuts)) for array in (points, normals, np.linspace(0, 1, 9))]
        for part in zip(*parts, strict=True):
            stroke.add(*part)
        assert len(stroke.end())
        seen.add(everything(texture, layer))
    assert len(seen) == 1


def test_threads_do_not_matter(monkeypatch):
    points, normals = arc(16)
    brush = Brush(0.5, color=RED, geodesic=True, detail=TEXEL, build_up=True, flow=0.3)
    seen = set()
    for threads in (1, 2, 5):
        monkeypatch.setattr(parallel, "n_threads", lambda threads=threads: threads)
        monkeypatch.setattr(stroke_cover, "n_threads", lambda threads=threads: threads)
        monkeypatch.setattr(stroke_cover, "PAIRS_FOR_THREADS", 0 if threads > 1 else 10**9)
        texture = VolumeTexture.around(BALL, texel=TEXEL)
        layer = texture.add_layer(color=GREY)
        paint(texture, layer, brush, points, normals)
        seen.add(everything(texture, layer))
    assert len(seen) == 1


def test_a_stroke_that_changes_nothing_reports_none(texture):
    layer = painted_layer(texture, RED)
    slots, used = layer.slots.copy(), texture.pool.n_used
    points, normals = arc(3)
    assert len(paint(texture, layer, Brush(0.2, color=RED, detail=TEXEL), points, normals)) == 0
    assert len(paint(texture, layer, Brush(0.2, detail=TEXEL), 9 * points, normals)) == 0
    assert len(paint(texture, layer, Brush(0.2, detail=TEXEL), points, -normals)) == 0
    assert len(Stroke(texture, layer, Brush(0.2)).end()) == 0
    assert_array_equal(layer.slots, slots)
    assert texture.pool.n_used == used


def test_what_changed_is_reported_and_nothing_else(texture):
    layer = painted_layer(texture, GREY)
    before = stored_texels(texture, layer, layer.stored)
    stored = layer.stored
    slots = layer.slots.copy()
    changed = paint(texture, layer, Brush(0.2, color=RED, detail=TEXEL), *arc(3))
    assert_array_equal(layer.stored, stored)
    assert_array_equal(changed, np.flatnonzero(slots != layer.slots))
    after = stored_texels(texture, layer, stored)
    n_texels = np.bitwise_count(texture.octree.tables.masks[stored]).sum(axis=1).astype(int)
    of_entry = np.repeat(stored, n_texels)
    assert_array_equal(np.unique(of_entry[before != after]), changed)
    assert set(texture.octree.tables.levels[changed]) == set(range(texture.octree.n_levels))


def test_pool_holds_what_layers_store(texture):
    layer = texture.add_layer(color=GREY)
    for kind in ("paint", "blur", "smudge", "erase", "clone", "fill", "gradient"):
        paint(texture, layer, Brush(0.2, kind=kind, color=RED, build_up=True), *arc(3))
        assert texture.pool.n_used == len(np.unique(layer.slots[layer.slots >= 0])), kind
        assert (texture.pool.holders[layer.slots[layer.slots >= 0]] == 1).all()


@pytest.mark.parametrize("kind", ["paint", "smudge", "fill", "gradient"])
def test_a_stroke_can_be_undone_and_redone(texture, kind):
    layer = texture.add_layer(color=GREY)
    paint(texture, layer, Brush(0.3, color=(0.0, 0.0, 1.0, 1.0)), *arc(2))
    before = everything(texture, layer)
    with recording(texture) as change:
        paint(texture, layer, Brush(0.2, kind=kind, color=RED), *arc(3, 0.1, 0.9))
    after = everything(texture, layer)
    assert after != before
    change.undo(texture)
    assert everything(texture, layer) == before
    change.redo(texture)
    assert everything(texture, layer) == after


def test_a_cancelled_stroke_leaves_the_picture_as_it_was(texture):
    layer = painted_layer(texture, GREY)
    slots, used = layer.slots.copy(), texture.pool.n_used
    points, normals = arc(3)
    stroke = Stroke(texture, layer, Brush(0.2))
    stroke.add(points, normals)
    assert (layer.slots != slots).any()
    with pytest.raises(TextureError, match="makes no sense"), stroke:
        stroke.add(points, 0 * normals)
    assert_array_equal(layer.slots, slots)
    assert texture.pool.n_used == used
    with pytest.raises(TextureError, match="stroke has ended"):
        stroke.add(points, normals)


def test_only_what_is_painted_is_stored_finely():
    texture = VolumeTexture.around(BALL, texel=TEXEL / 4)
    layer = texture.add_layer()
    points, normals = arc(1)
    changed = paint(texture, layer, Brush(0.16, hardness=0.0, color=RED), points, normals)
    levels = texture.octree.tables.levels
    # 0.16 / 8 is between two spacings, and the finer one is taken
    assert levels[layer.stored].min() == levels[changed].min() == 1
    fine = layer.stored[levels[layer.stored] == 1]
    away = np.linalg.norm(
        (8 * texture.octree.tables.bricks[fine] + 3.5) * TEXEL / 2 - points, axis=1
    )
    assert away.max() < 0.16 + 8 * TEXEL / 2 * np.sqrt(3)
    assert len(fine) < 0.1 * np.diff(texture.octree.level_first)[1]


def test_painting_finer_repaints_what_is_stored_coarser_and_the_other_way_round(texture):
    layer = texture.add_layer()
    point = np.array([[0.0, 0, 1]])
    paint(texture, layer, Brush(0.1, color=RED, detail=TEXEL), point, point)
    wide = Brush(0.9, color=(0.0, 0.0, 1.0, 1.0), hardness=0.5)
    paint(texture, layer, wide, point, point)
    a = np.linspace(-0.4, 0.4, 41)
    at = np.stack([np.sin(a), 0 * a, np.cos(a)], axis=1)
    for footprint, width in ((0.0, 0.4), (2 * TEXEL, 0.3), (4 * TEXEL, 0.2)):
        inside = at[np.abs(a) <= width]
        seen = texture.colors(inside, inside, footprint, layer=layer)
        assert_allclose(seen, np.tile([0.0, 0, 1, 1], (len(inside), 1)), atol=2 * BYTE)
