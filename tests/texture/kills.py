"""Kill writers of a project at random instants, and hold what is left against the truth."""

import contextlib
import os
import random
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from pathlib import Path

from meshsdf.texture.journal import Project
from tests.texture.kill_worker import CLIENT
from tests.texture.random_operations import RESOLUTION, Twin, small_mesh

ROOT = Path(__file__).parent.parent.parent
KILLS_PER_PROJECT = 40  # the truth is carried out from the beginning, so projects stay short


class Worker:
    """The process that forks writers."""

    def __init__(self, module="tests.texture.kill_worker"):
        command = [sys.executable, "-m", module]
        self.process = subprocess.Popen(
            command, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        assert self.process.stdout.readline() == "ready\n"

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.stdin.close()
        self.process.wait()
        self.process.stdout.close()

    def kill_one(self, project, acknowledged, seed, seconds, from_first):
        """Fork a writer and kill it so long after its start, or after its first operation."""
        before = acknowledged.stat().st_size
        self.process.stdin.write(f"{project} {acknowledged} {seed}\n")
        self.process.stdin.flush()
        pid = int(self.process.stdout.readline())
        begin = time.perf_counter()
        while from_first and acknowledged.stat().st_size == before:
            assert time.perf_counter() - begin < 60
            time.sleep(0.0002)
        time.sleep(seconds)
        os.kill(pid, signal.SIGKILL)
        self.process.stdin.write("bury\n")
        self.process.stdin.flush()
        assert self.process.stdout.readline() == "dead\n"


class Trial:
    """One project that is killed again and again."""

    def __init__(self, folder, seed):
        self.folder, self.seed = Path(folder), seed
        self.path = self.folder / "killed.mtex"
        self.acknowledged = self.folder / "acknowledged"
        self.acknowledged.write_text("")
        Project.create(self.path, small_mesh(), resolution=RESOLUTION).close()
        self.twin = Twin(seed)

    def check(self):
        """Open a copy of what is left: nothing lost, nothing doubled, the same bytes."""
        lines = self.acknowledged.read_text().splitlines()
        assert not [line for line in lines if line.startswith("!")], lines
        promised = [tuple(map(int, line.split())) for line in lines]
        copy = copied(self.path, self.folder / "copy")
        words = []
        project = Project.open(copy, warn=words.append)
        assert not words, words
        rows = operations_of(copy)
        by_cseq = {cseq: seq for seq, client, cseq in rows if client == CLIENT}
        assert len(by_cseq) == len(rows), "an operation is there twice"
        assert all(by_cseq.get(cseq) == seq for cseq, seq in promised), "an operation is lost"
        assert 0 <= len(rows) - len(promised) <= 1, "more was done than was asked for"
        assert project.digest() == self._truth(len(rows)), "the texels differ"
        project.close()
        with contextlib.closing(sqlite3.connect(copy)) as connection:
            assert connection.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
        return len(rows)

    def check_from_scratch(self):
        """The steps that are done give the same texels without checkpoints and undo."""
        assert self.twin.digest() == self.twin.digest_from_scratch()

    def _truth(self, n):
        while len(self.twin.operations) < n:
            self.twin.next()
        return self.twin.digest()


def copied(path, folder):
    """A copy of a project as its owner's death left it, in a folder that is made anew."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    for end in ("", "-wal", "-lock"):
        if Path(f"{path}{end}").exists():
            shutil.copyfile(f"{path}{end}", folder / f"{path.name}{end}")
    return folder / path.name


def operations_of(path):
    """(seq, client, cseq) of all that is in a project's file."""
    with contextlib.closing(sqlite3.connect(path)) as connection:
        return connection.execute("SELECT seq, client, cseq FROM op ORDER BY seq").fetchall()


def kill(folder, n, *, seed=0, told=lambda done, n_operations: None):
    """Kill n writers; AssertionError says what was lost. Returns how many operations were done."""
    dice = random.Random(seed)
    total = 0
    with Worker() as worker:
        for done in range(n):
            if done % KILLS_PER_PROJECT == 0:
                place = Path(folder) / str(done)
                place.mkdir()
                trial = Trial(place, seed + done)
                before = 0
            # At times while the project is opened, mostly while operations run
            worker.kill_one(
                trial.path, trial.acknowledged, trial.seed, dice.expovariate(1 / 0.02),
                dice.random() < 0.8,
            )  # fmt: skip
            now = trial.check()
            total, before = total + now - before, now
            if (done + 1) % KILLS_PER_PROJECT == 0 or done + 1 == n:
                trial.check_from_scratch()
                shutil.rmtree(place)
            told(done + 1, total)
    return total
