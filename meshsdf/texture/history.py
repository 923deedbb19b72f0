"""The steps that can be undone and redone, within a budget of memory.

The bricks of the steps nearest to now stay in the texture's pool; those of the others are put by
(`cold`): compressed, and in a temporary file when they are many.
"""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from ..arrays import Number
from ..errors import TextureError
from .blobs import Damaged
from .change import Change, recording
from .spill import Spill
from .volume_texture import VolumeTexture

BUDGET = 512 * 2**20
DENSE = 8 * 2**20
ENTRIES_AT_ONCE = 128  # put by before the clock is looked at: about a millisecond


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
        What the change needs, in memory and in the file.
    n_hot : int
        Of these, what is not put by.
    """

    name: str
    number: int
    change: Change | None
    n_bytes: int = 0
    n_hot: int = 0


class History:
    """What was done to a texture, to be undone and redone.

    Parameters
    ----------
    texture : VolumeTexture
        All of its edits go through `record`.
    budget : int
        Bytes that may be kept for undoing and redoing, as they are: 512 texels a brick for those in
        the texture's pool, what they are compressed to for those put by, in memory or in the
        temporary file. Beyond it steps are let go, the oldest first.
    dense : int
        Bytes of bricks that may stay in the pool, of the steps nearest to now: undoing these takes
        no unpacking. An eighth of the budget if that is less. They may be twice as many, and what
        the latest steps need, until `put_some_by` is called.
    rebuild : callable, optional
        ``rebuild(n)`` brings the texture to where the first n of `steps` are done, some other way,
        and may give back changes by `keep`. It is called for steps that were let go.

    Attributes
    ----------
    steps : list of Step
        Oldest first; the first `n_done` are done, the others undone.
    n_bytes, n_hot : int
        Sums of the steps'.
    spill : Spill
        Where bricks are put by.
    """

    def __init__(
        self,
        texture: VolumeTexture,
        *,
        budget: int = BUDGET,
        dense: int = DENSE,
        rebuild: Callable[[int], None] | None = None,
    ) -> None:
        self.texture = texture
        self.budget = budget
        self.dense = min(dense, budget // 8)
        self.rebuild = rebuild
        self.steps: list[Step] = []
        self.n_done = 0
        self.n_bytes = self.n_hot = 0
        self.spill = Spill()
        self._hot: set[int] = set()  # indices of steps that are not all put by
        self._shared: set[int] = set()  # of steps whose bricks others need now, too
        self._needed: np.ndarray | None = None  # how often steps name each slot

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
        for index in range(self.n_done, len(self.steps)):
            self._let_go(index)
        del self.steps[self.n_done :]
        self.steps.append(Step(name, number, None))
        self.n_done += 1
        if change is not None:
            self._share_lists(change)
            self.keep(self.n_done - 1, change)

    def keep(self, index: int, change: Change) -> None:
        """Give a step its change, as far as the budget allows."""
        self._let_go(index)
        self.steps[index].change = change
        self._turned(index)

    def put_some_by(self, seconds: Number = 0.002) -> bool:
        """Put bricks by for a while, those of the steps farthest from now first.

        Call it when nobody waits, from the thread that edits the texture. Nothing happens if the
        bricks in the pool are few.

        Parameters
        ----------
        seconds : float
            Stop after this time, or up to two milliseconds later.

        Returns
        -------
        again : bool
            Whether there is more to do.
        """
        if self.n_hot <= self.dense:
            return False
        end = time.perf_counter() + seconds
        for index in self._farthest_first():
            while self.n_hot > self.dense and self._put_by(index, ENTRIES_AT_ONCE):
                if time.perf_counter() >= end:
                    return self.n_hot > self.dense
        return False

    def close(self) -> None:
        """Let go of all steps' changes, and of the temporary file."""
        for index in range(len(self.steps)):
            self._let_go(index)
        self.spill.close()

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
            try:
                turn(step.change, self.texture)
            except Damaged as error:
                self._let_go(index)
                what = f"step {step.name!r} is lost for now: {error}"
                raise TextureError(what, "undo() or redo()", "try again") from None
            self.n_done = n_done
            self._turned(index)
        elif self.rebuild is not None:
            self.rebuild(n_done)
            self.n_done = n_done
            self._trim(0)
        else:
            what = f"step {step.name!r} was let go: {self.budget} bytes did not hold it"
            raise TextureError(what, "undo() or redo()", "give the history a larger budget")

    def _turned(self, index: int) -> None:
        """A step's bricks are all in the pool."""
        self._needed = None
        self._shared.clear()
        self._measure(index)
        self._trim(2 * self.steps[index].n_hot)

    def _measure(self, index: int) -> None:
        step = self.steps[index]
        n_bytes = step.change.n_bytes(self.texture) if step.change else 0
        n_hot = step.change.n_hot_bytes(self.texture) if step.change else 0
        self.n_bytes += n_bytes - step.n_bytes
        self.n_hot += n_hot - step.n_hot
        step.n_bytes, step.n_hot = n_bytes, n_hot
        (self._hot.add if n_hot else self._hot.discard)(index)

    def _let_go(self, index: int) -> None:
        step = self.steps[index]
        if step.change is not None:
            step.change.release(self.texture)
            step.change = None
            self._needed = None
            self._measure(index)

    def _share_lists(self, change: Change) -> None:
        """Most steps leave the list of layers alone: let them have one between them."""
        if self.n_done > 1 and (last := self.steps[self.n_done - 2].change) is not None:
            if change.before.same(last.after):
                change.before = last.after
            if change.after.same(change.before):
                change.after = change.before

    def _farthest_first(self, nearest: int = 1) -> list[int]:
        """Indices of steps that may be put by; those to be undone or redone next if ``nearest`` is
        0."""
        now = self.n_done - 0.5
        far = [index for index in self._hot - self._shared if abs(index - now) > nearest]
        return sorted(far, key=lambda index: (-abs(index - now), index))

    def _put_by(self, index: int, most: int) -> int:
        """Put some of a step's bricks by; how many entries that were."""
        if self._needed is None:
            self._needed = self._count_needed()
        step = self.steps[index]
        n = step.change.put_by(self.texture, self.spill, self._needed, most)
        self._measure(index)
        if not n:
            self._shared.add(index)
        return n

    def _count_needed(self) -> np.ndarray:
        """(c,) int32: how often changes name each slot of the pool."""
        named = [np.empty(0, np.int32)]
        for index in self._hot:
            for one in self.steps[index].change.slots:
                named += [one.before, one.after]
        slots = np.concatenate(named)
        found = np.bincount(slots[slots >= 0], minlength=len(self.texture.pool.holders))
        return found.astype(np.int32)

    def _trim(self, n_bytes: int) -> None:
        """Put by about so many bytes if too much is not; let go of steps, the oldest first, then
        those that are to be redone last, until the budget is kept."""
        per_brick = sum(array[0].nbytes for array in self.texture.pool.arrays.values())
        most = n_bytes // per_brick + ENTRIES_AT_ONCE
        for index in self._farthest_first() if self.n_hot > 2 * self.dense else ():
            most -= self._put_by(index, most)
            if most <= 0 or self.n_hot <= 2 * self.dense:
                break
        if self.n_bytes <= self.budget:
            return
        for index in self._farthest_first(nearest=0):
            if self.n_hot > self.dense:
                self._put_by(index, self.steps[index].change.n_entries)
        for index in [*range(self.n_done), *range(len(self.steps) - 1, self.n_done - 1, -1)]:
            if self.n_bytes <= self.budget:
                return
            self._let_go(index)
