"""What a project's file needs now and then, done beside its owner's work on a thread of its own.

Checkpoints are packed and written there, and what the write-ahead log holds is copied into the
file. Commits of others wait for neither, but for a short transaction. A disk has one queue, though,
in which a commit's few kilobytes stand behind all that was sent there before: so the thread writes
little at a time, sees that it arrives, and leaves the disk alone for longer than that took.
"""

import contextlib
import sqlite3
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from threading import Event

from .journal_schema import Turn, Writer, connect

COPY_SECONDS = 2.0  # between copies of the log
TRIES = 3  # to copy what came while the log was copied
COPY = "PRAGMA wal_checkpoint(PASSIVE)"  # waits for nobody, and nobody for it
LONG = 4096  # frames; a longer log is copied while others wait, so that it begins anew
REST = 3.0  # times as long as what was written took to arrive
LONGEST_REST = 2.0  # seconds


class Housekeeping:
    """The thread of a project, and its connection.

    Parameters
    ----------
    path : Path
        Of the project.
    turn : Turn
        As its other connections have it.
    """

    def __init__(self, path: Path, turn: Turn) -> None:
        self._connection = connect(path, turn)
        self._connection.copy_log_on_commit(False)
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="housekeeping")
        self._copy: Future | None = None
        self._copied = time.monotonic()
        self._is_hurried = Event()

    def do(self, write: Callable[..., None], *args: object, **kwargs: object) -> Future:
        """Call ``write(connection, ...)`` on the thread."""
        return self._thread.submit(write, self._connection, *args, **kwargs)

    def rest(self) -> None:
        """For what `do` was given to call between transactions: wait, so that others can write.

        Until then, all that was written has arrived in the file. Nobody rests in a `hurry`.
        """
        begin = time.monotonic()
        _copied(self._connection)
        took = time.monotonic() - begin
        self._is_hurried.wait(min(REST * took, LONGEST_REST))

    @contextlib.contextmanager
    def hurry(self) -> Iterator[None]:
        """Meanwhile somebody waits for what is being done."""
        self._is_hurried.set()
        try:
            yield
        finally:
            self._is_hurried.clear()

    def copy_log(self) -> None:
        """Copy the log into the file, if that was not done lately; returns at once."""
        now = time.monotonic()
        if now - self._copied >= COPY_SECONDS and (self._copy is None or self._copy.done()):
            self._copied, self._copy = now, self.do(_copied)

    def close(self) -> None:
        """Finish what was begun."""
        with self.hurry():
            self._thread.shutdown()
        self._connection.close()


def _copied(connection: Writer) -> None:
    """Copy all of the log into the file, so that the next commit begins it anew."""
    with contextlib.suppress(sqlite3.Error):  # then it stays in the log, as safe as before
        for _ in range(TRIES):
            _, n_frames, n_copied = connection.execute(COPY).fetchone()
            if n_frames == n_copied:
                return
        if n_frames > LONG:
            with connection.turn:
                connection.execute(COPY).fetchone()
