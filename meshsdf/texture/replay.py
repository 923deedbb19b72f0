"""Bring a texture to where some of its project's steps are done: a checkpoint, and what follows."""

import sqlite3
from collections.abc import Callable

from ..errors import MeshsdfError, TextureError
from .blobs import Damaged
from .change import recording
from .checkpoint import Loaded, install, load_checkpoint
from .history import History
from .journal_log import read_operation
from .journal_schema import FAULTS
from .operations import perform


class Replay:
    """Finds earlier states again.

    Parameters
    ----------
    connection : sqlite3.Connection
        To the project.
    history : History
        Its steps, and the texture.
    origin : int
        Operation whose checkpoint the project begins with; 0 if it begins without layers.
    warn : callable
        Told of checkpoints that are passed over.
    """

    def __init__(
        self,
        connection: sqlite3.Connection,
        history: History,
        origin: int,
        warn: Callable[[str], None],
    ) -> None:
        self.connection = connection
        self.history = history
        self.texture = history.texture
        self.origin = origin
        self.warn = warn

    def rebuild(self, n_done: int) -> None:
        """Bring the texture to where the first ``n_done`` steps are done; for the history.

        Raises
        ------
        TextureError
            That state cannot be found again; then nothing has changed.
        """
        try:
            if n_done == self.history.n_done + 1:
                self._perform_step(n_done - 1)
                return
            with recording(self.texture) as change:
                self.perform_steps(self.load(n_done), n_done)
        except Damaged as error:
            fix = "go on from here, or open a copy of the file"
            raise TextureError(str(error), "undo() or redo()", fix) from None
        change.release(self.texture)

    def load(self, n_done: int) -> Loaded | None:
        """Put the checkpoint into the texture from which the fewest steps lead to ``n_done``.

        None stands for a texture without layers. `Damaged` if it begins with none of these.
        """
        depth = self._depths(n_done)
        rows = self.connection.execute("SELECT seq, tip FROM checkpoint").fetchall()
        usable = [(depth[tip], seq) for seq, tip in rows if tip in depth]
        self.texture.pool.begin_recording()  # so that its slots are known as new ones
        try:
            for _, seq in sorted(usable, reverse=True):
                try:
                    loaded = load_checkpoint(self.connection, self.texture, seq)
                except Damaged as error:
                    self.warn(f"{error}; an earlier one is used")
                    continue
                install(self.texture, loaded)
                return loaded
            if self.origin:
                raise Damaged(f"the state after operation {self.origin} cannot be read")
            install(self.texture, None)
            return None
        finally:
            self.texture.pool.end_recording()

    def perform_steps(self, loaded: Loaded | None, n_done: int) -> int:
        """Perform the steps after a checkpoint; return the index of the first."""
        first = self._depths(n_done)[loaded.tip] if loaded else 0
        for index in range(first, n_done):
            self._perform_step(index)
        return first

    def _depths(self, n_done: int) -> dict[int, int]:
        """Of every step that may be a checkpoint's tip, how many steps are then done."""
        done = self.history.steps[:n_done]
        return {0: 0} | {step.number: index + 1 for index, step in enumerate(done)}

    def _perform_step(self, index: int) -> None:
        number = self.history.steps[index].number
        try:
            operation = read_operation(self.connection, number)
            with recording(self.texture) as change:
                perform(self.texture, operation)
        except (MeshsdfError, *FAULTS) as error:
            raise Damaged(f"operation {number} cannot be done again: {error}") from None
        self.history.keep(index, change)
