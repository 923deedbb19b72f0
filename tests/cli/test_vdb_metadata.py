"""meshsdf convert on ``.vdb`` files with notes of other programs: carried, or named."""

import json

import numpy as np

from tests.io.vdb_examples import needs_openvdb, run_openvdb

NOTES = {"shot": "a10", "frame": 1001, "scale": 0.1, "final": True, "at": [1, 2, 3]}
GRID_NOTES = {"artist": "Zo\u00eb", "take": -2, "wind": [0.5, 0.25, -1.0], "uv": [0.5, 2.0]}


def noted(path, **grid):
    """A level set that OpenVDB wrote, with notes."""
    words = {"file": NOTES | {"creator": "another program"}, "grid": GRID_NOTES | grid}
    path.with_name(f"{path.name}.json").write_text(json.dumps(words))
    run_openvdb("noted", path)
    return path


def found_by_openvdb(*paths) -> list[dict]:
    """What OpenVDB says of files."""
    run_openvdb("dump", *paths)
    return [json.loads(str(np.load(f"{path}.npz")["words"])) for path in paths]


@needs_openvdb
def test_openvdb_finds_its_notes_in_the_converted_file(cli, tmp_path):
    theirs, ours = noted(tmp_path / "a.vdb"), tmp_path / "b.vdb"
    outcome = cli("convert", theirs, ours, "--json")
    assert (outcome.code, outcome.json["losses"], outcome.json["warnings"]) == (0, [], [])
    before, after = found_by_openvdb(theirs, ours)
    assert after["metadata"] == before["metadata"] == NOTES | {"creator": "another program"}
    (one,), (two,) = before["grids"], after["grids"]
    assert {name: two["metadata"][name] for name in GRID_NOTES} == GRID_NOTES
    # All else that it said is there, too, but for how the file is packed
    packing = {"file_mem_bytes", "file_compression", "file_delayed_load"}
    kept = {name: value for name, value in one["metadata"].items() if name not in packing}
    assert kept.items() <= two["metadata"].items()
    assert (two["name"], two["class"], two["n_active"]) == ("torso", "level set", one["n_active"])


@needs_openvdb
def test_formats_without_a_place_for_notes_name_each_of_them(cli, tmp_path):
    theirs = noted(tmp_path / "a.vdb")
    for suffix in ("nrrd", "npz"):
        outcome = cli("convert", theirs, tmp_path / f"b.{suffix}", "--json")
        assert outcome.code == 0, outcome.err
        told = " ".join(outcome.json["losses"])
        assert all(f"'{name}'" in told for name in (*NOTES, *GRID_NOTES, "creator"))
        assert set(outcome.json["losses"]) <= set(outcome.json["warnings"])
        assert "'artist', 'take'" in " ".join(outcome.err.split())


@needs_openvdb
def test_info_shows_notes_of_the_file_and_of_the_grid(cli, tmp_path):
    theirs = noted(tmp_path / "a.vdb", danger="\x1b[31m")
    facts = cli("info", theirs, "--json").json
    assert facts["metadata"] == NOTES | {"creator": "another program"}
    assert facts["grids"][0]["metadata"] == GRID_NOTES | {"danger": "\\x1b[31m"}
    words = cli("info", theirs).out
    assert "  metadata:\n    at: 1, 2, 3\n    creator: another program\n    final: yes" in words
    assert "\x1b" not in words
