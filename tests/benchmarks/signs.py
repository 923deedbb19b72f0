"""Are the signs right? Random band voxels against libigl's exact winding numbers.

python -m tests.benchmarks.signs [--voxels N] [--resolution N] [MODEL ...]

Models that are closed but whose neighbours disagree about their front are turned right by trimesh,
one connected part at a time, and crossings counted modulo 2 over the parts. A voxel counts as wrong
where libigl disagrees, unless it is within 1e-6 voxels of the surface.
"""

import argparse

import igl
import numpy as np
import trimesh

from meshsdf import Mesh, check, mesh_to_band, read_mesh
from meshsdf.errors import MeshsdfError

from .alternate import models

ON_SURFACE = 1e-6  # voxels
FACES_AT_ONCE = 2e8  # points times faces in one call of libigl


def winding(vertices: np.ndarray, faces: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Exact generalised winding numbers, by libigl."""
    step = max(1, int(FACES_AT_ONCE / len(faces)))
    parts = [
        igl.winding_number(vertices, faces, points[i : i + step])
        for i in range(0, len(points), step)
    ]
    return np.concatenate(parts)


def is_inside(mesh: Mesh, sign: str, points: np.ndarray) -> np.ndarray:
    """What libigl and trimesh say."""
    if sign == "winding":
        return np.abs(winding(mesh.vertices.copy(), mesh.faces.copy(), points)) > 0.5
    whole = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    whole.merge_vertices()
    inside = np.zeros(len(points), bool)
    for part in whole.split(only_watertight=False):
        trimesh.repair.fix_winding(part)
        vertices, faces = np.array(part.vertices), np.array(part.faces, np.int32)
        inside ^= np.abs(winding(vertices, faces, points)) > 0.5
    return inside


def main() -> None:
    """Print one line per model."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--voxels", type=int, default=100_000)
    parser.add_argument("--resolution", type=int, default=128)
    parser.add_argument("models", nargs="*")
    asked = parser.parse_args()
    names = asked.models or sorted(path.name for path in models().iterdir())
    rng = np.random.default_rng(0)
    print(f"{'model':<26}{'two-set':>8}{'sign':>9}{'voxels':>9}{'wrong':>7}{'of them sure':>13}")
    for name in names:
        try:
            mesh = read_mesh(models() / name)
        except MeshsdfError:
            continue
        report = check(mesh, self_intersections=False)
        band = mesh_to_band(mesh, resolution=asked.resolution, report=report)
        if not band.is_signed:
            print(f"{name:<26}{report.two_set!s:>8}{band.sign:>9}")
            continue
        nodes, values = band.active_ijk(), band.active_values()
        chosen = rng.choice(len(nodes), min(len(nodes), asked.voxels), replace=False)
        nodes, values = nodes[chosen], values[chosen]
        inside = is_inside(mesh, band.sign, band.to_world(nodes))
        clear = np.abs(values) > ON_SURFACE * band.voxel_size
        wrong = nodes[clear & ((values < 0) != inside)]
        doubted = {tuple(node) for node in band.uncertain_ijk().tolist()}
        sure = sum(tuple(node) not in doubted for node in wrong.tolist())
        line = f"{name:<26}{report.two_set!s:>8}{band.sign:>9}{len(nodes):>9}{len(wrong):>7}"
        print(f"{line}{sure:>13}", flush=True)


if __name__ == "__main__":
    main()
