"""``meshsdf paint``: its start, its words, and its end."""

import os
import signal
import socket
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import httpx
import numpy as np
import pytest

from meshsdf.cli import paint as cli_paint
from meshsdf.cli.main import run
from meshsdf.io import read_mesh, write_mesh
from meshsdf.mesh.primitives import icosphere
from meshsdf.server.client import Painter
from meshsdf.server.paint import Place, _listening, seen_address
from meshsdf.texture.brush import Brush
from meshsdf.texture.journal import Project
from meshsdf.texture.volume_texture import VolumeTexture

POLE = np.array([[0.0, 0.0, 1.0]])
posix = pytest.mark.skipif(sys.platform == "win32", reason="signals are others there")

# Whoever runs the tests under nohup asks for servers that do not mind
HAS_NOHUP = signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
HANG_UP = signal.SIGTERM if HAS_NOHUP else signal.SIGHUP


@pytest.fixture
def mesh(tmp_path) -> Path:
    path = tmp_path / "ball.ply"
    write_mesh(path, icosphere(subdivisions=3))
    return path


class Listener:
    """Takes the place of a console: keeps what is said."""

    def __init__(self) -> None:
        self.said: list[str] = []
        self.say = self.warn = self.said.append

    def progress(self, stage: str, fraction: float) -> None:
        """Nobody waits."""


@contextmanager
def painting(*arguments, env: dict | None = None):
    """The process of a server, and the address that it printed."""
    command = [sys.executable, "-m", "meshsdf", "paint", *map(str, arguments)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    process = subprocess.Popen(command, env=os.environ | (env or {}), text=True, **pipes)
    try:
        yield process, process.stdout.readline().strip()
    finally:
        if process.poll() is None:
            process.kill()
        process.communicate()


def ended(process, number: signal.Signals) -> tuple[int, str, str]:
    """Exit code, the rest of stdout, and stderr, after a signal."""
    process.send_signal(number)
    out, err = process.communicate(timeout=60)
    return process.returncode, out, err


@pytest.fixture
def cli(capsys):
    def call(*arguments) -> tuple[int, str]:
        code = run(["paint", *map(str, arguments)])
        return code, capsys.readouterr().err

    return call


@posix
@pytest.mark.parametrize("number", ["SIGINT", "SIGTERM"])
def test_one_address_is_printed_and_a_signal_ends_it_in_peace(mesh, tmp_path, number):
    with painting(mesh, "--resolution", 24) as (process, address):
        base, token = address.split("/#t=")
        assert base.startswith("http://127.0.0.1:")
        assert len(token) >= 43
        with Painter(address) as painter:
            assert painter.facts["resolution"] == 24
            assert [layer["name"] for layer in painter.state["layers"]] == ["base", "paint"]
            painter.begin(1, Brush(0.3, color=(1.0, 0.0, 0.0, 1.0)))
            painter.dabs(POLE, POLE)
            painter.wait()  # the stroke is still open
            code, out, err = ended(process, getattr(signal, number))
            painter.close()
    assert code == 0, err
    assert out == ""
    assert "Traceback" not in err
    assert token not in err
    assert f"{mesh.with_suffix('.mtex')}: closed, with 3 steps" in err
    assert sorted(os.listdir(tmp_path)) == ["ball.mtex", "ball.ply"]  # no lock, no log, no draft
    with Project.open(tmp_path / "ball.mtex") as project:
        assert project.history.names[-1] == "stroke"
        assert np.allclose(project.texture.colors(POLE, POLE)[0], [1, 0, 0, 1], atol=0.01)


@posix
def test_a_second_server_is_told_who_has_the_project_and_a_killed_one_lost_nothing(mesh, tmp_path):
    with painting(mesh, "--resolution", 24) as (process, address), Painter(address) as painter:
        painter.operation("fill-color", layer=1, color=[0.0, 0.0, 1.0, 1.0])
        painter.wait()
        digest = painter.get_json("/api/digest")
        second = subprocess.run(
            [sys.executable, "-m", "meshsdf", "paint", str(mesh)],
            capture_output=True, text=True, timeout=60, check=False,
        )  # fmt: skip
        assert second.returncode == 3
        assert f"the project is open in process {process.pid}" in second.stderr
        process.kill()
        painter.close()
    with painting(mesh.with_suffix(".mtex")) as (process, address):
        base, token = address.split("/#t=")
        headers = {"authorization": f"Bearer {token}"}
        assert httpx.get(f"{base}/api/digest", headers=headers).json() == digest
        assert httpx.get(f"{base}/api/project", headers=headers).json()["name"] == "ball"
        assert ended(process, signal.SIGTERM)[0] == 0


def test_a_port_that_is_taken_is_told_and_the_project_is_closed_again(mesh, cli, tmp_path):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        code, err = cli(mesh, "--port", port, "--resolution", 16)
    assert code == 3
    assert f"ServerError: port {port} is in use by another program" in err
    assert "--port 0" in err
    assert sorted(os.listdir(tmp_path)) == ["ball.mtex", "ball.ply"]


def test_the_usual_port_is_taken_if_it_is_free_and_any_other_if_not():
    first = _listening(Place())
    second = _listening(Place())
    with first, second:
        ports = [one.getsockname()[1] for one in (first, second)]
    assert ports[0] != ports[1]


def test_an_address_of_others_is_refused_and_remote_ones_come_with_a_warning(mesh, cli):
    for address, reason in (("192.0.2.1", "is no address of this machine"), ("here", "no IP")):
        code, err = cli(mesh, "--resolution", 16, "--allow-remote", address)
        assert code == 3
        assert reason in err
        assert "warning: others on the network can reach this server" in err


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["ball.mtex", "--project", "other.mtex"], "MESH is a project already"),
        (["ball.ply", "--project", "other.glb"], "projects end in .mtex"),
        (["ball.ply", "--port", "65536"], "65536"),
        (["ball.ply", "--resolution", "0"], "0 is not above 0"),
        ([], "MESH"),
    ],
)
def test_misuse_is_told(mesh, cli, monkeypatch, arguments, reason):
    monkeypatch.chdir(mesh.parent)
    code, err = cli(*arguments)
    assert code == 2
    assert reason in err


