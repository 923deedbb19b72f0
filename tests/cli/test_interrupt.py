"""meshsdf.cli: Ctrl-C ends with exit code 130, one line, and no half-written file."""

import os
import signal
import subprocess
import sys
import threading
import time

import pytest

from meshsdf.cli.console import Console

from .examples import ball

LONG = ["--resolution", "1500", "--dense", "--max-memory", "100G"]


@pytest.fixture(scope="module")
def mesh(tmp_path_factory):
    return ball(tmp_path_factory.mktemp("interrupt") / "ball.ply", subdivisions=6)


@pytest.mark.skipif(sys.platform == "win32", reason="SIGINT is sent otherwise there")
@pytest.mark.parametrize("delay", [0.0, 0.4, 1.5])
def test_ctrl_c_leaves_the_old_file_and_nothing_else(mesh, tmp_path, delay):
    out = tmp_path / "a.npz"
    out.write_text("precious")
    command = [sys.executable, "-m", "meshsdf", "convert", str(mesh), str(out), "--force", *LONG]
    running = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    wait_until_it_reads(running, mesh)
    time.sleep(delay)
    running.send_signal(signal.SIGINT)
    printed, words = (text.decode() for text in running.communicate(timeout=60))
    assert running.returncode == 130, words
    assert printed == ""
    lines = [line for line in words.splitlines() if not line.startswith("compiling")]
    assert lines == ["interrupted; nothing is left half written"]
    assert out.read_text() == "precious"
    assert os.listdir(tmp_path) == ["a.npz"]


def wait_until_it_reads(running: subprocess.Popen, mesh) -> None:
    """Return once the libraries are imported: numba's is among the mapped files."""
    maps = f"/proc/{running.pid}/maps"
    if not os.path.exists(maps):
        time.sleep(1.0)
        return
    for _ in range(200):
        with open(maps) as file:
            if "libllvmlite" in file.read():
                return
        time.sleep(0.05)


def test_ctrl_c_while_a_file_is_written_removes_what_was_written(cli, tmp_path, monkeypatch):
    small = ball(tmp_path / "ball.ply")

    def stopped(file):
        assert len(os.listdir(tmp_path)) == 2  # the mesh, and the file being written
        raise KeyboardInterrupt

    monkeypatch.setattr("meshsdf.io.atomic.os.fsync", stopped)
    outcome = cli("convert", small, tmp_path / "a.npz", "--resolution", "8")
    assert outcome.code == 130
    assert outcome.err.strip().splitlines()[-1] == "interrupted; nothing is left half written"
    assert os.listdir(tmp_path) == ["ball.ply"]


def test_an_interrupt_that_python_dropped_is_raised_at_the_next_progress(monkeypatch):
    pressed = threading.Event()
    monkeypatch.setattr("meshsdf.cli.console.CTRL_C", pressed)
    pressed.set()
    with pytest.raises(KeyboardInterrupt):
        object.__new__(Console).progress("edges", 1.0)  # one made whole needs a running command


@pytest.mark.skipif(sys.platform == "win32", reason="signals are sent otherwise there")
@pytest.mark.parametrize(
    ("number", "seen", "delay"),
    [
        (signal.SIGINT, "", 0.0),
        (signal.SIGINT, ".new", 0.0),
        (signal.SIGINT, "-wal", 0.3),
        (signal.SIGTERM, "-lock", 0.0),
        (signal.SIGTERM, "-wal", 0.1),
    ],
)
def test_a_texture_that_is_stopped_leaves_nothing(tmp_path, number, seen, delay):
    small, out = ball(tmp_path / "ball.ply", subdivisions=4), tmp_path / "a.mtex"
    command = [sys.executable, "-m", "meshsdf", "texture", "procedural", str(small), str(out)]
    command += ["--kind", "wood_grain", "--resolution", "800", "--level", "0"]
    running = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    while not any(name.endswith(seen) and name != small.name for name in names_below(tmp_path)):
        assert running.poll() is None, "it ended before it was stopped"
        time.sleep(0.002)
    time.sleep(delay)
    running.send_signal(number)
    printed, words = (text.decode() for text in running.communicate(timeout=120))
    assert running.returncode == 128 + number, words
    assert printed == ""
    assert words.splitlines()[-1] == "interrupted; nothing is left half written"
    assert os.listdir(tmp_path) == ["ball.ply"]


def names_below(folder) -> list[str]:
    """Files and folders, however fast they come and go."""
    return [name for _, folders, files in os.walk(folder) for name in folders + files]


@pytest.mark.skipif(sys.platform == "win32", reason="SIGTERM ends a process at once there")
@pytest.mark.parametrize("name", ["a.npz", "a.zarr"])
def test_sigterm_leaves_the_old_file_and_nothing_else(mesh, tmp_path, name):
    out = tmp_path / name
    command = [sys.executable, "-m", "meshsdf", "convert", str(mesh), str(out), *LONG]
    running = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    wait_until_it_reads(running, mesh)
    running.send_signal(signal.SIGTERM)
    _, words = (text.decode() for text in running.communicate(timeout=60))
    assert running.returncode == 143, words
    assert "nothing is left half written" in words
    assert os.listdir(tmp_path) == []
