"""Run by the system's Python: quads of a level set with OpenVDB, timed around the call.

Usage: rival_openvdb_quads.py MESH.npz RESOLUTION TIMES [OUT.npz]; prints one JSON object. The level
set is OpenVDB's own; the first call is not counted.
"""

import json
import sys
import time

import numpy as np
import pyopenvdb as vdb


def main(mesh, resolution, times, out=None):
    with np.load(mesh) as data:
        points, triangles = data["points"].astype(np.float32), data["faces"].astype(np.uint32)
    size = float((points.max(0) - points.min(0)).max()) / float(resolution)
    grid = vdb.FloatGrid.createLevelSetFromPolygons(
        points,
        triangles=triangles,
        transform=vdb.createLinearTransform(voxelSize=size),
        halfWidth=3.0,
    )
    vertices, quads = grid.convertToQuads()
    if out is not None:
        np.savez(out, vertices=vertices, faces=quads)
    seconds = []
    for _ in range(int(times)):
        begin = time.perf_counter()
        grid.convertToQuads()
        seconds.append(time.perf_counter() - begin)
    print(json.dumps({"seconds": seconds, "n_vertices": len(vertices)}))


main(*sys.argv[1:])
