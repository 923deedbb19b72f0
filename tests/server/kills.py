"""Kill the painting server at random instants while a client paints; nothing may be lost."""

import contextlib
import json
import os
import random
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from meshsdf.server.client import Painter
from meshsdf.server.samples import Samples
from meshsdf.texture.brush import Brush
from meshsdf.texture.journal import Project
from meshsdf.texture.journal_log import read_operation
from meshsdf.texture.operations import Operation
from tests.texture.kills import copied
from tests.texture.random_operations import RESOLUTION, direction, small_mesh

ROOT = Path(__file__).parent.parent.parent
KILLS_PER_PROJECT = 25
LONGEST = 0.25  # seconds of painting before a kill
PATIENCE = 60.0


class Worker:
    """The process that forks servers."""

    def __init__(self):
        command = [sys.executable, "-m", "tests.server.kill_worker"]
        self.process = subprocess.Popen(
            command, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
            start_new_session=True,
        )  # fmt: skip
        assert self.process.stdout.readline() == "ready\n"

    def __enter__(self):
        return self

    def __exit__(self, *_):
        os.killpg(self.process.pid, signal.SIGKILL)  # whatever it has forked, too
        self.process.wait()
        self.process.stdin.close()
        self.process.stdout.close()

    def start(self, project):
        """The process number and the address of a new server."""
        self._write(project)
        pid, address = int(self.process.stdout.readline()), self.process.stdout.readline().strip()
        assert address.startswith("http://"), address
        return pid, address

    def end(self, pid, how):
        """Send a signal, and wait for the end."""
        os.kill(pid, how)
        self._write("bury")
        assert self.process.stdout.readline() == "dead\n"

    def _write(self, line):
        self.process.stdin.write(f"{line}\n")
        self.process.stdin.flush()


class Script:
    """A client that paints whatever its dice say, and remembers what it has asked for.

    ``asked`` is by the message's number: the operation that should be in the journal, strokes as
    their brush and all samples.
    """

    def __init__(self, seed):
        self.rng = np.random.default_rng(seed)
        self.asked, self._stroke = {}, None
        self.n_done = 0

    def step(self, painter):
        """Send one message."""
        dice = self.rng.random()
        if self._stroke is None and dice < 0.15 and self.n_done > 1:
            self._keep(painter.undo(), Operation("undo"))
            self.n_done -= 1
        elif self._stroke is None:
            color = (*np.round(self.rng.random(3), 3).tolist(), 1.0)
            brush = Brush(float(np.round(0.1 + 0.3 * self.rng.random(), 3)), color=color)
            painter.begin(0, brush)
            self._stroke, self._at = (brush, []), direction(self.rng)
        elif dice < 0.2 and self._stroke[1]:
            brush, samples = self._stroke
            self._keep(painter.end(), (brush, np.concatenate(samples)))
            self._stroke, self.n_done = None, self.n_done + 1
        else:
            self._at = self._at + 0.2 * direction(self.rng)
            self._at /= np.linalg.norm(self._at)
            points = self._at[None]
            painter.dabs(points, points)
            sent = Samples(points - painter.origin, points, np.ones(1))
            got = Samples.unpacked(sent.packed())
            self._stroke[1].append(np.hstack([got.points + painter.origin, got.normals]))

    def finish(self, painter):
        """End what is open."""
        while self._stroke is not None:
            self.step(painter)

    def _keep(self, cseq, what):
        self.asked[cseq] = what


@contextlib.contextmanager
def reading(path):
    """Look at a project that is open: its log stays meanwhile, so that it can be copied."""
    with contextlib.closing(sqlite3.connect(path, isolation_level=None)) as connection:
        connection.execute("BEGIN")
        connection.execute("SELECT 1 FROM project").fetchall()
        yield


class Trial:
    """One project, whose servers are killed again and again, and the client that paints on it."""

    def __init__(self, worker, folder, seed):
        self.worker, self.folder = worker, Path(folder)
        self.path = self.folder / "killed.mtex"
        with Project.create(self.path, small_mesh(), resolution=RESOLUTION) as project:
            project.apply(Operation("add-layer", {"name": "paint"}))
        self.script, self.dice = Script(seed), random.Random(seed)
        self.pid, address = worker.start(self.path)
        self.painter = Painter(address, patience=PATIENCE)

    def kill_one(self):
        """Paint for a while, kill the server wherever it is, and start another."""
        until = time.perf_counter() + self.dice.uniform(0, LONGEST)
        while time.perf_counter() < until:
            self.script.step(self.painter)
            time.sleep(self.dice.choice((0, 0, 0.001, 0.01)))
        self.worker.end(self.pid, signal.SIGKILL)
        self.pid, address = self.worker.start(self.path)
        self.painter.go_to(address)

    def check(self):
        """All is there once, as it was asked for, and a copy opens with the same texels."""
        painter = self.painter
        self.script.finish(painter)
        painter.catch_up()
        wanted = painter.get_json("/api/digest")["project"]
        with reading(self.path):
            copy = copied(self.path, self.folder / "copy")
        words = []
        with Project.open(copy, warn=words.append) as project:
            assert project.digest() == wanted, "the texels differ"
        assert not words, words
        with contextlib.closing(sqlite3.connect(copy)) as connection:
            assert connection.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
            self._check_operations(connection)
        painter.close()
        self.worker.end(self.pid, signal.SIGTERM)
        with Project.open(self.path, warn=words.append) as project:
            assert project.digest() == wanted, "closing changed the texels"
        assert not words, words
        return len(self.script.asked)

    def _check_operations(self, connection):
        rows = connection.execute(
            "SELECT seq, cseq, kind FROM op WHERE client = ? ORDER BY seq", (self.painter.client,)
        ).fetchall()
        asked = self.script.asked
        assert [cseq for _, cseq, _ in rows] == sorted(asked), "an operation is lost or doubled"
        for seq, cseq, kind in rows:
            assert self.painter.number(cseq) in (0, seq), "acknowledged as another operation"
            if kind == "stroke":
                self._check_stroke(read_operation(connection, seq).params, *asked[cseq])
            else:
                assert asked[cseq].kind == kind

    @staticmethod
    def _check_stroke(params, brush, samples):
        assert json.loads(json.dumps(params["brush"])) == json.loads(json.dumps(brush.to_dict()))
        kept = np.hstack([params["points"], params["normals"]])
        np.testing.assert_array_equal(kept, samples)


def kill(folder, n, *, seed=0, told=lambda done, n_operations: None):
    """Kill n servers; AssertionError says what was lost. Returns how many operations were asked."""
    total = 0
    with Worker() as worker:
        for first in range(0, n, KILLS_PER_PROJECT):
            place = Path(folder) / str(first)
            place.mkdir()
            trial = Trial(worker, place, seed + first)
            for number in range(first, min(n, first + KILLS_PER_PROJECT)):
                trial.kill_one()
                told(number + 1, total + len(trial.script.asked))
            total += trial.check()
            shutil.rmtree(place)
    return total
