"""meshsdf texture: made from meshes, formulas and images; out to meshes, pictures and volumes."""

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from meshsdf.io import read_mesh, write_mesh
from meshsdf.io.pictures import read_picture
from meshsdf.io.vdb import read_vdb_grids
from meshsdf.mesh import Mesh
from meshsdf.mesh.primitives import box_mesh, icosphere
from meshsdf.srgb import srgb_rgba
from meshsdf.texture.atlas import atlas_for, textured, vertex_colored
from meshsdf.texture.brush import Brush
from meshsdf.texture.content import digest
from meshsdf.texture.journal import Project
from meshsdf.texture.mip import bake
from meshsdf.texture.operations import Operation, perform
from meshsdf.texture.procedural import procedural
from meshsdf.texture.stroke_record import StrokeRecord
from meshsdf.texture.volume_texture import VolumeTexture

from .examples import ball

KEYS = """input output bytes kind texel base n_levels n_texels n_bricks n_tiles memory last_seq
channels layers seconds warnings"""


@pytest.fixture
def mesh(tmp_path):
    return ball(tmp_path / "ball.ply", radius=2.0, subdivisions=3)


@pytest.fixture
def checkered(tmp_path):
    """A box with an image of its own, black and white in space."""
    box = box_mesh()
    texture = VolumeTexture.around(box, resolution=64)
    bake(texture, texture.add_layer(), procedural("checker", scale=0.25))
    path = tmp_path / "checkered.obj"
    write_mesh(path, textured(texture, atlas_for(box, 512, "squares")))
    return path


def test_a_solid_texture_is_made_and_told(cli, mesh, tmp_path):
    out = tmp_path / "wood.mtex"
    options = ["--kind", "wood", "--parameter", "ring_width=0.2", "--resolution", 48]
    outcome = cli("texture", "procedural", mesh, out, *options, "--json")
    assert outcome.code == 0
    facts = outcome.json
    assert next(iter(facts.items())) == ("schema", "meshsdf.texture-procedural/1")
    assert set(KEYS.split()) <= set(facts)
    assert facts["texel"] == pytest.approx(4 / 48)
    assert [layer["name"] for layer in facts["layers"]] == ["wood"]
    assert facts["last_seq"] == 2
    told = cli("texture", "info", out, "--json").json
    assert told["n_texels"] == facts["n_texels"]
    assert "2 operations" in cli("texture", "info", out).out
    assert cli("info", out).out == cli("texture", "info", out).out
    again = cli("texture", "procedural", mesh, out, *options)
    assert again.code == 2
    assert "exists" in again.err
    assert not [path for path in tmp_path.iterdir() if path.suffix not in (".mtex", ".ply")]


def test_a_texture_that_sees_the_shape_is_made_and_made_again_from_the_journal(cli, tmp_path):
    mesh, out = tmp_path / "box.ply", tmp_path / "worn.mtex"
    write_mesh(mesh, box_mesh((2.0, 2.0, 2.0)))
    options = ["--kind", "edge-wear", "--parameter", "bare=#ffffff", "--parameter", "paint=#000000"]
    outcome = cli("texture", "procedural", mesh, out, *options, "--resolution", 24, "--json")
    assert outcome.code == 0
    assert [layer["name"] for layer in outcome.json["layers"]] == ["edge-wear"]
    with Project.open(out) as project:
        texture = project.texture
        rows = [[1.0, 0.0, 0.0], [1.0, 1.0, 0.0]]  # the middle of a side, and of an edge
        middle, edge = texture.colors(np.array(rows), np.array([[1.0, 0, 0], [1.0, 1, 0]]))
        assert middle[0] < 0.1 < 0.3 < edge[0]
        before = project.digest()
        project.undo()
        project.redo()
        assert project.digest() == before
        again = VolumeTexture.around(texture.surface, resolution=24)
        again.add_layer("edge-wear")
        lengths = {"reach": "0.04", "bare": "#ffffff", "paint": "#000000"}
        kind = {"layer": 0, "texture_kind": "edge-wear", "level": "auto"}
        perform(again, Operation("bake", kind | lengths))
        assert digest(again) == before


