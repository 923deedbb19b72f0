"""Sheets that look the same way and need the same texels have colours of their own."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from meshsdf import read_mesh
from meshsdf.mesh import Mesh
from meshsdf.mesh.primitives import box_mesh, icosphere
from meshsdf.mesh.sampling import sample_surface
from meshsdf.texture.mip import bake
from meshsdf.texture.octree import Octree
from meshsdf.texture.refine import refine_to
from meshsdf.texture.volume_texture import VolumeTexture
from tests.models import model, needs_models
from tests.texture.folded_shapes import COLORS, baked, boxes, plate, plates, strip, zigzag

# Half a step of sRGB in 8 bits, in linear light, where it is longest
STEP = 0.5 * 2.4 / 1.055 / 255 + 1e-6


def wrong(texture, on, owner, **how):
    """How many points of a sample do not show their owner's colour."""
    seen = texture.colors(on.points, **how)
    return int((np.abs(seen - COLORS[owner[on.face_index]]).max(axis=1) > STEP).sum())


@pytest.mark.parametrize("z", [0.1, 0.45, 0.8])
@pytest.mark.parametrize("gap", [0.5, 0.2])
def test_no_texel_of_two_parallel_plates_mixes_their_colours(gap, z):
    mesh, owner = plates(gap, z)
    texture, layer = baked(mesh, owner)
    wanted = set(texture.channels["base"].encoded(COLORS[:2])) | {0}
    for slot in layer.slots:
        texel = texture.tiles.texel(int(slot))["base"] if slot < 0 else None
        assert {texel} <= wanted if slot < 0 else set(texture.pool.arrays["base"][slot]) <= wanted
    on = sample_surface(mesh, 20_000, seed=1)
    assert np.bincount(owner[on.face_index]).min() > 9_000
    for width in (0.0, 1.5, 3.0, 7.0):
        assert wrong(texture, on, owner, normals=on.normals, footprint=width) == 0
        assert wrong(texture, on, owner, footprint=width, project=True) == 0


def test_each_of_two_plates_has_the_texels_it_would_have_alone():
    for gap, z, tilt in ((0.5, 0.1, 0.0), (0.2, 0.8, 0.0), (0.3, 0.4, 0.11)):
        octree = Octree.around(plates(gap, z, tilt)[0], texel=1.0, divides=True)
        alone = [
            Octree.around(plate(height, tilt), texel=1.0, divides=True) for height in (z, z + gap)
        ]
        assert octree.n_texels(0) == sum(one.n_texels(0) for one in alone)


def test_a_zigzag_of_seven_leaves_has_seven_colours():
    mesh, owner = zigzag()
    texture, _ = baked(mesh, owner)
    on = sample_surface(mesh, 30_000, seed=2)
    # Where leaves meet, their colours do, too
    inside = np.abs(on.points[:, 0] - 20.3) < 20 - 3
    own = owner[on.face_index][inside]
    seen = texture.colors(on.points[inside], on.normals[inside])
    assert np.bincount(own).min() > 2_000
    assert np.abs(seen - COLORS[own]).max() <= STEP


def test_the_turns_of_a_spiral_keep_their_shades():
    t = np.linspace(0, 12 * np.pi, 600)
    radius = 10 + 0.7 * t / (2 * np.pi)
    curve = np.stack([radius * np.cos(t), radius * np.sin(t)], axis=1)
    mesh, at = strip(curve, 20.0, np.arange(599))
    shade = np.stack([at / 600, 1 - at / 600, 0 * at + 0.2, 0 * at + 1.0], axis=1)
    texture = VolumeTexture.around(mesh, texel=1.0, divides=True)
    bake(texture, texture.add_layer(), lambda points, faces: shade[faces].astype(np.float32))
    on = sample_surface(mesh, 20_000, seed=3)
    off = np.abs(texture.colors(on.points, on.normals) - shade[on.face_index]).max(axis=1)
    # Corners of a cell are next to faces at most 3 texels away; a turn is 100 faces, 1/6 of a shade
    per_texel = 1 / 600 / (10 * 12 * np.pi / 599)
    assert off.max() < 4 * per_texel + 2 / 600 + STEP < 1 / 12


def test_nested_boxes_do_not_mix_along_their_edges():
    mesh, owner = boxes()
    texture, _ = baked(mesh, owner)
    on = sample_surface(mesh, 40_000, seed=4)
    assert wrong(texture, on, owner, normals=on.normals) == 0
    assert wrong(texture, on, owner, footprint=2.0, project=True) == 0


