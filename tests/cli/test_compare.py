"""meshsdf compare: limits, units, budgets."""

import pytest

from meshsdf.io import write_mesh
from meshsdf.mesh.primitives import box_mesh, icosphere


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
