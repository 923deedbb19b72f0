"""How fast and how lean is the signed band, beside OpenVDB's createLevelSetFromPolygons?

python -m tests.benchmarks.band [--mesh NAME|subdivided] [--repeats N] [--stages] [RESOLUTION ...]

Each run is a process of its own, ours and OpenVDB's in alternation; timers stand around the calls
alone, peak memory is the whole process's. Both must find nearly the same number of active voxels.
``subdivided`` is armadillo with every face cut in 64: 5.5 million faces.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from meshsdf import Mesh, read_mesh

from .alternate import RIVAL, SYSTEM_PYTHON, alternate, machine, median, models

OURS = Path(__file__).with_name("ours_band.py")


def run(command: list[str]) -> dict:
    """The JSON object that a process prints."""
    return json.loads(subprocess.run(command, check=True, capture_output=True).stdout)


def subdivided(mesh: Mesh, times: int) -> Mesh:
    """Cut every face in four, ``times`` times."""
    import trimesh

    vertices, faces = mesh.vertices, mesh.faces
    for _ in range(times):
        vertices, faces = trimesh.remesh.subdivide(vertices, faces)
    return Mesh(np.asarray(vertices), np.asarray(faces, np.int32))


def measure(path: str, resolution: str, repeats: int) -> dict[str, dict]:
    """Median seconds and peak megabytes of both, and the seconds of our stages."""
    commands = {
        "meshsdf": [sys.executable, str(OURS), path, resolution],
        "OpenVDB": [SYSTEM_PYTHON, str(RIVAL), path, "-", resolution],
    }
    active = {name: run(command)["n_active"] for name, command in commands.items()}
    # OpenVDB is off by up to a voxel where millions of faces meet few voxels
    assert abs(active["meshsdf"] / active["OpenVDB"] - 1) < 5e-3, active
    runs = {name: (lambda command=command: run(command)) for name, command in commands.items()}
    found = alternate(runs, repeats)
    return {
        name: {
            "seconds": median([one["seconds"] for one in each]),
            "MB": median([one["peak"] / 1e6 for one in each]),
            "stages": each[0].get("stages"),
        }
        for name, each in found.items()
    }


def slope(resolutions: list[str], values: list[float]) -> float:
    """Of log value against log resolution, by least squares."""
    return float(np.polyfit(np.log([float(n) for n in resolutions]), np.log(values), 1)[0])


def main() -> None:
    """Print a table of medians and ratios, and the slopes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--mesh", default="armadillo.obj")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--stages", action="store_true", help="also print where our time goes")
    parser.add_argument("resolutions", nargs="*", default=["128", "256", "512", "1024", "2048"])
    asked = parser.parse_args()
    name = "armadillo.obj" if asked.mesh == "subdivided" else asked.mesh
    mesh = read_mesh(models() / name)
    if asked.mesh == "subdivided":
        mesh = subdivided(mesh, 3)
    print(f"{asked.mesh}: {mesh.n_faces} faces; {machine()}; medians of {asked.repeats}")
    print(f"{'n':>6}{'ours s':>9}{'vdb s':>9}{'speed':>8}{'ours MB':>9}{'vdb MB':>9}{'memory':>8}")
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "mesh.npz")
        np.savez(path, points=mesh.vertices, faces=mesh.faces)
        for n in asked.resolutions:
            found = measure(path, n, asked.repeats)
            ours, theirs = found["meshsdf"], found["OpenVDB"]
            rows.append(ours)
            print(
                f"{n:>6}{ours['seconds']:9.3f}{theirs['seconds']:9.3f}"
                f"{theirs['seconds'] / ours['seconds']:7.1f}x{ours['MB']:9.0f}{theirs['MB']:9.0f}"
                f"{ours['MB'] / theirs['MB']:7.2f}x",
                flush=True,
            )
            if asked.stages:
                stages = ours["stages"].items()
                print("       " + ", ".join(f"{stage} {seconds:.3f}" for stage, seconds in stages))
    if len(rows) > 1:
        time = slope(asked.resolutions, [row["seconds"] for row in rows])
        memory = slope(asked.resolutions, [row["MB"] for row in rows])
        print(f"log-log slope against n: time {time:.2f}, peak memory {memory:.2f}")


if __name__ == "__main__":
    main()
