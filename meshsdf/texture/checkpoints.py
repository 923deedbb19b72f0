"""When a project's layers are kept beside its operations: at once, or while painting goes on."""

import sqlite3
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path

from .checkpoint import Loaded
from .checkpoint_write import write_checkpoint
from .content import Content, Frozen
from .history import History
from .housekeeping import Housekeeping
from .journal_schema import Writer
from .pool import Slots

OPERATIONS_PER_CHECKPOINT = 256
BYTES_PER_CHECKPOINT = 64 * 2**20


@dataclass(frozen=True, eq=False)
class _UnderWay:
    """A checkpoint that is being written."""

    frozen: Frozen
    seq: int
    written: Future


class Checkpoints:
    """The checkpoints of a project that is open.

    Parameters
    ----------
    connection : Writer
        Of the thread that owns the project, which makes all calls.
    history : History
        Its steps, and the texture.
    origin : int
        Operation whose checkpoint is never removed.
    warn : callable
        Told if one cannot be written that nobody asked for.

    Attributes
    ----------
    seq : int
        Operation of the latest; -1 if there is none.
    n_bytes : int
        How much was changed since; for the caller to count.
    """

    def __init__(
        self, connection: Writer, history: History, origin: int, warn: Callable[[str], None]
    ) -> None:
        self.seq, self.n_bytes = -1, 0
        self._connection, self._history, self._origin = connection, history, origin
        self._warn = warn
        self._content = Content(history.texture)
        self._housekeeping: Housekeeping | None = None
        self._under_way: _UnderWay | None = None

    def loaded(self, found: Loaded) -> None:
        """The texture holds what a checkpoint says."""
        self.seq = found.seq
        self._content.know({one.attributes["number"]: one.digests for one in found.layers})

    def write(self, seq: int, slots_of: Mapping[int, Slots]) -> None:
        """Keep what the layers hold after operation ``seq``, the last one.

        Parameters
        ----------
        seq : int
        slots_of : mapping of int to (e,) int32
            As `Content.freeze` takes them.
        """
        self.settle()
        if self.seq == seq:
            return
        frozen = self._content.freeze(slots_of)
        try:
            write_checkpoint(self._connection, frozen, seq, self._tip, self._origin)
            self._take(frozen, seq)
        finally:
            frozen.release()
        self.n_bytes = 0

    def write_if_due(self, seq: int, slots_of: Mapping[int, Slots]) -> None:
        """The same if there is much to keep; after `write_apart`, only begin it."""
        if self._under_way is not None and self._under_way.written.done():
            self.settle()
        many = seq - max(self.seq, self._origin) >= OPERATIONS_PER_CHECKPOINT
        is_due = many or self.n_bytes >= BYTES_PER_CHECKPOINT
        if self._housekeeping is not None:
            self._housekeeping.copy_log()
            if is_due and self._under_way is None:
                frozen = self._content.freeze(slots_of)
                work = write_checkpoint, frozen, seq, self._tip, self._origin
                written = self._housekeeping.do(*work, rest=self._housekeeping.rest)
                self._under_way = _UnderWay(frozen, seq, written)
                self.n_bytes = 0
        elif is_due:
            try:
                self.write(seq, slots_of)
            except sqlite3.Error as error:
                self._say(error)

    def write_apart(self, path: Path, *writers: Writer) -> None:
        """From now on a thread writes those that are due, and shortens the log of all writers."""
        self._housekeeping = Housekeeping(path, self._connection.turn)
        for writer in (self._connection, *writers):
            writer.copy_log_on_commit(False)

    def settle(self) -> None:
        """Wait until none is being written."""
        under_way, self._under_way = self._under_way, None
        if under_way is None:
            return
        try:
            with self._housekeeping.hurry():
                under_way.written.result()
            self._take(under_way.frozen, under_way.seq)
        except (sqlite3.Error, OSError, MemoryError) as error:
            self._say(error)
        finally:
            under_way.frozen.release()

    def close(self) -> None:
        """End the thread, if there is one."""
        self.settle()
        if self._housekeeping is not None:
            self._housekeeping.close()
            self._housekeeping = None

    @property
    def _tip(self) -> int:
        """The latest step that is done."""
        history = self._history
        return history.steps[history.n_done - 1].number if history.n_done else 0

    def _take(self, frozen: Frozen, seq: int) -> None:
        self._content.know_frozen(frozen)
        self.seq = seq

    def _say(self, error: Exception) -> None:
        self._warn(f"no checkpoint could be written: {error}")
