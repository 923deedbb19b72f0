"""A second process that compiles what strokes need while this one compiles the rest."""

import contextlib
import subprocess
import sys
from threading import Event, Thread

from ..kernels.compiling import on_first_compilation
from ..kernels.parallel import n_threads

LONGEST = 300.0  # seconds to wait for what it does
PATIENCE = 5.0  # and for its end


class Helper:
    """The process; a context manager, which ends it.

    It is started when this process begins to compile, and so not at all once everything was; nor
    where there is but one core. What goes wrong with it costs time alone.

    Examples
    --------
    >>> helper = Helper()  # not entered, so it never starts
    >>> helper.go(), helper.wait()
    (None, False)
    """

    def __init__(self) -> None:
        self._process: subprocess.Popen[str] | None = None
        self._is_told, self._is_over = False, False
        self._is_ready = Event()

    def __enter__(self) -> "Helper":
        if n_threads() > 1:
            on_first_compilation(self._start)
        return self

    def __exit__(self, *_: object) -> None:
        self._is_over = True
        if self._process is not None:
            self._process.terminate()
            try:
                self._process.wait(PATIENCE)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
            with contextlib.suppress(OSError):  # what it was told may not have got there
                self._process.stdin.close()

    def go(self) -> None:
        """What both processes need is compiled; now let it begin."""
        self._is_told = True
        if self._process is not None:
            with contextlib.suppress(OSError):  # it has died
                self._process.stdin.write("\n")
                self._process.stdin.flush()

    def wait(self) -> bool:
        """Wait until all is compiled for the plain brush; False if nobody helps."""
        if self._process is None:
            return False
        self._is_ready.wait(LONGEST)
        return True

    def _start(self) -> None:
        if self._is_over or not sys.executable:
            return
        command = [sys.executable, "-m", f"{__package__}.warm_up"]
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
        with contextlib.suppress(OSError):
            self._process = subprocess.Popen(command, text=True, **pipes)
            Thread(target=self._listen, args=(self._process,), daemon=True).start()
            if self._is_told:
                self.go()

    def _listen(self, process: subprocess.Popen[str]) -> None:
        """Note the first line, or the end."""
        with process.stdout:
            process.stdout.readline()
            self._is_ready.set()
