"""Run by the system's Python: a mesh to a level set with OpenVDB, timed around the call.

Usage: rival_openvdb.py MESH.obj|MESH.npz OUT.vdb|- RESOLUTION; prints one JSON object.
"""

import json
import sys
import time

import numpy as np
import pyopenvdb as vdb
from peak import peak_bytes


def read_obj(path):
    """Positions and triangles of a plain OBJ (no polygons beyond triangles)."""
    with open(path) as file:
        lines = file.readlines()
    points = np.array([line.split()[1:4] for line in lines if line.startswith("v ")], np.float32)
    corners = [
        [token.split("/")[0] for token in line.split()[1:4]]
        for line in lines
        if line.startswith("f ")
    ]
    return points, np.array(corners, np.int64).astype(np.uint32) - 1


def read_npz(path):
    """Positions and triangles as numpy wrote them."""
    with np.load(path) as data:
        return data["points"].astype(np.float32), data["faces"].astype(np.uint32)


def main(mesh, out, resolution):
    points, triangles = (read_npz if mesh.endswith(".npz") else read_obj)(mesh)
    size = float((points.max(0) - points.min(0)).max()) / float(resolution)
    transform = vdb.createLinearTransform(voxelSize=size)
    begin = time.perf_counter()
    grid = vdb.FloatGrid.createLevelSetFromPolygons(
        points, triangles=triangles, transform=transform, halfWidth=3.0
    )
    seconds = time.perf_counter() - begin
    if out != "-":
        vdb.write(out, grids=[grid])
    print(
        json.dumps({"seconds": seconds, "n_active": grid.activeVoxelCount(), "peak": peak_bytes()})
    )


main(*sys.argv[1:])
