"""A texture that is never lost: one file that knows every operation, as soon as it is done.

An operation is acknowledged (`Project.apply` returns) when it is on the disk. Opening a project is
reading the last checkpoint and performing later operations again, which gives the same bytes:
operations are the document, texels are what they make.
"""

import contextlib
import os
import sqlite3
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from ..arrays import Number
from ..errors import TextureError
from ..mesh import Mesh
from ..progress import Progress, silent
from .blobs import Damaged
from .change import Change, recording
from .checkpoints import Checkpoints
from .content import Content, digest
from .history import BUDGET, History, Step
from .journal_log import (
    KERNEL_VERSION,
    Entry,
    commit,
    op_row,
    steps_of,
)
from .journal_open import open_sound
from .journal_schema import FAULTS, Statement, Writer, check_header, connect, copy_to
from .operations import TURNS, Operation, perform
from .pending import PendingTable
from .pool import Slots
from .project_lock import ProjectLock
from .project_parts import write_new
from .replay import Replay
from .salvage import salvage
from .volume_texture import VolumeTexture

Warn = Callable[[str], None]


def unheard(message: str) -> None:
    """The default for warnings: nobody listens."""


class Project:
    """A texture, its operations and its file; made by `create` or `open`.

    Attributes
    ----------
    path : Path
    texture : VolumeTexture
        Change it through `apply` alone: other edits are neither kept nor undone.
    history : History
        Names of steps, for people.
    last_seq : int
        Number of the last operation; they are counted from 1.
    warn : callable
        Called with a sentence for whatever is not as it should be.
    seqs : dict
        Numbers of operations by ``(client, cseq)``, as `apply` was given them.
    pending : PendingTable
        Strokes that are no operations yet.
    painting : LiveStrokes or None
        Who paints these.
    """

    def __init__(
        self,
        path: Path,
        connection: Writer,
        texture: VolumeTexture,
        origin: int = 0,
        *,
        lock: ProjectLock,
        warn: Warn,
        budget: int,
    ) -> None:
        self.path = path
        self.texture = texture
        self.history = History(texture, budget=budget)
        self._replay = Replay(connection, self.history, origin, warn)
        self.history.rebuild = self._rebuild
        self.last_seq = origin
        self.warn = warn
        self._connection = connection
        self._lock = lock
        self._origin = origin
        self._checkpoints = Checkpoints(connection, self.history, origin, warn)
        self._digests = Content(texture)
        self.seqs: dict[tuple[str, int], int] = {}
        self._is_open = True
        self.painting: Any = None
        self.pending = PendingTable(connection, path, lock)

    @classmethod
    def create(
        cls,
        path: str | os.PathLike[str],
        mesh: Mesh,
        *,
        resolution: Number | None = None,
        texel: Number | None = None,
        base: str = "srgb8",
        divides: bool = False,
        budget: int = BUDGET,
        warn: Warn = unheard,
        progress: Progress = silent,
    ) -> "Project":
        """A new project around a mesh, without layers.

        Parameters
        ----------
        path : path
            Of a file that is not there yet, ``.mtex`` by custom.
        mesh : Mesh
            Its vertices and faces are kept in the project.
        resolution, texel, base, divides
            As `VolumeTexture.around` takes them.
        budget : int
            Bytes for undoing, see `History`.
        warn : callable
            Called with a sentence for whatever is not as it should be.

        Raises
        ------
        TextureError
            There is such a file, or it cannot be written; errors as `VolumeTexture.around`.
        """
        path = Path(path)
        texture = VolumeTexture.around(
            mesh, resolution=resolution, texel=texel, base=base, divides=divides, progress=progress
        )
        lock = ProjectLock(path)
        try:
            if path.exists():
                what = "there is such a file already"
                raise TextureError(what, str(path), "open it, or choose another name")
            write_new(path, texture)
            connection = connect(path)
        except BaseException:
            lock.release()
            raise
        return cls(path, connection, texture, lock=lock, warn=warn, budget=budget)

    @classmethod
    def open(
        cls,
        path: str | os.PathLike[str],
        *,
        budget: int = BUDGET,
        warn: Warn = unheard,
        finish_strokes: bool = True,
    ) -> "Project":
        """Open a project in the state after its last operation that can be read.

        Of a damaged file all that is sound goes into a new one in its place; the damaged one stays
        beside it. What that is and what is lost is said through ``warn``.

        Parameters
        ----------
        path, budget, warn
            As `create` takes them.
        finish_strokes : bool
            Make operations of the strokes that were being painted when the last owner died; else
            they wait until `LiveStrokes` goes on with them.

        Raises
        ------
        TextureError
            The file is not there, is no project, is of a later version, is open elsewhere, or
            nothing of it can be read.
        """
        path = Path(path)
        check_header(path)
        lock = ProjectLock(path)

        def restored(entries: list[Entry], *args: Any) -> "Project":
            project = cls(path, *args, lock=lock, warn=warn, budget=budget)
            project._restore(entries)
            return project

        try:
            try:
                project = open_sound(path, lock, warn, restored)
            except (Damaged, *FAULTS) as error:
                warn(f"{path} is damaged: {error}")
                salvage(path, warn)
                project = open_sound(path, lock, warn, restored)
        except (Damaged, *FAULTS) as error:
            lock.release(keep=True)
            what = f"nothing of the project can be read: {error}"
            raise TextureError(what, str(path), "bring back a copy of the file") from None
        except BaseException:
            lock.release(keep=True)
            raise
        lock.note(project.last_seq, project.pending.n_rows)
        if finish_strokes and project.pending.n_rows:
            from .live import finish_pending  # which imports this module

            finish_pending(project)
        return project

    def __enter__(self) -> "Project":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def apply(
        self, operation: Operation, *, client: str = "", cseq: int | None = None,
        progress: Progress = silent,
    ) -> int:  # fmt: skip
        """Do an operation, keep it, and return its number once it is on the disk.

        Parameters
        ----------
        operation : Operation
            Kinds "undo" and "redo" take back and repeat steps of all clients.
        client, cseq : str, int, optional
            A sender's name and its own number for the operation. The same pair again is the same
            operation: it is not done twice, and its number is returned again.

        Raises
        ------
        TextureError
            It cannot be done, or not be kept; then nothing has changed.
        """
        self._require_open()
        if cseq is not None and (client, cseq) in self.seqs:
            return self.seqs[client, cseq]
        if self._is_painting:
            what = "strokes are being painted"
            raise TextureError(what, "Project.apply", "go through LiveStrokes.apply")
        return self.apply_under(operation, client=client, cseq=cseq, progress=progress)

    def apply_under(
        self, operation: Operation, *, client: str, cseq: int | None, progress: Progress = silent
    ) -> int:
        """As `apply`, by whoever sees to the strokes that are being painted."""
        operation = Operation.decoded(operation.kind, operation.encoded())
        seq = self.last_seq + 1
        if operation.kind in TURNS:
            self._turn(operation, op_row(seq, client, cseq, operation, True))
        else:
            with recording(self.texture) as change:
                perform(self.texture, operation, progress=progress)
            row = op_row(seq, client, cseq, operation, not change.is_empty)
            self._commit(row, lambda: change.undo(self.texture))
            self._push(operation, seq, change)
        self._done(seq, client, cseq)
        if operation.kind not in TURNS:  # undo and redo do not wait for a checkpoint
            self.keep_house()
        return seq

    def adopt(self, operation: Operation, change: Change, *, client: str, cseq: int) -> int:
        """Keep an operation that is done already, in the place of its client's pending rows.

        Raises
        ------
        TextureError
            It cannot be kept; then it is taken back.
        """
        self._require_open()
        seq = self.last_seq + 1
        row = op_row(seq, client, cseq, operation, not change.is_empty)
        with self.pending.turn:
            self._commit(row, lambda: change.undo(self.texture), self.pending.forget(client))
            self.pending.forgotten(client)
            self._done(seq, client, cseq)
        self._push(operation, seq, change)
        return seq

    def undo(self) -> int:
        """Take the latest step back; an operation of its own, whose number is returned."""
        return self.apply(Operation("undo"))

    def redo(self) -> int:
        """Do the step again that was undone last; an operation of its own, as `undo`."""
        return self.apply(Operation("redo"))

    def checkpoint(self) -> None:
        """Keep what the layers hold now, so that opening need not perform operations again.

        Strokes that are no operations yet are left out.
        """
        self._require_open()
        self._checkpoints.write(self.last_seq, self._slots_below())

    def digest(self) -> str:
        """SHA-256 of all that the layers hold, wherever in memory it is."""
        if self._is_painting:
            return digest(self.texture)
        for _ in self._digests.update():
            pass
        return self._digests.digest()

    def save_as(self, path: str | os.PathLike[str]) -> None:
        """Write a compact copy of the project to a file that is not there yet.

        Raises
        ------
        TextureError
            There is such a file, or it cannot be written.
        """
        self._require_open()
        copy_to(self._connection, Path(path))

    def close(self) -> None:
        """Write a checkpoint and let others open the project; closing twice does no harm."""
        if not self._is_open:
            return
        if self.painting is not None:
            self.painting.set_aside()
        try:
            self.checkpoint()
        finally:
            self._is_open = False
            self._checkpoints.close()
            self.pending.close()
            self.history.close()
            with contextlib.suppress(sqlite3.Error):  # then the log stays, which is as good
                self._connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
            self._connection.close()
            self._lock.release()

    def keep_house_apart(self) -> None:
        """From now on a thread of its own writes checkpoints and shortens the log."""
        self._checkpoints.write_apart(self.path, self.pending.writer)

    def keep_house(self) -> None:
        """Write a checkpoint if one is due; at once, or see that the thread does it."""
        self._checkpoints.write_if_due(self.last_seq, self._slots_below())

    def _rebuild(self, n_done: int) -> None:
        self._checkpoints.settle()  # whose rows must not go while they are read
        self._replay.rebuild(n_done)

    def _slots_below(self) -> Mapping[int, Slots]:
        return {} if self.painting is None else self.painting.slots_below()

    def _turn(self, operation: Operation, row: tuple) -> None:
        history = self.history
        turn, back = history.undo, history.redo
        if operation.kind == "redo":
            turn, back = back, turn
        turn()
        self._commit(row, back)
        turned = history.n_done - (operation.kind == "redo")
        self._checkpoints.n_bytes += history.steps[turned].n_bytes

    def _commit(self, row: tuple, take_back: Callable[[], object], *more: Statement) -> None:
        commit(self._connection, self.path, row, take_back, *more)

    def _push(self, operation: Operation, seq: int, change: Change) -> None:
        self._checkpoints.n_bytes += change.n_bytes(self.texture)
        if not change.is_empty:
            self.history.push(operation.kind, seq, change)

    def _done(self, seq: int, client: str, cseq: int | None) -> None:
        with self.pending.turn:
            self.last_seq = seq
            if cseq is not None:
                self.seqs[client, cseq] = seq
            self._lock.note(seq, self.pending.n_rows)

    @property
    def _is_painting(self) -> bool:
        return self.painting is not None and self.painting.is_painting

    def _restore(self, entries: list[Entry]) -> None:
        """Bring the texture to the state after the last operation of the log."""
        steps, n_done = steps_of(entries)
        self.history.steps = [Step(step.kind, step.seq, None) for step in steps]
        self.history.n_done = n_done
        self.last_seq = entries[-1].seq if entries else self._origin
        self.seqs = {(e.client, e.cseq): e.seq for e in entries if e.cseq is not None}
        later = {step.seq for step in steps if step.kernel_version != KERNEL_VERSION}
        loaded = self._replay.load(n_done)
        if loaded is not None:
            digests = {one.attributes["number"]: one.digests for one in loaded.layers}
            self._checkpoints.loaded(loaded)
            self._digests.know({number: dict(each) for number, each in digests.items()})
        # What was passed over must not be taken for rows of the next checkpoint
        for table in ("checkpoint", "brick"):
            self._connection.execute(f"DELETE FROM {table} WHERE seq > ?", (self._checkpoints.seq,))
        first = self._replay.perform_steps(loaded, n_done)
        if later & {step.number for step in self.history.steps[first:n_done]}:
            self.warn(
                f"operations of {self.path} were first done by another version of meshsdf; "
                "done again, their texels may differ by rounding"
            )

    def _require_open(self) -> None:
        if not self._is_open:
            what = "the project is closed"
            raise TextureError(what, str(self.path), "open it again with Project.open")
