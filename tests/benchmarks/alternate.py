"""Measure rivals fairly: in one run, in alternation, medians and ratios."""

import os
import platform
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

SYSTEM_PYTHON = "/usr/bin/python3"
RIVAL = Path(__file__).with_name("rival_openvdb.py")


def alternate(runs: dict[str, Callable[[], float]], repeats: int) -> dict[str, list[float]]:
    """Call every run in turn, ``repeats`` times; each returns its own seconds."""
    seconds: dict[str, list[float]] = {name: [] for name in runs}
    for _ in range(repeats):
        for name, run in runs.items():
            seconds[name].append(run())
    return seconds


def process_seconds(command: list[str]) -> float:
    """Wall time of a whole process."""
    begin = time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return time.perf_counter() - begin


def median(values: list[float]) -> float:
    """The middle of several runs."""
    return statistics.median(values)


def has_openvdb() -> bool:
    """Whether the system's Python has Debian's OpenVDB module."""
    if not Path(SYSTEM_PYTHON).exists():
        return False
    command = [SYSTEM_PYTHON, "-c", "import pyopenvdb"]
    return subprocess.run(command, capture_output=True, check=False).returncode == 0


def models() -> Path:
    """Folder of real meshes, named by MESHSDF_MODELS."""
    folder = os.environ.get("MESHSDF_MODELS")
    if not folder:
        sys.exit("set MESHSDF_MODELS to the folder of real meshes")
    return Path(folder)


def machine() -> str:
    """One line about where this was measured."""
    import numba
    import numpy

    cores = len(os.sched_getaffinity(0))
    return (
        f"{platform.machine()}, {cores} cores, Python {platform.python_version()}, "
        f"numpy {numpy.__version__}, numba {numba.__version__}"
    )
