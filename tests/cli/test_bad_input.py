"""meshsdf.cli: input that cannot be used ends with one clear sentence and exit code 3."""

import numpy as np
import pytest

from meshsdf.grid import Grid
from meshsdf.io import write_volume

from .examples import MESH_SUFFIXES, any_format, ball, random_bytes

EMPTY_FILES = {
    "empty.obj": "",
    "comment.obj": "# nothing here\n",
    "points.obj": "v 0 0 0\nv 1 0 0\nv 0 1 0\n",
    "lines.obj": "v 0 0 0\nv 1 0 0\nv 0 1 0\nl 1 2 3\n",
    "empty.off": "OFF\n0 0 0\n",
    "points.off": "OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n",
    "empty.stl": "solid nothing\nendsolid nothing\n",
    "points.ply": "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
    "property float z\nend_header\n0 0 0\n1 0 0\n",
}
NOT_FINITE = {"nan": "nan", "inf": "inf", "huge": "1e999", "negative": "-inf"}
INDICES = {"past": "1 2 4", "zero": "0 1 2", "far": "1 2 99999999999999999999", "back": "-1 -2 -9"}


def assert_refused(outcome, *words, code=3):
    assert outcome.code == code
    assert outcome.out == ""
    what, where, fix = outcome.err.strip().splitlines()[-3:]
    assert what.split(":")[0].endswith("Error")
    assert where.startswith("  where: ")
    assert fix.startswith("  fix:   ")
    for word in words:
        assert word in outcome.err


def test_a_missing_file_is_named_and_a_near_one_suggested(cli, tmp_path):
    assert_refused(cli("check", tmp_path / "a.obj"), "no such file", "check the name")
    ball(tmp_path / "bunny.obj")
    assert_refused(cli("check", tmp_path / "buny.obj"), "no such file", "did you mean", "bunny.obj")
    assert_refused(cli("info", tmp_path / "no" / "a.obj"), "no such file", "check the folder")


@pytest.mark.parametrize("command", ["check", "info", "roundtrip"])
def test_a_folder_is_no_file(cli, tmp_path, command):
    assert_refused(cli(command, tmp_path), "this is a folder, not a file")


def test_an_unknown_suffix_gets_the_nearest_suggested(cli, tmp_path):
    (tmp_path / "a.objj").write_text("")
    assert_refused(cli("check", tmp_path / "a.objj"), "suffix '.objj'", "did you mean .obj?")
    (tmp_path / "a").write_text("")
    assert_refused(cli("check", tmp_path / "a"), "the name has no suffix", ".obj, .ply")


def test_a_volume_is_no_mesh_and_a_mesh_no_volume(cli, tmp_path):
    mesh, volume = ball(tmp_path / "a.obj"), tmp_path / "a.npz"
    write_volume(volume, Grid(np.ones((2, 2, 2)), 1.0, np.zeros(3)))
    outcome = cli("check", volume)
    assert_refused(outcome, "a mesh with suffix '.npz' cannot be read: that is a volume")
    assert "did you mean" not in outcome.err
    outcome = cli("mesh", mesh, tmp_path / "b.ply")
    assert_refused(outcome, "a volume with suffix '.obj' cannot be read: that is a mesh")
    outcome = cli("convert", mesh, tmp_path / "b.ply")
    assert_refused(outcome, "a volume with suffix '.ply' cannot be written: that is a mesh", code=2)


@pytest.mark.parametrize("name", EMPTY_FILES)
def test_a_file_without_faces_is_refused(cli, tmp_path, name):
    path = tmp_path / name
    path.write_text(EMPTY_FILES[name])
    assert_refused(cli("check", path), f"{name} is not a readable", "no ")


@pytest.mark.parametrize("suffix", MESH_SUFFIXES)
def test_a_file_of_no_bytes_is_refused(cli, tmp_path, suffix):
    path = tmp_path / f"nothing{suffix}"
    path.write_bytes(b"")
    assert_refused(cli("info", path), f"nothing{suffix} is not a readable")


