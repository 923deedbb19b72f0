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
