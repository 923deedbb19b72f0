"""What every command shares: words on stderr, a progress bar, timings, JSON, and exit codes."""

import json
import os
import sys
import threading
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import click

from ..errors import IoError

YES, NO, MISUSE, UNUSABLE, INTERRUPTED = 0, 1, 2, 3, 130
BAR_AFTER = 1.0  # seconds of work before a progress bar appears
CTRL_C = threading.Event()
"""Set once Ctrl-C was pressed: Python drops the exception if it strikes in its own callbacks."""


class Console:
    """One command's run: measures its stages and shows a bar when work lasts.

    The bar goes before the last result is printed, and however the command ends.

    Attributes
    ----------
    seconds : dict
        Time spent in every stage so far.
    warnings : list of str
        What the user was warned of so far.
    """

    def __init__(self, command: str, *, as_json: bool) -> None:
        self.command = command
        self.as_json = as_json
        self.seconds: dict[str, float] = defaultdict(float)
        self.warnings: list[str] = []
        self._begin = self._mark = time.perf_counter()
        self._stage, self._fraction = "", 0.0
        self._bar = self._task = self._timer = None
        self._lock = threading.Lock()
        click.get_current_context().call_on_close(self.close)
        if sys.stderr is not None and sys.stderr.isatty():
            self._timer = threading.Timer(BAR_AFTER, self._open_bar)
            self._timer.daemon = True
            self._timer.start()

    def watch_compilation(self) -> None:
        """Say a word on stderr if kernels have to be compiled."""
        from ..kernels.compiling import on_first_compilation

        text = "compiling kernels for this machine: once, some seconds; later runs start at once"
        on_first_compilation(lambda: self.say(text))

    def say(self, text: str) -> None:
        """Words for people, on stderr."""
        if self._bar is None:
            click.echo(text, err=True)
        else:
            self._bar.console.print(text, markup=False, highlight=False, soft_wrap=True)

    def warn(self, text: str) -> None:
        """Say what the user should know about the result, and keep it for the JSON."""
        if text not in self.warnings:
            self.warnings.append(text)
            self.say(f"warning: {text}")

    def result(self, text: str, *, is_last: bool = True) -> None:
        """The answer in words, on stdout unless JSON was asked for; the last ends the bar."""
        if self.as_json:
            return
        if is_last:
            self.close()
        with self._lock:
            if self._bar is not None:
                self._bar.stop()
            _print(text)
            if self._bar is not None:
                self._bar.start()

    def json(self, facts: dict) -> None:
        """The answer as one JSON object on stdout, if asked for."""
        if self.as_json:
            head = {"schema": f"meshsdf.{self.command}/1"}
            self.close()
            _print(json.dumps(head | facts, indent=2, allow_nan=False))

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Count the time within as ``name``."""
        self._mark = time.perf_counter()
        self._show(name, 0.0)
        yield
        self._count(name)

    def progress(self, stage: str, fraction: float) -> None:
        """The callback that library functions report to; raises Ctrl-C again if it was lost."""
        if CTRL_C.is_set():
            raise KeyboardInterrupt
        self._count(stage)
        self._show(stage, fraction)

    def within(self, name: str) -> Callable[[str, float], None]:
        """A callback that shows what it is told, as `progress`, and counts the time as ``name``."""

        def shown(stage: str, fraction: float) -> None:
            self.progress(name, fraction)
            self._show(stage, fraction)

        return shown

    def close(self) -> None:
        """Take the bar away, or see that none appears any more."""
        with self._lock:
            if self._timer is not None:
                self._timer.cancel()
                self._timer = None
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

    def _show(self, stage: str, fraction: float) -> None:
        self._stage, self._fraction = stage, fraction
        if self._bar is not None:
            self._bar.update(self._task, description=stage, completed=fraction)

    def _open_bar(self) -> None:
        from rich.console import Console as RichConsole
        from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

        text = TextColumn("{task.description:>12}", markup=False)
        columns = SpinnerColumn(), text, BarColumn(), TimeElapsedColumn()
        with self._lock:
            if self._timer is None:  # closed meanwhile
                return
            bar = Progress(*columns, console=RichConsole(stderr=True), transient=True)
            self._task = bar.add_task(self._stage, total=1.0, completed=self._fraction)
            bar.start()
            self._bar = bar


def _print(text: str) -> None:
    try:
        click.echo(text)
    except BrokenPipeError:
        _discard_output()  # the reader has what it wanted; the exit code still answers
    except OSError as error:
        _discard_output()
        what = f"the result cannot be printed: {error.strerror}"
        raise IoError(what, "standard output", "send it elsewhere") from error


def _discard_output() -> None:
    """Send stdout nowhere, so that the interpreter does not fail on it again at exit."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, sys.stdout.fileno())
    os.close(nowhere)


def plural(n: int, one: str, many: str = "") -> str:
    """``3 holes``, ``1 hole``; thousands parted by spaces."""
    return f"{n:,}".replace(",", " ") + " " + (one if n == 1 else many or one + "s")


def file_size(n_bytes: int) -> str:
    """``7.2 MB``."""
    for unit, size in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if n_bytes >= size:
            return f"{n_bytes / size:.3g} {unit}"
    return f"{n_bytes} bytes"
