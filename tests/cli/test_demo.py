"""meshsdf demo: the whole chain, and every file it leaves."""

import json

import pytest
from PIL import Image

from meshsdf.io import read_mesh, read_volume


@pytest.fixture(autouse=True)
def coarse(monkeypatch):
    monkeypatch.setattr("meshsdf.cli.demo.RESOLUTIONS", (12, 24))


def test_the_demo_leaves_files_that_open_and_overwrites_nothing(cli, tmp_path):
    folder = tmp_path / "new folder"
    outcome = cli("demo", folder, "--json")
    assert outcome.code == 0
    facts = outcome.json
    assert facts["schema"] == "meshsdf.demo/1"
    assert sorted(facts["files"]) == sorted(path.name for path in folder.iterdir())
    for path in folder.iterdir():
        if path.suffix == ".png":
            with Image.open(path) as image:
                assert min(image.size) > 300
        elif path.suffix == ".ply":
            assert read_mesh(path).n_faces > 0
        elif path.suffix == ".json":
            json.loads(path.read_text())
        else:
            assert read_volume(path).n_active > 0
    assert json.loads((folder / "check.json").read_text())["two_set"] is True
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    outcome = cli("demo", folder)
    assert outcome.code == 2
    assert "the output exists" in outcome.err
    outcome = cli("demo", folder, "--force")
    assert outcome.code == 0
    assert "observed order" in outcome.out
    after = {path.name: path.read_bytes() for path in folder.iterdir()}
    for name in before.keys() - {"roundtrip.json"}:  # which holds seconds
        assert before[name] == after[name], name


def test_a_file_where_the_folder_should_be_is_refused(cli, tmp_path):
    (tmp_path / "file").write_text("precious")
    outcome = cli("demo", tmp_path / "file")
    assert outcome.code == 2
    assert "a file stands where the folder should be" in outcome.err
