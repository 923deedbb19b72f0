"""Tell when a kernel is compiled because no cached one fits; load cached ones without delay."""

from collections.abc import Callable

import numba
from numba.core import caching, event
from numba.core.runtime import rtsys

KNOWN = "0.68."  # version of numba whose way of loading is known


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


def load_cached_at_once() -> None:
    """Let numba load cached kernels without all that it needs for compiling.

    It imports scipy.linalg and all its registries before it loads a finished kernel: 0.4 s for
    every process. A finished kernel needs the runtime alone; what is compiled later still loads
    the registries, as the compiler itself asks for them. Other versions are left as they are.
    """
    if numba.__version__.startswith(KNOWN):
        caching.Cache.load_overload = _load_overload


def _load_overload(self, sig, target_context):
    rtsys.initialize(target_context)
    with self._guard_against_spurious_io_errors():
        return self._load_overload(sig, target_context)
