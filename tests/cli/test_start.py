"""meshsdf.cli.main: it starts at once, and ends well whoever reads its output."""

import os
import subprocess
import sys

import pytest

from meshsdf.cli.main import COMMANDS

from .examples import ball, box_without_lid

HEAVY = ("numpy", "numba", "scipy", "trimesh", "matplotlib", "rich", "jinja2", "PIL")
HELP = """
import sys
from meshsdf.cli.main import run
codes = [run(line.split()) for line in sys.argv[1].split(",")]
print(codes, [name for name in sys.argv[2].split(",") if name in sys.modules], file=sys.stderr)
"""


def test_help_imports_no_array_library():
    lines = ["--help", "--version", "chek", *(f"{name} --help" for name in COMMANDS)]
    command = [sys.executable, "-c", HELP, ",".join(lines), ",".join(HEAVY)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    codes = [2 if line == "chek" else 0 for line in lines]
    assert done.stderr.splitlines()[-1] == f"{codes} []"
    assert done.stdout.count("Example: meshsdf ") == 1 + len(COMMANDS)


def test_every_command_tells_what_it_does_and_shows_a_line_that_runs(cli):
    for name, summary in COMMANDS.items():
        assert summary.split()[0] in cli("--help").out
        outcome = cli(name, "--help")
        assert outcome.code == 0
        assert f"Usage: meshsdf {name} " in outcome.out
        assert outcome.out.strip().splitlines()[-1].startswith(f"  Example: meshsdf {name} ")
    assert cli("--version").out.startswith("meshsdf, version ")
    assert cli().code == 2


def test_it_runs_as_a_module(process, tmp_path):
    outcome = process("info", ball(tmp_path / "ball.ply"))
    assert (outcome.code, outcome.err) == (0, "")
    assert "162 vertices, 320 faces" in outcome.out


@pytest.mark.skipif(sys.platform == "win32", reason="pipes end otherwise there")
def test_a_reader_that_leaves_early_changes_neither_words_nor_exit_code(tmp_path):
    mesh = box_without_lid(tmp_path / "open.ply")
    command = [sys.executable, "-m", "meshsdf", "check", str(mesh)]
    running = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    running.stdout.close()
    words = running.stderr.read()
    running.stderr.close()
    assert (running.wait(timeout=60), words) == (1, b"")


def test_an_answer_that_cannot_be_printed_is_no_success(tmp_path):
    if not os.path.exists("/dev/full"):
        pytest.skip("this system has no /dev/full")
    command = [sys.executable, "-m", "meshsdf", "info", str(ball(tmp_path / "ball.ply"))]
    with open("/dev/full", "w") as full:
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, timeout=60)
    assert done.returncode == 3
    assert done.stderr.startswith("IoError: the result cannot be printed: No space left on device")
    assert "Exception ignored" not in done.stderr


def test_a_fault_of_ours_is_told_in_three_lines_and_is_not_the_answer_no(
    tmp_path, capsys, monkeypatch
):
    from meshsdf.cli.main import run

    def faulty(*_, **__):
        raise RuntimeError("the sky\nfell")

    monkeypatch.setattr("meshsdf.io.meshes.read_mesh", faulty)
    assert run(["check", str(ball(tmp_path / "ball.ply"))]) == 3
    what, where, fix = capsys.readouterr().err.splitlines()
    assert what == "UnexpectedError: RuntimeError: the sky fell"
    assert where.startswith("  where: cli/check.py, line ")
    assert "report it" in fix


def test_running_out_of_memory_is_told(tmp_path, cli, monkeypatch):
    def hungry(*_, **__):
        raise MemoryError

    monkeypatch.setattr("meshsdf.mesh.two_set.check", hungry)
    outcome = cli("check", ball(tmp_path / "ball.ply"))
    assert outcome.code == 3
    assert outcome.err.startswith("MemoryLimitError: the system gave no more memory")
