"""meshsdf.cli.console: results on stdout, words on stderr, a bar only for people who wait."""

import os
import subprocess
import sys
import time

import click
import pytest

from meshsdf.cli import console as module
from meshsdf.cli.console import Console, file_size, plural

from .examples import ball

SHOW_CURSOR = b"\x1b[?25h"
HIDE_CURSOR = b"\x1b[?25l"


def test_numbers_are_written_for_people():
    assert plural(1, "face") == "1 face"
    assert plural(12345, "vertex", "vertices") == "12 345 vertices"
    assert [file_size(n) for n in (7, 1500, 7.2e6, 3e9)] == ["7 bytes", "1.5 kB", "7.2 MB", "3 GB"]


def test_json_is_all_there_is_on_stdout_and_warnings_go_to_stderr(cli, tmp_path):
    path = tmp_path / "a.obj"
    path.write_text("v 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n" + TETRAHEDRON)
    outcome = cli("check", path, "--json")
    assert outcome.code == 0
    assert next(iter(outcome.json)) == "schema"
    assert outcome.json["warnings"] == ["1 of 5 positions are used by no face; left out"]
    assert "warning: 1 of 5 positions" in outcome.err


TETRAHEDRON = "f 2 4 3\nf 2 3 5\nf 2 5 4\nf 3 4 5\n"


@pytest.fixture
def context():
    with click.Context(click.Command("test")) as context:
        yield context


def opened_bar(monkeypatch, *, is_terminal: bool, after: float) -> bool:
    """Whether a bar appears within 0.3 s when stderr is, or is not, a terminal."""
    monkeypatch.setattr(sys.stderr, "isatty", lambda: is_terminal)
    monkeypatch.setattr(module, "BAR_AFTER", after)
    console = Console("test", as_json=False)
    console.progress("distance", 0.5)
    end = time.perf_counter() + 0.3
    while console._bar is None and time.perf_counter() < end:
        time.sleep(0.01)
    was_open = console._bar is not None
    console.close()
    assert console._bar is None
    return was_open


def test_a_bar_appears_only_on_a_terminal_and_only_when_work_lasts(monkeypatch, context):
    assert opened_bar(monkeypatch, is_terminal=True, after=0.02)
    assert not opened_bar(monkeypatch, is_terminal=True, after=60.0)
    assert not opened_bar(monkeypatch, is_terminal=False, after=0.0)


@pytest.mark.parametrize("options", [[], ["--json"]], ids=["words", "json"])
def test_on_a_terminal_the_bar_is_drawn_on_stderr_and_taken_away(tmp_path, options):
    pty = pytest.importorskip("pty")
    mesh = ball(tmp_path / "ball.ply")
    code = (
        "import sys; from meshsdf.cli import console, main; console.BAR_AFTER = 0.0;"
        "sys.exit(main.run(sys.argv[1:]))"
    )
    ours, theirs = pty.openpty()
    arguments = ["roundtrip", str(mesh), "--resolution", "24", *options]
    running = subprocess.Popen(
        [sys.executable, "-c", code, *arguments],
        stdout=subprocess.PIPE,
        stderr=theirs,
        env=os.environ | {"TERM": "xterm", "COLUMNS": "80"},
    )
    os.close(theirs)
    drawn = b""
    while True:
        try:
            piece = os.read(ours, 65536)
        except OSError:  # the other end is closed
            break
        if not piece:
            break
        drawn += piece
    os.close(ours)
    printed = running.communicate(timeout=60)[0]
    assert running.returncode == 0
    assert HIDE_CURSOR in drawn
    assert drawn.rindex(SHOW_CURSOR) > drawn.rindex(HIDE_CURSOR)
    assert b"check" in drawn or b"load" in drawn or b"hausdorff" in drawn
    assert b"\x1b" not in printed
    assert printed.startswith(b"{" if options else str(mesh).encode())


def test_compiling_is_said_once_and_a_warm_cache_says_nothing(process, tmp_path):
    mesh = tmp_path / "a.obj"
    mesh.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    env = {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    cold = process("check", mesh, "--json", env=env)
    assert cold.code == 0
    assert cold.err.count("compiling kernels for this machine") == 1
    assert cold.json["two_set"] is True
    warm = process("check", mesh, "--json", env=env)
    assert (warm.code, warm.err) == (0, "")
