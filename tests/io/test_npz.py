"""meshsdf.io.npz: volumes come back bit-equal, and no bytes whatever can do harm."""

import dataclasses
import io
import struct
import tracemalloc
import zipfile

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from meshsdf.errors import IoError
from meshsdf.grid import BrickIndex, Grid, NarrowBand
from meshsdf.io.npz import probe_npz, read_npz, write_npz
from tests.io.examples import narrow_band

few = settings(max_examples=25, deadline=None)
seeds = st.integers(0, 2**32 - 1)


def assert_equal(a, b):
    """Every field, and every field of fields, has the same type and the same bits."""
    assert type(a) is type(b)
    if dataclasses.is_dataclass(a):
        for field in dataclasses.fields(a):
            assert_equal(getattr(a, field.name), getattr(b, field.name))
    elif isinstance(a, np.ndarray):
        assert (a.dtype, a.shape, a.tobytes()) == (b.dtype, b.shape, b.tobytes())
    else:
        assert a == b


@few
@given(seeds, st.integers(0, 12), st.booleans())
def test_a_band_comes_back_bit_equal(tmp_path_factory, seed, n_bricks, with_faces):
    path = tmp_path_factory.mktemp("band") / "a.npz"
    if n_bricks == 0:
        index = BrickIndex.from_coordinates(np.empty((0, 3), np.int64))
        empty = np.empty((0, 8, 8, 8), np.float32)
        masks = np.empty((0, 8), np.uint64)
        band = NarrowBand(index, empty, masks, 0.1, np.zeros(3), 3.0, "unsigned")
    else:
        band = narrow_band(seed, n_bricks=n_bricks, with_faces=with_faces)
        uncertain = band.active // 3 if seed % 2 else None
        band = dataclasses.replace(band, uncertain=uncertain, n_inner_faces=seed % 3)
    write_npz(path, band)
    assert_equal(read_npz(path), band)


@few
@given(seeds, st.sampled_from([np.float32, np.float64]))
def test_a_grid_comes_back_bit_equal_with_its_gaps(tmp_path_factory, seed, dtype):
    path = tmp_path_factory.mktemp("grid") / "a.npz"
    random = np.random.default_rng(seed)
    values = random.normal(size=random.integers(0, 6, 3)).astype(dtype)
    values[values > 1] = np.nan
    doubts = int(random.integers(9)) if seed % 2 else None
    grid = Grid(values, float(random.uniform(1e-9, 1e9)), random.normal(size=3), "winding", doubts)
    write_npz(path, grid)
    assert_equal(read_npz(path), grid)


@few
@given(seeds)
def test_half_rounds_each_value_to_the_nearest_float16_and_nothing_else(tmp_path_factory, seed):
    path = tmp_path_factory.mktemp("half") / "a.npz"
    band = narrow_band(seed, with_faces=True)
    write_npz(path, band, half=True)
    back = read_npz(path)
    assert_array_equal(back.values, band.values.astype(np.float16).astype(np.float32))
    assert_equal(dataclasses.replace(back, values=band.values), band)
    assert probe_npz(path)["dtype"] == "float16"


def test_half_refuses_distances_that_float16_cannot_hold(tmp_path):
    for scale, shown in [(1e6, "e.06"), (1e-6, "e-06")]:
        grid = Grid(np.full((2, 2, 2), scale), 1.0, np.zeros(3))
        with pytest.raises(IoError, match=rf"values up to 1{shown} do not fit float16"):
            write_npz(tmp_path / "a.npz", grid, half=True)
    assert not (tmp_path / "a.npz").exists()


def test_the_same_volume_gives_the_same_bytes_whatever_its_memory_order(tmp_path):
    values = np.random.default_rng(0).normal(size=(3, 4, 5))
    for name, array in [("a", values), ("b", np.asfortranarray(values)), ("c", values.copy())]:
        write_npz(tmp_path / f"{name}.npz", Grid(array, 1.0, np.zeros(3)))
    assert len({(tmp_path / f"{name}.npz").read_bytes() for name in "abc"}) == 1


