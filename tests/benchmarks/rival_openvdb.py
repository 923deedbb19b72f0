"""Run by the system's Python: OBJ to a level set with OpenVDB, timed inside and written as .vdb.

Usage: rival_openvdb.py MESH.obj OUT.vdb RESOLUTION [REPEATS]; prints one JSON object.
"""

import json
import sys
import time

import numpy as np
import pyopenvdb as vdb


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


def main(mesh, out, resolution, repeats="1"):
    points, triangles = read_obj(mesh)
    size = float((points.max(0) - points.min(0)).max()) / float(resolution)
    transform = vdb.createLinearTransform(voxelSize=size)
    seconds = []
    for _ in range(int(repeats)):
        begin = time.perf_counter()
        grid = vdb.FloatGrid.createLevelSetFromPolygons(
            points, triangles=triangles, transform=transform, halfWidth=3.0
        )
        seconds.append(time.perf_counter() - begin)
    if out != "-":
        vdb.write(out, grids=[grid])
    print(json.dumps({"seconds": seconds, "active_voxels": grid.activeVoxelCount()}))


main(*sys.argv[1:])
