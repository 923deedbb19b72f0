"""Run as a process of its own: a band to a mesh with meshsdf, timed around the call.

Usage: ours_surface.py MESH.npz RESOLUTION TIMES [OUT.npz]; prints one JSON object. The first call,
which loads the kernels, is not counted.
"""

import json
import sys
import time

import numpy as np

from meshsdf import Mesh, marching_cubes, mesh_to_band


def main(path, resolution, times, out=None):
    with np.load(path) as data:
        mesh = Mesh(data["points"], data["faces"].astype(np.int32))
    band = mesh_to_band(mesh, resolution=float(resolution))
    surface = marching_cubes(band)
    if out is not None:
        np.savez(out, vertices=surface.vertices, faces=surface.faces)
    seconds = []
    for _ in range(int(times)):
        begin = time.perf_counter()
        marching_cubes(band)
        seconds.append(time.perf_counter() - begin)
    print(json.dumps({"seconds": seconds, "n_vertices": surface.n_vertices}))


main(*sys.argv[1:])
