"""Blurring, smudging, cloning, filling and gradients, against closed formulas and plain NumPy."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.ndimage import label

from meshsdf.errors import TextureError
from meshsdf.mesh import box_mesh, icosphere
from meshsdf.texture.brush import Brush
from meshsdf.texture.stroke import Stroke, paint
from meshsdf.texture.symmetry import Symmetry
from meshsdf.texture.volume_texture import VolumeTexture

from .paint_twin import finest, painted_layer, stored_values

TEXEL = 1 / 32
RED, BLUE = (1.0, 0.0, 0.0, 1.0), (0.0, 0.0, 1.0, 1.0)
GREY = (0.5, 0.5, 0.5, 1.0)
BYTE = 1 / 255
UP = np.array([[0.0, 0, 1]])
TOP = np.array([[0.0, 0, 0.25]])


@pytest.fixture
def texture() -> VolumeTexture:
    """Around a flat box, whose top is at z = 1/4."""
    return VolumeTexture.around(box_mesh((1.0, 1.0, 0.5)), texel=TEXEL)


def put(texture, layer, function) -> None:
    """Store what a function of places says, at the finest level."""
    entries = finest(texture)
    texture.put(layer, entries, function(texture.places(entries)[0]).astype(np.float32))


def step_at(x0: float):
    """Red below x0, blue from there on."""
    return lambda p: np.where(p[:, :1] < x0, [RED], [BLUE])


def top_line(texture, layer, n=61) -> tuple[np.ndarray, np.ndarray]:
    """x and colours along the middle of the top."""
    x = np.linspace(-0.3, 0.3, n)
    points = np.stack([x, 0 * x, 0 * x + 0.25], axis=1)
    return x, texture.colors(points, np.tile(UP, (n, 1)), layer=layer)


def test_one_dab_of_blur_is_one_mean_of_neighbours(texture):
    layer = painted_layer(texture)
    put(texture, layer, step_at(-1e-9))
    paint(texture, layer, Brush(0.25, kind="blur", hardness=1.0, detail=TEXEL), TOP, UP)
    places, looks = texture.places(finest(texture))
    seen = stored_values(texture, layer)
    inside = (np.linalg.norm(places - TOP, axis=1) < 0.24) & (looks @ UP[0] > 0.9)
    # Weights [1 2 1] across the step, whose sides are the nodes -1 and 0
    want = {-2: 1.0, -1: 0.75, 0: 0.25, 1: 0.0}
    for node, red in want.items():
        at = inside & (np.abs(places[:, 0] - node * TEXEL) < 1e-9)
        assert at.sum() > 10
        assert_allclose(seen[at, 0], red, atol=BYTE)
        assert_allclose(seen[at, 2], 1 - red, atol=BYTE)


def test_blur_keeps_one_colour_and_softens_an_edge(texture):
    layer = painted_layer(texture, GREY)
    assert len(paint(texture, layer, Brush(0.2, kind="blur", detail=TEXEL), TOP, UP)) == 0
    put(texture, layer, step_at(0.0))
    points = np.repeat(TOP, 9, axis=0)
    points[:, 1] = np.linspace(-0.1, 0.1, 9)
    brush = Brush(0.2, kind="blur", detail=TEXEL)
    paint(texture, layer, brush, points, np.repeat(UP, 9, axis=0))
    _, colors = top_line(texture, layer)
    assert (np.diff(colors[:, 0]) <= BYTE).all()
    assert colors[0, 0] == 1
    assert colors[-1, 0] == 0
    assert ((colors[:, 0] > 0.1) & (colors[:, 0] < 0.9)).sum() > 10
    assert_allclose(colors[:, 0] + colors[:, 2], 1, atol=3 * BYTE)  # light is kept


def test_smudging_drags_paint_along(texture):
    layer = painted_layer(texture)
    put(texture, layer, step_at(0.0))
    points = np.repeat(TOP, 3, axis=0)
    points[:, 0] = [-0.2, 0.0, 0.15]
    brush = Brush(0.1, kind="smudge", hardness=0.5, flow=1.0, detail=TEXEL)
    paint(texture, layer, brush, points, np.repeat(UP, 3, axis=0))
    x, colors = top_line(texture, layer)
    assert colors[(x > -0.28) & (x < 0.1)][:, 0].min() > 0.95  # it was 0 from x = 0 on
    assert colors[x > 0.25][:, 0].max() < 0.01
    aside = texture.colors(np.array([[0.05, 0.2, 0.25]]), UP, layer=layer)
    assert_allclose(aside[0], BLUE, atol=BYTE)


def test_cloning_lays_on_what_was_elsewhere_before(texture):
    layer = painted_layer(texture)

    def wave(p: np.ndarray) -> np.ndarray:
        return np.column_stack([0.5 + 0.4 * np.sin(9 * p), np.ones(len(p))])

    put(texture, layer, wave)
    offset = (8 * TEXEL, -4 * TEXEL, 0.0)
    points = np.repeat(TOP, 4, axis=0)
    points[:, 0] = np.linspace(-0.2, 0.2, 4)  # over its own source: it must be that of before
    brush = Brush(0.1, kind="clone", hardness=0.9, offset=offset, detail=TEXEL)
    paint(texture, layer, brush, points, np.repeat(UP, 4, axis=0))
    x = np.linspace(-0.2, 0.2, 33)
    at = np.stack([x, 0 * x, 0 * x + 0.25], axis=1)
    seen = texture.colors(at, np.tile(UP, (33, 1)), layer=layer)
    assert_allclose(seen, wave(at + offset), atol=0.01)
    assert np.abs(wave(at + offset) - wave(at)).max() > 0.2


def test_filling_stops_where_the_colour_changes(texture):
    layer = painted_layer(texture)

    def disc(p: np.ndarray) -> np.ndarray:
        return np.where(p[:, :1] ** 2 + p[:, 1:2] ** 2 < 0.3**2, [RED], [GREY])

    put(texture, layer, disc)
    places, _ = texture.places(finest(texture))
    low = places[:, 2] < 0
    brush = Brush(0.1, kind="fill", color=BLUE, tolerance=0.1)
    paint(texture, layer, brush, TOP, UP)
    seen = stored_values(texture, layer)
    was_red = disc(places)[:, 1] == 0
    assert_allclose(seen[was_red & ~low], np.tile(BLUE, ((was_red & ~low).sum(), 1)))
    assert_allclose(seen[was_red & low], np.tile(RED, ((was_red & low).sum(), 1)))
    assert_allclose(seen[~was_red][:, 1], 0.5, atol=BYTE)


def test_filling_is_what_labelling_finds(texture):
    layer = painted_layer(texture)
    rng = np.random.default_rng(0)
    chosen = rng.random((40, 40, 40)) < 0.5  # by node, so that all sheets agree

    def is_red(p: np.ndarray) -> np.ndarray:
        return chosen[tuple((np.round(p / TEXEL).astype(int) + 20).T)]

    put(texture, layer, lambda p: np.where(is_red(p)[:, None], [RED], [GREY]))
    places, looks = texture.places(finest(texture))
    nodes = np.round(places / TEXEL).astype(int) + 20
    exists = np.zeros((40, 40, 40), bool)
    exists[tuple(nodes.T)] = True
    parts, n_parts = label(exists & chosen)  # steps along the axes connect
    part = parts[tuple(nodes.T)]
    largest = np.bincount(part[part > 0]).argmax()
    seed = np.flatnonzero(part == largest)[0]
    paint(texture, layer, Brush(0.1, kind="fill", color=BLUE), places[[seed]], looks[[seed]])
    filled = stored_values(texture, layer)[:, 2] == 1
    assert n_parts > 10
    assert 100 < filled.sum() < is_red(places).sum() - 100
    assert (filled == (part == largest)).all()


def test_filling_a_ball_paints_all_of_it_as_tiles():
    texture = VolumeTexture.around(icosphere(subdivisions=3), texel=TEXEL)
    layer = texture.add_layer(color=GREY)
    paint(texture, layer, Brush(0.1, kind="fill", color=BLUE, detail=TEXEL), 4 * TOP, UP)
    assert_allclose(stored_values(texture, layer), np.tile(BLUE, (texture.octree.n_texels(0), 1)))
    assert (layer.slots < -1).all()


def test_filling_has_copies_too(texture):
    layer = painted_layer(texture)
    put(texture, layer, lambda p: np.where(np.abs(p[:, :1]) > 0.3, [RED], [GREY]))
    brush = Brush(0.1, kind="fill", color=BLUE, symmetry=Symmetry("x"))
    paint(texture, layer, brush, np.array([[0.4, 0, 0.25]]), UP)
    at = np.array([[0.4, 0.0, 0.25], [-0.4, 0, 0.25], [0, 0, 0.25]])
    seen = texture.colors(at, np.repeat(UP, 3, axis=0), layer=layer)
    assert_allclose(seen, [BLUE, BLUE, GREY], atol=BYTE)


@pytest.mark.parametrize("shape", ["linear", "radial"])
@pytest.mark.parametrize("opacity", [1.0, 0.5])
def test_a_gradient_is_a_ramp_in_linear_light(texture, shape, opacity):
    layer = texture.add_layer(color=GREY)
    brush = Brush(
        0.1, kind="gradient", shape=shape, color=RED, end_color=BLUE, opacity=opacity, detail=TEXEL
    )
    ends = np.array([[-0.25, 0.1, 0.25], [0.25, 0.1, 0.25]])
    paint(texture, layer, brush, ends, np.repeat(UP, 2, axis=0))
    places, _ = texture.places(finest(texture))
    if shape == "linear":
        t = np.clip((places[:, :1] + 0.25) / 0.5, 0, 1)
    else:
        t = np.clip(np.linalg.norm(places - ends[0], axis=1, keepdims=True) / 0.5, 0, 1)
    want = (1 - opacity) * np.array(GREY) + opacity * ((1 - t) * RED + t * np.array(BLUE))
    assert_allclose(stored_values(texture, layer), want, atol=0.006)  # half a step of 8 bits
    assert t.min() < 0.02
    assert t.max() == 1


def test_a_gradient_needs_two_points(texture):
    layer = texture.add_layer()
    with pytest.raises(TextureError, match="begins and ends at"):
        paint(texture, layer, Brush(0.1, kind="gradient"), TOP, UP)
    assert len(Stroke(texture, layer, Brush(0.1, kind="gradient")).end()) == 0
