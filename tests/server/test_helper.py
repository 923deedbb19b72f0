"""meshsdf.server.helper: a process that compiles beside this one, and leaves nothing behind."""

import json
import os
import signal
import subprocess
import sys
import time

import pytest

from meshsdf import write_mesh
from meshsdf.kernels.parallel import n_threads
from meshsdf.mesh.primitives import icosphere

CODE = """
import json, os, sys, time
from numba import njit
from meshsdf.server.helper import Helper

@njit
def next_of(x):
    return x + 1

with Helper() as helper:
    before = helper._process is not None
    if "compile" in sys.argv:
        next_of(1.0)
    helper.go()
    is_helped = helper.wait() if "wait" in sys.argv else None
    process = helper._process
    if "wait" in sys.argv:
        process.wait(300)
    while "stop" in sys.argv and not os.listdir(os.environ["TMPDIR"]):
        time.sleep(0.05)
code = process and process.returncode
print(json.dumps([before, is_helped, code, os.listdir(os.environ["TMPDIR"])]))
"""
pytestmark = pytest.mark.skipif(n_threads() < 2, reason="one core: nobody can help")


def run(tmp_path, *words):
    """Whether it was there before compiling, whether it helped, its exit code, files it left."""
    env = os.environ | {"TMPDIR": str(tmp_path)}
    command = [sys.executable, "-c", CODE, *words]
    done = subprocess.run(command, env=env, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_it_is_not_started_where_nothing_is_compiled(tmp_path):
    assert run(tmp_path) == [False, None, None, []]


def test_it_starts_when_something_is_compiled_says_when_it_is_ready_and_ends(tmp_path):
    assert run(tmp_path, "compile", "wait") == [False, True, 0, []]


def test_it_is_stopped_with_its_owner_and_leaves_no_files(tmp_path):
    before, _, code, left = run(tmp_path, "compile", "stop")
    assert not before
    assert code is not None
    assert left == []


@pytest.mark.skipif(not hasattr(os, "killpg"), reason="no groups of processes")
def test_ctrl_c_while_a_new_machine_compiles_ends_both_and_leaves_no_files(tmp_path):
    mesh, kernels, temporary = tmp_path / "ball.obj", tmp_path / "kernels", tmp_path / "temporary"
    temporary.mkdir()
    write_mesh(mesh, icosphere(subdivisions=1))
    env = os.environ | {"TMPDIR": str(temporary), "NUMBA_CACHE_DIR": str(kernels)}
    command = [sys.executable, "-m", "meshsdf", "paint", str(mesh), "--port", "0"]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen(command, env=env, start_new_session=True, **pipes) as process:
        assert "compiling" in process.stderr.readline()
        while not list(temporary.iterdir()):
            time.sleep(0.05)
        time.sleep(2)  # seconds; the whole takes tens of them
        os.killpg(process.pid, signal.SIGINT)
        out, words = process.communicate(timeout=60)
    assert process.returncode == 130, words
    assert "interrupted" in words
    assert not out
    assert list(temporary.iterdir()) == []
    assert sorted(path.name for path in tmp_path.iterdir()) == ["ball.obj", "kernels", "temporary"]
