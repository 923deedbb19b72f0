"""Make the set of sound meshes: `python data_gen/meshes/make.py --out DIR --seed 0`.

Prints one row per file: vertices, faces, pieces, genus, signed volume, SHA-256 of the bytes.
"""

import argparse
import hashlib
from pathlib import Path

import numpy as np
from shapes import gear, gyroid_slab, lattice

from meshsdf.io import write_mesh
from meshsdf.mesh import Mesh
from meshsdf.mesh.measures import euler_number, is_watertight, n_components, volume
from meshsdf.mesh.primitives import box_mesh, icosphere
from meshsdf.mesh.tubes import torus, trefoil_tube

DECIMALS = 6  # coarser than the last bit of a sine, which differs between machines


def solids() -> dict[str, tuple[Mesh, int]]:
    """File name -> mesh and the genus it must have."""
    return {
        "sphere.ply": (icosphere(1.0, subdivisions=5), 0),
        "torus.obj": (torus(1.0, 0.35, n_major=96, n_minor=48), 1),
        "box.obj": (box_mesh((1.0, 2.0, 3.0)), 0),
        "gear.obj": (gear(n_teeth=18, outer=1.0, root=0.82, bore=0.3, thickness=0.4), 1),
        "trefoil.ply": (trefoil_tube(0.4, n_along=300, n_around=32), 1),
        "gyroid.ply": (
            gyroid_slab(n=32, n_high=12, n_waves=2, phase=0.4, half_thickness=0.6),
            29,
        ),
        "lattice.ply": (lattice(n_nodes=5, period=4), 3 * 25 * 4 - 125 + 1),
    }


def placed(mesh: Mesh, seed: int) -> Mesh:
    """Seed 0 leaves a mesh along the axes; any other turns and moves it at random."""
    vertices = mesh.vertices
    if seed != 0:
        random = np.random.default_rng(seed)
        turn, triangular = np.linalg.qr(random.normal(size=(3, 3)))
        turn = turn * np.sign(np.diag(triangular))
        vertices = vertices @ (turn * np.linalg.det(turn)).T + random.uniform(-1, 1, 3)
    return Mesh(vertices.round(DECIMALS) + 0.0, mesh.faces)


def row(path: Path, mesh: Mesh, genus: int) -> str:
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    counts = f"{mesh.n_vertices} | {mesh.n_faces} | {n_components(mesh)} | {genus}"
    return f"| {path.name} | {counts} | {volume(mesh):.6g} | {digest} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="folder to write to")
    parser.add_argument("--seed", type=int, default=0, help="0: along the axes; else: turned")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    for name, (solid, genus) in solids().items():
        mesh = placed(solid, arguments.seed)
        if not is_watertight(mesh) or volume(mesh) <= 0 or euler_number(mesh) != 2 - 2 * genus:
            raise SystemExit(f"{name} is not the closed solid of genus {genus} it should be")
        write_mesh(arguments.out / name, mesh, force=True)
        print(row(arguments.out / name, mesh, genus))


if __name__ == "__main__":
    main()
