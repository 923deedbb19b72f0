"""How a reader tells what it could not keep.

A warn callback receives one sentence. Library code never prints; pass ``notes.append`` to collect
the sentences in a list.
"""

from collections.abc import Callable

Warn = Callable[[str], None]
"""``warn(sentence)``."""


def ignore(sentence: str) -> None:
    """The default warn callback: say nothing."""
