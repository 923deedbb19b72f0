"""How fast is the signed band itself, beside OpenVDB's createLevelSetFromPolygons?

python -m tests.benchmarks.band [RESOLUTION ...]

Timers stand around the calls alone: ours covers weld, check, sign and distance; OpenVDB's its one
call. Before the clock counts, both must find nearly the same number of active voxels.
"""

import json
import subprocess
import sys
import time

from meshsdf import check, mesh_to_band, read_mesh

from .alternate import RIVAL, SYSTEM_PYTHON, alternate, machine, median, models

REPEATS = 5


def main(resolutions: list[str]) -> None:
    """Print medians and ratios for armadillo."""
    path = models() / "armadillo.obj"
    mesh = read_mesh(path)
    print(machine())
    for n in resolutions:
        rival = [SYSTEM_PYTHON, str(RIVAL), str(path), "-", n]

        def theirs(command: list[str] = rival) -> dict:
            return json.loads(subprocess.run(command, check=True, capture_output=True).stdout)

        def ours(resolution: float = float(n)) -> float:
            begin = time.perf_counter()
            report = check(mesh, self_intersections=False)
            mesh_to_band(mesh, resolution=resolution, report=report)
            return time.perf_counter() - begin

        band = mesh_to_band(mesh, resolution=float(n))
        expected = theirs()["active_voxels"]
        assert abs(band.n_active - expected) < 1e-3 * expected, (band.n_active, expected)
        runs = {"meshsdf": ours, "OpenVDB": lambda: theirs()["seconds"][0]}
        seconds = {name: median(v) for name, v in alternate(runs, REPEATS).items()}
        rate = band.n_active / seconds["meshsdf"] / 1e6
        print(
            f"{n:>5}: meshsdf {seconds['meshsdf']:.3f} s ({rate:.1f} M active voxels/s), "
            f"OpenVDB {seconds['OpenVDB']:.3f} s, "
            f"OpenVDB / meshsdf = {seconds['OpenVDB'] / seconds['meshsdf']:.1f}"
        )


if __name__ == "__main__":
    main(sys.argv[1:] or ["128", "256", "512", "1024"])