def test_refining_keeps_plates_apart():
    mesh, owner = plates(0.5, 0.3, 0.05)
    texture = VolumeTexture.around(mesh, texel=0.25, divides=True)
    layer = texture.add_layer()
    bake(texture, layer, lambda points, faces: COLORS[owner[faces]], level=2)
    on = sample_surface(mesh, 10_000, seed=5)
    assert wrong(texture, on, owner, normals=on.normals) == 0
    refine_to(texture, layer, 0)
    assert wrong(texture, on, owner, normals=on.normals) == 0


def tables_equal(mesh, **size):
    """The tables are the same, byte for byte, whether sheets may be divided or not."""
    octree, plain = (
        Octree.around(mesh, divides=True, **size),
        Octree.around(mesh, divides=False, **size),
    )
    for own, other in zip(octree.tables, plain.tables, strict=True):
        assert_array_equal(own, other)
        assert np.asarray(own).dtype == np.asarray(other).dtype
    return not octree.is_divided


def test_where_nothing_is_in_conflict_nothing_is_divided():
    shapes = icosphere(subdivisions=3), box_mesh((1, 0.8, 0.01)), plate(0.4, 0.1)
    for mesh in shapes:
        assert tables_equal(mesh, resolution=60)


def test_t_junctions_cracks_and_crossings_are_no_conflicts():
    # One side of a seam has a vertex that the other lacks; one side lies a hair off; two cross
    seam = np.array([[0.0, 0, 0], [30, 0, 0], [30, 40, 0], [0, 40, 0], [30, 20, 0]])
    seam = np.concatenate([seam, [[60, 0, 0], [60, 40, 0]]]) + np.array([0.2, 0.3, 0.45])
    faces = [[0, 1, 2], [0, 2, 3], [1, 5, 4], [4, 5, 6], [4, 6, 2]]
    assert tables_equal(Mesh(seam, np.array(faces, np.int32)), texel=1.0)
    crack = np.concatenate([seam[[0, 1, 2, 3]], seam[[1, 5, 6, 2]] + np.array([0.003, 0, 0.004])])
    apart = np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]], np.int32)
    assert tables_equal(Mesh(crack, apart), texel=1.0)
    crossing = np.concatenate([plate(0.4, 0.01).vertices, plate(0.7).vertices])
    assert tables_equal(Mesh(crossing[:, [1, 2, 0]], np.array(apart)), texel=10.0)


def test_plates_a_hair_apart_share_their_texels():
    assert tables_equal(plates(0.01, 0.4)[0], texel=1.0)


@needs_models
@pytest.mark.parametrize("name", ["armadillo.obj", "Duck.glb", "cow.obj", "camelhead.off"])
def test_sheets_of_real_models_have_colours_of_their_own(name):
    mesh = read_mesh(model(name))
    texture = VolumeTexture.around(mesh, resolution=256, divides=True)
    octree, layer = texture.octree, texture.add_layer()
    on = sample_surface(mesh, 400_000, seed=6)
    nodes = on.points / octree.texel
    number = octree.face_parts[on.face_index].astype(np.int64)
    of_finest = octree.tables.groups[octree.tables.groups[:, 0] < octree.level_first[1]]
    split = of_finest[(of_finest[:, 2:] != -1).any(axis=1)]
    assert len(split) > 5
    n_seen = 0
    for first, count, *bits in split[:: max(1, len(split) // 4)].tolist():
        # One divided sheet of the brick: its entries, and how the brick's other sheet looks
        own = next(s for s in range(count) if bits[s] != -1)
        looks = octree.tables.sheets[first : first + count]
        entries = [s for s in range(count) if (looks[s] == looks[own]).all()]
        others = [looks[s] for s in range(count) if s not in entries] or [-looks[own]]
        along = on.normals @ looks[own] > on.normals @ others[0] + 0.5
        # Cells that lie in the brick alone
        inside = (np.floor(nodes) // 8 == octree.tables.bricks[first]).all(axis=1)
        told = np.isin(number, [n for n in range(32) if any(bits[s] >> n & 1 for s in entries)])
        some = np.flatnonzero(inside & along & told & (nodes % 8 < 7).all(axis=1))
        is_own = (bits[own] >> octree.face_parts.astype(np.int64)) & 1
        bake(texture, layer, lambda points, faces, is_own=is_own: COLORS[is_own[faces]])
        seen = texture.colors(on.points[some], on.normals[some])
        wanted = COLORS[is_own[on.face_index[some]]]
        assert np.abs(seen - wanted).max(initial=0) <= STEP
        n_seen += len(some)
    assert n_seen > 50
