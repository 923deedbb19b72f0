"""Two sides of thin parts have two colours, however thin they are."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from meshsdf.mesh import Mesh
from meshsdf.mesh.primitives import box_mesh
from meshsdf.texture.mip import bake
from meshsdf.texture.refine import refine_to
from meshsdf.texture.volume_texture import VolumeTexture

RED, BLUE = np.array([0.8, 0.05, 0.02, 1.0]), np.array([0.02, 0.1, 0.7, 1.0])
XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])


def two_colors(points, normals, up=(0.0, 0.0, 1.0)):
    """Red where the surface looks up, blue where it looks down."""
    return np.where((normals @ np.array(up) > 0)[:, None], RED, BLUE)


def by_side(up):
    """The two colours of a plate that looks along ``up``."""
    return lambda points, normals: two_colors(points, normals, up)


def lab(linear):
    """CIE L*a*b* (D65) of linear sRGB."""
    ratio = (linear[:, :3].astype(float) @ XYZ.T) / XYZ.sum(axis=1)
    f = np.where(ratio > (6 / 29) ** 3, np.cbrt(ratio), ratio / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.stack(
        [116 * f[:, 1] - 16, 500 * (f[:, 0] - f[:, 1]), 200 * (f[:, 1] - f[:, 2])], axis=1
    )


def worst(texture, points, normals, color):
    """Largest difference of colours, CIE 1976, between what is seen and what was painted."""
    seen = lab(texture.colors(points, normals))
    return np.linalg.norm(seen - lab(color[None]), axis=1).max()


def plate(thickness, turn):
    """A plate of 60 x 40 texels, turned a little, with points and normals of both its sides."""
    mesh = box_mesh((60.0, 40.0, thickness), center=(0.3, 0.2, 0.37))
    a, b = np.array([[np.cos(t), np.sin(t)] for t in (turn, 0.7 * turn)])
    rotation = np.array([[1, 0, 0], [0, a[0], -a[1]], [0, a[1], a[0]]]) @ np.array(
        [[b[0], 0, b[1]], [0, 1, 0], [-b[1], 0, b[0]]]
    )
    random = np.random.default_rng(0)
    flat = random.uniform([-30, -20], [30, 20], (10_000, 2)) + np.array([0.3, 0.2])
    sides = [
        np.column_stack([flat, np.full(len(flat), 0.37 + s * thickness / 2)]) @ rotation.T
        for s in (1, -1)
    ]
    return Mesh(mesh.vertices @ rotation.T, mesh.faces), sides, rotation[:, 2]


@pytest.mark.parametrize("turn", [0.0, 0.05, 0.3])
@pytest.mark.parametrize("thickness", [0.5, 0.05])
def test_no_texel_of_a_thin_plate_mixes_its_two_sides(thickness, turn):
    mesh, (above, below), up = plate(thickness, turn)
    texture = VolumeTexture.around(mesh, texel=1.0)
    layer = texture.add_layer()
    bake(texture, layer, by_side(up))
    wanted = texture.channels["base"].encoded(np.stack([RED, BLUE]).astype(np.float32))
    for entry in range(texture.octree.n_entries):
        slot = layer.slots[entry]
        texel = texture.tiles.texel(int(slot))["base"] if slot < 0 else None
        if texture.octree.tables.levels[entry] == 0:
            assert texel is not None or set(texture.pool.arrays["base"][slot]) <= {*wanted, 0}
    assert worst(texture, above, np.tile(up, (len(above), 1)), RED) < 1
    assert worst(texture, below, np.tile(-up, (len(below), 1)), BLUE) < 1


@pytest.mark.parametrize("thickness", [0.5, 0.05])
def test_coarser_levels_keep_the_sides_apart(thickness):
    mesh, (above, below), up = plate(thickness, 0.1)
    texture = VolumeTexture.around(mesh, texel=1.0)
    bake(texture, texture.add_layer(), by_side(up))
    middle = np.abs(above - above.mean(axis=0)).max(axis=1) < 12
    for width in (1.5, 2.0, 4.0):
        for points, normal, color in ((above, up, RED), (below, -up, BLUE)):
            some = points[middle]
            seen = texture.colors(some, np.tile(normal, (len(some), 1)), width)
            assert np.linalg.norm(lab(seen) - lab(color[None]), axis=1).max() < 1


def test_a_folded_sheet_has_the_colours_of_both_its_layers():
    # Two leaves 0.3 texels apart, joined at one side by a strip
    leaf = np.array([[0.0, 0, 0], [50, 0, 0], [50, 30, 0], [0, 30, 0]]) + np.array([0.2, 0.1, 0.45])
    gap = np.array([0, 0, 0.3])
    vertices = np.concatenate([leaf, leaf + gap])
    faces = np.array([[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7], [1, 6, 5], [1, 2, 6]], np.int32)
    texture = VolumeTexture.around(Mesh(vertices, faces), texel=1.0)
    bake(texture, texture.add_layer(), two_colors)
    random = np.random.default_rng(1)
    points = random.uniform([0, 0, 0], [50, 30, 0], (10_000, 3)) + leaf[0]
    up = np.tile([0.0, 0, 1], (len(points), 1))
    assert worst(texture, points + gap, up, RED) < 1
    assert worst(texture, points, -up, BLUE) < 1


def test_where_a_wedge_grows_thick_its_sides_stay_apart():
    # From 0 to 12 texels: bricks of two sheets lie beside bricks of one that holds both surfaces
    corners = np.array([[0.0, 0, 0], [60, 0, -6], [60, 0, 6]]) + np.array([0.3, 0.2, 0.41])
    vertices = np.concatenate([corners, corners + np.array([0, 40, 0])])
    faces = np.array(
        [[0, 1, 2], [3, 5, 4], [0, 3, 4], [0, 4, 1], [0, 2, 5], [0, 5, 3], [1, 4, 5], [1, 5, 2]],
        np.int32,
    )
    texture = VolumeTexture.around(Mesh(vertices, faces), texel=1.0)
    layer = texture.add_layer()
    bake(texture, layer, two_colors)
    n_sheets = texture.octree.tables.groups[:, 1]
    assert len(n_sheets) > 10
    random = np.random.default_rng(1)
    share, along = random.uniform(0.02, 0.95, 20_000), random.uniform(1, 39, 20_000)
    for side, color in ((1, RED), (-1, BLUE)):
        points = np.stack([60 * share, along, 6 * side * share], axis=1) + corners[0]
        normals = np.tile([-6.0, 0, 60 * side], (len(points), 1))
        assert worst(texture, points, normals, color) < 1


def test_refining_keeps_the_sides_apart():
    mesh, (above, below), up = plate(0.5, 0.2)
    texture = VolumeTexture.around(mesh, texel=0.25)
    layer = texture.add_layer()
    bake(texture, layer, by_side(up), level=2)
    asked = (above, np.tile(up, (len(above), 1))), (below, np.tile(-up, (len(below), 1)))
    before = [texture.colors(*where) for where in asked]
    refine_to(texture, layer, 0)
    for where, colors in zip(asked, before, strict=True):
        assert_array_equal(np.rint(255 * texture.colors(*where)), np.rint(255 * colors))
