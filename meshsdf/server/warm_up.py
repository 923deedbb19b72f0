"""Loading, or once compiling, all that strokes need before the first of them comes."""

import tempfile
from pathlib import Path

import numpy as np

from ..mesh.primitives import icosphere
from ..texture.brush import Brush
from ..texture.journal import Project
from ..texture.live import LiveStrokes
from ..texture.operations import Operation
from .feed import Feed
from .wire_bricks import WireBricks

RESOLUTION = 24  # several levels, and bricks beside each other
RED = (0.8, 0.1, 0.1, 1.0)
BRUSHES = (
    Brush(0.4, color=RED),
    Brush(0.4, color=RED, build_up=True, flow=0.5),
    Brush(0.4, kind="erase"),
    Brush(0.4, kind="blur"),
    Brush(0.4, kind="smudge"),
)


def warm_up() -> None:
    """Paint on a small ball that nobody sees, in a project of its own."""
    ball = icosphere(subdivisions=2)
    with tempfile.TemporaryDirectory(prefix="meshsdf-") as folder:
        path = Path(folder) / "ball.mtex"
        with Project.create(path, ball, resolution=RESOLUTION) as project:
            for alpha in (1.0, 0.0):
                project.apply(Operation("add-layer", {"color": [0.5, 0.5, 0.5, alpha]}))
        live = LiveStrokes.open(path)
        try:
            _paint(live, ball.vertices[:4])
        finally:
            live.close()


def _paint(live: LiveStrokes, points: np.ndarray) -> None:
    bricks = WireBricks(live.project.texture)
    feed = Feed(bricks, lambda frame: None)
    for turn, brush in enumerate(BRUSHES):
        first = 100 * turn
        live.begin("warm", first + 1, 1, brush)
        for number in range(2):
            live.add("warm", first + 2 + number, points, points)
            bricks.update()
            feed.refill()
        live.end("warm", first + 9)
    live.apply(Operation("undo"))
    bricks.update()
    bricks.release()
