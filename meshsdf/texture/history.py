"""The steps that can be undone and redone, within a budget of memory."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from ..errors import TextureError
from .change import Change, recording
from .volume_texture import VolumeTexture

BUDGET = 512 * 2**20


@dataclass(eq=False)
class Step:
    """One step that people can take back.

    Attributes
    ----------
    name : str
        For people.
    number : int
        For whoever keeps the steps elsewhere, too.
    change : Change or None
        None if the budget did not allow to keep it.
    n_bytes : int
        Memory that the change needs.
    """

    name: str
    number: int
    change: Change | None
    n_bytes: int = 0


class History:
    """What was done to a texture, to be undone and redone.

    Parameters
    ----------
    texture : VolumeTexture
        All of its edits go through `record`.
    budget : int
        Bytes that bricks kept for undoing and redoing may take. The steps farthest from now are
        let go first.
    rebuild : callable, optional
        ``rebuild(n)`` brings the texture to where the first n of `steps` are done, some other way,
        and may give back changes by `keep`. It is called for steps that were let go.

    Attributes
    ----------
    steps : list of Step
        Oldest first; the first `n_done` are done, the others undone.
    """

    def __init__(
        self,
        texture: VolumeTexture,
        *,
        budget: int = BUDGET,
        rebuild: Callable[[int], None] | None = None,
    ) -> None:
        self.texture = texture
        self.budget = budget
        self.rebuild = rebuild
        self.steps: list[Step] = []
        self.n_done = 0
        self.n_bytes = 0

    @property
    def names(self) -> list[str]:
        """Names of the steps that are done, oldest first."""
        return [step.name for step in self.steps[: self.n_done]]

    @property
    def undone_names(self) -> list[str]:
        """Names of the steps that `redo` would do, the next one first."""
        return [step.name for step in self.steps[self.n_done :]]

    @contextmanager
    def record(self, name: str, number: int = 0) -> Iterator[Change]:
        """Record what the body does as one step; it is none if nothing changed.

        What was undone can no longer be redone. If the body raises, nothing has happened.
        """
        with recording(self.texture) as change:
            yield change
        if not change.is_empty:
            self.push(name, number, change)

    def push(self, name: str, number: int, change: Change | None) -> None:
        """Add a step that has just been done; without its change it can only be rebuilt."""
        for step in self.steps[self.n_done :]:
            self._let_go(step)
        del self.steps[self.n_done :]
        self.steps.append(Step(name, number, None))
        self.n_done += 1
        if change is not None:
            self.keep(self.n_done - 1, change)

    def keep(self, index: int, change: Change) -> None:
        """Give a step its change, as far as the budget allows."""
        step = self.steps[index]
        self._let_go(step)
        step.change = change
        self._measure(step)
        self._trim()

    def undo(self) -> str:
        """Take the latest step back, and return its name.

        Raises
        ------
        TextureError
            There is none, or its change was let go and cannot be rebuilt.
        """
        if not self.n_done:
            raise TextureError("there is nothing to undo", "undo()", "do something first")
        self._go(self.n_done - 1, self.n_done - 1, Change.undo)
        return self.steps[self.n_done].name

    def redo(self) -> str:
        """Do the step again that was undone last, and return its name.

        Raises
        ------
        TextureError
            There is none, or its change was let go and cannot be rebuilt.
        """
        if self.n_done == len(self.steps):
            raise TextureError("there is nothing to redo", "redo()", "undo something first")
        self._go(self.n_done, self.n_done + 1, Change.redo)
        return self.steps[self.n_done - 1].name

    def _go(self, index: int, n_done: int, turn: Callable[[Change, VolumeTexture], None]) -> None:
        step = self.steps[index]
        if step.change is not None:
            turn(step.change, self.texture)
            self._measure(step)
        elif self.rebuild is not None:
            self.rebuild(n_done)
        else:
            what = f"step {step.name!r} was let go: {self.budget} bytes did not hold it"
            raise TextureError(what, "undo() or redo()", "give the history a larger budget")
        self.n_done = n_done
        self._trim()

    def _measure(self, step: Step) -> None:
        now = step.change.n_bytes(self.texture) if step.change else 0
        self.n_bytes += now - step.n_bytes
        step.n_bytes = now

    def _let_go(self, step: Step) -> None:
        if step.change is not None:
            step.change.release(self.texture)
            step.change = None
            self._measure(step)

    def _trim(self) -> None:
        """Let go of steps, the oldest first, then those that are to be redone last."""
        if self.n_bytes <= self.budget:
            return
        for step in [*self.steps[: self.n_done], *reversed(self.steps[self.n_done :])]:
            self._let_go(step)
            if self.n_bytes <= self.budget:
                return
