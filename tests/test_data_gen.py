"""data_gen: each set is made from nothing, matches its README, and the check finds what is planted.

The sets are run as a user runs them; nothing here imports them.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import manifold3d
import numpy as np
import pytest

from meshsdf.io import read_mesh
from meshsdf.mesh import check
from meshsdf.mesh.measures import area, euler_number, n_components, volume

ROOT = Path(__file__).parent.parent
SETS = ("meshes", "broken_meshes")
MAX_BYTES = 2_000_000


def run(name: str, out: Path, seed: int = 0) -> list[str]:
    """Make one set; its rows as printed."""
    script = ROOT / "data_gen" / name / "make.py"
    command = [sys.executable, str(script), "--out", str(out), "--seed", str(seed)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return done.stdout.splitlines()


def cells(row: str) -> list[str]:
    return [cell.strip() for cell in row.strip("|").split("|")]


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Set name -> (folder, printed rows), made once."""
    result = {}
    for name in SETS:
        out = tmp_path_factory.mktemp(name)
        result[name] = (out, run(name, out))
    return result


@pytest.mark.parametrize("name", SETS)
def test_the_readme_lists_the_rows_that_are_printed(name, made):
    _, rows = made[name]
    readme = (ROOT / "data_gen" / name / "README.md").read_text().splitlines()
    listed = [line for line in readme if line.startswith("| ") and line.count("|") > 4]
    assert listed[2:] == rows  # after the heading and its rule


@pytest.mark.parametrize("name", SETS)
def test_files_hold_what_the_rows_say_and_stay_small(name, made):
    out, rows = made[name]
    meshes = {path.name for path in out.iterdir() if path.suffix != ".json"}
    assert meshes == {cells(row)[0] for row in rows}
    for row in rows:
        file, n_vertices, n_faces, *_ = cells(row)
        mesh = read_mesh(out / file)
        assert (mesh.n_vertices, mesh.n_faces) == (int(n_vertices), int(n_faces)), file
        assert (out / file).stat().st_size < MAX_BYTES


def test_sound_meshes_are_sound_to_the_check_and_to_another_library(made):
    out, rows = made["meshes"]
    for row in rows:
        file, _, _, pieces, genus, enclosed, _ = cells(row)
        mesh = read_mesh(out / file)
        report = check(mesh)
        assert report.two_set_by_index, file
        assert report.oriented, file
        assert report.n_components == n_components(mesh) == int(pieces) == 1
        assert report.n_degenerate_faces == report.n_duplicate_faces == 0
        assert report.n_nonmanifold_vertices == report.n_self_intersections == 0, file
        assert euler_number(mesh) == 2 - 2 * int(genus)
        # The row shows six digits.
        assert volume(mesh) == pytest.approx(float(enclosed), rel=1e-5)
        arrays = (np.array(mesh.vertices), mesh.faces.astype(np.uint64))
        solid = manifold3d.Manifold(manifold3d.Mesh64(*arrays))
        assert solid.status() == manifold3d.Error.NoError
        assert solid.genus() == int(genus)
        assert solid.volume() == pytest.approx(volume(mesh), rel=1e-9)


def test_another_seed_turns_the_solids_but_changes_no_size(made, tmp_path):
    out, _ = made["meshes"]
    run("meshes", tmp_path, seed=7)
    for file in ("box.obj", "gear.obj", "trefoil.ply"):
        mesh, turned = read_mesh(out / file), read_mesh(tmp_path / file)
        assert not np.allclose(mesh.vertices, turned.vertices)
        assert np.array_equal(mesh.faces, turned.faces)
        # Coordinates are rounded to 6 decimals: each moves by up to 5e-7 in sizes near 1.
        assert area(turned) == pytest.approx(area(mesh), rel=1e-5)
        assert volume(turned) == pytest.approx(volume(mesh), rel=1e-5)


def findings(mesh, keys) -> dict:
    """What the check says, by the names of the truth."""
    report = check(mesh)
    own = {
        "n_holes": len(report.holes),
        "n_inside_out": sum(part.inside_out for part in report.components),
        "self_intersecting": report.n_self_intersections > 0,
    }
    return {key: own[key] if key in own else getattr(report, key) for key in keys}


@pytest.mark.parametrize("seed", [0, 1])
def test_the_check_finds_the_planted_defects_and_nothing_else(seed, made, tmp_path):
    out, rows = made["broken_meshes"]
    if seed != 0:
        out, rows = tmp_path, run("broken_meshes", tmp_path, seed)
    wrong = []
    for row in rows:
        path = out / cells(row)[0]
        truth = json.loads(path.with_suffix(".json").read_text())
        assert truth.pop("file") == path.name
        planted = truth.pop("defects")
        assert planted or path.stem == "sound"
        found = findings(read_mesh(path), truth)
        wrong += [
            f"{path.name}: {key} is {found[key]}, planted {truth[key]}"
            for key in truth
            if found[key] != truth[key]
        ]
    assert not wrong, "\n".join(wrong)


def test_the_set_shows_every_verdict_both_ways(made):
    out, _ = made["broken_meshes"]
    truths = [json.loads(path.read_text()) for path in out.glob("*.json")]
    for key in ("two_set", "two_set_by_index", "oriented", "self_intersecting"):
        assert {truth[key] for truth in truths} == {True, False}
    for key in truths[0]:
        if key.startswith("n_"):
            assert len({truth[key] for truth in truths}) > 1, f"no mesh of the set shows {key}"