def test_auto_keeps_fewer_bricks_than_all_detail_and_says_what_is_no_level(cli, mesh, tmp_path):
    found = {}
    for level in ("auto", "0", "2"):
        options = ["--kind", "clouds", "--parameter", "scale=50", "--level", level]
        out = tmp_path / f"{level}.mtex"
        outcome = cli("texture", "procedural", mesh, out, *options, "--resolution", 96, "--json")
        found[level] = outcome.json["n_bricks"]
    assert found["auto"] < 0.6 * found["0"]
    assert found["2"] < 0.2 * found["0"]
    outcome = cli("texture", "procedural", mesh, tmp_path / "x.mtex", "--level", "fine")
    assert outcome.code == 2
    assert "use auto, or 0 for the finest texels" in " ".join(outcome.err.split())


def test_layers_are_added_to_what_exists(cli, mesh, tmp_path):
    out = tmp_path / "two.mtex"
    assert (
        cli("texture", "procedural", mesh, out, "--kind", "checker", "--resolution", 32).code == 0
    )
    more = ["--kind", "clouds", "--add", "--layer", "sky"]
    facts = cli("texture", "procedural", mesh, out, *more, "--json").json
    assert [layer["name"] for layer in facts["layers"]] == ["checker", "sky"]
    assert cli("texture", "procedural", mesh, out, *more, "--resolution", 64).code == 2


def test_a_meshs_own_image_goes_through_space_to_other_files(cli, checkered, tmp_path):
    out = tmp_path / "box.mtex"
    assert cli("texture", "bake", checkered, out, "--resolution", 96).code == 0
    other = tmp_path / "other.glb"
    facts = cli("texture", "apply", out, checkered, other, "--size", 512, "--json").json
    assert (facts["colors"], facts["atlas"]) == ("image", "own")
    before = read_mesh(checkered).materials[0].image[..., :3].astype(float)
    after = read_mesh(other).materials[0].image[..., :3].astype(float)
    assert np.abs(before - after).mean() < 6
    dense = tmp_path / "dense.ply"
    write_mesh(tmp_path / "plain.ply", read_mesh(checkered))
    facts = cli("texture", "apply", out, tmp_path / "plain.ply", dense, "--json").json
    assert facts["colors"] == "vertices"
    assert read_mesh(dense).vertex_colors is not None


def test_everything_that_can_be_exported_is(cli, checkered, tmp_path):
    out = tmp_path / "box.mtex"
    assert cli("texture", "bake", checkered, out, "--resolution", 64).code == 0
    names = ["a.exr", "b.png", "c.ply", "d.vdb", "e.glb", "f.obj"]
    to = [text for name in names for text in ("--to", tmp_path / name)]
    options = ["--atlas", "squares", "--size", 256]
    facts = cli("texture", "export", out, *to, *options, "--json").json
    assert [one["colors"] for one in facts["written"]] == [
        "image", "image", "vertices", "voxels", "image", "image",
    ]  # fmt: skip
    linear, encoded = read_picture(tmp_path / "a.exr"), read_picture(tmp_path / "b.png")
    same = np.rint(255 * srgb_rgba(linear.reshape(-1, 4).astype(np.float32)))[:, :3]
    assert np.abs(same - encoded.reshape(-1, encoded.shape[2])[:, :3]).max() <= 1
    assert read_mesh(tmp_path / "a-atlas.obj").uv is not None
    (colors,) = read_vdb_grids(tmp_path / "d.vdb")
    assert colors.name == "Cd"
    assert (tmp_path / "f.mtl").exists()
    assert cli("texture", "export", out, *to, *options).code == 2


def test_pictures_of_one_stem_share_their_mesh_and_name_it(cli, checkered, tmp_path):
    out = tmp_path / "box.mtex"
    assert cli("texture", "bake", checkered, out, "--resolution", 32).code == 0
    export = ["texture", "export", out, "--atlas", "squares", "--size", 128]
    outcome = cli(*export, "--to", tmp_path / "a.exr", "--to", tmp_path / "a.png")
    assert outcome.code == 0
    assert outcome.out.count("on the mesh a-atlas.obj") == 2
    assert read_mesh(tmp_path / "a-atlas.obj").uv is not None
    assert not list(tmp_path.glob("*.mtl"))[1:]  # that of the mesh it all began with
    for names, words in (
        (["a.jpg"], "a-atlas.obj, which goes with a.jpg, exists"),
        (["b.png", "b.png"], "b.png would be written twice"),
        (["b.png", "b-atlas.obj"], "b-atlas.obj would be written twice"),
        (["c.ply", "c-c.png", "c.obj"], "c-c.png would be written twice"),
    ):
        before = sorted(tmp_path.iterdir())
        outcome = cli(*export, *(text for name in names for text in ("--to", tmp_path / name)))
        assert outcome.code == 2
        assert words in outcome.err
        assert sorted(tmp_path.iterdir()) == before


