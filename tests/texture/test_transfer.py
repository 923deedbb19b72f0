"""meshsdf.texture.transfer: paint stays byte for byte where the surface did, or follows it."""

import igl
import manifold3d
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf.errors import TextureError
from meshsdf.io import read_mesh
from meshsdf.mesh import Mesh, box_mesh, icosphere
from meshsdf.texture.mesh_change import is_in
from meshsdf.texture.mip import bake, update_mips
from meshsdf.texture.procedural_layer import add_procedural, fill
from meshsdf.texture.refine import refine
from meshsdf.texture.transfer import transfer
from meshsdf.texture.volume_texture import VolumeTexture
from tests.models import model, needs_models

SRGB = 1.0 / 255


def waves(scale, count=6):
    """A smooth solid paint: colours run through ``count`` periods over a length."""

    def paint(points):
        colors = np.ones((len(points), 4), np.float32)
        colors[:, :3] = 0.5 + 0.4 * np.sin(2 * np.pi * count * points / scale)
        return colors

    return paint


def painted(mesh, resolution):
    """A texture with paint, height and a mask, one layer all over and one in a few bricks."""
    texture = VolumeTexture.around(mesh, resolution=resolution)
    ground = texture.add_layer("ground")
    bake(texture, ground, waves(mesh.box.diagonal))
    bake(texture, ground, lambda p: np.abs(np.sin(p @ np.ones((3, 4)))), channel="height")
    spots = texture.add_layer("spots", color=(0.0, 0.0, 0.0, 0.0))
    spots.mode, spots.opacity = "multiply", 0.75
    bricks = np.arange(0, int(texture.octree.level_first[1]), 7, dtype=np.int32)
    refine(texture, spots, bricks)
    n = len(texture.places(bricks)[0])
    values = np.random.default_rng(0).uniform(size=(n, 4)).astype(np.float32)
    texture.put(spots, bricks, values)
    texture.put(spots, bricks, values, channel="mask")
    texture.collapse_uniform(spots, bricks)
    update_mips(texture, spots, bricks)
    return texture


def brick_bytes(texture, layer, entry):
    """Everything that an entry of a layer holds where texels exist, or None."""
    slot = int(layer.slots[entry])
    if slot == -1:
        return None
    needed = np.unpackbits(
        texture.octree.tables.masks[entry].view(np.uint8), bitorder="little"
    ).astype(bool)
    texels = []
    for name, channel in texture.channels.items():
        if slot < 0:
            row = np.full(512, texture.tiles.arrays[name][-2 - slot])
        else:
            row = texture.pool.arrays.get(name, np.full((slot + 1, 512), channel.nothing))[slot]
        texels.append(row[needed].astype(channel.dtype).tobytes())
    return b"".join(texels)


def key_of(octree, entry):
    """Level, brick, sheet and mask of an entry."""
    tables = octree.tables
    sheet = np.round(tables.sheets[entry], 2) + 0.0
    place = int(tables.levels[entry]), *tables.bricks[entry].tolist()
    return *place, *sheet.tolist(), tables.masks[entry].tobytes()


def keyed(octree):
    """Entries by what tells them apart, so that two octrees can be compared."""
    return {key_of(octree, entry): entry for entry in range(octree.n_entries)}


def untouched(texture, old, new, levels):
    """Entries of bricks that lie farther than two texels from all faces of one mesh alone."""
    changed = []
    for one, other in ((old, new), (new, old)):
        turns = np.concatenate([np.roll(other.triangles, i, axis=1) for i in range(3)])
        there = {triangle.tobytes() for triangle in turns}
        changed += [t for t in one.triangles if t.tobytes() not in there]
    flat, faces = np.array(changed).reshape(-1, 3), np.arange(3 * len(changed)).reshape(-1, 3)
    tables = texture.octree.tables
    entries = np.arange(texture.octree.level_first[levels], dtype=np.int32)
    spacing = texture.octree.texel * 2.0 ** tables.levels[entries]

    def distances(places):
        return np.sqrt(igl.point_mesh_squared_distance(places, flat, faces)[0])

    middle = distances(spacing[:, None] * (8 * tables.bricks[entries] + 3.5))
    far = middle > (2 + 3.5 * 3**0.5) * spacing
    nodes = np.indices((8, 8, 8)).reshape(3, 512).T
    some = np.flatnonzero(~far & (middle > 2 * spacing))
    places = spacing[some, None, None] * (8 * tables.bricks[entries[some], None] + nodes)
    nearest = distances(places.reshape(-1, 3)).reshape(len(some), 512).min(axis=1)
    far[some] = nearest > 2 * spacing[some]
    return entries[far], len(entries)


