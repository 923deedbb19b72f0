"""Run by the system's Python: files made by OpenVDB, and what OpenVDB finds in files.

Usage: openvdb_process.py make DIR · dump FILE... (writes FILE.npz) · probe FILE... (reads
FILE.npy, nodes, and writes FILE.npz: the values of the first grid there, and which are active) ·
noted FILE... (reads FILE.json, metadata, and writes FILE) · quads FILE... (writes FILE.npz: the
surface of the first grid as OpenVDB extracts it).
"""

import json
import random
import sys

import numpy as np
import pyopenvdb as vdb


def entries(grid):
    """Rows (i, j, k, side, active, value...) of all voxels of leaves and of tiles that matter."""
    rows = []
    for items in (grid.citerOnValues(), grid.citerOffValues()):
        for item in items:
            value = item.value
            if item.depth < 3 and not item.active and value == grid.background:
                continue
            value = value if isinstance(value, tuple) else (value,)
            side = item.max[0] - item.min[0] + 1
            rows.append((*item.min, side, item.active, *value))
    size = len(grid.background) if isinstance(grid.background, tuple) else 1
    return np.array(rows, float).reshape(len(rows), 5 + size)


def dump(path):
    """Everything OpenVDB says of a file, as arrays and JSON."""
    grids, metadata = vdb.readAll(path)
    arrays, words = {}, []
    for number, grid in enumerate(grids):
        arrays[f"entries{number}"] = entries(grid)
        to_world = grid.transform.indexToWorld
        arrays[f"corners{number}"] = np.array(
            [to_world(p) for p in ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))]
        )
        words.append(
            {
                "name": grid.name,
                "class": grid.gridClass,
                "type": grid.valueTypeName,
                "half": grid.saveFloatAsHalf,
                "vector_type": grid.vectorType,
                "background": grid.background,
                "n_active": grid.activeVoxelCount(),
                "box": grid.evalActiveVoxelBoundingBox(),
                "n_leaves": grid.leafCount(),
                "metadata": dict(grid.metadata),
            }
        )
    arrays["words"] = json.dumps({"grids": words, "metadata": metadata}, default=str)
    np.savez(path + ".npz", **arrays)


def probe(path):
    """Values and states of the first grid at given voxels."""
    grids, _ = vdb.readAll(path)
    accessor = grids[0].getConstAccessor()
    found = np.array([accessor.probeValue(tuple(ijk)) for ijk in np.load(path + ".npy").tolist()])
    np.savez(path + ".npz", values=found[:, 0].astype(np.float32), active=found[:, 1] == 1)


def quads(path):
    """The surface of the first grid."""
    grids, _ = vdb.readAll(path)
    points, faces = grids[0].convertToQuads(0.0)
    np.savez(path + ".npz", points=points, quads=faces)


def scattered(grid, numbers, value, inactive, n_leaves=12):
    """Leaves at random places in three lower nodes, half active, the rest from a short list."""
    accessor = grid.getAccessor()
    for leaf in range(n_leaves):
        start = [8 * numbers.randrange(-18, 14) for _ in range(3)]
        start[1:] = [abs(x) % 128 for x in start[1:]]
        few = numbers.sample(inactive, 1 + leaf % len(inactive))
        for n in range(512):
            ijk = (start[0] + (n >> 6), start[1] + (n >> 3 & 7), start[2] + (n & 7))
            if numbers.random() < 0.5:
                accessor.setValueOn(ijk, value())
            else:
                accessor.setValueOff(ijk, numbers.choice(few))
    return grid


def make(folder):
    """Level sets, fog, vectors, odd trees; in every form this module can be made to write."""
    numbers = random.Random(1)
    sphere = vdb.createLevelSetSphere(1.5, center=(0.3, 0.2, 0.1), voxelSize=0.1)
    sphere.name = "surface"
    half = sphere.deepCopy()
    half.saveFloatAsHalf = True
    vdb.write(f"{folder}/sphere.vdb", grids=[sphere], metadata={"creator": "a test", "n": 3})
    vdb.write(f"{folder}/sphere_half.vdb", grids=[half])

    big = vdb.createLevelSetSphere(45.0, voxelSize=1.0)  # with tiles of its inside
    big.transform = vdb.createLinearTransform(
        [[0.5, 0, 0, 0], [0, 0.5, 0, 0], [0, 0, 0.5, 0], [3, -2, 1, 1]]
    )
    vdb.write(f"{folder}/tiled_sphere.vdb", grids=[big])

    fog = scattered(vdb.FloatGrid(0.0), numbers, lambda: numbers.random(), [0.0])
    fog.fill((-140, 0, 0), (-128 + 11, 23, 23), 0.75)
    fog.name, fog.gridClass = "density", vdb.GridClass.FOG_VOLUME
    vdb.write(f"{folder}/fog.vdb", grids=[fog])

    def three():
        return tuple(numbers.uniform(-2, 2) for _ in range(3))

    colors = scattered(vdb.Vec3SGrid((0.5, -1.0, 2.0)), numbers, three, [three() for _ in range(4)])
    colors.fill((128, 0, 0), (255, 127, 127), (1.0, 2.0, 3.0))
    colors.name, colors.vectorType = "Cd", vdb.VectorType.INVARIANT
    soft = colors.deepCopy()
    soft.name, soft.saveFloatAsHalf = "soft", True
    pool = [3.0, -3.0, 0.75, 1.5, 2.25]
    odd = scattered(vdb.FloatGrid(3.0), numbers, lambda: numbers.uniform(-3, 3), pool, 30)
    odd.fill((-8192, 0, 0), (-8192 + 4095, 4095, 4095), 0.5)  # a tile of the root
    odd.fill((0, 256, 0), (127, 383, 127), -0.5, False)
    odd.name = "odd"
    odd.transform = vdb.createLinearTransform(
        [[0.1, 0.05, 0, 0], [0, 0.2, 0, 0], [0, 0, 0.3, 0], [7, 8, 9, 1]]
    )
    mask = vdb.BoolGrid()
    mask.name = "mask"
    mask.fill((0, 0, 0), (9, 9, 9), True)
    twin = odd.deepCopy()
    shared = odd.copy()
    shared.name = "shared"
    vdb.write(f"{folder}/many.vdb", grids=[mask, colors, odd, soft, shared, twin])
    with open(f"{folder}/stream.vdb", "wb") as file:  # what pickle stores is a file without offsets
        file.write(next(part for part in odd.__getstate__() if isinstance(part, bytes)))
    vdb.write(f"{folder}/empty.vdb", grids=[vdb.FloatGrid(2.0)])


def noted(path):
    """A level set; it and its file say what FILE.json does."""
    with open(path + ".json") as file:
        words = json.load(file)
    for entries in words.values():
        for name, value in entries.items():
            entries[name] = tuple(value) if isinstance(value, list) else value
    sphere = vdb.createLevelSetSphere(1.5, center=(0.3, 0.2, 0.1), voxelSize=0.1)
    sphere.name = "torso"
    for name, value in words["grid"].items():
        sphere[name] = value
    vdb.write(path, grids=[sphere], metadata=words["file"])


if __name__ == "__main__":
    work = {"make": make, "dump": dump, "probe": probe, "noted": noted, "quads": quads}[sys.argv[1]]
    for name in sys.argv[2:]:
        work(name)