def test_an_image_is_projected(cli, mesh, tmp_path):
    picture = np.zeros((64, 64, 3), np.uint8)
    picture[:, :32], picture[:, 32:] = [255, 0, 0], [0, 0, 255]
    Image.fromarray(picture).save(tmp_path / "halves.png")
    out = tmp_path / "front.mtex"
    camera = ["--by", "camera", "--eye", "0,0,9", "--target", "0,0,0", "--field-of-view", 60]
    command = ["texture", "project", mesh, tmp_path / "halves.png", out, "--resolution", 64]
    assert cli(*command, *camera).code == 0
    with Project.open(out) as project:
        places = np.array([[-0.6, 0, 1.9], [0.6, 0, 1.9], [0, 0, -2.0]])
        shown = project.texture.colors(places, places)
    assert shown[:2].tolist() == [[1, 0, 0, 1], [0, 0, 1, 1]]
    assert shown[2, 3] == 0
    assert cli(*command, "--by", "camera", "--force").code == 2
    for by in ("planar", "triplanar", "cylindrical", "spherical", "decal"):
        assert cli(*command, "--by", by, "--force").code == 0, by
        place = np.array([[0.3, 1.95, 0.2]])
        with Project.open(out) as project:
            assert project.texture.colors(place, place)[0, 3] == 1, by


def test_a_picture_shows_the_texture(cli, mesh, tmp_path):
    out = tmp_path / "red.ply"
    red = np.tile(np.array([1, 0, 0, 1], np.float32), (icosphere(subdivisions=3).n_vertices, 1))
    write_mesh(out, replace(read_mesh(mesh), vertex_colors=red))
    assert cli("texture", "bake", out, tmp_path / "red.mtex", "--resolution", 32).code == 0
    for number, words in enumerate(([tmp_path / "red.mtex"], [mesh])):
        options = ["--texture", tmp_path / "red.mtex"] if number else []
        picture = tmp_path / f"{number}.png"
        assert cli("render", *words, picture, "--width", 64, *options).code == 0
        middle = np.asarray(Image.open(picture))[24, 32].astype(int)
        assert middle[0] > 120
        assert middle[1] < 90
    first, second = (np.asarray(Image.open(tmp_path / f"{k}.png")).astype(int) for k in (0, 1))
    assert np.abs(first - second).max() <= 3
    assert cli("render", mesh, tmp_path / "x.png", "--texture", mesh, "--error-of", mesh).code == 2


def test_a_mesh_that_the_texture_does_not_fit_is_refused_or_told(cli, mesh, tmp_path):
    made = tmp_path / "red.mtex"
    assert cli("texture", "procedural", mesh, made, "--resolution", 32).code == 0
    other, out = ball(tmp_path / "other.ply", radius=9.0), tmp_path / "out.ply"
    for words in (["texture", "apply", made, other, out], ["render", other, tmp_path / "x.png"]):
        options = ["--texture", made] if words[0] == "render" else []
        outcome = cli(*words, *options, "--force")
        assert outcome.code == 3
        assert "100 % of the mesh's area lies farther than 1 (8 texels)" in outcome.err
        assert f"where: mesh {other}, texture {made}" in outcome.err
        assert "made around another mesh" in outcome.err
    assert not out.exists()
    vertices = read_mesh(mesh).vertices
    partly = vertices * np.where(vertices[:, 1:2] > 1.0, [1.0, 2.0, 1.0], 1.0)
    write_mesh(other, Mesh(partly, read_mesh(mesh).faces), force=True)
    outcome = cli("texture", "apply", made, other, out, "--json")
    assert outcome.code == 0
    (warning,) = outcome.json["warnings"]
    assert "as far as 1.9" in warning
    assert "it gets no colour there" in warning
    assert cli("texture", "apply", made, mesh, out, "--json", "--force").json["warnings"] == []


