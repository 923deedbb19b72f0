"""meshsdf sample: points with their signed distances, in files for learners."""

import numpy as np
import pytest

from .examples import ball, box_without_lid

KEYS = """input output bytes n kinds seed layout normalization sign sign_reason n_uncertain n_inside
seconds warnings"""


@pytest.fixture
def mesh(tmp_path):
    return ball(tmp_path / "ball.ply", radius=2.0, subdivisions=3)


def test_samples_are_written_and_their_facts_told(cli, mesh, tmp_path):
    out = tmp_path / "a.npz"
    outcome = cli("sample", mesh, out, "--n", 1000, "--normalize", "unit-sphere", "--json")
    assert outcome.code == 0
    facts = outcome.json
    assert next(iter(facts.items())) == ("schema", "meshsdf.sample/1")
    assert set(KEYS.split()) <= set(facts)
    assert facts["kinds"] == {"near": 940, "uniform": 60, "surface": 0}
    assert (facts["n"], facts["seed"], facts["sign"]) == (1000, 0, "winding")
    assert set(facts["seconds"]) == {"load", "check", "samples", "write", "total"}
    placing = facts["normalization"]
    assert placing["name"] == "unit-sphere"
    assert placing["center"] == pytest.approx([0, 0, 0], abs=1e-12)
    assert placing["scale"] == pytest.approx(1 / 2.06)
    with np.load(out) as found:
        assert found["points"].shape == (1000, 3)
        assert (found["distance"] < 0).sum() == facts["n_inside"]
        assert found["scale"] == placing["scale"]
        radius = np.linalg.norm(found["points"], axis=1)
        assert np.abs(radius - 1 / 1.03 - found["distance"]).max() < 0.02
    words = cli("sample", mesh, out, "--n", 1000, "--force").out
    assert "world units" in words
    assert "1 000 samples (940 near, 60 uniform)" in words


def test_kinds_are_split_or_counted(cli, mesh, tmp_path):
    for options, kinds in (
        (["--n", 11, "--kind", "near"], {"near": 11}),
        (["--n", 11, "--kind", "uniform,surface"], {"uniform": 5, "surface": 6}),
        (["--kind", "near=3, surface=4"], {"near": 3, "surface": 4}),
    ):
        facts = cli("sample", mesh, tmp_path / "a.ply", *options, "--force", "--json").json
        assert {kind: n for kind, n in facts["kinds"].items() if n} == kinds
    facts = cli("info", tmp_path / "a.ply", "--json").json
    assert (facts["kind"], facts["n"], facts["has_normals"]) == ("samples", 7, True)


def test_deepsdfs_layout_has_both_sides(cli, mesh, tmp_path):
    out = tmp_path / "a.npz"
    options = ["--n", 500, "--layout", "deepsdf", "--json"]
    outcome = cli("sample", mesh, out, *options)
    assert outcome.json["warnings"] == []
    with np.load(out) as found:
        assert len(found["neg"]) == outcome.json["n_inside"]
        assert len(found["pos"]) + len(found["neg"]) == 500
    words = cli("info", out).out
    assert words.startswith(f"{out}: samples, ")
    assert "n pos: " in words
    outcome = cli("sample", mesh, out, *options, "--sign", "unsigned", "--force")
    assert "neg is empty: DeepSDF's loader needs samples on both sides" in outcome.json["warnings"]
    options = ["--kind", "surface=10,near=10", "--layout", "deepsdf", "--force", "--json"]
    outcome = cli("sample", mesh, out, *options)
    assert "normals have no place in DeepSDF's layout; left out" in outcome.json["warnings"]


def test_the_same_seed_gives_the_same_bytes(cli, process, mesh, tmp_path):
    files = []
    for name, seed in (("a", 1), ("b", 1), ("c", 2)):
        for suffix in ("npz", "ply"):
            options = ["--kind", "near=300,uniform=100,surface=50", "--seed", seed]
            cli("sample", mesh, tmp_path / f"{name}.{suffix}", *options)
        files.append([(tmp_path / f"{name}.{suffix}").read_bytes() for suffix in ("npz", "ply")])
    assert files[0] == files[1]
    assert files[0][0] != files[2][0]
    process(
        *("sample", mesh, tmp_path / "alone.npz", *options[:2], "--seed", 1),
        preexec_fn=lambda: __import__("os").sched_setaffinity(0, {0}),
    )
    assert (tmp_path / "alone.npz").read_bytes() == files[0][0]


def test_an_open_mesh_is_told_of(cli, tmp_path):
    mesh = box_without_lid(tmp_path / "open.ply")
    outcome = cli("sample", mesh, tmp_path / "a.npz", "--kind", "uniform=3000", "--json")
    assert outcome.code == 0
    n = outcome.json["n_uncertain"]
    assert n > 0
    assert f"{n} samples: the side is not certain" in outcome.json["warnings"]
    assert any("1 hole" in warning for warning in outcome.json["warnings"])


MISUSE = {
    "both counts": (["--n", 5, "--kind", "near=3"], "give --n or counts in --kind, not both"),
    "some counts": (["--kind", "near=3,uniform"], "give a count to each kind, or to none"),
    "no samples": (["--kind", "near=0"], "ask for one sample at least"),
    "no n": (["--n", 0], "0 is not in the range"),
    "unknown kind": (["--kind", "close"], "'close' is none of near, uniform, surface"),
    "twice": (["--kind", "near,near"], "'near' is given twice"),
    "no count": (["--kind", "near=x"], "'x' is no count"),
    "margin": (["--margin=-1"], "--margin -1 is below 0"),
    "variance": (["--variance", "0"], "0 is not above 0"),
    "double": (["--layout", "deepsdf", "--double"], "--layout deepsdf holds 32-bit"),
    "seed": (["--seed=-1"], "-1 is not in the range"),
}


@pytest.mark.parametrize("name", MISUSE)
def test_misuse_says_what_would_be_right(cli, mesh, tmp_path, name):
    options, words = MISUSE[name]
    outcome = cli("sample", mesh, tmp_path / "a.npz", *options)
    assert outcome.code == 2
    assert words in " ".join(outcome.err.split())
    assert not (tmp_path / "a.npz").exists()


def test_what_cannot_be_is_refused_before_the_mesh_is_read(cli, mesh, tmp_path, monkeypatch):
    assert cli("sample", mesh, tmp_path / "a.npz", "--n", 10**9, "--max-memory", "1G").code == 3

    def load(*_, **__):
        raise AssertionError("the mesh was loaded first")

    monkeypatch.setattr("meshsdf.io.meshes.read_mesh", load)
    outcome = cli("sample", mesh, tmp_path / "a.csv")
    assert outcome.code == 2
    assert "samples cannot be written with suffix '.csv'" in outcome.err
    outcome = cli("sample", mesh, tmp_path / "a.ply", "--layout", "deepsdf")
    assert outcome.code == 2
    (tmp_path / "a.npz").write_text("precious")
    assert cli("sample", mesh, tmp_path / "a.npz").code == 2
    assert (tmp_path / "a.npz").read_text() == "precious"
