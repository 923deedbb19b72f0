"""meshsdf compare: limits, units, budgets, reports."""

import json

import pytest

from meshsdf.io import write_mesh
from meshsdf.mesh.primitives import box_mesh, icosphere

from .examples import embedded


@pytest.fixture
def pair(tmp_path):
    """Two boxes, 0.25 apart."""
    a, b = tmp_path / "a.ply", tmp_path / "b.ply"
    write_mesh(a, box_mesh((2, 2, 2)))
    write_mesh(b, box_mesh((2, 2, 2), center=(0.25, 0, 0)))
    return a, b


@pytest.mark.parametrize(
    ("options", "code", "words"),
    [
        (["--max-error", "0.26"], 0, ""),
        (["--max-error", "0.24"], 1, "they are 0.24"),
        (["--max-error", "0.52vox", "--voxel-size", "0.5"], 0, ""),
        (["--max-error", "0.48vox", "--voxel-size", "0.5"], 1, "above --max-error 0.48vox"),
        (["--max-error", "0.25"], 1, "they may be 0.25"),
        (["--tolerance", "0.26", "--max-error", "0.24"], 1, "above --max-error 0.24"),
        (["--tolerance", "0.24", "--max-error", "0.26"], 1, "above --tolerance 0.24"),
        (["--tolerance", "0.2501", "--max-error", "0.2501"], 0, ""),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else None,
)
def test_limits_decide_the_exit_code(cli, pair, options, code, words):
    outcome = cli("compare", *pair, *options)
    assert outcome.code == code
    assert words in outcome.err
    assert (" apart, above " in outcome.err) == (code == 1)


def test_the_limit_and_the_answer_are_told_in_world_units(cli, pair):
    options = ["--max-error", "0.48vox", "--voxel-size", "0.5", "--json"]
    facts = cli("compare", *pair, *options).json
    assert facts["max_error"] == pytest.approx(0.24)
    assert facts["passed"] is False
    assert facts["tolerance"] is None
    assert facts["hausdorff"]["lower"] <= 0.25 <= facts["hausdorff"]["upper"]
    facts = cli("compare", *pair, "--json").json
    assert facts["max_error"] is None
    assert facts["passed"] is True


def test_a_limit_far_below_the_default_tolerance_is_still_decided(cli, tmp_path):
    # Two triangulations of one surface: by default an interval up to 1e-6 of the diagonal would do
    paths = [tmp_path / "a.off", tmp_path / "b.off"]
    box = box_mesh((1, 1, 1))
    write_mesh(paths[0], box)
    turned = box.vertices[:, [1, 0, 2]]  # other diagonals
    write_mesh(paths[1], type(box)(turned, box.faces[:, ::-1].copy()))
    assert cli("compare", *paths, "--max-error", "1e-12").code == 0


def test_voxels_need_a_size(cli, pair):
    outcome = cli("compare", *pair, "--max-error", "0.5vox")
    assert outcome.code == 2
    assert "--max-error 0.5vox needs --voxel-size" in " ".join(outcome.err.split())
    assert outcome.out == ""


def test_a_spent_time_budget_leaves_a_wider_interval_and_says_so(cli, tmp_path):
    paths = [tmp_path / "a.off", tmp_path / "b.off"]
    write_mesh(paths[0], icosphere(subdivisions=1))
    write_mesh(paths[1], box_mesh((0.3, 0.5, 0.7)))
    narrow = cli("compare", *paths, "--json").json["hausdorff"]
    outcome = cli("compare", *paths, "--time-budget", "1e-9")
    assert outcome.code == 0
    assert "the search met its limit" in outcome.out
    wide = cli("compare", *paths, "--time-budget", "1e-9", "--json").json
    assert wide["forward"]["is_within_tolerance"] is False
    assert wide["hausdorff"]["lower"] <= narrow["lower"]
    assert narrow["upper"] < wide["hausdorff"]["upper"]


def test_one_run_writes_every_format_with_the_same_numbers(cli, pair, tmp_path):
    names = [tmp_path / f"out.{suffix}" for suffix in ("html", "json", "md")]
    asked = [word for name in names for word in ("--report", name)]
    outcome = cli("compare", *pair, "--voxel-size", "0.123456789", "--no-statistics", *asked)
    assert outcome.code == 0
    assert outcome.out.splitlines()[-1] == ", ".join(map(str, names))
    data = json.loads(names[1].read_text())
    assert data["schema"] == "meshsdf.compare_report/1"
    assert embedded(names[0]) == data
    assert (data["a"]["name"], data["b"]["name"]) == ("a.ply", "b.ply")
    command = f"meshsdf compare {pair[0]} {pair[1]} --voxel-size 0.123456789 --no-statistics"
    assert data["command"] == command
    assert command in names[2].read_text()
    # The command of the report gives its bytes again, and the page is no more than asked for
    cli(*command.split()[1:], "--report", tmp_path / "again.md")
    assert (tmp_path / "again.md").read_bytes() == names[2].read_bytes()


def test_a_report_changes_nothing_of_the_answer(cli, pair, tmp_path):
    plain = cli("compare", *pair)
    told = cli("compare", *pair, "--report", tmp_path / "a.json")
    assert told.out == f"{plain.out}{tmp_path / 'a.json'}\n"
    facts = cli("compare", *pair, "--json").json
    assert "reports" not in facts
    with_report = cli("compare", *pair, "--report", tmp_path / "b.json", "--json").json
    assert with_report.pop("reports") == [str(tmp_path / "b.json")]
    assert facts.pop("seconds").keys() <= with_report.pop("seconds").keys()
    assert with_report == facts
    data = json.loads((tmp_path / "b.json").read_text())
    assert data["comparison"]["largest"]["world"] == facts["hausdorff"]


def test_reports_are_judged_before_the_meshes_are_loaded(cli, pair, tmp_path, monkeypatch):
    def load(*_, **__):
        raise AssertionError("a mesh was loaded first")

    monkeypatch.setattr("meshsdf.io.meshes.read_mesh", load)
    old = tmp_path / "old.html"
    old.write_text("precious")
    for names, words in (
        ([tmp_path / "a.pdf"], "a report with suffix '.pdf' cannot be written"),
        ([tmp_path / "no" / "a.html"], "does not exist"),
        ([old], "the output exists"),
        ([tmp_path / "a.md", tmp_path / "a.md"], "two reports would be written to one file"),
    ):
        outcome = cli("compare", *pair, *(w for name in names for w in ("--report", name)))
        assert outcome.code == 2
        assert words in outcome.err
    assert old.read_text() == "precious"


def test_force_replaces_a_report(cli, pair, tmp_path):
    old = tmp_path / "old.md"
    old.write_text("precious")
    assert cli("compare", *pair, "--report", old, "--force").code == 0
    assert old.read_text().startswith("# a.ply and b.ply: compared")


def test_a_missed_limit_is_told_in_the_report_and_by_the_exit_code(cli, pair, tmp_path):
    for limit, code in (("0.24", 1), ("0.26", 0)):
        name = tmp_path / f"{limit}.json"
        assert cli("compare", *pair, "--max-error", limit, "--report", name).code == code
        limits = json.loads(name.read_text())["limits"]
        assert limits["passed"] is (code == 0)
        assert limits["max_error"] == limit
        assert limits["tolerance"] is None
        assert [text.startswith("The meshes are 0.24") for text in limits["missed"]] == [
            True
        ] * code