def test_a_stroke_of_height_moves_the_exported_mesh(cli, mesh, tmp_path):
    out, moved = tmp_path / "grown.mtex", tmp_path / "grown.ply"
    brush = Brush(radius=1.0, hardness=0.5, channel="height", value=3.0)
    top = np.array([[0.0, 0.0, 2.0]])
    with Project.create(out, read_mesh(mesh), resolution=64) as project:
        project.apply(Operation("add-layer", {"name": "heights"}))
        record = StrokeRecord(brush, top, top / 2, np.ones(1), project.texture.layers[-1].number)
        project.apply(Operation("stroke", record.to_params()))
        texel = project.texture.octree.texel
    options = ["--to", moved, "--displaced", "--resolution", 48]
    assert cli("texture", "export", out, *options).code == 0
    vertices = read_mesh(moved).vertices
    highest = vertices[:, 2].max()
    assert highest == pytest.approx(2 + 3 * texel, abs=0.02)
    below = np.linalg.norm(vertices[vertices[:, 2] < 0], axis=1)
    assert np.abs(below - 2).max() < 0.05


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (["procedural", "MESH", "x.mtex", "--kind", "wod"], 3, "wood"),
        (["procedural", "MESH", "x.mtex", "--parameter", "ring=1"], 3, "ring_width"),
        (
            ["procedural", "MESH", "x.mtex", "--kind", "thickness", "--parameter", "thin=1"],
            3,
            "thin",
        ),
        (["procedural", "MESH", "x.txt"], 2, ".mtex"),
        (["procedural", "MESH", "x.mtex", "--resolution", "64", "--texel", "1"], 2, "exclude"),
        (["procedural", "MESH", "x.mtex", "--resolution", "1e9"], 3, "ask for at most"),
        (["bake", "none.obj", "x.mtex"], 3, "no such file"),
        (["info", "none.mtex"], 3, "fix"),
        (["info", "MESH"], 3, "no project"),
        (["apply", "MESH", "MESH", "x.glb"], 3, "no project"),
        (["project", "MESH", "MESH", "x.mtex"], 3, "not a readable image"),
        (["export", "none.mtex", "--to", "x.stl1"], 2, "suffix"),
        (["paint", "x"], 2, "No such command"),
    ],
)
def test_what_cannot_be_done_is_told(cli, mesh, tmp_path, words, code, said):
    words = [mesh if word == "MESH" else word for word in words]
    words = [tmp_path / word if str(word).startswith("x.") else word for word in words]
    outcome = cli("texture", *words)
    assert (outcome.code, said in outcome.err) == (code, True), outcome.err
    assert not (tmp_path / "x.mtex").exists()


def test_kinds_and_parameters_are_listed(cli):
    outcome = cli("texture", "procedural", "--list")
    assert outcome.code == 0
    assert "wood_grain" in outcome.out
    assert "ring_width=" in outcome.out


def test_vertex_colours_lie_where_the_texture_says():
    mesh = icosphere(subdivisions=3)
    texture = VolumeTexture.around(mesh, resolution=64)
    bake(texture, texture.add_layer(), procedural("stripes", scale=1.0))
    colored = vertex_colored(texture, mesh)
    assert np.ptp(colored.vertex_colors[:, 0]) > 0.3


def test_the_list_tells_lengths_as_they_are_without_a_parameter(cli):
    lines = cli("texture", "procedural", "--list").out.splitlines()
    assert "edge-wear" in lines
    (reach,) = (line for line in lines if line.startswith("  reach=0.02"))
    assert reach.endswith("if not given, 0.02 of the mesh's longest side")
    scales = [line for line in lines if line.startswith("  scale=")]
    assert scales
    assert all(line.endswith("if not given, 1 of the mesh's longest side") for line in scales)


def test_every_suffix_that_a_command_takes_is_named(cli, mesh, tmp_path):
    made = tmp_path / "a.mtex"
    made.write_bytes(b"")
    outcome = cli("texture", "export", made, "--to", tmp_path / "x.gif")
    assert outcome.code == 2
    assert ".obj, .ply, .stl, .off, .glb, .vdb, .png, .jpg, .jpeg, .exr" in outcome.err
    assert "did you mean" not in outcome.err
    (tmp_path / "x.png").write_bytes(b"")
    outcome = cli("info", tmp_path / "x.png")
    assert outcome.code == 3
    assert ".obj" in outcome.err
    assert ".mtex" in outcome.err
    for name in ("x.foo", "x.png", "x.fbx"):
        assert "did you mean" not in cli("convert", mesh, tmp_path / name).err
    folder = cli("convert", tmp_path, tmp_path / "out.vdb")
    assert folder.code == 3
    assert "this is a folder, not a file" in folder.err
