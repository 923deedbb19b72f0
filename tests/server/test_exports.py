"""meshsdf.server.exports: into the project's folder, and over nobody's files."""

import os
import string
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from meshsdf.errors import IoError
from meshsdf.io import read_mesh
from meshsdf.io.pictures import read_picture
from meshsdf.mesh.primitives import icosphere
from meshsdf.server.exports import FORMATS, Exports, checked_name, image_size
from meshsdf.server.limits import Refused
from meshsdf.texture.atlas import atlas_for, textured
from meshsdf.texture.volume_texture import VolumeTexture

MESH = icosphere(subdivisions=2)
RED = (0.8, 0.1, 0.1)


@pytest.fixture(scope="module")
def texture():
    made = VolumeTexture.around(MESH, resolution=16)
    made.add_layer(color=RED)
    return made


@pytest.fixture
def exports(tmp_path):
    return Exports(tmp_path / "painted.mtex", size=128)


def copying(data: bytes):
    """A way to save a project that writes these bytes."""
    return lambda path: path.write_bytes(data)


@pytest.mark.parametrize(
    ("name", "files"),
    [
        ("a.glb", {"a.glb"}),
        ("a.ply", {"a.ply"}),
        ("a.obj", {"a.obj", "a.mtl", "a-a.png"}),
        ("a.png", {"a.png", "a-atlas.obj"}),
        ("a.exr", {"a.exr", "a-atlas.obj"}),
        ("a.vdb", {"a.vdb"}),
        ("my ball é.GLB", {"my ball é.GLB"}),
    ],
)
def test_each_format_and_what_belongs_to_it(exports, texture, tmp_path, name, files):
    written = exports.write(name, texture, MESH)
    assert written.names[0] == name
    assert set(written.names) == set(os.listdir(tmp_path)) == files
    assert written.n_bytes == sum((tmp_path / one).stat().st_size for one in files)
    assert all(exports.find(one) == tmp_path / one for one in files)
    again = exports.write(name, texture, MESH)
    assert again.names == written.names
    assert set(os.listdir(tmp_path)) == files


def test_what_was_painted_is_in_the_files(exports, texture, tmp_path):
    exports.write("a.ply", texture, MESH)
    assert np.allclose(read_mesh(tmp_path / "a.ply").vertex_colors[:, :3], RED, atol=0.01)
    exports.write("a.exr", texture, MESH)
    assert np.allclose(read_picture(tmp_path / "a.exr")[..., :3], RED, atol=0.01)
    for name in ("a.glb", "a.obj"):
        exports.write(name, texture, MESH)
        (material,) = read_mesh(tmp_path / name).materials
        assert np.abs(material.image[..., :3].astype(int) - [231, 89, 89]).max() <= 1


def test_a_file_of_others_stays_and_ours_gets_a_number(exports, texture, tmp_path):
    (tmp_path / "a.glb").write_text("precious")
    (tmp_path / "a-2.glb").mkdir()
    written = exports.write("a.glb", texture, MESH)
    assert written.names == ("a-3.glb",)
    assert "a.glb was there already, so this is a-3.glb" in written.notes
    assert (tmp_path / "a.glb").read_text() == "precious"
    with pytest.raises(Refused, match=r"there is no export 'a\.glb'"):
        exports.find("a.glb")


@pytest.mark.parametrize("taken", ["a.mtl", "a-a.png"])
def test_a_file_that_an_export_brings_along_stays_too(exports, texture, tmp_path, taken):
    (tmp_path / taken).write_text("precious")
    assert exports.write("a.obj", texture, MESH).names[0] == "a-2.obj"
    assert (tmp_path / taken).read_text() == "precious"


def test_an_export_that_was_replaced_by_somebody_is_no_longer_ours(exports, texture, tmp_path):
    exports.write("a.ply", texture, MESH)
    other = tmp_path / "other"
    other.write_text("precious")
    os.replace(other, tmp_path / "a.ply")
    with pytest.raises(Refused):
        exports.find("a.ply")
    assert exports.write("a.ply", texture, MESH).names == ("a-2.ply",)
    assert (tmp_path / "a.ply").read_text() == "precious"


def test_an_export_that_somebody_edited_is_theirs_now(exports, texture, tmp_path):
    exports.write("a.ply", texture, MESH)
    with open(tmp_path / "a.ply", "ab") as file:
        file.write(b"comment")
    edited = (tmp_path / "a.ply").read_bytes()
    assert exports.write("a.ply", texture, MESH).names == ("a-2.ply",)
    assert (tmp_path / "a.ply").read_bytes() == edited


def test_the_mesh_beside_an_image_has_none_of_its_own(exports, texture, tmp_path):
    own = textured(texture, atlas_for(MESH, 128, "squares"))
    assert exports.write("a.png", texture, own).names == ("a.png", "a-atlas.obj")
    assert not read_mesh(tmp_path / "a-atlas.obj").materials


def test_every_mesh_fits_onto_its_image_whoever_laid_it_out():
    for subdivisions in (1, 3, 5):
        ball = icosphere(subdivisions=subdivisions)
        size = image_size(ball, 32)
        assert atlas_for(ball, size, "squares").coverage > 0.1
        assert size < 4 * 9 * np.sqrt(ball.n_faces)
    assert image_size(MESH, 2048) == 2048


def test_all_images_of_a_run_are_laid_out_alike(exports, texture, tmp_path):
    notes = [exports.write(name, texture, MESH).notes for name in ("a.glb", "a.obj", "a.png")]
    assert notes[0] == notes[1] == notes[2]
    meshes = [read_mesh(tmp_path / name) for name in ("a.glb", "a.obj", "a-atlas.obj")]
    assert all(np.allclose(one.uv, meshes[0].uv, atol=1e-6) for one in meshes)
    assert "the mesh's own" not in notes[0][0]  # it has none


