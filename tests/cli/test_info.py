"""meshsdf info: every file that can be written is described."""

import pytest

from meshsdf.io import stored_bytes, write_volume
from meshsdf.io.registry import FORMATS
from meshsdf.mesh import icosphere
from meshsdf.sdf import mesh_to_grid

from .examples import MESH_SUFFIXES, any_format, ball

VOLUMES = [suffix for f in FORMATS if f.kind == "volume" for suffix in f.suffixes]


@pytest.mark.parametrize("suffix", VOLUMES)
def test_every_volume_is_described_from_its_header(cli, tmp_path, suffix, monkeypatch):
    volume = tmp_path / f"a{suffix}"
    grid = mesh_to_grid(icosphere(subdivisions=1), voxel_size=0.5)
    write_volume(volume, grid)

    def read(*_, **__):
        raise AssertionError("the values were read")

    monkeypatch.setattr("meshsdf.io.volumes.read_volume", read)
    outcome = cli("info", volume, "--json")
    assert outcome.code == 0
    facts = outcome.json
    assert next(iter(facts.items())) == ("schema", "meshsdf.info/1")
    assert (facts["input"], facts["bytes"]) == (str(volume), stored_bytes(volume))
    assert facts["kind"] == ("vdb" if suffix == ".vdb" else "grid")
    words = cli("info", volume).out.splitlines()
    assert words[0].startswith(f"{volume}: {facts['kind']}, ")
    if suffix != ".vdb":
        assert f"  shape: {', '.join(map(str, grid.values.shape))}" in words


@pytest.mark.parametrize("suffix", MESH_SUFFIXES)
def test_every_mesh_is_described(cli, tmp_path, suffix):
    mesh = any_format(tmp_path, suffix)
    facts = cli("info", mesh, "--json").json
    assert (facts["kind"], facts["bytes"]) == ("mesh", mesh.stat().st_size)
    assert facts["n_faces"] == (12 if suffix == ".gltf" else 80)


def test_samples_are_told_from_volumes_and_meshes(cli, tmp_path):
    mesh = ball(tmp_path / "ball.ply")
    for name, layout in (("s.npz", "plain"), ("d.npz", "deepsdf"), ("s.ply", "plain")):
        samples = tmp_path / name
        cli("sample", mesh, samples, "--n", 50, "--layout", layout)
        facts = cli("info", samples, "--json").json
        assert (facts["kind"], facts["n"]) == ("samples", 50)
        assert cli("info", samples).out.startswith(f"{samples}: samples, ")
    outcome = cli("convert", tmp_path / "s.npz", tmp_path / "a.vdb")
    assert outcome.code == 3
    assert "s.npz holds samples of distances at scattered points, not a volume" in outcome.err
    assert "meshsdf info" in outcome.err
    outcome = cli("check", tmp_path / "s.ply")
    assert outcome.code == 3
    assert "it holds 50 points, but no faces" in outcome.err
