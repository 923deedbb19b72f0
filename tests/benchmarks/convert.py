"""How long does a whole `meshsdf convert` take, beside a process that does it with OpenVDB?

python -m tests.benchmarks.convert [RESOLUTION ...]

Also prints where the time goes, and what a cold process (nothing compiled yet) takes.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from .alternate import RIVAL, SYSTEM_PYTHON, alternate, machine, median, models, process_seconds

REPEATS = 7


def main(resolutions: list[str]) -> None:
    """Print medians and ratios for armadillo."""
    mesh = str(models() / "armadillo.obj")
    print(machine())
    with tempfile.TemporaryDirectory() as folder:
        ours, theirs = str(Path(folder) / "a.npz"), str(Path(folder) / "a.vdb")
        for n in resolutions:
            convert = [sys.executable, "-m", "meshsdf", "convert", mesh, ours, "--force"]
            convert += ["--resolution", n]
            rival = [SYSTEM_PYTHON, str(RIVAL), mesh, theirs, n]
            process_seconds(convert)  # fill the kernel cache and the page cache
            runs = {
                "meshsdf": lambda command=convert: process_seconds(command),
                "OpenVDB": lambda command=rival: process_seconds(command),
            }
            seconds = {name: median(v) for name, v in alternate(runs, REPEATS).items()}
            ratio = seconds["OpenVDB"] / seconds["meshsdf"]
            print(
                f"{n:>5}: meshsdf {seconds['meshsdf']:.2f} s, OpenVDB {seconds['OpenVDB']:.2f} s, "
                f"OpenVDB / meshsdf = {ratio:.2f} (medians of {REPEATS}, in alternation)"
            )
            told = subprocess.run([*convert, "--json"], check=True, capture_output=True).stdout
            stages = json.loads(told)["seconds"]
            print("       stages:", ", ".join(f"{name} {s:.2f}" for name, s in stages.items()))
            imports = "import meshsdf.sdf, meshsdf.io.meshes, meshsdf.kernels.compiling"
            start = process_seconds([sys.executable, "-c", imports])
            print(f"       start-up and imports: {start:.2f} s")
        begin = time.perf_counter()
        cold = {**os.environ, "NUMBA_CACHE_DIR": str(Path(folder) / "cold")}
        subprocess.run(convert, check=True, capture_output=True, env=cold)
        print(f"cold process: {time.perf_counter() - begin:.1f} s")


if __name__ == "__main__":
    main(sys.argv[1:] or ["256"])
