"""meshsdf.cli: nothing is overwritten unasked, and a failure leaves the old file or none."""

import os
import subprocess
import sys

import pytest

from meshsdf.io import read_mesh, read_volume

from .examples import ball


@pytest.fixture
def mesh(tmp_path):
    return ball(tmp_path / "ball.ply")


def convert(cli, mesh, out, *options):
    return cli("convert", mesh, out, "--resolution", "8", *options)


def test_an_existing_output_is_kept_without_force_and_replaced_with_it(cli, mesh, tmp_path):
    out = tmp_path / "a.npz"
    out.write_text("precious")
    outcome = convert(cli, mesh, out)
    assert outcome.code == 2
    assert "the output exists" in outcome.err
    assert "pass --force to replace it" in outcome.err
    assert out.read_text() == "precious"
    assert convert(cli, mesh, out, "--force").code == 0
    assert read_volume(out).n_active > 0
    surface = tmp_path / "b.obj"
    surface.write_text("precious")
    assert cli("mesh", out, surface).code == 2
    assert surface.read_text() == "precious"
    assert cli("mesh", out, surface, "--force").code == 0
    assert read_mesh(surface).n_faces > 0
    assert sorted(os.listdir(tmp_path)) == ["a.npz", "b.obj", "ball.ply"]


def test_the_output_is_judged_before_the_input_is_loaded(cli, mesh, tmp_path, monkeypatch):
    def load(*_, **__):
        raise AssertionError("the mesh was loaded first")

    monkeypatch.setattr("meshsdf.io.meshes.read_mesh", load)
    (tmp_path / "file").write_text("")
    for out, words in (
        (tmp_path / "no" / "a.npz", "does not exist"),
        (tmp_path / "file" / "a.npz", "is a file, not a folder"),
        (tmp_path / "a.nzp", "a volume with suffix '.nzp' cannot be written"),
    ):
        outcome = convert(cli, mesh, out)
        assert outcome.code == 2
        assert words in outcome.err


def test_a_folder_that_takes_no_files_is_told_before_any_work(cli, mesh, monkeypatch):
    if not os.path.isdir("/proc/self/fd"):
        pytest.skip("this system has no folder that refuses even its administrator")
    monkeypatch.setattr("meshsdf.io.meshes.read_mesh", None)
    outcome = convert(cli, mesh, "/proc/self/a.npz")
    assert outcome.code == 2
    assert "OutputError: folder /proc/" in outcome.err
    assert "is not writable" in outcome.err
    assert "output /proc/self/a.npz" in outcome.err


LIMITED = """
import resource, signal, sys
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
from meshsdf.cli.main import run
import meshsdf.io.atomic, meshsdf.io.npz
from meshsdf.io.volumes import write_volume
def limited(*arguments, **options):
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))
    return write_volume(*arguments, **options)
import meshsdf.io.volumes
meshsdf.io.volumes.write_volume = limited
sys.exit(run(sys.argv[1:]))
"""


def test_a_write_that_fails_midway_leaves_the_old_file_and_nothing_else(mesh, tmp_path):
    pytest.importorskip("resource")
    out = tmp_path / "a.npz"
    out.write_text("precious")
    arguments = ["convert", str(mesh), str(out), "--resolution", "8", "--force"]
    done = subprocess.run([sys.executable, "-c", LIMITED, *arguments], capture_output=True)
    words = done.stderr.decode()
    assert done.returncode == 3, words
    assert "IoError: writing failed (File too large); the old file, if any, is intact" in words
    assert "Traceback" not in words
    assert out.read_text() == "precious"
    assert sorted(os.listdir(tmp_path)) == ["a.npz", "ball.ply"]


def test_a_full_disk_is_named(cli, mesh, tmp_path, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("meshsdf.io.atomic.os.fsync", full)
    out = tmp_path / "a.npz"
    outcome = convert(cli, mesh, out)
    assert outcome.code == 3
    assert f"disk full: {tmp_path} has no room left" in outcome.err
    assert os.listdir(tmp_path) == ["ball.ply"]


def test_names_with_spaces_and_letters_of_any_script_work(cli, tmp_path):
    folder = tmp_path / "мои модели ✓"
    folder.mkdir()
    mesh = ball(folder / "kugel schön 球.obj")
    volume, surface = folder / "völume 体.npz", folder / "zurück 面.ply"
    assert cli("convert", mesh, volume, "--resolution", 8, "--json").json["output"] == str(volume)
    assert cli("mesh", volume, surface).code == 0
    assert str(volume) in cli("info", volume).out
    assert cli("check", surface).code == 0


def test_a_name_that_is_no_text_is_printed_all_the_same(process, tmp_path):
    name = os.fsencode(tmp_path) + b"/caf\xe9.obj"
    try:
        os.close(os.open(name, os.O_CREAT | os.O_WRONLY))
    except OSError:
        pytest.skip("this file system takes only text as names")
    os.replace(ball(tmp_path / "ball.obj"), name)
    outcome = process("info", os.fsdecode(name))
    assert outcome.code == 0
    assert "320 faces" in outcome.out
    assert process("info", os.fsdecode(name), "--json").json["n_faces"] == 320
