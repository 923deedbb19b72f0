"""The thread that owns a project while pages paint on it.

Everything that reads or changes the project runs there, one thing after another; whoever asks
awaits the outcome. When something changed, all that was asked for by then is done first (for at
most `TICK` seconds), then the pages are told once.

Samples of strokes have a second thread, the intake: it puts them on the disk, and so they are
acknowledged, while the first one paints what came before and makes pictures of it.
"""

import asyncio
import secrets
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import islice
from typing import Any, ParamSpec, Protocol, TypeVar, runtime_checkable

from ..arrays import Number
from ..errors import MeshsdfError
from ..texture.live import LiveStrokes
from ..texture.operations import Operation
from .octree_wire import wire_origin
from .state import state_of
from .wire_bricks import RELIEFS, WireBricks

P = ParamSpec("P")
R = TypeVar("R")

TICK = 0.016  # seconds
MOST_WAITING = 256  # things asked for and not yet done
MOST_UNPAINTED = 64  # batches of samples; others are not taken in before
PATIENCE = 30.0  # seconds


@runtime_checkable
class Subscriber(Protocol):
    """A page that is connected."""

    def refill(self) -> None:
        """On the studio's thread: bricks may have changed, or the page may have more of them."""

    def told_state(self, state: dict[str, Any]) -> None:
        """On the studio's thread: the state is another one now."""

    def replace(self) -> None:
        """Another connection of the same client is there."""


