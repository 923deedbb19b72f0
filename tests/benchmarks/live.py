"""How long until a batch of a live stroke is painted and on the disk?

python -m tests.benchmarks.live [MODEL] [--resolution N] [--radius TEXELS] [--folder DIR] [--cpu]

Strokes wander over the surface as in `dabs`, a few samples a batch. "add" paints a batch and
commits it; "look" asks a `Watch` what changed; "end" averages coarser levels and commits the
operation. The disk is that of --folder. With --cpu the time is that of all cores together, which
says more on a busy machine, but counts no waiting for the disk. Before the clock starts a stroke
that was painted live is checked against the whole stroke, done as one operation: the same bytes.
"""

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np

from meshsdf import read_mesh
from meshsdf.texture.brush import Brush
from meshsdf.texture.journal import Project
from meshsdf.texture.live import LiveStrokes
from meshsdf.texture.operations import Operation
from meshsdf.texture.stroke_record import StrokeRecord
from meshsdf.texture.watch import Watch

from ..models import model
from .alternate import machine
from .dabs import STEP, wander

CLIENT = "c" * 32
FLOORS = {"add": 5.0, "end": 20.0}  # milliseconds, medians


class Painter:
    """Paints strokes live, and keeps how long everything took."""

    def __init__(self, live: LiveStrokes, *, batch: int, cpu: bool) -> None:
        self.live, self.batch = live, batch
        self.watch = Watch(live.project.texture)
        self.clock = time.process_time if cpu else time.perf_counter
        self.seconds: dict[str, list[float]] = {}
        self.cseq = live.last_cseq(CLIENT)

    def timed(self, name: str, function, *args):
        """Call and remember."""
        begin = self.clock()
        out = function(*args)
        self.seconds.setdefault(name, []).append(self.clock() - begin)
        return out

    def number(self) -> int:
        """The client's next number."""
        self.cseq += 1
        return self.cseq

    def paint(self, brush: Brush, points: np.ndarray, normals: np.ndarray) -> None:
        """One stroke."""
        self.timed("begin", self.live.begin, CLIENT, self.number(), 0, brush)
        for first in range(0, len(points), self.batch):
            part = slice(first, first + self.batch)
            self.timed("add", self.live.add, CLIENT, self.number(), points[part], normals[part])
            self.timed("look", self.watch.changed)
        self.timed("end", self.live.end, CLIENT, self.number())


def check(painter: Painter, brush: Brush, points: np.ndarray, normals: np.ndarray) -> None:
    """A live stroke beside the same stroke as one operation."""
    live = painter.live
    painter.paint(brush, points, normals)
    digest = live.project.digest()
    live.apply(Operation("undo"))
    record = StrokeRecord(brush, points, normals, np.ones(len(points)), 0)
    live.apply(Operation("stroke", record.to_params()))
    assert live.project.digest() == digest


def main() -> None:
    """One line per step of a stroke."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("model", nargs="?", default="armadillo.obj")
    parser.add_argument("--resolution", type=int, default=512)
    parser.add_argument("--radius", type=float, default=25.0)
    parser.add_argument("--hardness", type=float, default=0.5)
    parser.add_argument("--batch", type=int, default=2)
    parser.add_argument("--strokes", type=int, default=40)
    parser.add_argument("--samples", type=int, default=64)
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--cpu", action="store_true")
    asked = parser.parse_args()
    rng = np.random.default_rng(0)
    with tempfile.TemporaryDirectory(dir=asked.folder) as folder:
        mesh, path = read_mesh(model(asked.model)), Path(folder) / "live.mtex"
        live = LiveStrokes(Project.create(path, mesh, resolution=asked.resolution))
        live.apply(Operation("add-layer", {"color": [0.5, 0.5, 0.5, 1.0]}))
        texture = live.project.texture
        radius = asked.radius * texture.octree.texel
        painter = Painter(live, batch=asked.batch, cpu=asked.cpu)
        for n in range(asked.strokes + 3):
            color = (1.0, 0.1 * (n % 10), 0.0, 1.0)
            brush = Brush(radius, hardness=asked.hardness, color=color, build_up=n % 2 == 1)
            path = wander(texture, STEP * radius, asked.samples, rng)
            if n < 3:
                check(painter, brush, *path)
                painter.seconds = {}
            else:
                painter.paint(brush, *path)
        live.close()
    print(machine())
    print(f"{asked.model} at {asked.resolution}, {asked}")
    for name, seconds in painter.seconds.items():
        ms = 1e3 * np.array(seconds)
        p99, worst = np.percentile(ms, 99), ms.max()
        floor = f"; floor {FLOORS[name]:g}" if name in FLOORS else ""
        print(
            f"{name:5}: median {np.median(ms):6.2f} ms, 99 % {p99:6.2f}, most {worst:6.2f}{floor}"
        )


if __name__ == "__main__":
    main()
