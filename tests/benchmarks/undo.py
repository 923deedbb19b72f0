"""How long do undo, redo and opening a project take?

python -m tests.benchmarks.undo [--mesh NAME] [--resolution N] [--operations N] [--layers N]

Balls of random size and place are painted over a real mesh, all undone and all redone; the texels'
SHA-256 is compared at every tenth step. Then layers of noise, which does not compress, are added,
and the project is opened; the digest must be what it was.
"""

import argparse
import os
import statistics
import tempfile
import time
from pathlib import Path

import numpy as np

from meshsdf import read_mesh
from meshsdf.texture.journal import Project
from meshsdf.texture.operation_kinds import layer_numbered
from meshsdf.texture.operations import KINDS, Operation

from .alternate import machine, models

ENTRIES_AT_ONCE = 4096
LONGEST = 0.05  # seconds a step may take


def noise(texture, *, layer: int) -> None:
    """Fill a layer with random texels at all levels."""
    found = layer_numbered(texture, layer)
    dice = np.random.default_rng(layer)
    for begin in range(0, texture.octree.n_entries, ENTRIES_AT_ONCE):
        end = min(begin + ENTRIES_AT_ONCE, texture.octree.n_entries)
        slots = texture.writable(found, np.arange(begin, end, dtype=np.int32))
        texels = dice.integers(0, 2**32, (len(slots), 512), np.uint32)
        texture.pool.arrays["base"][slots] = texels


def timed(call) -> float:
    """Seconds of one call."""
    begin = time.perf_counter()
    call()
    return time.perf_counter() - begin


def tell(name: str, seconds: list[float]) -> None:
    """Median, and the longest."""
    middle, most = statistics.median(seconds), max(seconds)
    print(f"{name:18} median {1e3 * middle:8.2f} ms, longest {1e3 * most:8.2f} ms")


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--mesh", default="armadillo.obj")
    parser.add_argument("--resolution", type=int, default=1024)
    parser.add_argument("--operations", type=int, default=1000)
    parser.add_argument("--layers", type=int, default=3)
    asked = parser.parse_args()
    mesh = read_mesh(models() / asked.mesh)
    size, dice = float(mesh.box.size.max()), np.random.default_rng(0)
    print(f"{asked.mesh} at {asked.resolution}; {machine()}")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "paint.mtex"
        with Project.create(path, mesh, resolution=asked.resolution) as project:
            project.apply(Operation("add-layer"))
            digests, seconds = [project.digest()], []
            for _ in range(asked.operations):
                params = {
                    "layer": 0,
                    "center": mesh.vertices[dice.integers(mesh.n_vertices)],
                    "radius": size * float(dice.uniform(0.005, 0.03)),
                    "color": dice.random(4),
                }
                operation = Operation("paint-ball", params)
                seconds.append(timed(lambda operation=operation: project.apply(operation)))
                digests.append(project.digest() if len(digests) % 10 == 0 else "")
            tell("apply", seconds)
            for name, turn, states in (
                ("undo", project.undo, digests[-2::-1]),
                ("redo", project.redo, digests[1:]),
            ):
                seconds = []
                for digest in states:
                    seconds.append(timed(turn))
                    assert not digest or project.digest() == digest
                tell(name, seconds)
            print(f"slower than {LONGEST} s: {sum(s > LONGEST for s in seconds)}")
            print(f"memory of the history: {project.history.n_bytes / 1e6:.1f} MB")
        KINDS["noise"] = noise
        with Project.open(path) as project:
            for layer in range(1, asked.layers + 1):
                project.apply(Operation("add-layer"))
                project.apply(Operation("noise", {"layer": layer}))
            print(f"checkpoint of all: {timed(project.checkpoint):.2f} s")
            digest = project.digest()
        seconds = []
        for _ in range(5):
            begin = time.perf_counter()
            project = Project.open(path)
            seconds.append(time.perf_counter() - begin)
            assert project.digest() == digest
            project.close()
        tell(f"open {os.path.getsize(path) / 1e6:.0f} MB", seconds)


if __name__ == "__main__":
    main()
