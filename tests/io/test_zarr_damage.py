"""meshsdf.io.zarr_volume: no bytes whatever can do harm. Chunks have a checksum, ``zarr.json`` has
none, so damage ends in IoError or in a sound volume, of bounded size."""

import gzip
import json
import shutil
import tracemalloc

import numpy as np
import pytest

from meshsdf import mesh_to_band
from meshsdf.errors import IoError
from meshsdf.grid import Grid
from meshsdf.io.registry import stored_bytes
from meshsdf.io.volume_checks import check_volume
from meshsdf.io.zarr_volume import read_zarr, write_zarr
from meshsdf.mesh.primitives import box_mesh
from tests.io.zarr_examples import foreign

SMALL = mesh_to_band(box_mesh(), voxel_size=0.1, closest=True)
"""A band whose values are one chunk."""


def damaged(tmp_path, change):
    """A small band whose folder was changed by a function; what is read of it."""
    whole, path = tmp_path / "whole.zarr", tmp_path / "a.zarr"
    if not whole.exists():
        write_zarr(whole, SMALL)
    shutil.rmtree(path, ignore_errors=True)
    shutil.copytree(whole, path)
    change(path)
    return read_zarr(path)


def edit(name, **changes):
    """Change entries of a zarr.json; None takes one away."""

    def change(path):
        file = path / name / "zarr.json"
        found = json.loads(file.read_text())
        for key, value in changes.items():
            place, found_in = found, key.split("__")
            for part in found_in[:-1]:
                place = place[int(part) if part.isdigit() else part]
            if value is None:
                del place[found_in[-1]]
            else:
                place[found_in[-1]] = value
        file.write_text(json.dumps(found))

    return change


def remove(name):
    """Take away a file or a folder."""

    def change(path):
        place = path / name
        shutil.rmtree(place) if place.is_dir() else place.unlink()

    return change


def test_missing_and_damaged_parts_are_named(tmp_path):
    cases = [
        (remove("zarr.json"), "has no zarr.json"),
        (remove("0"), "has no zarr.json"),
        (remove("0/c"), "of its values is missing"),
        (remove("band/pages"), "lacks 'pages'"),
        (remove("band/active/c"), "is missing"),
        (edit("", zarr_format=2), "does not say zarr_format 3"),
        (edit("", node_type="array"), "an array without a place in space"),
        (edit("", attributes__meshsdf__format="meshsdf.grid/7"), "none of the formats"),
        (edit("", attributes__meshsdf=7), "none of the formats"),
        (edit("", attributes__meshsdf__voxel_size=-1.0), "voxel_size is -1.0"),
        (edit("", attributes__meshsdf__voxel_size="wide"), "its voxel_size is wide"),
        (edit("", attributes__meshsdf__voxel_size=[1.0]), "'voxel_size' is float64 of shape"),
        (edit("", attributes__meshsdf__sign=5), "its sign is 5"),
        (edit("", attributes__meshsdf__translation=[0, 0]), "'translation' is float64 of shape"),
        (edit("", attributes__meshsdf__half_width=None), "lacks 'half_width'"),
        (edit("", attributes=[]), "its attributes are damaged"),
        (edit("0", shape=[8, 8, 8]), "do not suit its bricks"),
        (edit("0", data_type="float64"), "'values' is float64"),
        (edit("0", chunk_grid__configuration__chunk_shape=[60, 60, 60]), "do not suit its bricks"),
        (edit("0", chunk_grid__configuration__chunk_shape=[0, 60, 60]), "claims the shape"),
        (edit("0", codecs__1__name="zstd"), "packed with bytes, zstd"),
        (edit("0", codecs=[]), "no list of codecs"),
        (edit("0", fill_value="much"), "the fill value much"),
        (edit("band/coordinates", data_type="int32"), "'coordinates' is int32"),
        (edit("band/active", shape=[3, 9]), "'active' is uint64"),
        (edit("band/active", shape=[4, 8]), "'active' is uint64"),
        (edit("band/pages", shape=[10**9, 16, 16, 16]), "are allowed"),
        (edit("band/active", codecs__1__name="pickle"), "packed with bytes, pickle"),
    ]
    for change, words in cases:
        with pytest.raises(IoError, match=words):
            damaged(tmp_path, change)