def test_no_link_leads_out_of_the_folder(texture, tmp_path):
    inside, outside = tmp_path / "inside", tmp_path / "outside"
    inside.mkdir()
    outside.mkdir()
    (outside / "a.glb").write_text("precious")
    (inside / "a.glb").symlink_to(outside / "a.glb")
    (inside / "b.glb").symlink_to(outside / "new.glb")
    exports = Exports(inside / "painted.mtex", size=128)
    assert exports.write("a.glb", texture, MESH).names == ("a-2.glb",)
    assert exports.write("b.glb", texture, MESH).names == ("b-2.glb",)
    exports.write("c.glb", texture, MESH)
    (inside / "c.glb").unlink()
    (inside / "c.glb").symlink_to(outside / "a.glb")
    with pytest.raises(Refused):
        exports.find("c.glb")
    assert exports.write("c.glb", texture, MESH).names == ("c-2.glb",)
    assert os.listdir(outside) == ["a.glb"]
    assert (outside / "a.glb").read_text() == "precious"


def test_what_a_killed_owner_left_half_written_is_deleted(texture, tmp_path):
    code = """
import os, sys
from pathlib import Path
from meshsdf.server.exports import Exports
exports = Exports(Path(sys.argv[1]))
exports.save_project("copy.mtex", lambda path: (path.write_bytes(b"half"), os._exit(9)))
"""
    script = [sys.executable, "-c", code]
    for name in ("painted.mtex", "other.mtex"):
        assert subprocess.run([*script, str(tmp_path / name)]).returncode == 9
    assert len(os.listdir(tmp_path)) == 2
    exports = Exports(tmp_path / "painted.mtex", size=128)
    (left,) = os.listdir(tmp_path)  # the other's
    exports.write("a.ply", texture, MESH)
    assert sorted(os.listdir(tmp_path)) == [left, "a.ply"]


@pytest.mark.parametrize(
    "name",
    [
        "../a.glb", "/etc/a.glb", "a/b.glb", "a\\b.glb", "..", ".", "", ".a.glb", "-a.glb",
        "~a.glb", "a.glb ", " a.glb", "a.glb.", "C:a.glb", "a\0.glb", "a\n.glb", "a?.glb",
        "CON.glb", "nul.vdb", "com1.x.glb", "a.html", "a.mtex-wal", "a.py", "glb", "a.glb/",
        "a" * 97 + ".glb", "é" * 49 + ".glb", "\ud800.glb", None, 7, ["a.glb"], {"a": "b.glb"},
    ],
)  # fmt: skip
def test_what_is_no_plain_name_is_refused(exports, texture, tmp_path, name):
    with pytest.raises(Refused) as refused:
        checked_name(name)
    assert refused.value.status == 400
    if isinstance(name, str):
        with pytest.raises(Refused):
            exports.write(name, texture, MESH)
        with pytest.raises(Refused):
            exports.save_project(name, copying(b""))
    assert os.listdir(tmp_path) == []


@given(st.text(string.printable + "é\u202e\u2028", max_size=20), st.sampled_from([*FORMATS]))
def test_a_name_that_is_taken_stays_in_the_folder(stem, suffix):
    try:
        name = checked_name(stem + suffix)
    except Refused:
        return
    assert Path("/folder", name).resolve().parent == Path("/folder")
    assert Path(name).name == name
    assert name.isprintable()


def test_a_copy_of_the_project_is_numbered_as_the_project_itself_is_no_export(exports, tmp_path):
    (tmp_path / "ball.mtex").write_text("the project")
    written = exports.save_project("ball.mtex", copying(b"copy"))
    assert written.names == ("ball-2.mtex",)
    assert (tmp_path / "ball.mtex").read_text() == "the project"
    assert (tmp_path / "ball-2.mtex").read_bytes() == b"copy"
    with pytest.raises(Refused, match=r"a project's copy is no \.glb"):
        exports.save_project("a.glb", copying(b""))


def test_a_failure_leaves_what_was_there(exports, texture, tmp_path):
    exports.save_project("a.mtex", copying(b"good"))

    def failing(path):
        path.write_bytes(b"half")
        raise IoError("disk full", "here", "free some")

    with pytest.raises(IoError, match="disk full"):
        exports.save_project("a.mtex", failing)
    assert os.listdir(tmp_path) == ["a.mtex"]
    assert (tmp_path / "a.mtex").read_bytes() == b"good"


def test_a_file_that_appears_meanwhile_is_not_replaced(exports, tmp_path):
    def slow(path):
        path.write_bytes(b"ours")
        (tmp_path / path.name).write_bytes(b"theirs")

    written = exports.save_project("a.mtex", lambda path: (path.name == "a.mtex" and slow(path),
                                                           path.write_bytes(b"ours")))  # fmt: skip
    assert written.names == ("a-2.mtex",)
    assert (tmp_path / "a.mtex").read_bytes() == b"theirs"
    assert (tmp_path / "a-2.mtex").read_bytes() == b"ours"


def test_stopping_leaves_nothing_half_written(exports, tmp_path):
    inside, stopped = threading.Event(), threading.Event()

    def waiting(path):
        path.write_bytes(b"half")
        inside.set()
        stopped.wait(10)

    def export():
        with pytest.raises(OSError, match="No such file"):
            exports.save_project("a.mtex", waiting)

    thread = threading.Thread(target=export)
    thread.start()
    inside.wait(10)
    assert len(os.listdir(tmp_path)) == 1
    exports.stop()
    stopped.set()
    thread.join()
    assert os.listdir(tmp_path) == []
