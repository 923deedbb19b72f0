"""The commands of meshsdf on ``.exr`` and ``.zarr`` volumes."""

import json

import pytest

from meshsdf.grid import Grid
from meshsdf.io import probe_exr, read_mesh, read_volume, stored_bytes
from meshsdf.mesh.measures import is_watertight

from .examples import ball


def test_the_options_for_exr_arrive_in_the_file(cli, tmp_path):
    mesh, out = ball(tmp_path / "b.ply"), tmp_path / "a.exr"
    options = ["--resolution", "12", "--columns", "5", "--up", "y", "--remap", "0.5", "--half"]
    outcome = cli("convert", mesh, out, "--json", *options)
    assert outcome.code == 0, outcome.err
    facts = probe_exr(out)
    assert (facts["columns"], facts["up"], facts["remap"]) == (5, "y", 0.5)
    assert (facts["layout"], facts["dtype"]) == ("atlas", "float16")
    assert any("clipped" in warning for warning in outcome.json["warnings"])
    told = cli("info", out, "--json").json
    assert {key: told[key] for key in facts} == facts
    options = ["--layout", "parts", "--remap", "range", "--dense", "--resolution", "12"]
    assert cli("convert", mesh, out, "--force", *options).code == 0
    facts = probe_exr(out)
    assert (facts["layout"], facts["columns"], facts["up"]) == ("parts", None, "z")
    assert facts["remap"] == max(map(abs, facts["value_range"]))


def test_a_mesh_comes_back_from_either(cli, tmp_path):
    mesh = ball(tmp_path / "b.ply")
    for name, options in [("a.exr", ["--up", "y"]), ("b.exr", []), ("a.zarr", []), ("n.npz", [])]:
        assert cli("convert", mesh, tmp_path / name, "--resolution", "12", *options).code == 0
        assert cli("mesh", tmp_path / name, tmp_path / f"{name}.ply").code == 0
        assert is_watertight(read_mesh(tmp_path / f"{name}.ply"))
    surfaces = [(tmp_path / f"{name}.ply").read_bytes() for name in ("a.zarr", "n.npz")]
    assert surfaces[0] == surfaces[1]
    assert isinstance(read_volume(tmp_path / "a.exr"), Grid)


def test_the_size_of_a_folder_is_that_of_its_files(cli, tmp_path):
    mesh, out = ball(tmp_path / "b.ply"), tmp_path / "a.zarr"
    facts = cli("convert", mesh, out, "--resolution", "12", "--json").json
    files = [file for file in out.rglob("*") if file.is_file()]
    assert facts["bytes"] == stored_bytes(out) == sum(len(file.read_bytes()) for file in files)
    assert cli("info", out, "--json").json["bytes"] == facts["bytes"]
    again = cli("convert", mesh, out, "--resolution", "12")
    assert (again.code, "the output exists" in again.err) == (2, True)
    assert cli("convert", mesh, out, "--resolution", "12", "--force", "--hermite").code == 0
    assert read_volume(out).hermite is not None


@pytest.mark.parametrize(
    ("out", "options", "words"),
    [
        ("a.npz", ["--up", "y"], "--up is for .exr files"),
        ("a.vdb", ["--remap", "range"], "--remap is for .exr files"),
        ("a.exr", ["--layout", "parts", "--columns", "2"], "--columns is for --layout atlas"),
        ("a.exr", ["--columns", "0"], "0 is not in the range"),
        ("a.exr", ["--remap", "-1"], "-1 is not above 0"),
        ("a.exr", ["--remap", "far"], "'far' is not a number"),
        ("a.exr", ["--up", "x"], "'x' is not one of 'y', 'z'"),
    ],
)
def test_options_that_do_not_suit_are_misuse(cli, tmp_path, out, options, words):
    outcome = cli("convert", ball(tmp_path / "b.ply"), tmp_path / out, *options)
    assert outcome.code == 2
    assert words in outcome.err
    assert not (tmp_path / out).exists()


def test_a_strangers_json_stops_the_command_before_any_work(cli, tmp_path):
    (tmp_path / "a.exr.json").write_text(json.dumps({"mine": 1}))
    mesh = ball(tmp_path / "b.ply")
    for options in ([], ["--force"]):
        outcome = cli("convert", mesh, tmp_path / "a.exr", "--resolution", "1e9", *options)
        assert outcome.code == 2
        assert "a.exr.json" in outcome.err