def assert_the_rest_is_the_same_bytes(texture, result, old, new, *, share, levels=2):
    far, n = untouched(texture, old, new, levels)
    assert share * n < len(far) < n
    there = keyed(result.texture.octree)
    for entry in far:
        key = key_of(texture.octree, entry)
        assert key in there
        for before, after in zip(texture.layers, result.texture.layers, strict=True):
            mine = brick_bytes(texture, before, entry)
            if mine is not None:
                assert brick_bytes(result.texture, after, there[key]) == mine
        first = result.texture.octree.tables.texel_first[there[key] : there[key] + 2]
        assert (result.confidence[slice(*first)] == 1).all()


def moved_vertex(mesh, vertex, step):
    vertices = np.array(mesh.vertices)
    vertices[vertex] += step
    return Mesh(vertices, np.array(mesh.faces))


def bored(mesh, center, radius):
    """The mesh with a hole from a ball, by manifold3d, and the mesh as that library writes it."""
    data = manifold3d.Mesh64(
        np.array(mesh.vertices), np.array(mesh.faces, np.uint64)
    )  # fmt: skip
    solid = manifold3d.Manifold(data)
    assert solid.status() == manifold3d.Error.NoError
    hole = manifold3d.Manifold.sphere(radius, 32).translate(center)
    return [
        Mesh(out.vert_properties[:, :3].copy(), out.tri_verts.astype(np.int32))
        for out in (solid.to_mesh64(), (solid - hole).to_mesh64())
    ]


def test_on_the_same_mesh_every_byte_is_the_same_however_its_faces_are_listed():
    mesh = icosphere(subdivisions=3)
    texture = painted(mesh, 48)
    shuffled = np.random.default_rng(2).permutation(mesh.n_faces)
    for other in (mesh, Mesh(mesh.vertices, np.roll(mesh.faces[shuffled], 1, axis=1))):
        result = transfer(texture, other)
        there = keyed(result.texture.octree)
        assert keyed(texture.octree).keys() == there.keys()
        assert (result.confidence == 1).all()
        assert result.texture.octree.texel == texture.octree.texel
        for key, entry in keyed(texture.octree).items():
            for before, after in zip(texture.layers, result.texture.layers, strict=True):
                mine = brick_bytes(texture, before, entry)
                assert brick_bytes(result.texture, after, there[key]) == mine
        spots = result.texture.layers[1]
        assert (spots.name, spots.mode, spots.opacity) == ("spots", "multiply", 0.75)


def test_moving_one_vertex_leaves_bricks_two_texels_away_as_they_are():
    mesh = icosphere(subdivisions=3)
    texture = painted(mesh, 64)
    other = moved_vertex(mesh, 300, 0.1 * mesh.vertices[300])
    result = transfer(texture, other)
    assert_the_rest_is_the_same_bytes(texture, result, mesh, other, share=0.8)
    assert 0 < (result.confidence < 1).mean() < 0.05


def test_boring_a_hole_leaves_bricks_two_texels_away_as_they_are():
    ball = icosphere(subdivisions=4)
    mesh, other = bored(ball, [0.0, 0.0, 1.0], 0.2)  # 1 % of the sphere
    texture = painted(mesh, 64)
    result = transfer(texture, other)
    assert_the_rest_is_the_same_bytes(texture, result, mesh, other, share=0.8)
    # The wall of the hole lies 13 texels deep: what is there was filled in, from colours there are
    deep = np.array([[0.0, 0.0, 0.8]])
    assert result.texture.colors(deep, layer=result.texture.layers[0])[0, 3] == 1


@needs_models
@pytest.mark.parametrize(("name", "size"), [("spot.obj", 96), ("armadillo.obj", 80)])
def test_a_vertex_moved_and_a_hole_bored_leave_the_rest_of_a_real_mesh(name, size):
    mesh = read_mesh(model(name))
    welded = mesh.welded
    mesh, other = bored(
        Mesh(np.array(welded.points), np.array(welded.faces)), mesh.triangles[0, 0],
        0.05 * mesh.box.longest_side,
    )  # fmt: skip
    texture = painted(mesh, size)
    result = transfer(texture, other)
    assert_the_rest_is_the_same_bytes(texture, result, mesh, other, share=0.6)
    other = moved_vertex(mesh, mesh.n_vertices // 3, 0.01 * mesh.box.longest_side)
    result = transfer(texture, other)
    assert_the_rest_is_the_same_bytes(texture, result, mesh, other, share=0.9)


def lab(rgb):
    """CIE L*a*b* (D65) of linear sRGB."""
    to_xyz = [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750],
              [0.0193339, 0.1191920, 0.9503041]]  # fmt: skip
    xyz = rgb.astype(float) @ np.array(to_xyz).T / [0.95047, 1.0, 1.08883]
    f = np.where(xyz > 216 / 24389, np.cbrt(xyz), (24389 / 27 * xyz + 16) / 116)
    return np.stack(
        [116 * f[:, 1] - 16, 500 * (f[:, 0] - f[:, 1]), 200 * (f[:, 1] - f[:, 2])], axis=1
    )


