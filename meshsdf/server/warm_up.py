"""Loading, or once compiling, all that strokes need before the first of them comes.

On a new machine two processes compile: this one makes what a project needs, then what pictures
need, while a `Helper` (which runs this module) makes what strokes need. Both keep what they compile
where the other one finds it. Brushes that are rarer than the plain one are the helper's, too, while
people paint already.
"""

import contextlib
import os
import signal
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from itertools import count
from pathlib import Path

import numpy as np

from ..mesh.primitives import icosphere
from ..texture.brush import Brush
from ..texture.journal import Project
from ..texture.layers import shown
from ..texture.live import LiveStrokes
from ..texture.operations import Operation
from .feed import Feed
from .helper import Helper
from .wire_bricks import WireBricks

RESOLUTION = 24  # several levels, and bricks beside each other
RED = (0.8, 0.1, 0.1, 1.0)
PLAIN = (Brush(0.4, color=RED),)
RARER = (
    Brush(0.4, color=RED, build_up=True, flow=0.5),
    Brush(0.4, kind="erase"),
    Brush(0.4, kind="blur"),
    Brush(0.4, kind="smudge"),
    Brush(0.4, channel="height", value=2.0),
)
CLIENT = "warm-up"
LEAST_NICE = 10  # of what is compiled beside painting


def warm_up(folder: Path, helper: Helper | None = None) -> None:
    """Paint on a small ball that nobody sees, in a project of its own.

    Parameters
    ----------
    folder : Path
        For the project's file, which is left there.
    helper : Helper, optional
        If it has something to compile, this returns when the plain brush is ready, and the rarer
        ones come later.
    """
    helper = helper or Helper()
    with _ball(folder) as live:
        helper.go()
        bricks = WireBricks(live.project.texture)
        feed = Feed(bricks, lambda frame: None)
        for operation in (Operation("add-layer", {"color": RED}), Operation("undo")):
            live.apply(operation)
            bricks.update()
            feed.refill()
        is_helped = helper.wait()
        _paint(live, bricks, PLAIN if is_helped else PLAIN + RARER)


def help_out() -> None:
    """What a helper does: once it is told to go, compile for strokes, and tell when it has."""
    # Leaving no files; Ctrl-C is for the owner
    signal.signal(signal.SIGTERM, lambda *_: sys.exit())
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    sys.stdin.readline()
    with tempfile.TemporaryDirectory(prefix="meshsdf-") as folder, _ball(Path(folder)) as live:
        with _stroke(live, PLAIN[0]) as go_on:
            go_on()
        with _stroke(live, PLAIN[0]) as go_on:
            shown(live.project.texture)  # the other process was there first
            go_on()
            shown(live.project.texture)
        bricks = WireBricks(live.project.texture)
        _paint(live, bricks, PLAIN)
        print("ready", flush=True)
        if hasattr(os, "nice"):
            os.nice(LEAST_NICE)
        _paint(live, bricks, RARER)
        texture = live.project.texture
        texture.colors(texture.surface.vertices, texture.surface.vertices)  # as exports look it up


@contextlib.contextmanager
def _ball(folder: Path) -> Iterator[LiveStrokes]:
    """A ball with two layers."""
    path, ball = folder / "ball.mtex", icosphere(subdivisions=2)
    with Project.create(path, ball, resolution=RESOLUTION) as project:
        for alpha in (1.0, 0.0):
            project.apply(Operation("add-layer", {"color": [0.5, 0.5, 0.5, alpha]}))
    live = LiveStrokes.open(path)
    try:
        yield live
    finally:
        live.close()


def _paint(live: LiveStrokes, bricks: WireBricks, brushes: Sequence[Brush]) -> None:
    """Paint with each brush, and send what that changes to a page that is not there."""
    feed = Feed(bricks, lambda frame: None)
    for brush in brushes:
        with _stroke(live, brush) as go_on:
            for _ in range(2):
                go_on()
                bricks.update()
                feed.refill()
    live.apply(Operation("undo"))
    bricks.update()


@contextlib.contextmanager
def _stroke(live: LiveStrokes, brush: Brush) -> Iterator[Callable[[], None]]:
    """A stroke on the upper layer, partly on the one before; what is called goes on with it."""
    last = live.last_cseq(CLIENT)
    points = np.roll(live.project.texture.surface.vertices, -last, axis=0)[:4]
    numbers = count(last + 1)
    live.begin(CLIENT, next(numbers), 1, brush)
    yield lambda: live.add(CLIENT, next(numbers), points, points)
    live.end(CLIENT, next(numbers))


if __name__ == "__main__":
    help_out()
