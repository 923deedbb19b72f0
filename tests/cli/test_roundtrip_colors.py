"""meshsdf roundtrip --carry-texture: what became of the colours."""

import json
from dataclasses import replace

import numpy as np
import pytest

from meshsdf.io import write_mesh
from meshsdf.mesh.primitives import icosphere

from .examples import ball, embedded


@pytest.fixture
def colored(tmp_path):
    """A sphere whose colours are its positions."""
    mesh = icosphere(subdivisions=2)
    rgba = np.ones((mesh.n_vertices, 4), np.float32)
    rgba[:, :3] = (mesh.vertices + 1) / 2
    write_mesh(tmp_path / "colored.ply", replace(mesh, vertex_colors=rgba))
    return tmp_path / "colored.ply"


def roundtrip(cli, mesh, *options):
    return cli("roundtrip", mesh, "--resolution", "8,16", *options)


def without_seconds(told: dict) -> dict:
    rows = [row | {"seconds": None} for row in told["rows"]]
    return told | {"rows": rows, "seconds": None}


def test_colours_are_told_in_words_and_json(cli, colored):
    outcome = roundtrip(cli, colored, "--carry-texture")
    assert outcome.code == 0
    assert "colours at 16: ΔE " in outcome.out
    assert "apart from the blur of a voxel: ΔE " in outcome.out
    told = roundtrip(cli, colored, "--carry-texture", "--json").json
    for row in told["rows"]:
        found = row["colors"]
        assert found["texel"] == row["voxel_size"]
        for kind in ("sharp", "filtered"):
            assert 0 < found[kind]["mean"] < found[kind]["percentile_95"] < found[kind]["largest"]
            assert np.linalg.norm(found[kind]["where"]) == pytest.approx(1, abs=0.1)
    assert told["rows"][1]["colors"]["sharp"]["mean"] < told["rows"][0]["colors"]["sharp"]["mean"]


def test_nothing_else_changes(cli, colored):
    plain = without_seconds(roundtrip(cli, colored, "--json").json)
    asked = without_seconds(roundtrip(cli, colored, "--carry-texture", "--json").json)
    assert all("colors" not in row for row in plain["rows"])
    for row in asked["rows"]:
        del row["colors"]
    assert asked == plain
    assert "colours" not in roundtrip(cli, colored).out


def test_reports_tell_the_same_and_the_command_that_gives_them(cli, colored, tmp_path):
    names = [tmp_path / f"a.{suffix}" for suffix in ("html", "json", "md")]
    asked = [word for name in names for word in ("--report", name)]
    outcome = cli("roundtrip", colored, "--resolution", "8", "--carry-texture", "--json", *asked)
    data = json.loads(names[1].read_text())
    assert embedded(names[0]) == data
    assert data["rows"][0]["colors"] == outcome.json["rows"][0]["colors"]
    assert data["command"].endswith(" --carry-texture")
    assert 'id="colors"' in names[0].read_text()
    assert "## Colours" in names[2].read_text()


def test_a_mesh_without_colours_is_refused_before_any_work(cli, tmp_path, monkeypatch):
    def work(*_, **__):
        raise AssertionError("the mesh was checked first")

    monkeypatch.setattr("meshsdf.mesh.two_set.check", work)
    outcome = roundtrip(cli, ball(tmp_path / "plain.ply"), "--carry-texture")
    assert outcome.code == 3
    assert "the mesh has no colours: neither vertex colours nor a material" in outcome.err
    assert "plain.ply, --carry-texture" in outcome.err
    assert outcome.out == ""
