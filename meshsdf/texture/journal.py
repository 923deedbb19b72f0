"""A texture that is never lost: one file that knows every operation, as soon as it is done.

An operation is acknowledged (`Project.apply` returns) when it is on the disk. Opening a project is
reading the last checkpoint and performing later operations again, which gives the same bytes:
operations are the document, texels are what they make.
"""

import os
import sqlite3
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from ..arrays import Number
from ..errors import TextureError
from ..mesh import Mesh
from ..progress import Progress, silent
from .blobs import Damaged
from .change import recording
from .checkpoint import write_checkpoint
from .content import Content
from .history import BUDGET, History, Step
from .journal_log import (
    INSERT,
    KERNEL_VERSION,
    Entry,
    op_row,
    read_log,
    steps_of,
)
from .journal_schema import (
    FAULTS,
    check_header,
    connect,
    header_damage,
    integrity,
    lost_commits,
)
from .operations import TURNS, Operation, perform
from .project_lock import ProjectLock
from .project_parts import read_parts, write_new
from .replay import Replay
from .salvage import salvage
from .volume_texture import VolumeTexture

Warn = Callable[[str], None]

OPERATIONS_PER_CHECKPOINT = 256
BYTES_PER_CHECKPOINT = 64 * 2**20


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
    """

    def __init__(
        self,
        path: Path,
        connection: sqlite3.Connection,
        lock: ProjectLock,
        texture: VolumeTexture,
        *,
        origin: int,
        warn: Warn,
        budget: int,
    ) -> None:
        self.path = path
        self.texture = texture
        self.history = History(texture, budget=budget)
        self._replay = Replay(connection, self.history, origin, warn)
        self.history.rebuild = self._replay.rebuild
        self.last_seq = origin
        self.warn = warn
        self._connection = connection
        self._lock = lock
        self._origin = origin
        self._content, self._digests = Content(texture), Content(texture)
        self._seqs: dict[tuple[str, int], int] = {}
        self._checkpoint_seq = -1
        self._dirty_bytes = 0
        self._is_open = True

    @classmethod
    def create(
        cls,
        path: str | os.PathLike[str],
        mesh: Mesh,
        *,
        resolution: Number | None = None,
        texel: Number | None = None,
        base: str = "srgb8",
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
        resolution, texel, base
            As `VolumeTexture.around` takes them.
        budget : int
            Bytes of memory for undoing, see `History`.
        warn : callable
            Called with a sentence for whatever is not as it should be.

        Raises
        ------
        TextureError
            There is such a file, or it cannot be written; errors as `VolumeTexture.around`.
        """
        path = Path(path)
        texture = VolumeTexture.around(
            mesh, resolution=resolution, texel=texel, base=base, progress=progress
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
        return cls(path, connection, lock, texture, origin=0, warn=warn, budget=budget)

    @classmethod
    def open(
        cls,
        path: str | os.PathLike[str],
        *,
        budget: int = BUDGET,
        warn: Warn = unheard,
    ) -> "Project":
        """Open a project in the state after its last operation that can be read.

        Of a damaged file all that is sound goes into a new one in its place; the damaged one stays
        beside it. What that is and what is lost is said through ``warn``.

        Raises
        ------
        TextureError
            The file is not there, is no project, is of a later version, is open elsewhere, or
            nothing of it can be read.
        """
        path = Path(path)
        check_header(path)
        lock = ProjectLock(path)
        try:
            try:
                project = cls._opened(path, lock, budget, warn)
            except (Damaged, *FAULTS) as error:
                warn(f"{path} is damaged: {error}")
                salvage(path, warn)
                project = cls._opened(path, lock, budget, warn)
        except (Damaged, *FAULTS) as error:
            lock.release(keep=True)
            what = f"nothing of the project can be read: {error}"
            raise TextureError(what, str(path), "bring back a copy of the file") from None
        except BaseException:
            lock.release(keep=True)
            raise
        lock.write(project.last_seq)
        return project

    @classmethod
    def _opened(cls, path: Path, lock: ProjectLock, budget: int, warn: Warn) -> "Project":
        """The project of a file in which nothing but checkpoints may be damaged."""
        if found := header_damage(path):
            raise Damaged(found)
        n_lost = lost_commits(path)
        connection = connect(path)
        helper = ThreadPoolExecutor(1)
        try:
            verdict = helper.submit(integrity, path)
            texture, origin, sound = read_parts(connection, warn)
            if not sound:
                raise Damaged("mesh or octree are not as they were written")
            project = cls(path, connection, lock, texture, origin=origin, warn=warn, budget=budget)
            entries, wrong = read_log(connection, origin)
            if wrong:
                raise Damaged(wrong)
            project._restore(entries)
            if verdict.result() != "ok":
                raise Damaged(verdict.result())
            project._say_what_is_missing(n_lost)
        except BaseException:
            helper.shutdown()
            connection.close()
            raise
        helper.shutdown()
        return project

    def __enter__(self) -> "Project":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def apply(self, operation: Operation, *, client: str = "", cseq: int | None = None) -> int:
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
        if cseq is not None and (client, cseq) in self._seqs:
            return self._seqs[client, cseq]
        operation = Operation.decoded(operation.kind, operation.encoded())
        seq = self.last_seq + 1
        if operation.kind in TURNS:
            self._turn(operation, op_row(seq, client, cseq, operation, True))
        else:
            with recording(self.texture) as change:
                perform(self.texture, operation)
            row = op_row(seq, client, cseq, operation, not change.is_empty)
            self._commit(row, lambda: change.undo(self.texture))
            self._dirty_bytes += change.n_bytes(self.texture)
            if not change.is_empty:
                self.history.push(operation.kind, seq, change)
        self.last_seq = seq
        if cseq is not None:
            self._seqs[client, cseq] = seq
        self._lock.write(seq)
        if operation.kind not in TURNS:  # undo and redo do not wait for a checkpoint
            self._checkpoint_if_due()
        return seq

    def undo(self) -> int:
        """Take the latest step back; an operation of its own, whose number is returned."""
        return self.apply(Operation("undo"))

    def redo(self) -> int:
        """Do the step again that was undone last; an operation of its own, as `undo`."""
        return self.apply(Operation("redo"))

    def checkpoint(self) -> None:
        """Keep what the layers hold now, so that opening need not perform operations again."""
        self._require_open()
        if self._checkpoint_seq == self.last_seq:
            return
        history = self.history
        tip = history.steps[history.n_done - 1].number if history.n_done else 0
        write_checkpoint(self._connection, self._content, self.last_seq, tip, self._origin)
        self._checkpoint_seq, self._dirty_bytes = self.last_seq, 0

    def digest(self) -> str:
        """SHA-256 of all that the layers hold, wherever in memory it is."""
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
        path = Path(path)
        if path.exists():
            raise TextureError("there is such a file already", str(path), "choose another name")
        beside = path.with_name(f".{path.name}.new")
        beside.unlink(missing_ok=True)
        try:
            self._connection.execute("VACUUM INTO ?", (str(beside),))
            os.replace(beside, path)
        except (sqlite3.Error, OSError) as error:
            beside.unlink(missing_ok=True)
            what = f"the copy cannot be written: {error}"
            raise TextureError(what, str(path), "check the folder and its free space") from None

    def close(self) -> None:
        """Write a checkpoint and let others open the project; closing twice does no harm."""
        if not self._is_open:
            return
        try:
            self.checkpoint()
            self._connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        finally:
            self._is_open = False
            self._connection.close()
            self._lock.release()

    def _turn(self, operation: Operation, row: tuple) -> None:
        history = self.history
        turn, back = history.undo, history.redo
        if operation.kind == "redo":
            turn, back = back, turn
        turn()
        self._commit(row, back)
        turned = history.n_done - (operation.kind == "redo")
        self._dirty_bytes += history.steps[turned].n_bytes

    def _commit(self, row: tuple, take_back: Callable[[], object]) -> None:
        """Write an operation's row; if that fails, its effect is taken back."""
        try:
            self._connection.execute(INSERT, row)
        except BaseException as error:
            take_back()
            if not isinstance(error, sqlite3.Error):
                # Ctrl-C may come when all was written already
                self._connection.execute("DELETE FROM op WHERE seq = ?", row[:1])
                raise
            what = f"operation {row[0]} could not be kept: {error}"
            fix = "free some space, or save the project elsewhere; then do it again"
            raise TextureError(what, str(self.path), fix) from None

    def _checkpoint_if_due(self) -> None:
        n_operations = self.last_seq - max(self._checkpoint_seq, self._origin)
        if n_operations < OPERATIONS_PER_CHECKPOINT and self._dirty_bytes < BYTES_PER_CHECKPOINT:
            return
        try:
            self.checkpoint()
        except sqlite3.Error as error:
            self.warn(f"no checkpoint could be written to {self.path}: {error}")

    def _restore(self, entries: list[Entry]) -> None:
        """Bring the texture to the state after the last operation of the log."""
        steps, n_done = steps_of(entries)
        self.history.steps = [Step(step.kind, step.seq, None) for step in steps]
        self.history.n_done = n_done
        self.last_seq = entries[-1].seq if entries else self._origin
        self._seqs = {(e.client, e.cseq): e.seq for e in entries if e.cseq is not None}
        later = {step.seq for step in steps if step.kernel_version != KERNEL_VERSION}
        loaded = self._replay.load(n_done)
        if loaded is not None:
            digests = {one.attributes["number"]: one.digests for one in loaded.layers}
            self._content.know(digests)
            self._digests.know({number: dict(each) for number, each in digests.items()})
        self._checkpoint_seq = loaded.seq if loaded else -1
        # What was passed over must not be taken for rows of the next checkpoint
        for table in ("checkpoint", "brick"):
            self._connection.execute(f"DELETE FROM {table} WHERE seq > ?", (self._checkpoint_seq,))
        first = self._replay.perform_steps(loaded, n_done)
        if later & {step.number for step in self.history.steps[first:n_done]}:
            self.warn(
                f"operations of {self.path} were first done by another version of meshsdf; "
                "done again, their texels may differ by rounding"
            )

    def _say_what_is_missing(self, n_lost: int) -> None:
        """Compare with what was acknowledged before the last owner died."""
        left = self._lock.left_seq
        if left > self.last_seq:
            self.warn(
                f"operations {self.last_seq + 1} to {left} of {self.path} were acknowledged and "
                "are missing from the file"
            )
        elif n_lost > 1 or (n_lost and not left):
            self.warn(f"{n_lost} damaged commits in the log of {self.path} were passed over")

    def _require_open(self) -> None:
        if not self._is_open:
            what = "the project is closed"
            raise TextureError(what, str(self.path), "open it again with Project.open")
