"""meshsdf.server.wire_bricks: a page that blends them shows what the texture shows."""

import numpy as np
import pytest

from meshsdf.io import read_mesh
from meshsdf.mesh import icosphere
from meshsdf.mesh.primitives import box_mesh
from meshsdf.server.wire_bricks import WireBricks
from meshsdf.server.wire_records import brick_records
from meshsdf.srgb import srgb_from_linear
from meshsdf.texture import Brush, Project, VolumeTexture, paint
from meshsdf.texture.layers import shown
from meshsdf.texture.live import LiveStrokes
from tests.models import model, needs_models
from tests.texture.random_operations import random_operation, small_mesh

from .wire_examples import painted, surface_points, thin_plate
from .wire_twin import page_colors, unpacked

# Bricks are rounded to half a step of 1/255 in sRGB. A blend in linear light of colours that are
# off by that is off by no more in sRGB, as the slope of the curve there is a concave function of
# linear light. Base colours are themselves rounded alike where they are kept in 8 bits.
ALLOWED = 0.5 / 255 + 1e-5


N_OPERATIONS = 50


def errors(texture, mesh, rng, n=10_000):
    """How far the page's colours are off, premultiplied and in sRGB; whether points are plain."""
    points, normals = surface_points(mesh, n, rng)
    wire = WireBricks(texture)
    bricks = unpacked(all_of(wire))
    slots = shown(texture).slots
    got, plain = page_colors(texture.octree, slots, bricks, points, normals)
    assert not np.isnan(got).any()
    wanted = texture.colors(points, normals).astype(np.float64)
    wanted[:, :3] *= wanted[:, 3:]
    off = [np.clip(one, 0, 1) for one in (got, wanted)]
    for one in off:
        one[:, :3] = srgb_from_linear(one[:, :3])
    return np.abs(off[0] - off[1]).max(axis=1), plain


MESHES = {
    "sphere": (lambda: icosphere(subdivisions=3), {"resolution": 64}),
    "box": (lambda: box_mesh((3.0, 2.0, 1.0), center=(40.0, -7.0, 3.3)), {"resolution": 64}),
    "thin plate": (thin_plate, {"texel": 1.0}),
    "thinner plate": (lambda: thin_plate(0.05, 0.0), {"texel": 1.0}),
}


@pytest.mark.parametrize(("n_layers", "base"), [(1, "srgb8"), (3, "srgb8"), (3, "half")])
@pytest.mark.parametrize("name", list(MESHES))
def test_a_page_shows_the_texture_to_half_a_step_of_its_colours(name, n_layers, base):
    mesh, size = MESHES[name][0](), MESHES[name][1]
    rng = np.random.default_rng(len(name))
    texture = painted(mesh, rng, n_layers=n_layers, base=base, **size)
    off, plain = errors(texture, mesh, rng)
    assert off[plain].max() <= ALLOWED
    assert plain.mean() > 0.998
    assert (off > 1 / 255).mean() < 0.001


@needs_models
@pytest.mark.parametrize("name", ["spot.obj", "armadillo.obj", "camelhead.off", "fandisk.obj"])
def test_a_page_shows_real_models_as_they_are_painted(name):
    mesh = read_mesh(model(name))
    rng = np.random.default_rng(5)
    texture = painted(mesh, rng, n_layers=3, n_strokes=6, resolution=128)
    off, plain = errors(texture, mesh, rng)
    assert off[plain].max() <= ALLOWED
    # Elsewhere are folds, where both of two sheets have the texels beside a brick of one sheet
    assert plain.mean() > 0.9
    assert (off > 1 / 255).mean() < 0.001


@pytest.mark.parametrize("seed", range(2))
def test_updates_are_what_a_new_page_would_get_byte_for_byte(tmp_path, seed):
    project = Project.create(tmp_path / "a.mtex", small_mesh(), resolution=48)
    live = LiveStrokes(project)
    wire = WireBricks(project.texture)
    bricks, n_sent, versions = {}, 0, wire.pictures["base"].versions
    for number in range(N_OPERATIONS):
        layers = [layer.number for layer in project.texture.layers]
        history = project.history
        n_undone = len(history.steps) - history.n_done
        live.apply(random_operation(seed, number, layers, history.n_done, n_undone))
        changed = wire.update()["base"]
        before = versions.copy()
        for entry, version, brick in brick_records(wire.pictures["base"].payload(changed)):
            assert version == versions[entry] == wire.revision
            bricks[entry] = brick
        n_sent += len(changed)
        if number % 10 == 9:
            fresh = WireBricks(project.texture)
            wanted = {entry: brick for entry, _, brick in brick_records(all_of(fresh))}
            assert {e: b for e, b in bricks.items() if b[0]} == wanted
            assert fresh.digest() == wire.digest()
            fresh.release()
        assert (versions == before).all()
    assert n_sent < N_OPERATIONS * len(wanted)  # not everything every time
    live.close()


def all_of(wire):
    """The payload that a new page gets."""
    return wire.range_payload(0, wire.texture.octree.n_entries)


def test_only_bricks_that_became_others_are_told():
    texture = VolumeTexture.around(icosphere(subdivisions=3), resolution=64)
    layer = texture.add_layer(color=(0.5, 0.5, 0.5))
    wire = WireBricks(texture)
    before = {entry: brick for entry, _, brick in brick_records(all_of(wire))}
    pole = np.array([[0.0, 0.0, 1.0]])
    paint(texture, layer, Brush(0.1, color=(1.0, 0.0, 0.0, 1.0)), pole, pole)
    colors = wire.pictures["base"]
    changed = wire.update()["base"]
    assert 0 < len(changed) < len(colors.present)
    told = {entry: brick for entry, _, brick in brick_records(colors.payload(changed))}
    assert all(before.get(entry) != brick for entry, brick in told.items())
    after = {entry: brick for entry, _, brick in brick_records(all_of(WireBricks(texture)))}
    assert told == {entry: after[entry] for entry in after if after[entry] != before.get(entry)}
    assert [len(entries) for entries in wire.update().values()] == [0]


def test_bricks_of_one_colour_are_sent_as_such():
    texture = VolumeTexture.around(icosphere(subdivisions=2), resolution=32)
    texture.add_layer(color=(1.0, 0.0, 0.0, 0.5))
    wire = WireBricks(texture)
    records = list(brick_records(all_of(wire)))
    top = int(np.diff(texture.octree.level_first)[-1])
    assert len(records) == top
    # Half of full red in linear light is sRGB 188
    assert {brick for _, _, brick in records} == {bytes([1, 0, 0, 0, 188, 0, 0, 128])}


def test_entries_of_a_range_are_those():
    texture = painted(
        icosphere(subdivisions=3), np.random.default_rng(0), n_layers=1, resolution=48
    )
    wire = WireBricks(texture)
    n = texture.octree.n_entries
    parts = [wire.range_payload(0, n // 2), wire.range_payload(n // 2, n)]
    joined = [record for part in parts for record in brick_records(part)]
    assert joined == list(brick_records(all_of(wire)))
