"""How fast are signed distances at arbitrary points, beside libigl and Open3D?

python -m tests.benchmarks.points [NUMBER ...]

Points are uniform in the mesh's box grown by a tenth, in random order. Building the trees is
counted, ours and theirs. Before the clock counts, the answers must agree.
"""

import sys
import time

import numpy as np

from meshsdf import MeshDistance, read_mesh

from .alternate import alternate, machine, median, models
from .rivals import compare_answers, rivals

REPEATS = 5


def main(numbers: list[str]) -> None:
    """Print medians, rates and ratios for armadillo."""
    mesh = read_mesh(models() / "armadillo.obj")
    print(machine())
    for number in numbers:
        random = np.random.default_rng(0).uniform(-0.6, 0.6, (int(number), 3))
        points = mesh.box.center + random * mesh.box.size
        print(f"{number:>8} points")

        def ours(points: np.ndarray = points) -> float:
            begin = time.perf_counter()
            MeshDistance(mesh)(points)
            return time.perf_counter() - begin

        found = MeshDistance(mesh)(points).distance
        runs = {"meshsdf": ours}
        for name, run in rivals(mesh, points).items():
            compare_answers(name, found, run()[1], mesh.box.longest_side)
            runs[name] = lambda run=run: run()[0]
        seconds = {name: median(v) for name, v in alternate(runs, REPEATS).items()}
        for name, value in seconds.items():
            rate, ratio = len(points) / value / 1e6, value / seconds["meshsdf"]
            print(f"       {name}: {value:.3f} s ({rate:.2f} M points/s), {ratio:.1f} x meshsdf")


if __name__ == "__main__":
    main(sys.argv[1:] or ["10000", "100000"])
