"""meshsdf.server.wire_relief: normals and heights in bricks, sent only where there are any."""

import hashlib

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from meshsdf.io import read_mesh
from meshsdf.kernels.texture_lookup import ABSENT
from meshsdf.kernels.wire_bricks import TEXELS
from meshsdf.server.wire_bricks import WireBricks
from meshsdf.server.wire_records import brick_records
from meshsdf.texture import Brush, paint
from meshsdf.texture.change import recording
from meshsdf.texture.layers import shown
from meshsdf.texture.mip import update_mips
from meshsdf.texture.refine import refine_to
from tests.models import model, needs_models

from .test_wire_bricks import MESHES
from .wire_examples import painted, surface_points, with_relief
from .wire_twin import codes_of, has_texel, hiding, page_colors, unpacked

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


def texture_of(name, n_layers=2, seed=0):
    """A mesh, and a texture around it with paint of all kinds."""
    mesh, size = MESHES[name][0](), MESHES[name][1]
    rng = np.random.default_rng([seed, len(name)])
    texture = painted(mesh, rng, n_layers=n_layers, n_strokes=4, **size)
    return mesh, with_relief(texture, mesh, rng, n_strokes=6), rng


@pytest.mark.parametrize("picture", ["height", "normal"])
@pytest.mark.parametrize("name", list(MESHES))
def test_what_nodes_say_are_the_texels_that_are_stored(name, picture):
    _, texture, _ = texture_of(name)
    wire, octree = WireBricks(texture), texture.octree
    slots, channel = shown(texture).slots, texture.channels[picture]
    pool, tiles = texture.pool.arrays[picture], texture.tiles.arrays[picture]
    n_compared = 0
    for entry, _, brick in brick_records(everything(wire, picture)):
        if brick[0] != TEXELS or slots[entry] == ABSENT:
            continue
        bits = np.frombuffer(brick[4 : 4 + 92], np.uint8)
        sent = np.flatnonzero(np.unpackbits(bits, bitorder="little")[:729])
        codes = np.frombuffer(brick[4 + 92 :], "<u4")
        i, j, k = np.unravel_index(sent, (9, 9, 9))
        own = (i < 8) & (j < 8) & (k < 8)
        t = (64 * i + 8 * j + k)[own]
        here = has_texel(octree.tables, np.full(len(t), entry), t)
        slot = slots[entry]
        texels = pool[slot, t] if slot >= 0 else np.full(len(t), tiles[-2 - slot])
        wanted = codes_of(channel.decoded(texels), picture)
        assert_array_equal(codes[own][here], wanted[here])
        n_compared += here.sum()
    assert n_compared > 1000


@pytest.mark.parametrize("picture", ["height", "normal"])
@pytest.mark.parametrize("name", list(MESHES))
def test_what_says_nothing_is_sent_only_where_it_hides_something(name, picture):
    _, texture, _ = texture_of(name)
    wire = WireBricks(texture)
    present = set(wire.pictures["base"].present.tolist())
    value = slice(0, 1) if picture == "height" else slice(None)
    sent = unpacked(everything(wire, picture), picture)
    saying = {entry for entry, nodes in sent.items() if np.nan_to_num(nodes)[..., value].any()}
    assert 0 < len(saying) < len(present)
    assert set(sent) - saying == hiding(texture.octree, present, saying)


def test_without_normals_and_heights_there_is_nothing_of_them():
    mesh = MESHES["sphere"][0]()
    texture = painted(mesh, np.random.default_rng(0), n_layers=2, resolution=48)
    wire = WireBricks(texture)
    assert list(wire.pictures) == ["base"]
    assert wire.digest("height") == wire.digest("normal") == hashlib.sha256().hexdigest()
    assert everything(wire, "height") == bytes(4)
    pole = np.array([[0.0, 0.0, 1.0]])
    with recording(texture) as change:
        paint(texture, texture.layers[0], Brush(0.1, channel="height", value=2.0), pole, pole)
    wire.update()
    assert list(wire.pictures) == ["base", "height"]
    raised = wire.digest("height")
    change.undo(texture)
    wire.update()
    assert wire.digest("height") == hashlib.sha256().hexdigest()
    assert len(wire.pictures["height"].present) == 0
    change.redo(texture)
    wire.update()
    assert wire.digest("height") == raised
    assert WireBricks(texture).digest("height") == raised


def test_bricks_of_a_picture_are_made_only_when_its_own_texels_changed():
    mesh, texture, rng = texture_of("sphere", n_layers=1)
    for layer in texture.layers:
        refine_to(texture, layer, 0)
        update_mips(texture, layer, layer.stored)
    wire = WireBricks(texture)
    made = {name: [] for name in wire.pictures}
    for name, picture in wire.pictures.items():

        def counted(entries, whole=picture._made, seen=made[name]):
            seen.append(len(entries))
            return whole(entries)

        picture._made = counted
    for channel in made:
        points, normals = surface_points(mesh, 1, rng)
        brush = Brush(0.2, channel=channel, color=(0.0, 0.6, 0.8, 1.0), value=3.0)
        paint(texture, texture.layers[0], brush, points, normals)
        told = wire.update()
        assert {name for name in made if len(told[name])} == {channel}
        assert {name for name in made if made[name]} == {channel}
        made[channel].clear()


def random_stroke(texture, mesh, rng):
    """Paint somewhere in some channel."""
    channel = ("base", "height", "normal")[int(rng.integers(3))]
    start, _ = surface_points(mesh, 1, rng)
    points, normals = texture.on_surface(np.repeat(start, 2, axis=0) + rng.normal(0, 0.1, (2, 3)))
    size = float(np.ptp(mesh.vertices, axis=0).max())
    brush = Brush(
        size * float(rng.uniform(0.005, 0.2)),
        channel=channel,
        color=(*rng.random(3).tolist(), 1.0),
        value=float(rng.uniform(-4, 4)),
        kind="erase" if rng.random() < 0.3 else "paint",
    )
    paint(texture, texture.layers[int(rng.integers(len(texture.layers)))], brush, points, normals)


@pytest.mark.parametrize("name", ["sphere", "thinner plate"])
def test_updates_of_every_picture_are_what_a_new_page_would_get(name):
    mesh, size = MESHES[name][0](), MESHES[name][1]
    rng = np.random.default_rng(7)
    texture = painted(mesh, rng, n_layers=2, n_strokes=2, **size)
    wire = WireBricks(texture)
    held = {picture: {} for picture in ("base", "normal", "height")}
    for picture in wire.pictures:
        held[picture] = bricks_of(wire, picture)
    done = []
    for number in range(24):
        if done and rng.random() < 0.3:
            done.pop().undo(texture)
        elif rng.random() < 0.1:
            texture.layers[1].opacity = float(rng.random())
        else:
            with recording(texture) as change:
                random_stroke(texture, mesh, rng)
            done.append(change)
        for picture, entries in wire.update().items():
            payload = wire.pictures[picture].payload(entries)
            for entry, version, brick in brick_records(payload):
                assert version == wire.revision
                held[picture][entry] = brick
        if number % 8 == 7:
            fresh = WireBricks(texture)
            for picture, bricks in held.items():
                assert {e: b for e, b in bricks.items() if b[0]} == bricks_of(fresh, picture)
                assert fresh.digest(picture) == wire.digest(picture)
            fresh.release()
    assert all(map(len, held.values()))


def bricks_of(wire, picture):
    """Every entry's brick."""
    return {entry: brick for entry, _, brick in brick_records(everything(wire, picture))}
