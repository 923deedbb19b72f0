"""Run as a process of its own: a mesh to a signed band with meshsdf, timed around the call.

Usage: ours_band.py MESH.npz RESOLUTION; prints one JSON object. The time covers weld, check, sign
and distance, after a first small run that loads the kernels.
"""

import json
import sys
import time

import numpy as np
from peak import peak_bytes

from meshsdf import Mesh, mesh_to_band


def main(path, resolution):
    with np.load(path) as data:
        points, faces = data["points"], data["faces"].astype(np.int32)
    mesh_to_band(Mesh(points, faces[:1000]), resolution=16)
    begin = time.perf_counter()
    band = mesh_to_band(Mesh(points, faces), resolution=float(resolution))
    seconds = time.perf_counter() - begin
    print(json.dumps({"seconds": seconds, "n_active": band.n_active, "peak": peak_bytes()}))


main(*sys.argv[1:])
