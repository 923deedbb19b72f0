"""What the tests of the command line share: run it here, or in a process of its own."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass

import pytest

from meshsdf.cli.main import run


@dataclass(frozen=True)
class Outcome:
    """What one command line left behind."""

    code: int
    out: str
    err: str

    @property
    def json(self) -> dict:
        """Stdout as one JSON object."""
        return json.loads(self.out)


def sound(outcome: Outcome) -> Outcome:
    """The outcome, if nothing in it looks like a fault of the program."""
    for text in (outcome.out, outcome.err):
        assert "Traceback" not in text, text
        assert "UnexpectedError" not in text, text
        assert "Exception ignored" not in text, text
    return outcome


@pytest.fixture
def cli(capsys) -> Callable[..., Outcome]:
    """``cli("check", path)``: run in this process."""

    def call(*arguments) -> Outcome:
        capsys.readouterr()
        code = run([os.fspath(a) if isinstance(a, os.PathLike) else str(a) for a in arguments])
        return sound(Outcome(code, *capsys.readouterr()))

    return call


@pytest.fixture
def process() -> Callable[..., Outcome]:
    """``process("check", path, env={...})``: run ``python -m meshsdf`` by itself."""

    def call(*arguments, env: dict | None = None, **options) -> Outcome:
        done = subprocess.run(
            [sys.executable, "-m", "meshsdf", *map(str, arguments)],
            capture_output=True,
            env=os.environ | (env or {}),
            timeout=120,
            **options,
        )
        out, err = done.stdout.decode(errors="replace"), done.stderr.decode(errors="replace")
        return sound(Outcome(done.returncode, out, err))

    return call