@pytest.mark.parametrize("name", ["none.ply", "none.mtex", "notes.txt"])
def test_what_cannot_be_painted_is_told(cli, tmp_path, name):
    (tmp_path / "notes.txt").write_text("no mesh")
    code, err = cli(tmp_path / name)
    assert code == 3
    assert name in err


def test_without_the_extra_there_is_the_line_that_installs_it(mesh, tmp_path):
    empty = tmp_path / "empty"
    empty.mkdir()
    (empty / "h11.py").write_text('raise ModuleNotFoundError("none", name="h11")')
    done = subprocess.run(
        [sys.executable, "-m", "meshsdf", "paint", str(mesh)],
        capture_output=True, text=True, env=os.environ | {"PYTHONPATH": str(empty)}, check=False,
    )  # fmt: skip
    assert done.returncode == 3
    assert "painting needs the package h11, which is not installed" in done.stderr
    assert "pip install '.[paint]'" in done.stderr
    assert not mesh.with_suffix(".mtex").exists()


def test_a_missing_package_is_named_before_anything_is_read(cli, monkeypatch):
    monkeypatch.setattr(cli_paint, "EXTRA", (*cli_paint.EXTRA, "no_such_package"))
    code, err = cli("no_such_mesh.ply")
    assert code == 3
    assert "painting needs the package no_such_package" in err


def test_the_project_goes_beside_the_mesh_or_here_and_that_is_said(tmp_path, monkeypatch):
    listener = Listener()
    mesh = tmp_path / "far" / "ball.ply"
    mesh.parent.mkdir()
    assert cli_paint._project_file(listener, str(mesh), None) == mesh.with_suffix(".mtex")
    assert cli_paint._project_file(listener, str(mesh), "a.mtex") == Path("a.mtex")
    assert listener.said == []
    monkeypatch.setattr(cli_paint.os, "access", lambda path, mode: False)
    monkeypatch.chdir(tmp_path)
    assert cli_paint._project_file(listener, str(mesh), None) == Path("ball.mtex")
    assert listener.said == [
        f"nothing can be written beside {mesh}; the project is {tmp_path / 'ball.mtex'}"
    ]


def test_a_mesh_with_colours_of_its_own_begins_with_them(mesh, tmp_path):
    ball = read_mesh(mesh)
    colors = np.tile(np.array([0.0, 0.5, 0.0, 1.0], np.float32), (ball.n_vertices, 1))
    colored = type(ball)(ball.vertices, ball.faces, vertex_colors=colors)
    for made, wanted in ((colored, [0, 0.5, 0, 1]), (ball, [0.578, 0.578, 0.578, 1])):
        file = tmp_path / f"{len(os.listdir(tmp_path))}.mtex"
        listener = Listener()
        cli_paint._create(listener, file, made, 16)
        assert listener.said == [f"{file}: a new project"]
        with Project.open(file) as project:
            names = [layer.name for layer in project.texture.layers]
            assert names == ["base", "paint"]
            assert np.allclose(project.texture.colors(POLE)[0], wanted, atol=0.01)


def test_another_mesh_and_another_resolution_than_the_project_has_are_noticed(mesh):
    ball, other = read_mesh(mesh), icosphere(subdivisions=2)
    texture = VolumeTexture.around(ball, resolution=16)
    listener = Listener()
    cli_paint._say_what_differs(listener, texture, ball, 16)
    assert listener.said == []
    cli_paint._say_what_differs(listener, texture, other, 64)
    assert "the project was made around another mesh (1280 faces)" in listener.said[0]
    assert "the project keeps its 16 texels along the longest side" in listener.said[1]


@pytest.mark.parametrize(
    ("address", "seen"),
    [("127.0.0.1", "127.0.0.1"), ("192.168.0.7", "192.168.0.7"), ("::1", "[::1]")],
)
def test_an_address_is_written_as_browsers_want_it(address, seen):
    assert seen_address(address) == seen


def test_of_all_addresses_one_is_named():
    assert seen_address("0.0.0.0") not in ("0.0.0.0", "")


@posix
def test_the_page_is_opened_without_telling_others_the_token(mesh, tmp_path):
    note = tmp_path / "note"
    browser = tmp_path / "browser"
    browser.write_text(f'#!/bin/sh\necho "$1" > {note}.tmp; cp "${{1#file://}}" {note}.html\n'
                       f"mv {note}.tmp {note}\n")  # fmt: skip
    browser.chmod(0o755)
    own = {"BROWSER": str(browser)}
    with painting(mesh, "--resolution", 16, "--open", env=own) as (process, address):
        for _ in range(200):
            if note.exists():
                break
            time.sleep(0.05)
        assert ended(process, HANG_UP)[0] == 0
    told = note.read_text().strip()
    assert told.startswith("file://")
    assert address.split("#t=")[1] not in told
    assert f"url={address}" in Path(f"{note}.html").read_text()
    assert not Path(told.removeprefix("file://")).exists()
