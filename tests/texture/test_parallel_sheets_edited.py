"""Painting, blending, keeping and carrying over sheets that need the same texels."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf.io.vdb import read_vdb_grids
from meshsdf.io.vdb_texture import write_vdb_texture
from meshsdf.kernels import parallel
from meshsdf.mesh import Mesh
from meshsdf.mesh.sampling import sample_surface
from meshsdf.texture import octree_levels
from meshsdf.texture.brush import Brush
from meshsdf.texture.journal import Project
from meshsdf.texture.layers import shown
from meshsdf.texture.mesh_source import MeshSource
from meshsdf.texture.mip import bake
from meshsdf.texture.octree import Octree
from meshsdf.texture.octree_store import octree_arrays, octree_of_arrays
from meshsdf.texture.operations import Operation
from meshsdf.texture.procedural_layer import add_procedural
from meshsdf.texture.project_parts import write_new
from meshsdf.texture.stroke import paint
from meshsdf.texture.transfer import transfer
from meshsdf.texture.volume_texture import VolumeTexture
from tests.texture.folded_shapes import COLORS, baked, plate, plates

OFFSET = np.array([0.3, 0.2])
STEP = 0.5 * 2.4 / 1.055 / 255 + 1e-6  # half a step of sRGB in 8 bits, where it is longest


def sides(mesh, owner, count=8_000):
    """Points of both plates, away from their rims, and their normals."""
    on = sample_surface(mesh, count, seed=1)
    inside = (np.abs(on.points[:, :2] - [30.3, 20.2]) < [26, 16]).all(axis=1)
    which = owner[on.face_index]
    return [(on.points[inside & (which == k)], on.normals[inside & (which == k)]) for k in (0, 1)]


def off(texture, place, color, **how):
    """How far colours at places are from what they should be."""
    return np.abs(texture.colors(*place, **how) - color).max()


@pytest.mark.parametrize("geodesic", [False, True])
@pytest.mark.parametrize("kind", ["paint", "erase"])
def test_a_stroke_on_one_plate_leaves_the_other_as_it_was(kind, geodesic):
    mesh, owner = plates(0.5, 0.3)
    texture, layer = baked(mesh, owner)
    low, high = sides(mesh, owner)
    brush = Brush(
        radius=8.0, hardness=0.9, kind=kind, color=(0.0, 1.0, 0.0, 1.0), geodesic=geodesic
    )
    way = np.array([[10.0, 20, 0.8], [50, 20, 0.8]])
    paint(texture, layer, brush, way, np.tile([0.0, 0, 1], (2, 1)))
    assert off(texture, low, COLORS[0]) <= STEP
    assert off(texture, low, COLORS[0], footprint=3.0) <= STEP
    under = np.abs(high[0][:, 1] - 20) < 4
    under &= np.abs(high[0][:, 0] - 30) < 18
    wanted = np.array([0.0, 1, 0, 1]) if kind == "paint" else np.zeros(4)
    assert under.sum() > 200
    assert off(texture, (high[0][under], high[1][under]), wanted) <= STEP


@pytest.mark.parametrize("kind", ["blur", "smudge"])
def test_moving_paint_about_does_not_mix_plates(kind):
    mesh, owner = plates(0.4, 0.3)
    texture, layer = baked(mesh, owner)
    brush = Brush(radius=8.0, kind=kind)
    for z in (0.3, 0.7):
        way = np.array([[10.0, 20, z], [40, 22, z]])
        paint(texture, layer, brush, way, np.tile([0.0, 0, 1], (2, 1)))
    for place, color in zip(sides(mesh, owner), COLORS, strict=False):
        assert off(texture, place, color) <= STEP


def test_layers_over_one_another_keep_plates_apart():
    mesh, owner = plates(0.3, 0.3)
    texture, _ = baked(mesh, owner)
    veil = texture.add_layer("veil", color=(0.0, 0.0, 0.0, 0.5))
    brush = Brush(radius=6.0, hardness=1.0, color=(0.0, 0.0, 0.0, 0.5), blend="normal")
    paint(texture, veil, brush, np.array([[30.0, 20, 0.3]]), np.array([[0.0, 0, 1]]))
    assert shown(texture) is not texture.layers[0]
    for (points, normals), color in zip(sides(mesh, owner), COLORS, strict=False):
        far = np.linalg.norm(points[:, :2] - [30, 20], axis=1) > 12
        dark = np.append(0.5 * color[:3], 1)
        for width in (0.0, 4.0):
            seen = off(texture, (points[far], normals[far]), dark, footprint=width)
            assert seen <= 2 * STEP


def test_colours_of_a_mesh_and_of_functions_come_to_the_right_plate():
    mesh, owner = plates(0.2, 0.4)
    colored = Mesh(mesh.vertices, mesh.faces, vertex_colors=COLORS[np.repeat([0, 1], 4)])
    texture = VolumeTexture.around(mesh, texel=1.0, divides=True)
    bake(texture, texture.add_layer(), MeshSource(colored))
    for place, color in zip(sides(mesh, owner), COLORS, strict=False):
        assert off(texture, place, color) <= STEP
    lazy = VolumeTexture.around(mesh, texel=1.0, divides=True)
    add_procedural(lazy, "by height", lambda points, feet: COLORS[(feet[:, 2] > 0.5).astype(int)])
    for place, color in zip(sides(mesh, owner), COLORS, strict=False):
        assert off(lazy, place, color) <= STEP


def test_feet_are_the_nearest_places_of_the_own_plate():
    mesh, owner = plates(0.5, 0.3)
    texture = VolumeTexture.around(mesh, texel=1.0, divides=True)
    entries = np.arange(texture.octree.level_first[1], dtype=np.int32)
    points, _ = texture.places(entries)
    feet, faces = texture.feet(entries)
    assert_array_equal(feet[:, 2], np.array([0.3, 0.8])[owner[faces]])
    inside = np.clip(points[:, :2], [0.3, 0.2], [60.3, 40.2])
    assert_allclose(feet[:, :2], inside, atol=1e-12)
    assert np.bincount(owner[faces]).min() > 5_000


def test_a_store_gives_the_tables_back():
    octree = Octree.around(plates(0.3, 0.4, 0.1)[0], texel=1.0, divides=True)
    arrays = octree_arrays(octree)
    again = octree_of_arrays(octree.texel, arrays)
    for own, other in zip(octree.tables, again.tables, strict=True):
        assert_array_equal(own, other)
    assert_array_equal(octree.face_parts, again.face_parts)
    undivided = octree_arrays(Octree.around(plate(0.4), texel=1.0, divides=True))
    assert set(arrays) - set(undivided) == {"parts", "texel_parts", "face_parts"}


def test_a_project_keeps_its_plates_apart(tmp_path):
    mesh, owner = plates(0.4, 0.3)
    ball = {"layer": 0, "center": np.array([30.0, 20, 0.3]), "radius": 6.0, "color": [1.0, 0, 0]}
    low, high = sides(mesh, owner)
    with Project.create(tmp_path / "two.mtex", mesh, texel=1.0) as project:
        project.apply(Operation("add-layer", {"color": [0.2, 0.4, 0.6]}))
        project.apply(Operation("paint-ball", ball))
        octree, digest = project.texture.octree, project.digest()
        seen = [project.texture.colors(*place) for place in (low, high)]
    with Project.open(tmp_path / "two.mtex") as project:
        assert project.digest() == digest
        assert_array_equal(project.texture.octree.face_parts, octree.face_parts)
        for own, other in zip(project.texture.octree.tables, octree.tables, strict=True):
            assert_array_equal(own, other)
        for place, colors in zip((low, high), seen, strict=True):
            assert_array_equal(project.texture.colors(*place), colors)


def test_a_project_whose_sheets_are_not_divided_opens_as_it_was(tmp_path):
    mesh, _ = plates(0.4, 0.3)
    texture = VolumeTexture(Octree.around(mesh, texel=1.0, divides=False))
    texture.surface = mesh
    write_new(tmp_path / "old.mtex", texture)
    with Project.open(tmp_path / "old.mtex") as project:
        assert not project.texture.octree.is_divided
        for own, other in zip(project.texture.octree.tables, texture.octree.tables, strict=True):
            assert_array_equal(own, other)


def test_one_thread_and_three_give_the_same_bytes(monkeypatch):
    mesh = plates(0.3, 0.4, 0.1)[0]
    made = []
    for threads in (1, 3):
        monkeypatch.setattr(parallel, "n_threads", lambda threads=threads: threads)
        monkeypatch.setattr(octree_levels, "n_threads", lambda threads=threads: threads)
        made.append(Octree.around(mesh, texel=1.0, divides=True))
    for own, other in zip(made[0].tables, made[1].tables, strict=True):
        assert_array_equal(own, other)


def test_paint_stays_on_its_plate_when_the_mesh_is_cut():
    mesh, owner = plates(0.4, 0.3)
    texture, _ = baked(mesh, owner)
    # Every plate becomes 60 x 40 small squares, of which some are cut out
    x, y = np.meshgrid(np.arange(60), np.arange(40), indexing="ij")
    corner = (41 * x + y).ravel()
    faces = np.concatenate([np.stack([corner, corner + 41, corner + 42], 1),
                            np.stack([corner, corner + 42, corner + 1], 1)])  # fmt: skip
    kept = ~((np.tile(x.ravel(), 2) > 40) & (np.tile(y.ravel(), 2) > 25))
    grid = np.stack(np.meshgrid(np.arange(61.0), np.arange(41.0), indexing="ij"), -1).reshape(-1, 2)
    points = [np.column_stack([grid + OFFSET, np.full(len(grid), z)]) for z in (0.3, 0.7)]
    cut = np.concatenate([faces[kept], faces + len(grid)]).astype(np.int32)
    carried = transfer(texture, Mesh(np.concatenate(points), cut)).texture
    for (points, normals), color in zip(sides(mesh, owner), COLORS, strict=False):
        there = (points[:, 0] < 38) | (points[:, 1] < 22)
        assert off(carried, (points[there], normals[there]), color) <= STEP


def test_a_vdb_file_has_every_texel_and_no_mixed_colour(tmp_path):
    mesh, owner = plates(0.5, 0.3)
    texture, _ = baked(mesh, owner)
    write_vdb_texture(tmp_path / "two.vdb", texture)
    (colors,) = read_vdb_grids(tmp_path / "two.vdb")
    active = np.unpackbits(colors.active.view(np.uint8), bitorder="little").view(bool)
    values = np.asarray(colors.values[:]).reshape(-1, 3)[active]
    # Both plates lie in one layer of cells
    assert len(values) == Octree.around(plate(0.3), texel=1.0, divides=True).n_texels(0)
    off = np.abs(values[:, None] - COLORS[:2, :3]).max(axis=2).min(axis=1)
    assert off.max() <= STEP
