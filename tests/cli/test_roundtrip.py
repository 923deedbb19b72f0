"""meshsdf roundtrip --report: pages, texts and JSON beside the table."""

import json

import pytest

from meshsdf.io import write_mesh
from meshsdf.mesh import Mesh
from meshsdf.mesh.primitives import box_mesh

from ..report.trips import open_ball
from .examples import ball, embedded


def roundtrip(cli, mesh, *options):
    return cli("roundtrip", mesh, "--resolution", "6,8", *options)


@pytest.fixture
def mesh(tmp_path):
    return ball(tmp_path / "ball.ply", subdivisions=1)


def test_one_run_writes_every_format_with_the_same_numbers(cli, mesh, tmp_path):
    names = [tmp_path / f"out.{suffix}" for suffix in ("html", "json", "md")]
    asked = [word for name in names for word in ("--report", name)]
    outcome = roundtrip(cli, mesh, *asked)
    assert outcome.code == 0
    assert "observed order" in outcome.out
    assert outcome.out.splitlines()[-1] == ", ".join(map(str, names))
    data = json.loads(names[1].read_text())
    assert embedded(names[0]) == data
    assert [row["resolution"] for row in data["rows"]] == [6, 8]
    assert data["input"]["name"] == "ball.ply"
    assert data["command"] == (
        f"meshsdf roundtrip {mesh} --resolution 6,8 --method marching-cubes --half-width 3 "
        "--sign auto"
    )
    assert data["command"] in names[2].read_text()
    roundtrip(cli, mesh, "--report", tmp_path / "again.html")
    assert (tmp_path / "again.html").read_bytes() == names[0].read_bytes()


def test_the_report_tells_the_same_as_the_command(cli, mesh, tmp_path):
    outcome = roundtrip(cli, mesh, "--report", tmp_path / "a.json", "--json")
    told, data = outcome.json, json.loads((tmp_path / "a.json").read_text())
    assert told["reports"] == [str(tmp_path / "a.json")]
    for row, kept in zip(told["rows"], data["rows"], strict=True):
        assert kept["largest"]["world"] == row["hausdorff"]
        assert kept["forward"]["maximum"]["world"]["upper"] == row["forward"]["upper"]
    assert data["orders"][0]["order"] == told["order"]


def test_times_are_told_only_when_asked(cli, mesh, tmp_path):
    roundtrip(cli, mesh, "--report", tmp_path / "a.json", "--report", tmp_path / "a.md")
    data = json.loads((tmp_path / "a.json").read_text())
    assert data["seconds"] is None
    assert [row["seconds"] for row in data["rows"]] == [None, None]
    assert "Seconds" not in (tmp_path / "a.md").read_text()
    roundtrip(cli, mesh, "--report", tmp_path / "b.json", "--timings")
    data = json.loads((tmp_path / "b.json").read_text())
    assert set(data["seconds"]) == {"load", "check", "total"}
    assert {"distance", "surface", "compare", "details"} == set(data["rows"][1]["seconds"])


def test_reports_are_judged_before_the_mesh_is_loaded(cli, mesh, tmp_path, monkeypatch):
    def load(*_, **__):
        raise AssertionError("the mesh was loaded first")

    monkeypatch.setattr("meshsdf.io.meshes.read_mesh", load)
    old = tmp_path / "old.html"
    old.write_text("precious")
    for names, words in (
        ([tmp_path / "a.pdf"], "a report with suffix '.pdf' cannot be written"),
        ([tmp_path / "no" / "a.html"], "does not exist"),
        ([old], "the output exists"),
        ([tmp_path / "a.md", tmp_path / "a.md"], "two reports would be written to one file"),
    ):
        asked = [word for name in names for word in ("--report", name)]
        outcome = roundtrip(cli, mesh, *asked)
        assert outcome.code == 2
        assert words in outcome.err
    assert old.read_text() == "precious"


def test_force_replaces_a_report(cli, mesh, tmp_path):
    old = tmp_path / "old.md"
    old.write_text("precious")
    assert roundtrip(cli, mesh, "--report", old, "--force").code == 0
    assert old.read_text().startswith("# ball.ply")


def test_a_limit_that_is_missed_is_told_in_the_report_and_by_the_exit_code(cli, mesh, tmp_path):
    for limit, code, words in (("1e-9", 1, "may exceed"), ("5vox", 0, None)):
        name = tmp_path / f"{limit}.json"
        outcome = roundtrip(cli, mesh, "--report", name, "--max-error", limit)
        assert outcome.code == code
        limits = json.loads(name.read_text())["limits"]
        assert limits["passed"] is (code == 0)
        assert limits["max_error"] == limit.replace("1e-9", "1e-09")
        assert bool(limits["missed"]) is bool(words)


def test_a_mesh_that_does_not_come_back_has_a_report(cli, tmp_path):
    plate, out = tmp_path / "plate.ply", tmp_path / "a.html"
    thin = box_mesh((2.0, 2.0, 0.01))
    write_mesh(plate, Mesh(thin.vertices + 0.06, thin.faces))
    assert roundtrip(cli, plate, "--report", out).code == 0
    assert "Nothing of plate.ply comes back" in out.read_text()


def test_holes_and_names_with_marks_come_through(cli, tmp_path):
    mesh, out = tmp_path / 'a<b>&"c".ply', tmp_path / "ö & co.json"
    write_mesh(mesh, open_ball())
    outcome = roundtrip(cli, mesh, "--report", out, "--method", "marching-cubes,dual-contouring")
    assert outcome.code == 0
    data = json.loads(out.read_text("utf-8"))
    assert data["input"]["name"] == 'a<b>&"c".ply'
    assert any("1 hole" in warning for warning in data["warnings"])
    assert len(data["verdict"]["sentences"]) == 2
