"""meshsdf.io.zarr_zip: a Zarr volume in one file is the volume of its folder, and harms nobody."""

import dataclasses
import io
import shutil
import struct
import tracemalloc
import zipfile

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from meshsdf import mesh_to_band
from meshsdf.errors import IoError
from meshsdf.grid import Grid
from meshsdf.io import read_volume, write_volume
from meshsdf.io.half import halved
from meshsdf.io.registry import format_of, suffix_of
from meshsdf.io.volume_checks import check_volume
from meshsdf.io.volumes import probe_volume
from meshsdf.mesh.primitives import box_mesh
from tests.io.examples import narrow_band
from tests.io.zarr_examples import assert_equal, foreign

SMALL = mesh_to_band(box_mesh(), voxel_size=0.1, closest=True)


def small_grid(seed: int = 0) -> Grid:
    """A full grid of a few chunks, some of which are empty."""
    values = np.random.default_rng(seed).normal(size=(70, 5, 130)).astype(np.float32)
    values[:64] = np.nan
    return Grid(values, 0.5, np.array([1.0, 2.0, 3.0]))


@pytest.mark.parametrize("volume", [narrow_band(3, with_faces=True), SMALL, small_grid()])
def test_a_zip_holds_the_files_of_the_folder_and_gives_the_same_volume(tmp_path, volume):
    write_volume(tmp_path / "a.zarr", volume)
    write_volume(tmp_path / "a.zarr.zip", volume)
    assert_equal(read_volume(tmp_path / "a.zarr.zip"), read_volume(tmp_path / "a.zarr"))
    assert_equal(read_volume(tmp_path / "a.zarr.zip"), volume)
    assert probe_volume(tmp_path / "a.zarr.zip") == probe_volume(tmp_path / "a.zarr")
    files = {p.relative_to(tmp_path / "a.zarr"): p for p in (tmp_path / "a.zarr").rglob("*")}
    files = {name.as_posix(): p.read_bytes() for name, p in files.items() if p.is_file()}
    with zipfile.ZipFile(tmp_path / "a.zarr.zip") as archive:
        entries = archive.infolist()
        assert {entry.filename: archive.read(entry) for entry in entries} == files
    # Whoever reads from the front meets the root first, and nothing that is packed twice
    assert entries[0].filename == "zarr.json"
    assert {entry.compress_type for entry in entries} == {zipfile.ZIP_STORED}
    write_volume(tmp_path / "b.zarr.zip", volume)
    assert (tmp_path / "b.zarr.zip").read_bytes() == (tmp_path / "a.zarr.zip").read_bytes()


def test_the_package_zarr_reads_what_we_zip(tmp_path):
    zarr = pytest.importorskip("zarr", reason="the package zarr is not installed")
    grid = small_grid()
    write_volume(tmp_path / "a.zarr.zip", grid)
    with zarr.storage.ZipStore(tmp_path / "a.zarr.zip", mode="r") as store:
        group = zarr.open_group(store, mode="r", zarr_format=3)
        assert_array_equal(group["0"][...].T, grid.values)
        assert group.attrs["ome"]["version"] == "0.5"


@pytest.mark.parametrize("packing", ["none", "gzip", "zstd"])
def test_zips_of_other_programs_come_in_as_grids(tmp_path, packing):
    codecs = pytest.importorskip("zarr.codecs", reason="the package zarr is not installed")
    from zarr.storage import ZipStore

    options = {"none": {"compressors": None}, "gzip": {"compressors": [codecs.GzipCodec(level=5)]}}
    values = np.random.default_rng(0).normal(size=(5, 6, 7)).astype(np.float32)
    path = tmp_path / "a.zarr.zip"
    # It writes what it has to say of a group twice, one after the other
    with ZipStore(path, mode="w") as store, pytest.warns(UserWarning, match="Duplicate name"):
        foreign(store, values, chunks=(3, 4, 2), **options.get(packing, {}))
    grid = read_volume(path)
    assert_array_equal(grid.values, values.T)
    assert (grid.voxel_size, grid.sign) == (0.5, "winding")
    assert probe_volume(path)["shape"] == [7, 6, 5]


def test_a_folder_zipped_by_hand_is_read_unless_that_hides_how_much_it_holds(tmp_path):
    write_volume(tmp_path / "a.zarr", SMALL)
    shutil.make_archive(str(tmp_path / "a.zarr"), "zip", tmp_path / "a.zarr")
    with zipfile.ZipFile(tmp_path / "a.zarr.zip") as archive:
        assert {e.compress_type for e in archive.infolist() if e.file_size} == {8}
    assert_equal(read_volume(tmp_path / "a.zarr.zip"), SMALL)
    foreign(tmp_path / "b.zarr", np.ones((2, 2, 2), np.float32))
    shutil.make_archive(str(tmp_path / "b.zarr"), "zip", tmp_path / "b.zarr")
    with pytest.raises(IoError, match="packed with bytes, zstd are packed again by its zip"):
        read_volume(tmp_path / "b.zarr.zip")


