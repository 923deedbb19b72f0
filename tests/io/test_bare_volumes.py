"""meshsdf.io.raw, vf and sdfgen beside plain readers that follow each format's own words."""

import json
import struct

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf.errors import IoError
from meshsdf.grid import Grid
from meshsdf.io import read_volume, write_volume
from meshsdf.io.raw import probe_raw, read_raw, write_raw
from meshsdf.io.sdfgen import read_sdfgen, write_sdfgen
from meshsdf.io.vf import probe_vf, read_vf, read_vf_vectors, write_vf, write_vf_vectors
from tests.io.dense_examples import CENTER, STEP, assert_centered, center_of_inside, sphere_grid


def test_a_raw_file_is_what_its_json_says(tmp_path):
    grid = sphere_grid()
    write_raw(tmp_path / "a.raw", grid)
    facts = json.loads((tmp_path / "a.raw.json").read_text())
    assert facts == {
        "format": "meshsdf.raw/1",
        "shape": [27, 26, 28],
        "dtype": "float32",
        "byte_order": "little",
        "order": "x_fastest",
        "origin": grid.origin.tolist(),
        "voxel_size": 0.1,
        "sign": "parity",
    }
    flat = np.fromfile(tmp_path / "a.raw", "<f4")
    n = np.arange(len(flat))
    ijk = np.stack([n % 27, n // 27 % 26, n // (27 * 26)], axis=1)
    assert_centered(flat, np.array(facts["origin"]) + facts["voxel_size"] * ijk)
    assert_array_equal(flat, grid.values[tuple(ijk.T)])


@pytest.mark.parametrize("kind", ["<f4", ">f4", "<f8", ">f8", "<f2", "|u1", "<i2", ">u2", ">i4"])
@pytest.mark.parametrize("order", ["x_fastest", "z_fastest"])
def test_raw_values_of_every_type_and_order_are_read(tmp_path, kind, order):
    values = np.random.default_rng(0).integers(0, 99, (3, 4, 5))
    stored = values if order == "z_fastest" else values.transpose(2, 1, 0)
    stored.astype(kind).tofile(tmp_path / "a.raw")
    facts = {
        "format": "meshsdf.raw/1",
        "shape": [3, 4, 5],
        "dtype": np.dtype(kind).name,
        "byte_order": "big" if kind[0] == ">" else "little",
        "order": order,
        "voxel_size": 2,
        "made_by": ["somebody", "else"],
    }
    (tmp_path / "a.json").write_text(json.dumps(facts))
    grid = read_raw(tmp_path / "a.raw")
    assert_array_equal(grid.values, values)
    assert grid.values.flags.c_contiguous
    assert (grid.voxel_size, grid.origin.tolist(), grid.sign) == (2, [0, 0, 0], "unsigned")
    assert probe_raw(tmp_path / "a.raw")["order"] == order


def test_a_raw_file_without_json_says_where_to_look(tmp_path):
    (tmp_path / "a.raw").write_bytes(bytes(8))
    with pytest.raises(
        IoError, match=r"there is no a\.raw\.json .*\n.*\n.*write a\.raw\.json beside it"
    ):
        read_volume(tmp_path / "a.raw")
    write_volume(tmp_path / "b.mhd", Grid(np.zeros((2, 2, 2)), 1.0, np.zeros(3)))
    (tmp_path / "b.raw").write_bytes(bytes(8))
    with pytest.raises(IoError, match=r"fix:   read .*b\.mhd"):
        read_volume(tmp_path / "b.raw")


def test_unity_gets_texels_in_a_box(tmp_path):
    grid, notes = sphere_grid(), []
    write_vf(tmp_path / "a.vf", grid, warn=notes.append)
    assert notes == ["Unity volume has no place for the voxel size 0.1, nor for 0.06, -3.49, -0.52"]
    data = (tmp_path / "a.vf").read_bytes()
    assert struct.unpack("<4s3H", data[:10]) == (b"VF_F", 27, 26, 28)
    values = np.frombuffer(data[10:], "<f4").reshape(28, 26, 27).transpose(2, 1, 0)
    assert_array_equal(values, grid.values)
    # The texture covers the box half a voxel beyond the nodes; texel n has its middle at n + 1/2
    low = grid.origin - STEP / 2
    texels = np.stack(np.indices(values.shape), axis=-1) + 0.5
    assert_centered(values, low + texels * STEP)


def test_a_unity_file_gets_a_box_around_zero_whose_longest_side_is_1(tmp_path):
    grid, notes = sphere_grid(), []
    write_vf(tmp_path / "a.vf", grid, normalized=True)
    back = read_vf(tmp_path / "a.vf", warn=notes.append)
    assert "its longest side is 1, so the voxel size is 0.0357143" in notes[0]
    assert_allclose(back.origin, -(np.array([27, 26, 28]) - 1) / 2 / 28, rtol=1e-15)
    # Divided by 2.8, distances are those to a sphere that is smaller by as much
    assert_allclose(back.values, grid.values / 2.8, rtol=2e-7)
    middle = grid.origin + STEP * (np.array([27, 26, 28]) - 1) / 2
    points = back.origin + back.voxel_size * np.stack(np.indices(back.values.shape), axis=-1)
    found = center_of_inside(back.values * 2.8, points)
    assert_allclose(found, (CENTER - middle) / 2.8, rtol=0, atol=1e-4 * STEP)


def test_unity_vectors_come_back_and_are_no_distances(tmp_path):
    vectors = np.random.default_rng(0).normal(size=(3, 4, 5, 3)).astype(np.float32)
    write_vf_vectors(tmp_path / "a.vf", vectors)
    data = (tmp_path / "a.vf").read_bytes()
    assert data[:4] == b"VF_V"
    assert_array_equal(np.frombuffer(data[10:22], "<f4"), vectors[0, 0, 0])
    assert_array_equal(np.frombuffer(data[22:34], "<f4"), vectors[1, 0, 0])
    assert_array_equal(read_vf_vectors(tmp_path / "a.vf"), vectors)
    assert probe_vf(tmp_path / "a.vf")["vectors"] is True
    with pytest.raises(IoError, match=r"holds vectors\n(.|\n)*read_vf_vectors"):
        read_volume(tmp_path / "a.vf")
    write_vf(tmp_path / "b.vf", sphere_grid())
    with pytest.raises(IoError, match="one number a node"):
        read_vf_vectors(tmp_path / "b.vf")


def test_odd_vf_files_are_refused(tmp_path):
    path = tmp_path / "a.vf"
    cases = [
        (b"VF2X" + bytes(73), "begins with 'VF2X'"),
        (b"VF_F\1\0", "cut off within its header"),
        (b"VF_F" + bytes(6), "claims 0 x 0 x 0 nodes"),
        (b"VF_F" + struct.pack("<3H", 1, 1, 1) + bytes(8), "8 bytes of values, but .* tell 4"),
        (b"VF_F" + struct.pack("<3Hf", 1, 1, 1, np.inf), "values are infinite"),
    ]
    for data, words in cases:
        path.write_bytes(data)
        with pytest.raises(IoError, match=words):
            read_vf(path)


def test_an_sdfgen_grid_is_read_as_its_author_writes_it(tmp_path):
    grid = sphere_grid()
    write_sdfgen(tmp_path / "a.sdf", grid)
    lines = (tmp_path / "a.sdf").read_text().splitlines()
    counts, origin, step = lines[0].split(), lines[1].split(), float(lines[2])
    assert counts == ["27", "26", "28"]
    values = np.array([float(line) for line in lines[3:]], np.float32)
    n = np.arange(len(values))
    ijk = np.stack([n % 27, n // 27 % 26, n // (27 * 26)], axis=1)
    assert_centered(values, np.array([float(x) for x in origin]) + step * ijk)
    assert_array_equal(values, grid.values[tuple(ijk.T)])
    # Blanks and more blanks are the same
    (tmp_path / "b.sdf").write_text("\r\n ".join(" ".join(lines).split()) + "\n\n")
    assert_array_equal(read_sdfgen(tmp_path / "b.sdf").values, grid.values)


def test_every_float32_survives_as_text(tmp_path):
    bits = np.random.default_rng(0).integers(0, 2**32, 60_000, np.uint32)
    edges = np.array([0, 1, 0x7FFFFF, 0x800000, 0x7F7FFFFF, 0x80000000, 0xFF7FFFFF], np.uint32)
    values = np.concatenate([bits, edges]).view(np.float32)
    values = values[np.isfinite(values)][:, None, None]
    write_sdfgen(tmp_path / "a.sdf", Grid(values, 1.0, np.zeros(3)))
    assert read_sdfgen(tmp_path / "a.sdf").values.tobytes() == values.tobytes()


def test_other_files_called_sdf_are_refused(tmp_path):
    path = tmp_path / "a.sdf"
    cases = [
        ("<?xml version='1.0'?><sdf version='1.6'><model name='a'></model></sdf>", "no text grid"),
        (
            "<?xml version='1.0'?> <sdf version='1.6'> <model name='a'> <link/> </model> </sdf>",
            "SD",
        ),
        ("2 2 2\n0 0 0\n1\n" + "1\n" * 7, "take|not a number|holds"),
        ("2 2 2\n0 0 0\n1\n" + "1\n" * 9, "not a number|holds"),
        ("2 2 2\n0 0 0\n-1\n" + "1\n" * 8, "its spacings are -1"),
        ("2 2 2.5\n0 0 0\n1\n" + "1\n" * 8, "the counts is '2 2 2.5'"),
        ("2 2 2\n0 0 0\n1\n" + "1\n" * 7 + "1e999\n", "values are infinite"),
        ("2 2 2\n0 0 0\n1\n" + "1\n" * 7 + "1e99\n", "values are infinite"),
        ("2 2 2\n0 0 0\n1\n" + "1\n" * 7 + "one\n", "line 8 holds 'one'"),
    ]
    for text, words in cases:
        path.write_text(text)
        with pytest.raises(IoError, match=words):
            read_sdfgen(path)
