"""How fast is a full exact signed distance grid, beside libigl and Open3D at the same nodes?

python -m tests.benchmarks.dense [RESOLUTION ...]

Ours covers check, sign, band and far field; theirs building their trees and querying every node.
Before the clock counts, the answers must agree.
"""

import sys
import time

import numpy as np

from meshsdf import mesh_to_grid, read_mesh

from .alternate import alternate, machine, median, models
from .rivals import compare_answers, rivals

REPEATS = 5


def main(resolutions: list[str]) -> None:
    """Print medians and ratios for armadillo."""
    mesh = read_mesh(models() / "armadillo.obj")
    print(machine())
    for n in resolutions:
        grid = mesh_to_grid(mesh, resolution=float(n))
        ijk = np.indices(grid.values.shape).reshape(3, -1).T
        nodes = np.ascontiguousarray(grid.origin + grid.voxel_size * ijk)
        print(f"{n:>5}: {len(nodes)} nodes")

        def ours(resolution: float = float(n)) -> float:
            begin = time.perf_counter()
            mesh_to_grid(mesh, resolution=resolution)
            return time.perf_counter() - begin

        runs = {"meshsdf": ours}
        for name, run in rivals(mesh, nodes).items():
            compare_answers(name, grid.values.ravel(), run()[1], mesh.box.longest_side)
            runs[name] = lambda run=run: run()[0]
        seconds = {name: median(v) for name, v in alternate(runs, REPEATS).items()}
        for name, value in seconds.items():
            ratio = value / seconds["meshsdf"]
            print(f"       {name}: {value:.3f} s, {ratio:.1f} x meshsdf")


if __name__ == "__main__":
    main(sys.argv[1:] or ["64", "128"])
