"""How fast does a volume become a mesh, beside OpenVDB's quads and scikit-image's marching cubes?

python -m tests.benchmarks.surface [RESOLUTION ...]

*Bands*: processes of their own, ours and OpenVDB's in turn, each with a band made by itself; the
timers stand around `marching_cubes` and `convertToQuads` alone. OpenVDB's quads have one vertex
for (nearly) every cell that is crossed, our triangles one for every edge that is; these numbers are
equal within a percent, and rates are in a program's own vertices per second.
*Dense*: one process, both programs on the same 256^3 float32 values. scikit-image computes normals
as well, which cannot be turned off.

Before the clock counts, the answers must agree: vertices, volume, and where the vertices are.
"""

import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from meshsdf import Grid, Mesh, marching_cubes, mesh_to_grid, read_mesh

from .alternate import SYSTEM_PYTHON, alternate, has_openvdb, machine, median, models
from .band import run

OURS = Path(__file__).with_name("ours_surface.py")
QUADS = Path(__file__).with_name("rival_openvdb_quads.py")
ROUNDS, CALLS = 3, 5
SIDE = 256


def signed_volume(vertices: np.ndarray, faces: np.ndarray) -> float:
    """Of a closed mesh of triangles or quads."""
    total = 0.0
    for n in range(1, faces.shape[1] - 1):
        a, b, c = (vertices[faces[:, k]].astype(float) for k in (0, n, n + 1))
        total += float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6
    return total


def compare_bands(folder: str, voxel_size: float) -> None:
    """Refuse to time surfaces of two shapes; OpenVDB's distances err by up to a voxel."""
    found = {}
    for name in ("ours", "theirs"):
        with np.load(Path(folder) / f"{name}.npz") as data:
            found[name] = data["vertices"], data["faces"]
    (ours, triangles), (theirs, quads) = found["ours"], found["theirs"]
    assert abs(len(ours) / len(theirs) - 1) < 0.01, (len(ours), len(theirs))
    volumes = abs(signed_volume(ours, triangles)), abs(signed_volume(theirs, quads))
    assert abs(volumes[0] / volumes[1] - 1) < 2e-3, volumes
    some = theirs[:: max(1, len(theirs) // 20000)].astype(float)
    farthest = cKDTree(ours).query(some)[0].max() / voxel_size
    assert farthest < 1.5, f"a vertex of OpenVDB is {farthest:.2f} voxels from the next of ours"
    gap = abs(volumes[0] / volumes[1] - 1)
    print(f"       volumes differ by {gap:.1g}, vertices are within {farthest:.2f} voxels of ours")


def beside_openvdb(mesh: Mesh, resolutions: list[str]) -> None:
    """Print medians, rates and ratios for bands."""
    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "mesh.npz")
        np.savez(path, points=mesh.vertices, faces=mesh.faces)
        for n in resolutions:
            commands = {
                "meshsdf": [sys.executable, str(OURS), path, n],
                "OpenVDB": [SYSTEM_PYTHON, str(QUADS), path, n],
            }
            print(f"{n:>5}: bands")
            for name, out in (("meshsdf", "ours.npz"), ("OpenVDB", "theirs.npz")):
                run([*commands[name], "0", str(Path(folder) / out)])
            compare_bands(folder, mesh.box.longest_side / float(n))
            runs = {name: (lambda c=c: run([*c, str(CALLS)])) for name, c in commands.items()}
            found = alternate(runs, ROUNDS)
            rate = {}
            for name, each in found.items():
                seconds = median([second for one in each for second in one["seconds"]])
                rate[name] = each[0]["n_vertices"] / seconds
                print(f"       {name}: {1e3 * seconds:.1f} ms, {each[0]['n_vertices']} vertices, "
                      f"{rate[name] / 1e6:.2f} M/s")  # fmt: skip
            print(f"       vertices per second: {rate['meshsdf'] / rate['OpenVDB']:.1f} x OpenVDB")


def dense_values(mesh: Mesh) -> np.ndarray:
    """Signed distances of the mesh on exactly 256^3 nodes."""
    grid = mesh_to_grid(mesh, resolution=float(SIDE - 16))
    values = np.full((SIDE,) * 3, grid.values.max(), np.float32)
    low = [(SIDE - n) // 2 for n in grid.values.shape]
    place = tuple(slice(a, a + n) for a, n in zip(low, grid.values.shape, strict=True))
    values[place] = grid.values
    return values


def beside_scikit_image(mesh: Mesh) -> None:
    """Print medians and the ratio for one dense grid."""
    try:
        from skimage import measure
    except ImportError as error:
        print(f"without scikit-image: {error}")
        return
    values = dense_values(mesh)
    grid = Grid(values, 1.0, np.zeros(3))

    def timed(call) -> float:
        begin = time.perf_counter()
        call()
        return time.perf_counter() - begin

    ours = marching_cubes(grid)
    theirs, faces, _, _ = measure.marching_cubes(values, 0.0)
    assert len(theirs) == ours.n_vertices
    assert len(faces) == ours.n_faces
    gap = cKDTree(ours.vertices).query(theirs.astype(float))[0].max()
    assert gap < 1e-4, f"a vertex of scikit-image is {gap:.2g} voxels from the next of ours"
    print(f"{SIDE}^3 dense, {ours.n_vertices} vertices, the same to {gap:.1g} voxels")
    runs = {
        "meshsdf": lambda: timed(lambda: marching_cubes(grid)),
        "meshsdf, trilinear": lambda: timed(lambda: marching_cubes(grid, topology="trilinear")),
        "scikit-image": lambda: timed(lambda: measure.marching_cubes(values, 0.0)),
    }
    for call in runs.values():
        call()
    seconds = {name: median(each) for name, each in alternate(runs, ROUNDS * CALLS).items()}
    for name, value in seconds.items():
        ratio = seconds["scikit-image"] / value
        print(f"       {name}: {1e3 * value:.1f} ms, {ratio:.1f} x scikit-image")


def main(resolutions: list[str]) -> None:
    """Measure armadillo."""
    mesh = read_mesh(models() / "armadillo.obj")
    print(f"{machine()}; medians of {ROUNDS} x {CALLS}")
    if has_openvdb():
        beside_openvdb(mesh, resolutions)
    else:
        print("without OpenVDB: the system's Python has no pyopenvdb")
    beside_scikit_image(mesh)


if __name__ == "__main__":
    main(sys.argv[1:] or ["256", "512", "1024"])