def test_plain_numpy_opens_the_documented_keys_without_pickles(tmp_path):
    band = narrow_band(1, with_faces=True)
    write_npz(tmp_path / "a.npz", band)
    with np.load(tmp_path / "a.npz", allow_pickle=False) as found:
        assert found["format"] == "meshsdf.narrow_band/2"
        assert found["sign"] == band.sign
        assert found["voxel_size"] == band.voxel_size
        assert found["half_width"] == band.half_width
        for name in ("values", "active", "translation", "closest_face", "barycentric"):
            assert_array_equal(found[name], getattr(band, name))
        for name in ("coordinates", "page_origin", "root", "pages"):
            assert_array_equal(found[name], getattr(band.index, name))
    with zipfile.ZipFile(tmp_path / "a.npz") as archive:
        assert {entry.compress_type for entry in archive.infolist()} == {zipfile.ZIP_STORED}


def test_the_header_alone_tells_what_is_in_the_file(tmp_path):
    band = narrow_band(2, with_faces=True)
    write_npz(tmp_path / "a.npz", band)
    facts = probe_npz(tmp_path / "a.npz")
    assert facts == {
        "kind": "narrow_band",
        "format": "meshsdf.narrow_band/2",
        "voxel_size": band.voxel_size,
        "half_width": band.half_width,
        "translation": band.translation.tolist(),
        "sign": band.sign,
        "n_bricks": band.index.n_bricks,
        "shape": list(band.values.shape),
        "dtype": "float32",
        "has_closest_face": True,
        "has_hermite": False,
    }
    write_npz(tmp_path / "g.npz", Grid(np.zeros((2, 3, 4)), 0.5, np.ones(3)))
    facts = probe_npz(tmp_path / "g.npz")
    assert (facts["kind"], facts["shape"], facts["dtype"]) == ("grid", [2, 3, 4], "float64")
    assert (facts["voxel_size"], facts["origin"]) == (0.5, [1.0, 1.0, 1.0])


# Damage. Every reading below must end in IoError or in the very volume that was written.


def small_grid_file(tmp_path):
    path = tmp_path / "whole.npz"
    grid = Grid(np.random.default_rng(3).normal(size=(3, 4, 5)), 0.5, np.zeros(3))
    write_npz(path, grid)
    return path.read_bytes(), grid


def assert_harmless(path, data, volume):
    path.write_bytes(data)
    try:
        found = read_npz(path)
    except IoError:
        return False
    assert_equal(found, volume)
    return True


def test_a_file_cut_anywhere_is_refused(tmp_path):
    data, grid = small_grid_file(tmp_path)
    random = np.random.default_rng(4)
    cuts = {*range(1024), *random.integers(0, len(data), 200).tolist(), len(data) - 1}
    for cut in sorted(cuts):
        assert not assert_harmless(tmp_path / "cut.npz", data[:cut], grid), cut


def test_a_flipped_bit_is_refused_or_does_not_matter(tmp_path):
    data, grid = small_grid_file(tmp_path)
    random = np.random.default_rng(5)
    n_survived = 0
    for place, bit in zip(
        random.integers(0, len(data), 2000).tolist(), random.integers(0, 8, 2000), strict=True
    ):
        flipped = bytearray(data)
        flipped[place] ^= 1 << bit
        n_survived += assert_harmless(tmp_path / "flip.npz", bytes(flipped), grid)
    # Dates, modes and version bytes of 5 entries are free to change; everything else is not.
    assert 0 < n_survived < 400


