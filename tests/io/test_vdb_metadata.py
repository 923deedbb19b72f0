"""meshsdf.io.vdb: what others put into a file beside its volume goes on to the next one."""

import json
import struct
from dataclasses import replace

import numpy as np
import pytest

from meshsdf.errors import IoError
from meshsdf.grid import Grid
from meshsdf.io import VdbMetadata, probe_volume, read_vdb_metadata, read_volume, write_volume
from meshsdf.io.losses import metadata_losses
from meshsdf.io.registry import FORMATS, format_of
from meshsdf.io.vdb import read_vdb_grids, write_vdb, write_vdb_grids
from meshsdf.io.vdb_metadata import Bytes, Int32, Single, Singles
from tests.io.examples import narrow_band

EVERY_TYPE = {
    "bool": (True, "?"),
    "int32": (Int32(-7), "i"),
    "int64": (1 << 40, "q"),
    "float": (Single(np.float32(0.1)), "f"),
    "double": (0.1, "d"),
    "vec2i": ((1, -2), "2i"),
    "vec3s": (Singles((0.5, 0.25, -1.0)), "3f"),
    "vec4d": ((0.1, 0.2, 0.3, 0.4), "4d"),
}
ODD = {"mat4d": Bytes("mat4d", bytes(range(128))), "no UTF-8": "a\udcffb"}


def raw_entry(name: str, kind: str, data: bytes) -> bytes:
    """An entry as the format has it."""
    words = [struct.pack("<I", len(text)) + text for text in (name.encode(), kind.encode())]
    return b"".join(words) + struct.pack("<I", len(data)) + data


def test_every_type_of_entry_goes_out_as_it_came_in(tmp_path):
    told = {kind: value for kind, (value, _) in EVERY_TYPE.items()} | ODD
    words = VdbMetadata(file=told, grid=told)
    write_vdb(tmp_path / "a.vdb", narrow_band(0), metadata=words)
    expected = []
    for kind, (value, letters) in EVERY_TYPE.items():
        numbers = value if isinstance(value, tuple) else (value,)
        expected.append(raw_entry(kind, kind, struct.pack(f"<{letters}", *numbers)))
    expected.append(raw_entry("mat4d", "mat4d", bytes(range(128))))
    expected.append(raw_entry("no UTF-8", "string", b"a\xffb"))
    for path in (tmp_path / "a.vdb", tmp_path / "b.vdb"):
        assert [path.read_bytes().count(entry) for entry in expected] == [2] * len(expected)
        found = read_vdb_metadata(path)
        assert found == words
        write_vdb(tmp_path / "b.vdb", read_volume(path), metadata=found, force=True)


def test_what_a_writer_works_out_anew_is_not_carried(tmp_path):
    band = narrow_band(1, with_faces=True)
    write_vdb(tmp_path / "a.vdb", band)
    assert read_vdb_metadata(tmp_path / "a.vdb") == VdbMetadata()
    stale = {"file_voxel_count": 1, "name": "other", "meshsdf_sign": "parity", "class": "staggered"}
    write_vdb(tmp_path / "b.vdb", band, metadata=VdbMetadata(grid=stale))
    assert (tmp_path / "b.vdb").read_bytes() == (tmp_path / "a.vdb").read_bytes()
    grid = Grid(np.ones((3, 4, 5), np.float32), 0.5, np.zeros(3), "unsigned")
    words = VdbMetadata({"shot": "a"}, {"frame": 3, "meshsdf_shape": (9, 9, 9)})
    write_vdb(tmp_path / "c.vdb", grid, metadata=words)
    assert read_volume(tmp_path / "c.vdb").values.shape == (3, 4, 5)
    assert read_vdb_metadata(tmp_path / "c.vdb") == VdbMetadata({"shot": "a"}, {"frame": 3})


def test_grids_read_as_they_are_keep_their_entries_too(tmp_path):
    told = {kind: value for kind, (value, _) in EVERY_TYPE.items()} | ODD
    write_vdb(tmp_path / "a.vdb", narrow_band(0), metadata=VdbMetadata(grid=told))
    (grid,) = read_vdb_grids(tmp_path / "a.vdb")
    write_vdb_grids(tmp_path / "b.vdb", [grid])
    assert read_vdb_metadata(tmp_path / "b.vdb").grid == told
    with pytest.raises(IoError, match="the metadata 'a' cannot be"):
        write_vdb_grids(tmp_path / "c.vdb", [replace(grid, metadata={"a": "\ud800"})])


def test_only_vdb_holds_metadata_and_losses_name_it(tmp_path):
    path = tmp_path / "a.vdb"
    many = {f"n{number:02}": number for number in range(25)}
    write_vdb(path, narrow_band(0), metadata=VdbMetadata({"shot": "a"}, many))
    facts = probe_volume(path)
    assert facts["metadata"] == {"shot": "a"}
    assert facts["grids"][0]["metadata"] == many
    for format in FORMATS:
        if format.kind != "volume":
            continue
        told = metadata_losses(facts, None, format)
        if format.name == "OpenVDB":
            assert told == []
            continue
        of_grid, of_file = told
        listed = ", ".join(f"'n{number:02}'" for number in range(20))
        words = f"{format.name} has no place for the metadata"
        assert of_grid == f"{words} {listed}, 5 more of the grid 'surface'"
        assert of_file == f"{words} 'shot' of the file"
    write_volume(tmp_path / "b.npz", read_volume(path))
    assert metadata_losses(probe_volume(tmp_path / "b.npz"), None, format_of("c.raw")) == []
    write_vdb(path, narrow_band(0), force=True)
    assert metadata_losses(probe_volume(path), None, format_of("c.raw")) == []


def test_what_a_terminal_obeys_and_what_json_has_no_word_for_is_shown_harmlessly(tmp_path):
    words = {"\x1b[31m": "\x1b[0m", "nan": float("nan"), "v": (float("inf"), 1.0), **ODD}
    write_vdb(tmp_path / "a.vdb", narrow_band(0), metadata=VdbMetadata(words, words))
    shown = probe_volume(tmp_path / "a.vdb")["metadata"]
    assert "\x1b" not in json.dumps(shown, allow_nan=False, ensure_ascii=False)
    assert (shown["nan"], shown["v"]) == ("nan", ["inf", 1.0])
    assert shown["mat4d"] == "128 bytes of type mat4d"
    shown["no UTF-8"].encode()