class Studio:
    """A project, its thread, and the pages that look at it.

    Parameters
    ----------
    live : LiveStrokes
        From now on nobody else may use it or its project, but through `do`.
    patience : float
        Seconds that a stroke stays open after its page has gone.

    Attributes
    ----------
    bricks : WireBricks
        What pages should show; for the studio's thread alone.
    origin : (3,) float64
        Where coordinates on the wire count from.
    run : str
        Random; versions of bricks are comparable within one run.
    refused : dict of (str, int) to MeshsdfError
        What was not done, by client and number.
    state : dict
        What STATE says. Never changed, but replaced.
    """

    def __init__(self, live: LiveStrokes, *, patience: Number = PATIENCE) -> None:
        self.patience = float(patience)
        self.live, self.project, self.texture = live, live.project, live.project.texture
        self.origin = wire_origin(self.texture)
        self.run = secrets.token_hex(8)
        self._clients: dict[int, str] = {}  # who did an operation
        self._n_seqs = 0
        self._subscribers: list[Subscriber] = []
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="studio")
        self._intake = ThreadPoolExecutor(1, thread_name_prefix="intake")
        self._room: asyncio.Semaphore | None = None
        self._tick_asked: float | None = None
        self._n_waiting = 0
        self._newest: tuple[int, str, Operation] | None = None
        self.refused: dict[tuple[str, int], MeshsdfError] = {}
        self._leaving: dict[str, asyncio.TimerHandle] = {}
        self._tasks: set[asyncio.Task] = set()
        self._pages: dict[str, Subscriber] = {}
        self.bricks = self._thread.submit(WireBricks, self.texture).result()
        self._thread.submit(self.project.keep_house_apart).result()
        self.state: dict[str, Any] = {}
        self._state_key, self._is_news = (-1, -1), False
        self._refresh()

    @property
    def is_busy(self) -> bool:
        """Whether something is being done or waits."""
        return self._n_waiting > 0

    async def do(self, function: Callable[P, R], *args: P.args, **kwargs: P.kwargs) -> R:
        """Call ``function(*args)`` on the studio's thread; what it returns, or what it raises.

        It waits while too much is waiting already.

        Examples
        --------
        ``await studio.do(studio.project.digest)``
        """
        return await (await self.ask(function, *args, **kwargs))

    async def ask(
        self, function: Callable[P, R], *args: P.args, **kwargs: P.kwargs
    ) -> asyncio.Future[R]:
        """As `do`, but return once it is sure that it comes next, before it is done."""
        return await self._submit(self._thread, self._run, function, *args, **kwargs)

    async def ask_intake(
        self, function: Callable[P, R], *args: P.args, **kwargs: P.kwargs
    ) -> asyncio.Future[R]:
        """As `ask`, on the intake, beside what the studio's thread does; `LiveStrokes.keep` may be.

        Nothing tells which of two things comes first that are asked of different threads.
        """
        while self.live.n_waiting > MOST_UNPAINTED:
            await self.do(self.live.paint)
        return await self._submit(self._intake, self._take_in, function, *args, **kwargs)

    async def _submit(self, thread: ThreadPoolExecutor, *work: Any, **kwargs: Any):
        if self._room is None:
            self._room = asyncio.Semaphore(MOST_WAITING)
            for client in self.live.open_clients():  # of a server that died
                if client not in self._pages:
                    self._wait_for(client)
        await self._room.acquire()
        self._n_waiting += 1
        asked = asyncio.wrap_future(thread.submit(*work, **kwargs))
        asked.add_done_callback(self._was_done)
        return asked

    def _was_done(self, _: asyncio.Future) -> None:
        self._n_waiting -= 1
        self._room.release()

    def arrive(self, client: str, page: Subscriber) -> None:
        """A page is there, or there again; it takes the place of its former connection."""
        former = self._pages.get(client)
        self._pages[client] = page
        if former is not None:
            former.replace()
        self._stop_waiting(client)

    def depart(self, client: str, page: Subscriber) -> None:
        """A connection has ended: the page's stroke ends, too, if it does not come back soon."""
        if self._pages.get(client) is page:
            del self._pages[client]
            self._wait_for(client)

    def _wait_for(self, client: str) -> None:
        self._stop_waiting(client)
        loop = asyncio.get_running_loop()
        self._leaving[client] = loop.call_later(self.patience, self._finish, client)

    def _stop_waiting(self, client: str) -> None:
        timer = self._leaving.pop(client, None)
        if timer is not None:
            timer.cancel()

    def note(self, seq: int, client: str, operation: Operation) -> None:
        """On the studio's thread: this operation of a client has become that step."""
        self._newest = (seq, client, operation)

    def is_newest(self, client: str, operation: Operation) -> bool:
        """Whether the newest step is this client's, of the same kind, on the same layer."""
        history = self.project.history
        if self._newest is None or history.n_done < len(history.steps) or not history.n_done:
            return False
        seq, whose, last = self._newest
        same = (whose, last.kind, last.layer) == (client, operation.kind, operation.layer)
        return same and history.steps[-1].number == seq

    def subscribe(self, subscriber: Subscriber) -> None:
        """From now on tell this one what changes."""
        self._subscribers.append(subscriber)
        self._thread.submit(self._run, bool)  # so that all are told

    def unsubscribe(self, subscriber: Subscriber) -> None:
        """Tell this one nothing more; this does not wait for what is being done."""
        if subscriber in self._subscribers:
            self._subscribers.remove(subscriber)
            self._thread.submit(self._run, bool)

    def digests(self) -> dict[str, str]:
        """On the studio's thread: the project's digest, and of every picture the bricks'."""
        self.look()
        found = {"project": self.project.digest(), "shown": self.bricks.digest()}
        return found | {name: self.bricks.digest(name) for name in RELIEFS}

    async def close(self) -> None:
        """End open strokes, close the project and end the threads."""
        await asyncio.get_running_loop().run_in_executor(None, self._intake.shutdown)
        await asyncio.wrap_future(self._thread.submit(self._close))
        self._thread.shutdown()

    def look(self) -> None:
        """On the studio's thread: let `bricks` be what is painted by now."""
        self.live.paint()
        self.bricks.update()

    def _run(self, function: Callable[..., R], *args: Any, **kwargs: Any) -> R:
        try:
            self.live.paint()
            return function(*args, **kwargs)
        finally:
            self._refresh()
            if not self._ask_for_tick() and time.monotonic() - self._tick_asked > TICK:
                self._tick(is_last=False)

    def _take_in(self, function: Callable[..., R], *args: Any, **kwargs: Any) -> R:
        try:
            return function(*args, **kwargs)
        finally:
            self._ask_for_tick()

    def _ask_for_tick(self) -> bool:
        """Tick after all that waits already, unless that was asked for."""
        if self._tick_asked is not None:
            return False
        self._tick_asked = time.monotonic()
        self._thread.submit(self._tick)
        return True

    def _tick(self, *, is_last: bool = True) -> None:
        self._tick_asked = None if is_last else time.monotonic()
        if self._is_news:
            self._is_news = False
            for subscriber in tuple(self._subscribers):
                subscriber.told_state(self.state)
        try:
            self.look()
            for subscriber in tuple(self._subscribers):
                subscriber.refill()
        except MeshsdfError as error:
            self.project.warn(f"pages could not be told what changed: {error.what}")
        self.project.keep_house()
        if not self.is_busy:
            self.project.history.put_some_by()

    def _refresh(self) -> None:
        """Keep `state` up to date; pages are told at the next tick."""
        key = (self.project.last_seq, len(self._subscribers))
        if key == self._state_key:
            return
        seqs = self.project.seqs
        for (client, _), seq in islice(seqs.items(), self._n_seqs, None):
            self._clients[seq] = client
        self._n_seqs = len(seqs)
        self.state = state_of(self.project, self._clients, len(self._subscribers))
        self._state_key, self._is_news = key, True

    def _finish(self, client: str) -> None:
        """End the stroke of a page that did not come back."""
        del self._leaving[client]

        def finish() -> None:
            if client in self.live.open_clients():
                self.live.finish(client)

        task = asyncio.get_running_loop().create_task(self.do(finish))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def _close(self) -> None:
        self._subscribers.clear()
        self._tick_asked = 0.0  # no more ticks
        self.bricks.release()
        self.live.close()
