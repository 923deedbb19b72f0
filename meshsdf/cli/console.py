"""What every command shares: words on stderr, progress, timings, JSON, and exit codes."""

import json
import sys
import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager

import click

YES, NO, MISUSE, UNUSABLE, INTERRUPTED = 0, 1, 2, 3, 130
BAR_AFTER = 1.0  # seconds of work before a progress bar appears


class Console:
    """One command's run: measures its stages and shows a bar when work lasts.

    Attributes
    ----------
    seconds : dict
        Time spent in every stage so far.
    """

    def __init__(self, command: str, *, as_json: bool) -> None:
        self.command = command
        self.as_json = as_json
        self.seconds: dict[str, float] = defaultdict(float)
        self._begin = self._mark = time.perf_counter()
        self._bar = None
        self._task = None

    def watch_compilation(self) -> None:
        """Say a word on stderr if kernels have to be compiled."""
        from ..kernels.compiling import on_first_compilation

        text = "compiling kernels for this machine: once, some seconds; later runs start at once"
        on_first_compilation(lambda: self.say(text))

    def say(self, text: str) -> None:
        """Words for people, on stderr."""
        click.echo(text, err=True)

    def result(self, text: str) -> None:
        """The answer in words, on stdout unless JSON was asked for."""
        if not self.as_json:
            click.echo(text)

    def json(self, facts: dict) -> None:
        """The answer as one JSON object on stdout, if asked for."""
        if self.as_json:
            head = {"schema": f"meshsdf.{self.command}/1"}
            click.echo(json.dumps(head | facts, indent=2, allow_nan=False))

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Count the time within as ``name``."""
        self._mark = time.perf_counter()
        yield
        self._count(name)

    def progress(self, stage: str, fraction: float) -> None:
        """The callback that library functions report to."""
        self._count(stage)
        if self._bar is None:
            if time.perf_counter() - self._begin < BAR_AFTER or not sys.stderr.isatty():
                return
            self._open_bar()
        self._bar.update(self._task, description=stage, completed=fraction)

    def close(self) -> None:
        """Take the bar away."""
        if self._bar is not None:
            self._bar.stop()
            self._bar = None

    def timings(self, *names: str) -> dict[str, float]:
        """Seconds of the named stages and in total, rounded to 0.1 ms."""
        total = time.perf_counter() - self._begin
        spent = {name: round(self.seconds[name], 4) for name in names}
        return spent | {"total": round(total, 4)}

    def _count(self, name: str) -> None:
        now = time.perf_counter()
        self.seconds[name] += now - self._mark
        self._mark = now

    def _open_bar(self) -> None:
        from rich.console import Console as RichConsole
        from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

        columns = TextColumn("{task.description:>12}"), BarColumn(), TimeElapsedColumn()
        self._bar = Progress(*columns, console=RichConsole(stderr=True), transient=True)
        self._task = self._bar.add_task("", total=1.0)
        self._bar.start()


def plural(n: int, one: str, many: str = "") -> str:
    """``3 holes``, ``1 hole``; thousands parted by spaces."""
    return f"{n:,}".replace(",", " ") + " " + (one if n == 1 else many or one + "s")


def file_size(n_bytes: int) -> str:
    """``7.2 MB``."""
    for unit, size in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if n_bytes >= size:
            return f"{n_bytes / size:.3g} {unit}"
    return f"{n_bytes} bytes"
