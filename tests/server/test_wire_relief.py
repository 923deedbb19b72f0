"""meshsdf.server.wire_relief: normals and heights in bricks, sent only where there are any."""

import numpy as np
import pytest

from meshsdf.io import read_mesh
from meshsdf.server.wire_bricks import WireBricks
from meshsdf.texture.layers import shown
from tests.models import model, needs_models

from .test_wire_bricks import MESHES
from .wire_examples import painted, surface_points, with_relief
from .wire_twin import page_colors, unpacked

# A node's height is the texture's own number or a blend of such, rounded to half precision: off by
# 1/2048 of itself at most, or, if it is tiny, by half a step of 2^-24. Blends are of float32.
OF_HEIGHT = 1 / 2048 + 1e-6
TINIEST = 2.0**-25
# A normal times its coverage is rounded to 1/127, the coverage to 1/255
OF_NORMAL, OF_COVERAGE = 0.5 / 127 + 1e-5, 0.5 / 255 + 1e-5


def everything(wire, picture="base"):
    """The payload of all bricks of a picture."""
    return wire.range_payload(0, wire.texture.octree.n_entries, picture)


def seen(wire, picture, points, normals):
    """(n, 4) what a page shows, times coverage, nothing where no brick was sent; plain points."""
    slots, octree = shown(wire.texture).slots, wire.texture.octree
    colors = unpacked(everything(wire))
    _, plain = page_colors(octree, slots, colors, points, normals)
    bricks = unpacked(everything(wire, picture), picture)
    assert set(bricks) <= set(colors)
    for one in bricks:  # a brick of one value has no mask
        sent, sent_of_colors = (~np.isnan(of[one]) for of in (bricks, colors))
        assert sent.all() or sent_of_colors.all() or (sent == sent_of_colors).all()
    got, _ = page_colors(octree, slots, bricks, points, normals)
    return np.nan_to_num(got, nan=0.0), plain


def check(texture, mesh, rng, n=10_000):
    """Heights and normals at points of the surface are the texture's own; how many are not 0."""
    points, normals = surface_points(mesh, n, rng)
    wire = WireBricks(texture)
    got, plain = seen(wire, "height", points, normals)
    heights = texture.colors(points, normals, channel="height")[:, 0]
    most = float(np.abs(heights).max())
    off = np.abs(got[:, 0] - heights)
    assert off[plain].max() <= OF_HEIGHT * most + TINIEST
    assert (off > 0.01 * most).mean() < 0.001
    turned, plain = seen(wire, "normal", points, normals)
    wanted = texture.colors(points, normals, channel="normal")
    off = np.abs(turned[:, :3] - wanted[:, :3] * wanted[:, 3:])
    assert off[plain].max() <= OF_NORMAL
    assert np.abs(turned[plain, 3] - wanted[plain, 3]).max() <= OF_COVERAGE
    return (heights != 0).mean(), plain.mean()


@pytest.mark.parametrize("n_layers", [1, 3])
@pytest.mark.parametrize("name", list(MESHES))
def test_a_page_shows_the_heights_and_normals_that_are_painted(name, n_layers):
    mesh, size = MESHES[name][0](), MESHES[name][1]
    rng = np.random.default_rng(len(name))
    texture = painted(mesh, rng, n_layers=n_layers, **size)
    with_relief(texture, mesh, rng)
    n_raised, n_plain = check(texture, mesh, rng)
    assert n_raised > 0.01
    assert n_plain > 0.998


@needs_models
@pytest.mark.parametrize("name", ["spot.obj", "armadillo.obj"])
def test_a_page_shows_the_relief_of_real_models(name):
    mesh = read_mesh(model(name))
    rng = np.random.default_rng(5)
    texture = painted(mesh, rng, n_layers=2, n_strokes=4, resolution=128)
    with_relief(texture, mesh, rng, n_strokes=6)
    n_raised, n_plain = check(texture, mesh, rng)
    assert n_raised > 0.01
    assert n_plain > 0.9
