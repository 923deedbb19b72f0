"""Long work beside the event loop, on threads that do not keep the process from ending."""

import asyncio
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, TypeVar

from .limits import Refused

T = TypeVar("T")


async def apart(function: Callable[..., T], *arguments: Any) -> T:
    """What ``function(*arguments)`` returns or raises on a thread of its own."""
    loop = asyncio.get_running_loop()
    future: asyncio.Future[T] = loop.create_future()

    def settle(result: Any, error: BaseException | None) -> None:
        if future.cancelled():
            return
        if error is None:
            future.set_result(result)
        else:
            future.set_exception(error)

    def work() -> None:
        result, error = None, None
        try:
            result = function(*arguments)
        except Exception as raised:  # noqa: BLE001 (it is raised again where it is awaited)
            error = raised
        with suppress(RuntimeError):  # the loop is closed: nobody waits any more
            loop.call_soon_threadsafe(settle, result, error)

    threading.Thread(target=work, name="meshsdf-apart", daemon=True).start()
    return await future


class Turnstile:
    """Lets so many in at once and turns others away.

    Parameters
    ----------
    most : int
    what : str
        What there would be too many of, for people.
    """

    def __init__(self, most: int, what: str) -> None:
        self.most, self.what = most, what
        self.inside = 0

    @contextmanager
    def passed(self) -> Iterator[None]:
        """Be one of them; Refused if there is no room."""
        if self.inside >= self.most:
            what = f"there are {self.inside} {self.what} already"
            raise Refused(429, what, "this server", "wait until one is done")
        self.inside += 1
        try:
            yield
        finally:
            self.inside -= 1
