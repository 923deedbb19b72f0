"""The commands of meshsdf on files of full grids."""

import numpy as np
import pytest

from meshsdf.io import read_mesh, read_volume
from meshsdf.mesh.measures import is_watertight

from .examples import ball

SUFFIXES = ("nrrd", "nhdr", "mha", "mhd", "vti", "raw", "dds", "sdf", "vf")


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_mesh_goes_through_every_format_of_full_grids(cli, tmp_path, suffix):
    mesh = ball(tmp_path / "a.ply")
    dense, clipped = tmp_path / f"dense.{suffix}", tmp_path / f"clipped.{suffix}"
    cli("convert", mesh, tmp_path / "dense.npz", "--resolution", "16", "--dense")
    outcome = cli("convert", mesh, dense, "--resolution", "16", "--dense", "--json")
    assert outcome.code == 0, outcome.err
    assert (outcome.json["output"], outcome.json["kind"]) == (str(dense), "grid")
    exact = read_volume(tmp_path / "dense.npz")
    assert read_volume(dense).values.tobytes() == exact.values.tobytes()
    outcome = cli("convert", mesh, clipped, "--resolution", "16", "--json")
    assert outcome.code == 0, outcome.err
    assert "clipped to +-0.375 beyond 3 voxels" in outcome.json["warnings"][0]
    found = read_volume(clipped).values
    assert found.max() == -found.min() == np.float32(0.375)
    for volume in (dense, clipped):
        facts = cli("info", volume, "--json").json
        assert (facts["kind"], facts["dtype"]) == ("grid", "float32")
        assert facts["shape"] == list(read_volume(volume).values.shape)
        out = volume.with_suffix(".ply")
        assert cli("mesh", volume, out).code == 0
        assert is_watertight(read_mesh(out))
