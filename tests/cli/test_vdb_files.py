"""The commands of meshsdf on ``.vdb`` files."""

from dataclasses import replace

import numpy as np
import pytest

from meshsdf.grid import Grid, NarrowBand
from meshsdf.io import read_mesh, read_volume
from meshsdf.io.vdb import read_vdb_grids, write_vdb_grids
from meshsdf.mesh.measures import is_watertight

from .examples import ball


def test_a_mesh_goes_through_vdb_as_it_goes_through_npz(cli, tmp_path):
    mesh = ball(tmp_path / "a.ply")
    for suffix in ("npz", "vdb"):
        for kind, options in [("band", []), ("closest", ["--closest"]), ("grid", ["--dense"])]:
            volume = tmp_path / f"{kind}.{suffix}"
            outcome = cli("convert", mesh, volume, "--resolution", "16", "--json", *options)
            assert outcome.code == 0, outcome.err
            assert outcome.json["output"] == str(volume)
            assert cli("mesh", volume, tmp_path / f"{kind}.{suffix}.ply").code == 0
    for kind in ("band", "closest", "grid"):
        one, two = (read_volume(tmp_path / f"{kind}.{suffix}") for suffix in ("npz", "vdb"))
        assert type(one) is type(two) is (Grid if kind == "grid" else NarrowBand)
        assert one.values.tobytes() == two.values.tobytes()
        assert one.facts() == two.facts()
        surfaces = [tmp_path / f"{kind}.{suffix}.ply" for suffix in ("npz", "vdb")]
        assert surfaces[0].read_bytes() == surfaces[1].read_bytes()
        assert is_watertight(read_mesh(surfaces[1]))
    assert read_volume(tmp_path / "closest.vdb").closest_face.max() < 320


def test_info_lists_all_grids_of_a_file(cli, tmp_path):
    volume = tmp_path / "a.vdb"
    cli("convert", ball(tmp_path / "a.ply"), volume, "--resolution", "16", "--half", "--closest")
    facts = cli("info", volume, "--json").json
    assert (facts["kind"], facts["default_grid"]) == ("vdb", "surface")
    assert [grid["name"] for grid in facts["grids"]] == ["surface", "closest_face", "barycentric"]
    assert facts["grids"][0]["dtype"] == "float16"
    words = cli("info", volume).out.splitlines()
    assert words[0].startswith(f"{volume}: vdb, ")
    assert "    - name: surface" in words
    assert f"      active voxels: {read_volume(volume).n_active}" in words


def test_a_grid_is_chosen_by_name_and_others_are_mentioned(cli, tmp_path):
    volume, out = tmp_path / "a.vdb", tmp_path / "a.ply"
    cli("convert", ball(tmp_path / "b.ply"), volume, "--resolution", "16")
    (small,) = read_vdb_grids(volume)
    matrix = np.diag([2, 2, 2, 1]) @ small.matrix
    large = {"name": "large", "matrix": matrix, "values": 2 * small.values}
    large["background"] = np.array(2 * small.background, np.float32)
    write_vdb_grids(volume, [small, replace(small, **large)], force=True)
    outcome = cli("mesh", volume, out, "--json")
    assert outcome.json["warnings"] == [
        "read the grid 'surface'; there are also 'large' (float, level set)"
    ]
    reach = np.abs(read_mesh(out).vertices).max()
    outcome = cli("mesh", volume, out, "--force", "--grid", "large", "--json")
    assert (outcome.code, outcome.json["warnings"]) == (0, [])
    assert np.abs(read_mesh(out).vertices).max() == pytest.approx(2 * reach, rel=1e-6)
    outcome = cli("mesh", volume, out, "--force", "--grid", "huge")
    assert outcome.code == 3
    assert "choose one of 'surface' (float, level set), 'large' (float, level set)" in outcome.err
