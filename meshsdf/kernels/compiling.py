"""Tell when a kernel is compiled because no cached one fits."""

from collections.abc import Callable

from numba.core import event


class _OnCompile(event.Listener):
    """Calls back once, when the first compilation starts."""

    def __init__(self, callback: Callable[[], None]) -> None:
        self.callback: Callable[[], None] | None = callback

    def on_start(self, event: event.Event) -> None:
        if self.callback is not None:
            callback, self.callback = self.callback, None
            callback()

    def on_end(self, event: event.Event) -> None:
        pass


def on_first_compilation(callback: Callable[[], None]) -> None:
    """Call ``callback()`` once, when the first kernel of this process is compiled."""
    event.register("numba:compile", _OnCompile(callback))