def test_claims_of_terabytes_are_refused_without_taking_memory(tmp_path):
    path = tmp_path / "a.zarr"
    write_zarr(path, Grid(np.zeros((2, 2, 2)), 1.0, np.zeros(3)))
    tracemalloc.start()
    for shape in ([10**6] * 3, [10**9, 10**9, 10**9], [2**39] * 3):
        edit("0", shape=shape)(path)
        with pytest.raises(IoError, match=r"bytes; 6.71e.07 are allowed"):
            read_zarr(path)
    edit("0", shape=[2, 2, 2], chunk_grid__configuration__chunk_shape=[10**6] * 3)(path)
    with pytest.raises(IoError, match=r"bytes; 6.71e.07 are allowed"):
        read_zarr(path)
    assert tracemalloc.get_traced_memory()[1] < 8e6
    tracemalloc.stop()


def test_chunks_that_hold_more_or_less_than_they_should_are_refused(tmp_path):
    path = tmp_path / "a.zarr"
    write_zarr(path, Grid(np.zeros((2, 2, 2)), 1.0, np.zeros(3)))
    chunk = path / "0" / "c" / "0" / "0" / "0"
    whole = chunk.read_bytes()
    n = 8 * 64**3
    cases = [
        (gzip.compress(bytes(n + 1)), "holds more than 2097152 bytes"),
        (gzip.compress(bytes(1 << 26)), "holds more than 2097152 bytes"),
        (gzip.compress(bytes(n - 8)), "holds 2097144 bytes, not 2097152"),
        (whole + b"more", "does not end where it should"),
        (whole[:-1], "does not end where it should"),
        (whole[:-8] + bytes(8), "is damaged"),
        (b"", "does not end where it should"),
        (b"plain", "is damaged"),
        (bytes(2 * n), "no plain file of up to"),
    ]
    for data, words in cases:
        chunk.write_bytes(data)
        with pytest.raises(IoError, match=words):
            read_zarr(path)
    chunk.unlink()
    chunk.mkdir()
    with pytest.raises(IoError, match="no plain file"):
        read_zarr(path)


def test_a_path_out_of_the_folder_is_refused(tmp_path):
    path = foreign(tmp_path / "a.zarr", np.ones((2, 2, 2), np.float32))
    for place in ("../b.zarr", "/etc", "s0/..", "", ".", "a\\b", "s0\n"):
        edit("", attributes__ome__multiscales__0__datasets__0__path=place)(path)
        with pytest.raises(IoError, match="its values are at"):
            read_zarr(path)


def test_a_flipped_byte_is_refused_or_gives_a_sound_volume(tmp_path):
    path = tmp_path / "a.zarr"
    write_zarr(path, SMALL)
    files = sorted(file for file in path.rglob("*") if file.is_file())
    random = np.random.default_rng(0)
    n_refused = 0
    for _ in range(300):
        file = files[random.integers(len(files))]
        whole = file.read_bytes()
        data = bytearray(whole)
        data[random.integers(len(data))] ^= random.integers(1, 256)
        file.write_bytes(data if random.random() < 0.7 else data[: random.integers(len(data))])
        try:
            check_volume(read_zarr(path))
        except IoError as error:
            refusal = str(error)
        else:
            refusal = ""
        assert len(refusal) < 1500
        n_refused += bool(refusal)
        file.write_bytes(whole)
    assert 100 < n_refused < 300
    assert stored_bytes(path) == sum(len(file.read_bytes()) for file in files)


def test_other_versions_and_files_are_named(tmp_path):
    (tmp_path / "a.zarr").mkdir()
    (tmp_path / "a.zarr" / ".zattrs").write_text("{}")
    with pytest.raises(IoError, match="it is of version 2 of Zarr"):
        read_zarr(tmp_path / "a.zarr")
    (tmp_path / "b.zarr").write_text("{}")
    with pytest.raises(IoError, match="Not a directory"):
        read_zarr(tmp_path / "b.zarr")
    with pytest.raises(IoError, match="no such file"):
        read_zarr(tmp_path / "c.zarr")