def test_the_suffix_has_two_words_and_one_of_them_is_not_enough(tmp_path):
    assert format_of("A.Zarr.ZIP").name == "Zarr in a zip"
    assert suffix_of("v1.2.zarr.zip") == ".zarr.zip"
    assert (suffix_of("v1.2.npz"), suffix_of("zip"), suffix_of("a.")) == (".npz", "", "")
    with pytest.raises(IoError, match=r"suffix '\.zip' cannot be written"):
        write_volume(tmp_path / "a.zip", SMALL)


def test_an_old_file_is_replaced_only_if_asked_and_stays_when_writing_stops(tmp_path, monkeypatch):
    path, one, other = tmp_path / "a.zarr.zip", small_grid(), small_grid(1)
    write_volume(path, one)
    with pytest.raises(IoError, match="the output exists"):
        write_volume(path, other)

    def stop(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr("meshsdf.io.zarr_values.store", stop)
        with pytest.raises(KeyboardInterrupt):
            write_volume(path, other, force=True)
    assert_equal(read_volume(path), one)
    assert [p.name for p in tmp_path.iterdir()] == ["a.zarr.zip"]
    write_volume(path, other, force=True)
    assert_equal(read_volume(path), other)
    assert [p.name for p in tmp_path.iterdir()] == ["a.zarr.zip"]


# Damage


def zipped(entries: list[tuple[str, bytes]], method: int = zipfile.ZIP_STORED) -> bytes:
    """A zip of these entries."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", method) as archive:
        for name, data in entries:
            archive.writestr(name, data)
    return out.getvalue()


def entries_of(path) -> list[tuple[str, bytes]]:
    """Names and bytes of the entries of a zip."""
    with zipfile.ZipFile(path) as archive:
        return [(name, archive.read(name)) for name in archive.namelist()]


def test_damaged_and_foreign_zips_are_named(tmp_path):
    path = tmp_path / "a.zarr.zip"
    write_volume(path, SMALL)
    entries, whole = entries_of(path), path.read_bytes()
    moved = [(f"a.zarr/{name}", data) for name, data in entries]
    at = whole.index(b"PK\1\2")
    encrypted = whole[: at + 8] + b"\1" + whole[at + 9 :]
    cases = [
        (b"", "no sound zip"),
        (b"PK\3\4" + bytes(100), "no sound zip"),
        (whole[:-1], "no sound zip"),
        (zipped([]), r"has no zarr\.json"),
        (zipped(moved), r"has no zarr\.json"),
        (zipped([("../zarr.json", b"{}"), ("/zarr.json", b"{}")]), r"has no zarr\.json"),
        (zipped([(".zattrs", b"{}")]), "it is of version 2 of Zarr"),
        (zipped([e for e in entries if e[0] != "0/c/0/0/0"]), "of its values is missing"),
        (zipped([e for e in entries if not e[0].startswith("band/pages")]), "lacks 'pages'"),
        (zipped(entries, zipfile.ZIP_LZMA), "encrypted, or packed by another method"),
        (encrypted, "encrypted, or packed by another method"),
    ]
    for data, words in cases:
        path.write_bytes(data)
        with pytest.raises(IoError, match=words):
            read_volume(path)


def test_entries_that_claim_or_unpack_to_gigabytes_take_no_memory(tmp_path):
    path = tmp_path / "a.zarr.zip"
    write_volume(path, Grid(np.zeros((2, 2, 2)), 1.0, np.zeros(3)))
    entries = dict(entries_of(path))
    chunk, huge = "0/c/0/0/0", bytes(1 << 26)
    bombs = [zipped([*(entries | {name: huge}).items()], 8) for name in (chunk, "zarr.json")]
    # The directory claims the size that is asked for, the entry holds far more; and the reverse
    small = zipped([*(entries | {chunk: bytes(1 << 22)}).items()], 8)
    for claim in (1 << 20, 2**32 - 2):
        data = bytearray(small)
        at = data.rindex(chunk.encode()) - 46
        data[at + 24 : at + 28] = struct.pack("<I", claim)
        bombs.append(bytes(data))
    for bomb in bombs:
        path.write_bytes(bomb)
        tracemalloc.start()
        with pytest.raises(IoError, match=r"no entry of up to|is damaged|does not end|holds"):
            read_volume(path)
        assert tracemalloc.get_traced_memory()[1] < 20e6
        tracemalloc.stop()


def test_a_flipped_byte_or_a_cut_is_refused_or_gives_a_sound_volume(tmp_path):
    path = tmp_path / "a.zarr.zip"
    write_volume(path, SMALL)
    whole, random, refusals = path.read_bytes(), np.random.default_rng(0), []
    directory = whole.index(b"PK\1\2")
    for number in range(300):
        data = bytearray(whole)
        data[random.integers(directory if number % 2 else 0, len(data))] ^= random.integers(1, 256)
        path.write_bytes(data if number % 5 else data[: random.integers(len(data))])
        try:
            check_volume(read_volume(path))
        except IoError as error:
            refusals.append(len(str(error)))
    assert max(refusals) < 1500
    assert 100 < len(refusals) < 300


def test_half_and_attributes_go_the_same_way(tmp_path):
    band, said = dataclasses.replace(SMALL, closest_face=None, barycentric=None), []
    write_volume(tmp_path / "a.zarr.zip", band, half=True)
    back = read_volume(tmp_path / "a.zarr.zip", warn=said.append)
    assert_array_equal(back.values, halved(band.values).astype(np.float32))
    assert said == []
