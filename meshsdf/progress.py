"""How long work tells how far it is.

A progress callback receives the name of the stage and the fraction done in [0, 1]. Library code
never prints; it calls the callback, if one was given, between pieces of work. An exception that
the callback raises (KeyboardInterrupt among them) stops the work.
"""

from collections.abc import Callable

Progress = Callable[[str, float], None]
"""``progress(stage, fraction)``."""


def silent(stage: str, fraction: float) -> None:
    """The default progress callback: say nothing."""