def sampled(mesh, n):
    """Points spread evenly over a mesh, and the normals of their faces."""
    rng = np.random.default_rng(4)
    corners = mesh.triangles
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(cross, axis=1)
    faces = rng.choice(len(corners), n, p=area / area.sum())
    weights = rng.dirichlet([1, 1, 1], n)
    return (weights[:, :, None] * corners[faces]).sum(axis=1), cross[faces]


@needs_models
@pytest.mark.parametrize("name", ["spot.obj", "armadillo.obj"])
def test_paint_survives_that_nine_of_ten_faces_are_taken_away(name):
    fast_simplification = pytest.importorskip("fast_simplification")
    mesh = read_mesh(model(name))
    welded = mesh.welded
    mesh = Mesh(np.array(welded.points), np.array(welded.faces))
    texture = VolumeTexture.around(mesh, resolution=200)
    paint = waves(mesh.box.diagonal)
    bake(texture, texture.add_layer(), paint)
    vertices, faces = fast_simplification.simplify(
        np.array(mesh.vertices), np.array(mesh.faces), 0.9
    )
    coarse = Mesh(vertices.astype(np.float64), faces.astype(np.int32))
    assert coarse.n_faces < 0.11 * mesh.n_faces
    points, normals = sampled(coarse, 20_000)
    closest = igl.point_mesh_squared_distance(
        points, np.array(mesh.vertices), np.array(mesh.faces)
    )[2]  # fmt: skip
    truth = lab(paint(closest)[:, :3])
    looked_up = lab(texture.colors(points, project=True)[:, :3])
    assert np.linalg.norm(looked_up - truth, axis=1).mean() <= 1
    carried = transfer(texture, coarse)
    shown = lab(carried.texture.colors(points, normals)[:, :3])
    assert np.linalg.norm(shown - truth, axis=1).mean() <= 1
    assert carried.confidence.mean() > 0.7


def lifted_box(steps, texel):
    """A cube of 32 texels, and the same with its top raised by a number of texels."""
    cube = box_mesh((32 * texel, 32 * texel, 32 * texel))
    vertices = np.array(cube.vertices)
    vertices[vertices[:, 2] > 0, 2] += steps * texel
    return cube, Mesh(vertices, np.array(cube.faces))


@pytest.mark.parametrize("steps", [1.0, 3.0, 6.0])
def test_confidence_falls_with_the_distance_that_the_surface_moved(steps):
    cube, raised = lifted_box(steps, 0.25)
    texture = VolumeTexture.around(cube, texel=0.25)
    texture.add_layer(color=(0.5, 0.5, 0.5))
    result = transfer(texture, raised, reach=8.0)
    entries = np.arange(result.texture.octree.level_first[1], dtype=np.int32)
    points, _ = result.texture.places(entries)
    own = result.confidence[: len(points)]
    top = (points[:, 2] > 4 + (steps - 0.1) * 0.25) & (np.abs(points[:, :2]).max(axis=1) < 3)
    assert top.any()
    assert_allclose(own[top], 1 - steps / 8, atol=1e-6)
    bottom = points[:, 2] < -4
    assert_array_equal(own[bottom], 1)
    least = result.entry_confidence
    assert len(least) == result.texture.octree.n_entries
    assert least.min() == result.confidence.min()


def test_what_is_out_of_reach_gets_the_colour_of_the_nearest_that_is_not():
    cube, raised = lifted_box(20.0, 0.25)
    texture = VolumeTexture.around(cube, texel=0.25)
    layer = texture.add_layer()

    def top_is_red(points):
        colors = np.ones((len(points), 4), np.float32)
        colors[:, 1:3] = (points[:, 2] < 3.5)[:, None]
        return colors

    bake(texture, layer, top_is_red)
    result = transfer(texture, raised, reach=4.0)
    seen = result.texture.colors(np.array([[0.1, 0.1, 9.0], [0.1, 0.1, -4.0]]))
    assert_allclose(seen, [[1, 0, 0, 1], [1, 1, 1, 1]], atol=SRGB)
    assert result.confidence.min() == 0


def test_the_input_is_not_changed_and_levels_that_were_not_stored_stay_so():
    mesh = icosphere(subdivisions=3)
    texture = VolumeTexture.around(mesh, resolution=64)
    layer = texture.add_layer()
    bake(texture, layer, waves(2.0), level=2)
    slots, pool = layer.slots.copy(), texture.pool.arrays["base"].copy()
    result = transfer(texture, moved_vertex(mesh, 300, 0.1 * mesh.vertices[300]))
    assert_array_equal(layer.slots, slots)
    assert_array_equal(texture.pool.arrays["base"], pool)
    stored = result.texture.layers[0].stored
    assert result.texture.octree.tables.levels[stored].min() == 2


