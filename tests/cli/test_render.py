"""meshsdf render: pictures of meshes and volumes, and of how far they are from others."""

import numpy as np
import pytest
from PIL import Image

from meshsdf.cli.render import VIEWS as OFFERED
from meshsdf.io import write_mesh
from meshsdf.mesh.primitives import icosphere
from meshsdf.ray import VIEWS

from .examples import ball


def pixels_of(path):
    with Image.open(path) as image:
        return np.asarray(image).astype(int)


@pytest.fixture
def mesh(tmp_path):
    return ball(tmp_path / "ball.ply", subdivisions=3)


SMALL = ("--width", "96")


def test_a_picture_is_written_and_its_facts_told(cli, mesh, tmp_path):
    out = tmp_path / "ball.png"
    outcome = cli("render", mesh, out, *SMALL, "--json")
    assert outcome.code == 0
    facts = outcome.json
    assert next(iter(facts.items())) == ("schema", "meshsdf.render/1")
    assert (facts["output"], facts["width"], facts["height"]) == (str(out), 96, 72)
    assert set(facts["seconds"]) == {"load", "render", "write", "total"}
    assert facts["seconds"]["load"] + facts["seconds"]["render"] > 0.5 * facts["seconds"]["total"]
    pixels = pixels_of(out)
    assert pixels.shape == (72, 96, 3)
    assert (pixels[0, 0] == 255).all()
    assert pixels[36, 48].max() < 250
    outcome = cli("render", mesh, out, *SMALL, "--height", 40, "--force")
    assert outcome.out.startswith(f"{out}: 96 x 40 pixels, ")
    assert pixels_of(out).shape == (40, 96, 3)


def test_backgrounds(cli, mesh, tmp_path):
    corner = {"white": [255] * 3, "black": [0] * 3, "transparent": [0] * 4, "#102030": [16, 32, 48]}
    for name, color in corner.items():
        out = tmp_path / f"{name.strip('#')}.png"
        assert cli("render", mesh, out, *SMALL, "--background", name).code == 0
        assert pixels_of(out)[0, 0].tolist() == color
    assert cli("render", mesh, tmp_path / "a.exr", *SMALL).code == 0
    assert (tmp_path / "a.exr").read_bytes()[:4] == b"\x76\x2f\x31\x01"
    out = tmp_path / "a.jpg"
    assert cli("render", mesh, out, *SMALL, "--background", "transparent").code == 0
    assert (pixels_of(out)[0, 0] >= 250).all()


def test_the_names_of_views_are_those_of_the_library():
    assert tuple(VIEWS) == OFFERED


def test_views_by_name_and_by_angles(cli, tmp_path):
    path = tmp_path / "long.obj"
    stretched = icosphere(subdivisions=2)
    write_mesh(path, type(stretched)(stretched.vertices * [1, 2, 4], stretched.faces))
    shares = {}
    for number, options in enumerate(
        (
            ("--view", "front"),
            ("--view", "0,0"),
            ("--view", "right"),
            ("--view", "-90,0"),
            ("--view", "front", "--up", "z"),
        )
    ):
        out = tmp_path / f"{number}.png"
        assert cli("render", path, out, *SMALL, *options).code == 0
        covered = pixels_of(out).min(axis=2) < 255
        shares[options] = covered.any(axis=0).sum() / covered.any(axis=1).sum()
    assert list(shares.values()) == pytest.approx([1 / 2, 1 / 2, 2, 2, 1 / 4], rel=0.12)
    assert pixels_of(tmp_path / "0.png").tolist() == pixels_of(tmp_path / "1.png").tolist()


def test_the_distance_to_another_mesh_is_painted_and_told(cli, mesh, tmp_path):
    other = ball(tmp_path / "other.ply", radius=1.25, subdivisions=3)
    out = tmp_path / "error.png"
    outcome = cli("render", mesh, out, "--width", 200, "--error-of", other, "--json")
    facts = outcome.json
    assert pixels_of(out).shape == (150, 200, 3)
    # Both lie inside their spheres by at most 0.3 r / 4**3
    assert 0.25 - 0.006 <= facts["mean_seen"] <= facts["max_seen"] <= 0.25 + 0.005
    assert facts["scale"] == facts["max_seen"]
    assert "no bound" in facts["seen"]
    outcome = cli("render", mesh, out, "--error-of", other, "--scale", 0.5, *SMALL, "--force")
    assert "in the mean" in outcome.out
    assert "no bound" in outcome.out
    outcome = cli("render", mesh, out, "--scale", 0.5, *SMALL, "--force")
    assert outcome.code == 2
    assert "--scale is for --error-of" in outcome.err


def test_a_volume_is_drawn_by_its_surface(cli, mesh, tmp_path):
    volume, out = tmp_path / "ball.npz", tmp_path / "ball.png"
    assert cli("convert", mesh, volume, "--resolution", 16).code == 0
    assert cli("render", volume, out, *SMALL).code == 0
    assert cli("render", mesh, tmp_path / "mesh.png", *SMALL).code == 0
    difference = np.abs(pixels_of(out) - pixels_of(tmp_path / "mesh.png"))
    assert difference.mean() < 5


def test_smooth_and_flat_differ(cli, mesh, tmp_path):
    for name in ("smooth", "flat"):
        assert cli("render", mesh, tmp_path / f"{name}.png", *SMALL, f"--{name}").code == 0
    smooth, flat = (pixels_of(tmp_path / f"{name}.png") for name in ("smooth", "flat"))
    assert 0.1 < np.abs(smooth - flat).mean() < 5


def test_the_output_is_judged_before_the_input_is_loaded(cli, mesh, tmp_path, monkeypatch):
    def load(*_, **__):
        raise AssertionError("the mesh was loaded first")

    monkeypatch.setattr("meshsdf.io.meshes.read_mesh", load)
    out = tmp_path / "a.png"
    out.write_text("precious")
    outcome = cli("render", mesh, out)
    assert (outcome.code, "the output exists" in outcome.err) == (2, True)
    assert out.read_text() == "precious"
    for name, words in (
        ("no/a.png", "does not exist"),
        ("a.bmp", "a picture with suffix '.bmp' cannot be written"),
        ("a", "the name has no suffix"),
    ):
        outcome = cli("render", mesh, tmp_path / name)
        assert outcome.code == 2
        assert words in outcome.err


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--view", "above"), "'above' is none of three-quarter, front"),
        (("--view", "1,2,3"), "nor two angles such as 30,20"),
        (("--view", "10,91"), "elevation 91 is not from -90 to 90"),
        (("--view", "x,1"), "'x' is not a number"),
        (("--background", "red"), "write white, black, transparent or #rrggbb"),
        (("--background", "#12345"), "'#12345' is no colour"),
        (("--width", "0"), "0 is not in the range"),
        (("--height", "-3"), "-3 is not in the range"),
        (("--scale", "0"), "0 is not above 0"),
        (("--up", "x"), "'y', 'z'"),
    ],
)
def test_misuse_says_what_would_be_right(cli, mesh, tmp_path, options, words):
    outcome = cli("render", mesh, tmp_path / "a.png", *options)
    assert outcome.code == 2
    assert words in " ".join(outcome.err.split())
    assert not (tmp_path / "a.png").exists()
