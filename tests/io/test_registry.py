"""meshsdf.io.registry: a suffix names a format."""

import numpy as np
import pytest

import meshsdf.io
from meshsdf.errors import IoError
from meshsdf.grid import Grid
from meshsdf.io import check_input, read_volume, write_volume
from meshsdf.io.registry import FORMATS, format_of, kind_of, suffixes
from meshsdf.io.volumes import check_volume_output, probe_volume


def test_every_format_names_functions_that_exist():
    for format in FORMATS:
        for name in (format.reader, format.writer, format.prober):
            assert name == "" or callable(format.function(name))


def test_no_suffix_belongs_to_two_formats():
    assert len(set(suffixes())) == len(suffixes())
    assert set(suffixes("mesh")) | set(suffixes("volume")) == set(suffixes())
    assert {".obj", ".ply", ".stl", ".off", ".glb", ".gltf"} <= set(suffixes("mesh"))
    assert ".npz" in suffixes("volume")


def test_capitals_do_not_matter():
    assert format_of("A.STL").name == "STL"
    assert format_of("a.Npz", "volume").name == "NPZ volume"
    assert (kind_of("a.PLY"), kind_of("a.npz")) == ("mesh", "volume")


def test_every_public_name_exists():
    for name in meshsdf.io.__all__:
        assert callable(getattr(meshsdf.io, name))
    with pytest.raises(AttributeError, match="no attribute 'read_minds'"):
        _ = meshsdf.io.read_minds


@pytest.mark.parametrize(
    ("wrong", "right"), [("a.stel", ".stl"), ("a.objj", ".obj"), ("a.glbf", ".glb")]
)
def test_a_slip_gets_the_nearest_suffix_suggested(wrong, right):
    with pytest.raises(IoError, match=rf"did you mean \{right}\?"):
        format_of(wrong, "mesh")


def test_a_mesh_is_no_volume():
    with pytest.raises(IoError, match=r"a volume with suffix '\.obj' cannot be read"):
        read_volume("a.obj")
    with pytest.raises(IoError, match=r"use one of \.npz"):
        write_volume("a.xyz", Grid(np.zeros((1, 1, 1)), 1.0, np.zeros(3)))


def test_volumes_pass_through_by_suffix(tmp_path):
    path = tmp_path / "a.npz"
    write_volume(path, Grid(np.ones((2, 2, 2)), 1.0, np.zeros(3)), half=True)
    assert read_volume(path).values.dtype == np.float32
    assert probe_volume(path)["dtype"] == "float16"
    with pytest.raises(IoError, match="the output exists"):
        write_volume(path, Grid(np.ones((2, 2, 2)), 1.0, np.zeros(3)))


def test_a_writer_takes_its_own_options_and_no_others(tmp_path):
    path, grid = tmp_path / "a.vdb", Grid(np.ones((2, 2, 2), np.float32), 1.0, np.zeros(3))
    write_volume(path, grid, options={"compression": "zip", "name": "torso"})
    (facts,) = probe_volume(path)["grids"]
    assert (facts["name"], facts["compression"]) == ("torso", "zip + active values")
    with pytest.raises(IoError, match="format 'NPZ volume' have no option 'compression'"):
        write_volume(tmp_path / "a.npz", grid, options={"compression": "zip"})
    assert not (tmp_path / "a.npz").exists()


@pytest.mark.parametrize(
    ("name", "beside"),
    [("a.raw", "a.raw.json"), ("a.exr", "a.exr.json"), ("a.nhdr", "a.raw.gz"), ("a.mhd", "a.zraw")],
)
def test_files_beside_an_output_are_judged_with_it(tmp_path, name, beside):
    grid = Grid(np.ones((2, 2, 2), np.float32), 1.0, np.zeros(3))
    write_volume(tmp_path / name, grid)
    assert (tmp_path / beside).is_file()
    check_volume_output(tmp_path / name, force=True)
    (tmp_path / name).unlink()
    with pytest.raises(IoError, match="the output exists"):
        check_volume_output(tmp_path / name)
    with pytest.raises(IoError, match="that is a mesh"):
        check_volume_output(tmp_path / "a.ply")


def test_an_input_is_judged_before_it_is_read(tmp_path):
    (tmp_path / "bunny.obj").write_text("")
    check_input(tmp_path / "bunny.obj", kind="mesh")
    with pytest.raises(IoError, match=r"did you mean .*bunny\.obj\?"):
        check_input(tmp_path / "buny.obj")
    with pytest.raises(IoError, match="this is a folder"):
        check_input(tmp_path)
    with pytest.raises(IoError, match="that is a mesh"):
        check_input(tmp_path / "bunny.obj", kind="volume")
