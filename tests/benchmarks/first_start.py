"""How long somebody waits who paints for the first time on a machine: `meshsdf paint`, no kernels.

python -m tests.benchmarks.first_start MESH

Kernels are compiled into a folder of their own, which goes in the end. Told are the seconds until
the address is printed, and until strokes of the plain brush, of blur and of heights are shown; then
the same with the kernels that are there by now.
"""

import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from meshsdf import read_mesh
from meshsdf.server.client import Painter
from meshsdf.texture.brush import Brush

from .alternate import machine

BRUSHES = {"paint": {}, "blur": {"kind": "blur"}, "height": {"channel": "height", "value": 2.0}}
RARER = 25.0  # seconds in which the rarer brushes are compiled


def start(mesh_path, project):
    """A server in a process, its address, and the seconds until it was there."""
    command = [sys.executable, "-m", "meshsdf", "paint", mesh_path, "--project", str(project)]
    begin = time.perf_counter()
    process = subprocess.Popen([*command, "--port", "0"], stdout=subprocess.PIPE, text=True)
    address = re.search(r"http://\S+", process.stdout.readline())[0]
    return process, address, time.perf_counter() - begin


def strokes(address, mesh):
    """Seconds until strokes of every brush are on the disk and shown."""
    corners = mesh.triangles[0]
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])[None]
    radius = float(mesh.box.size.max()) / 40
    waits = {}
    with Painter(address) as painter:
        layer = painter.state["layers"][-1]["number"]
        for name, kind in BRUSHES.items():
            begin = time.perf_counter()
            painter.begin(layer, Brush(radius, color=(1.0, 0.0, 0.0, 1.0), **kind))
            painter.dabs(corners.mean(axis=0)[None], normal)
            painter.end()
            painter.catch_up()
            waits[name] = time.perf_counter() - begin
    return ", ".join(f"{name} {wait:.2f} s" for name, wait in waits.items())


def main():
    mesh_path = sys.argv[1]
    mesh = read_mesh(mesh_path)
    print(machine())
    with tempfile.TemporaryDirectory() as folder:
        os.environ["NUMBA_CACHE_DIR"] = str(Path(folder) / "kernels")
        for name in ("first", "again"):
            process, address, wait = start(mesh_path, Path(folder) / f"{name}.mtex")
            print(f"{name} start: ready after {wait:.1f} s; strokes: {strokes(address, mesh)}")
            time.sleep(RARER if name == "first" else 0)
            process.send_signal(signal.SIGTERM)
            assert process.wait(60) == 0


if __name__ == "__main__":
    main()
