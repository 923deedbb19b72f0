"""Run as a process of its own: a mesh to a signed band with meshsdf, timed around the call.

Usage: ours_band.py MESH.npz RESOLUTION; prints one JSON object. The time covers weld, check, sign
and distance, after a first small run that loads the kernels.
"""

import json
import sys
import time

import numpy as np
from peak import peak_bytes

from meshsdf import Mesh, check, mesh_to_band


def stages_of(mesh, resolution):
    """Seconds of each stage, in a run of its own, by when progress is told."""
    seconds, last = {}, [time.perf_counter()]

    def progress(stage, _):
        now = time.perf_counter()
        seconds[stage] = seconds.get(stage, 0.0) + now - last[0]
        last[0] = now

    report = check(mesh, self_intersections=False)
    progress("check", 1.0)
    mesh_to_band(mesh, resolution=resolution, report=report, progress=progress)
    progress("rest", 1.0)
    return {stage: round(time, 3) for stage, time in seconds.items() if stage}


def main(path, resolution):
    with np.load(path) as data:
        points, faces = data["points"], data["faces"].astype(np.int32)
    mesh_to_band(Mesh(points, faces[:1000]), resolution=16)
    begin = time.perf_counter()
    band = mesh_to_band(Mesh(points, faces), resolution=float(resolution))
    seconds = time.perf_counter() - begin
    result = {"seconds": seconds, "n_active": band.n_active, "peak": peak_bytes()}
    del band
    result["stages"] = stages_of(Mesh(points, faces), float(resolution))
    print(json.dumps(result))


main(*sys.argv[1:])