@pytest.mark.parametrize("number", NOT_FINITE.values(), ids=NOT_FINITE)
def test_positions_must_be_finite(cli, tmp_path, number):
    path = tmp_path / "a.obj"
    path.write_text(f"v 0 0 0\nv 1 0 0\nv 0 {number} 0\nf 1 2 3\n")
    assert_refused(cli("check", path), "a.obj is not a readable OBJ file")


@pytest.mark.parametrize("corners", INDICES.values(), ids=INDICES)
def test_faces_must_name_vertices_that_exist(cli, tmp_path, corners):
    path = tmp_path / "a.obj"
    path.write_text(f"v 0 0 0\nv 1 0 0\nv 0 1 0\nf {corners}\n")
    assert_refused(cli("check", path), "a.obj is not a readable OBJ file")


@pytest.mark.parametrize("points", ["0 0 0", "1 2 3"], ids=["origin", "elsewhere"])
def test_faces_without_area_cannot_be_converted(cli, tmp_path, points):
    path = tmp_path / "a.obj"
    path.write_text(f"v {points}\nv {points}\nv {points}\nf 1 2 3\n")
    assert cli("check", path).code in (0, 1)
    assert_refused(cli("convert", path, tmp_path / "a.npz"))
    assert_refused(cli("convert", path, tmp_path / "a.npz", "--voxel-size", "0.1"))
    path.write_text("v 0 0 0\nv 1 1 1\nv 3 3 3\nf 1 2 3\nf 1 1 2\n")
    assert_refused(cli("convert", path, tmp_path / "a.npz"), "area")
    assert not (tmp_path / "a.npz").exists()


@pytest.mark.parametrize("suffix", MESH_SUFFIXES)
def test_a_mesh_cut_short_never_ends_in_a_traceback(cli, tmp_path, suffix):
    whole = any_format(tmp_path, suffix).read_bytes()
    path = tmp_path / f"cut{suffix}"
    codes = set()
    for tenth in range(10):
        path.write_bytes(whole[: len(whole) * tenth // 10])
        outcome = cli("check", path)
        codes.add(outcome.code)
        assert outcome.code in (0, 1, 3)
        if outcome.code == 3:
            assert_refused(outcome, f"cut{suffix} is not a readable")
    assert 3 in codes


def test_a_volume_cut_short_is_refused(cli, tmp_path):
    volume = tmp_path / "a.npz"
    ball(tmp_path / "a.ply")
    assert cli("convert", tmp_path / "a.ply", volume, "--resolution", 8).code == 0
    whole = volume.read_bytes()
    for tenth in range(10):
        volume.write_bytes(whole[: len(whole) * tenth // 10])
        assert_refused(cli("mesh", volume, tmp_path / "b.ply"), "a.npz is not a readable volume")
        assert_refused(cli("info", volume), "a.npz is not a readable volume")


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("suffix", MESH_SUFFIXES)
def test_noise_is_refused(cli, tmp_path, suffix, seed):
    path = random_bytes(tmp_path / f"noise{suffix}", seed)
    assert_refused(cli("check", path), f"noise{suffix} is not a readable")


def test_a_volume_of_noise_is_refused(cli, tmp_path):
    path = random_bytes(tmp_path / "noise.npz", 0)
    assert_refused(cli("info", path), "noise.npz is not a readable volume")
    assert_refused(cli("mesh", path, tmp_path / "a.ply"), "noise.npz is not a readable volume")


def test_text_that_is_no_mesh_is_refused_by_the_program_itself(process, tmp_path):
    path = tmp_path / "poem.stl"
    path.write_text("solid ground\nand nothing else that we know of\n" * 9)
    assert_refused(process("check", path), "poem.stl is not a readable STL file")


def test_parity_of_an_open_mesh_is_refused_with_the_number_of_open_edges(cli, tmp_path):
    path = tmp_path / "a.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    outcome = cli("convert", path, tmp_path / "a.npz", "--sign", "parity")
    assert_refused(outcome, "3 open edges", "winding")


def test_a_level_that_nothing_crosses_is_refused(cli, tmp_path):
    volume = tmp_path / "a.npz"
    write_volume(volume, Grid(np.ones((3, 3, 3)), 1.0, np.zeros(3)))
    assert_refused(cli("mesh", volume, tmp_path / "a.ply"), "no value crosses the level 0")
    assert not (tmp_path / "a.ply").exists()
