"""How fast are ``.vdb`` files written and read, beside OpenVDB, and in how little memory?

python -m tests.benchmarks.vdb [--mesh NAME] [--repeats N] [RESOLUTION ...]

Both write and read the same band, each in a process of its own, in alternation; timers stand
around the calls alone. OpenVDB writes as it always does (Blosc, active values) and is told to read
values at once; ours are measured with active values only, which is our default, and with Blosc.
Memory is what writing adds to a process that holds the band, relative to the band.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from meshsdf import mesh_to_band, read_mesh, write_volume

from .alternate import SYSTEM_PYTHON, alternate, machine, median, models

PROCESS = Path(__file__).with_name("vdb_files.py")


def run(command: list[str]) -> dict:
    """The JSON object that a process prints."""
    whole = os.environ | {"OPENVDB_DISABLE_DELAYED_LOAD": "1"}
    return json.loads(subprocess.run(command, check=True, capture_output=True, env=whole).stdout)


def measure(folder: str, repeats: int) -> dict[str, dict]:
    """Medians of seconds, bytes and memory for every way to write and read the band."""
    commands = {
        "OpenVDB": [SYSTEM_PYTHON, str(PROCESS), "openvdb", folder],
        "active": [sys.executable, str(PROCESS), "active", folder],
        "blosc": [sys.executable, str(PROCESS), "blosc", folder],
    }
    n_active = {name: run(command)["n_active"] for name, command in commands.items()}
    assert len(set(n_active.values())) == 1, n_active
    runs = {name: (lambda command=command: run(command)) for name, command in commands.items()}
    found = alternate(runs, repeats)
    return {
        name: {key: median([one[key] for one in each]) for key in each[0]}
        for name, each in found.items()
    }


def main() -> None:
    """Print a table of medians and ratios."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--mesh", default="armadillo.obj")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("resolutions", nargs="*", default=["256", "512", "1024"])
    asked = parser.parse_args()
    mesh = read_mesh(models() / asked.mesh)
    print(f"{asked.mesh}; {machine()}; medians of {asked.repeats}")
    print(
        f"{'n':>6} {'':8}{'write s':>9}{'read s':>9}{'write':>8}{'read':>8}{'MB':>8}{'memory':>8}"
    )
    for n in asked.resolutions:
        with tempfile.TemporaryDirectory() as folder:
            band = mesh_to_band(mesh, resolution=float(n))
            write_volume(f"{folder}/band.npz", band)
            write_volume(f"{folder}/band.vdb", band)
            del band
            found = measure(folder, asked.repeats)
        for name, one in found.items():
            ratios = [found["OpenVDB"][key] / one[key] for key in ("write", "read")]
            print(
                f"{n:>6} {name:8}{one['write']:9.3f}{one['read']:9.3f}"
                f"{ratios[0]:7.1f}x{ratios[1]:7.1f}x{one['bytes'] / 1e6:8.1f}{one['memory']:7.2f}x",
                flush=True,
            )


if __name__ == "__main__":
    main()