def test_a_procedural_layer_goes_on_by_its_function():
    mesh = icosphere(subdivisions=3)
    texture = VolumeTexture.around(mesh, resolution=48)
    add_procedural(texture, "waves", waves(2.0))
    other = moved_vertex(mesh, 300, 0.4 * mesh.vertices[300])
    tip = other.vertices[300:301]
    seen = transfer(texture, other).texture.colors(tip)
    assert_allclose(seen, waves(2.0)(tip), atol=0.1)


def test_paint_on_a_procedural_layer_is_carried_over_and_the_function_fills_the_rest():
    mesh = icosphere(subdivisions=3)
    texture = VolumeTexture.around(mesh, resolution=48)
    layer = add_procedural(texture, "waves", waves(2.0))
    opposite = int(np.argmin(mesh.vertices @ mesh.vertices[300]))
    tip, still = mesh.vertices[300:301], mesh.vertices[[opposite]]
    red = np.array([1.0, 0.0, 0.0, 1.0], np.float32)
    for place in (tip, still):
        around = place + texture.octree.texel * 6 * np.indices((3, 3, 3)).reshape(3, -1).T
        around -= 6 * texture.octree.texel
        bricks = np.floor(around / (8 * texture.octree.spacing(0))).astype(np.int64)
        own = np.unique(texture.octree.find(0, bricks, np.repeat(place, 27, axis=0)))
        own = own[own >= 0].astype(np.int32)
        fill(texture, layer, own)
        texture.put(layer, own, np.tile(red, (len(texture.places(own)[0]), 1)))
    other = moved_vertex(mesh, 300, 0.05 * mesh.vertices[300])
    new = transfer(texture, other).texture
    assert_allclose(new.colors(other.vertices[[300, opposite]]), [red, red], atol=0.05)
    elsewhere = np.random.default_rng(0).normal(size=(200, 3))
    elsewhere /= np.linalg.norm(elsewhere, axis=1, keepdims=True)
    far = (np.linalg.norm(elsewhere - tip, axis=1) > 0.7) & (
        np.linalg.norm(elsewhere - still, axis=1) > 0.7
    )
    expected = waves(2.0)(elsewhere[far])
    assert_allclose(new.colors(elsewhere[far]), expected, atol=0.1)
    held = [layer.slots[layer.slots >= 0] for layer in new.layers]
    assert new.pool.n_used == len(np.concatenate(held))


def test_a_mesh_of_another_size_gets_other_levels_and_keeps_its_paint():
    cube, _ = lifted_box(0.0, 0.25)
    texture = painted(cube, 32)
    larger = Mesh(
        np.concatenate([cube.vertices, cube.vertices * 0.1 + 30]),
        np.concatenate([cube.faces, cube.faces + 8]).astype(np.int32),
    )
    result = transfer(texture, larger)
    assert result.texture.octree.n_levels > texture.octree.n_levels
    points = np.random.default_rng(1).uniform(-4, 4, (500, 3))
    points[:, 2] = 4.0
    layer = texture.layers[0]
    assert_array_equal(
        result.texture.colors(points, layer=result.texture.layers[0]),
        texture.colors(points, layer=layer),
    )
    back = transfer(result.texture, cube)
    assert_array_equal(
        back.texture.colors(points, layer=back.texture.layers[0]),
        texture.colors(points, layer=layer),
    )


def test_faces_are_the_same_if_their_corners_are_whichever_is_listed_first():
    mesh = icosphere(subdivisions=1)
    rolled = Mesh(mesh.vertices, np.roll(mesh.faces, 1, axis=1))
    assert is_in(rolled, mesh).all()
    flipped = Mesh(mesh.vertices, mesh.faces[:, ::-1].copy())
    assert not is_in(flipped, mesh).any()
    moved = moved_vertex(mesh, 3, np.array([0.0, 0, 1e-16]) + 1e-12)
    assert_array_equal(is_in(moved, mesh), ~(mesh.faces == 3).any(axis=1))
    negative = Mesh(np.where(mesh.vertices == 0, -0.0, mesh.vertices), np.array(mesh.faces))
    assert is_in(negative, mesh).all()


def test_what_makes_no_sense_is_said():
    mesh = icosphere(subdivisions=1)
    texture = VolumeTexture.around(mesh, resolution=8)
    with pytest.raises(TextureError, match="reach of -1 texels"):
        transfer(texture, mesh, reach=-1)
    texture.surface = None
    with pytest.raises(TextureError, match="does not know its surface"):
        transfer(texture, mesh)