@pytest.mark.parametrize("place", ["front", "middle", "alone"])
def test_random_bytes_are_refused(tmp_path, place):
    data, grid = small_grid_file(tmp_path)
    random = np.random.default_rng(6)
    for size in [0, 1, 22, 100, 5000]:
        noise = random.bytes(size)
        if place == "front":
            mixed = noise + data[size:]
        elif place == "middle":
            mixed = data[: len(data) // 2] + noise + data[len(data) // 2 :]
        else:
            mixed = noise
        assert_harmless(tmp_path / "noise.npz", mixed, grid)


def archive_of(arrays, compression=zipfile.ZIP_STORED):
    """A zip of .npy entries; bytes are taken as an entry's whole content."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", compression) as archive:
        for name, array in arrays.items():
            if not isinstance(array, bytes):
                content = io.BytesIO()
                np.save(content, array, allow_pickle=True)
                array = content.getvalue()
            archive.writestr(f"{name}.npy", array)
    return out.getvalue()


def grid_arrays(**changes):
    arrays = {
        "format": np.array("meshsdf.grid/1"),
        "voxel_size": np.array(0.5),
        "origin": np.zeros(3),
        "sign": np.array("parity"),
        "values": np.zeros((2, 2, 2), np.float32),
    }
    return {name: array for name, array in (arrays | changes).items() if array is not None}


def header_claiming(shape, descr="<f4"):
    text = f"{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}".encode()
    text += b" " * (-(len(text) + 11) % 64) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text


def refuse(tmp_path, arrays, words, **options):
    path = tmp_path / "bad.npz"
    path.write_bytes(archive_of(arrays, **options))
    with pytest.raises(IoError, match=words):
        read_npz(path)


def test_an_archive_made_by_plain_numpy_is_read_too(tmp_path):
    np.savez(tmp_path / "a.npz", **grid_arrays())
    assert read_npz(tmp_path / "a.npz").values.shape == (2, 2, 2)


def test_headers_that_claim_terabytes_are_refused_without_taking_memory(tmp_path):
    shapes = ["(100000, 100000, 1000)", "(999999999999999999, 999999999999999999, 9)"]
    tracemalloc.start()
    for shape in shapes:
        refuse(tmp_path, grid_arrays(values=header_claiming(shape)), "but its entry holds 0")
    assert tracemalloc.get_traced_memory()[1] < 8e6
    tracemalloc.stop()


def test_compression_bombs_are_refused_without_being_opened(tmp_path):
    bomb = header_claiming("(400, 400, 400)") + bytes(4 * 400**3)
    tracemalloc.start()
    data = {"values": bomb}
    refuse(tmp_path, grid_arrays(**data), "compressed", compression=zipfile.ZIP_DEFLATED)
    del bomb, data
    tracemalloc.reset_peak()
    with pytest.raises(IoError, match="compressed"):
        read_npz(tmp_path / "bad.npz")
    assert tracemalloc.get_traced_memory()[1] < 8e6
    tracemalloc.stop()


def test_pickles_and_odd_types_are_refused(tmp_path):
    refuse(tmp_path, grid_arrays(sign=np.array([{}], object)), "header that volumes do not have")
    refuse(tmp_path, grid_arrays(values=np.zeros((2, 2, 2), complex)), "type c16")
    refuse(tmp_path, grid_arrays(values=np.zeros((2, 2, 2), ">f4")), "header")
    refuse(tmp_path, grid_arrays(values=np.zeros((2, 2, 2), "i8")), "'values' is int64")
    refuse(tmp_path, grid_arrays(values=np.zeros((2, 2), "f4")), r"shape \(2, 2\)")
    refuse(tmp_path, grid_arrays(values=np.zeros((2, 3, 4), "f4", order="F")), "header")
    refuse(tmp_path, grid_arrays(values=b"hello"), "'values' is not an array")


def test_missing_unknown_and_foreign_keys_are_named(tmp_path):
    refuse(tmp_path, grid_arrays(origin=None), "lacks 'origin'")
    refuse(tmp_path, grid_arrays(extra=np.zeros(1)), "unknown 'extra'")
    refuse(tmp_path, grid_arrays(format=None), "no 'format' key")
    refuse(tmp_path, grid_arrays(format=np.array("meshsdf.grid/2")), "'meshsdf.grid/2'; known")


def test_numbers_that_make_no_grid_are_refused(tmp_path):
    for size in (0.0, -1.0, np.nan, np.inf):
        refuse(tmp_path, grid_arrays(voxel_size=np.array(size)), "voxel_size is")
    refuse(tmp_path, grid_arrays(origin=np.array([0, np.nan, 0])), "1 of the numbers in origin")
    refuse(tmp_path, grid_arrays(values=np.full((2, 2, 2), np.inf)), "infinite")
    refuse(tmp_path, grid_arrays(sign=np.array("")), "sign is")
    refuse(tmp_path, grid_arrays(sign=np.array("\x1b[31m")), "sign is")
    with pytest.raises(IoError, match=r"cannot be written: .* infinite"):
        write_npz(tmp_path / "a.npz", Grid(np.full((2, 2, 2), np.inf), 1.0, np.zeros(3)))


def band_arrays(**changes):
    """The arrays of a band of three bricks, as stored, some of them replaced."""
    coordinates = np.array([[0, 0, 0], [0, 0, 1], [0, 0, 17]])
    index = BrickIndex.from_coordinates(coordinates)
    return {
        "format": np.array("meshsdf.narrow_band/2"),
        "voxel_size": np.array(0.5),
        "translation": np.zeros(3),
        "half_width": np.array(3.0),
        "sign": np.array("parity"),
        "coordinates": coordinates,
        "page_origin": index.page_origin,
        "root": index.root,
        "pages": index.pages,
        "values": np.zeros((3, 8, 8, 8), np.float32),
        "active": np.zeros((3, 8), np.uint64),
    } | changes


def changed(array, place, value):
    array = array.copy()
    array[place] = value
    return array


def hermite_arrays(**changes):
    """The arrays of a band whose Hermite data say five crossings, two loops and one arc."""
    random = np.random.default_rng(8)
    arrays = {
        "hermite_fractions": random.random(5),
        "hermite_normals": random.uniform(-0.5, 0.5, (5, 3)),
        "hermite_loops": np.array([3, 7], np.int32),
        "hermite_loop_points": random.normal(size=(2, 3)),
        "hermite_arcs": np.array([6]),
        "hermite_arc_points": random.normal(size=(1, 3)),
    }
    arrays = band_arrays(**(arrays | changes))
    return {name: array for name, array in arrays.items() if array is not None}


def test_hermite_data_come_back_bit_equal_and_files_without_them_have_none(tmp_path):
    path = tmp_path / "a.npz"
    path.write_bytes(archive_of(hermite_arrays()))
    band = read_npz(path)
    for name in dataclasses.asdict(band.hermite):
        assert_array_equal(getattr(band.hermite, name), hermite_arrays()[f"hermite_{name}"])
    write_npz(tmp_path / "b.npz", band)
    assert_equal(read_npz(tmp_path / "b.npz"), band)
    assert probe_npz(tmp_path / "b.npz")["has_hermite"] is True
    path.write_bytes(archive_of(band_arrays()))
    assert read_npz(path).hermite is None


def test_hermite_data_that_cannot_be_are_refused(tmp_path):
    cases = [
        ({"hermite_arcs": None}, "lacks 'hermite_arcs'"),
        ({"hermite_fractions": None}, "lacks 'hermite_fractions'"),
        ({"hermite_normals": np.zeros((4, 3))}, r"'hermite_normals' is float64 of shape \(4, 3\)"),
        ({"hermite_loops": np.array([3], np.int32)}, r"'hermite_loop_points' is .* \(2, 3\)"),
        ({"hermite_arc_points": np.zeros((2, 3))}, r"'hermite_arc_points' is .* \(2, 3\)"),
        ({"hermite_normals": np.zeros((5, 2))}, r"float64 of shape \(5, 2\)"),
        ({"hermite_normals": np.zeros((5, 3), np.float32)}, "'hermite_normals' is float32"),
        ({"hermite_fractions": np.array([0, 0.5, 1, 1.01, 0])}, "beyond 0 and 1"),
        ({"hermite_fractions": np.array([0, np.nan, 1, 1, 0])}, "1 of the numbers in hermite_frac"),
        ({"hermite_normals": np.full((5, 3), 2.0)}, "longer than 1"),
        ({"hermite_loop_points": np.full((2, 3), np.inf)}, "6 of the numbers in hermite_loop_p"),
        ({"hermite_loops": np.array([7, 3], np.int32)}, "hermite_loops does not rise"),
        ({"hermite_loops": np.array([-1, 3], np.int32)}, "hermite_loops does not rise"),
        ({"hermite_arcs": np.array([-6])}, "hermite_arcs does not rise"),
    ]
    for change, words in cases:
        refuse(tmp_path, hermite_arrays(**change), words)


def test_page_tables_that_would_lead_a_loop_astray_are_refused(tmp_path):
    whole = band_arrays()
    root, pages, coordinates = whole["root"], whole["pages"], whole["coordinates"]
    cases = [
        ({"pages": changed(pages, (1, 0, 0, 0), 3)}, "another slot"),
        ({"pages": changed(pages, (1, 0, 0, 0), 1)}, "another slot"),
        ({"pages": changed(pages, (1, 5, 0, 0), 2)}, "4 slots for 3 bricks"),
        ({"pages": changed(pages, (1, 0, 0, 0), -1)}, "2 slots for 3 bricks"),
        ({"pages": changed(pages, (0, 0, 0, 0), 2)}, "does not name each of the 3 pages once"),
        ({"pages": changed(pages, (0, 5, 5, 5), 7)}, "does not name each of the 3 pages once"),
        ({"pages": pages[[0, 2, 1]].copy()}, "another slot"),
        ({"pages": pages[[1, 0, 2]].copy()}, "does not name each of the 3 pages once"),
        ({"root": changed(root, (0, 0, 0), 2)}, "does not name each of the 3 pages once"),
        ({"root": changed(root, (0, 0, 0), -2)}, "does not name each of the 3 pages once"),
        ({"coordinates": coordinates[::-1].copy()}, "comes after"),
        ({"coordinates": changed(coordinates, (1, 2), 0)}, "comes after"),
        ({"coordinates": changed(coordinates, (2, 2), 999)}, "outside the root table"),
        ({"coordinates": changed(coordinates, (2, 2), 99)}, "a page that does not exist"),
        ({"coordinates": changed(coordinates, (2, 2), 2**62)}, "too large"),
        ({"coordinates": changed(coordinates, (0, 0), -(2**63))}, "too large"),
        ({"page_origin": np.array([0, 0, 1])}, "outside the root table"),
        ({"values": np.zeros((2, 8, 8, 8), np.float32)}, "'values' is float32 of shape"),
        ({"values": np.full((3, 8, 8, 8), np.nan, np.float32)}, "1536 of the numbers in values"),
        ({"closest_face": np.full((3, 8, 8, 8), -2, np.int32)}, "below -1"),
        ({"half_width": np.array(-3.0)}, "half_width is -3.0"),
    ]
    for change, words in cases:
        refuse(tmp_path, whole | change, words)
    (tmp_path / "good.npz").write_bytes(archive_of(whole))
    assert read_npz(tmp_path / "good.npz").index.n_bricks == 3


def test_an_entry_stored_twice_is_refused(tmp_path):
    out = io.BytesIO(archive_of(grid_arrays()))
    with zipfile.ZipFile(out, "a") as archive, pytest.warns(UserWarning, match="Duplicate"):
        archive.writestr("sign.npy", b"")
    (tmp_path / "bad.npz").write_bytes(out.getvalue())
    with pytest.raises(IoError, match="'sign' twice"):
        read_npz(tmp_path / "bad.npz")


def test_missing_files_and_folders_are_said(tmp_path):
    with pytest.raises(IoError, match="no such file"):
        read_npz(tmp_path / "missing.npz")
    with pytest.raises(IoError, match="folder"):
        probe_npz(tmp_path)
