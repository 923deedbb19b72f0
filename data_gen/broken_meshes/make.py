"""Make the set of broken meshes: `python data_gen/broken_meshes/make.py --out DIR --seed 0`.

Beside each mesh lies NAME.json: the defects planted, in words, and what a check must therefore
find. The numbers follow from how each mesh is built, never from a check. Prints one row per mesh:
vertices, faces, SHA-256 of the mesh file.
"""

import argparse
import hashlib
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from shapes import (
    apart,
    bowed_tube,
    cube,
    flipped,
    joined,
    klein_bottle,
    merged,
    moebius_band,
    moved,
    needle_fan,
    pierced,
    random_soup,
    ring,
    soup,
    sphere,
    split_side,
    torn,
    with_faces,
    without_faces,
)

from meshsdf.io import write_mesh
from meshsdf.mesh import Mesh

SOUND = {
    "two_set": True,
    "two_set_by_index": True,
    "oriented": True,
    "n_open_edges": 0,
    "n_holes": 0,
    "n_tjunction_edges": 0,
    "n_duplicate_faces": 0,
    "n_degenerate_faces": 0,
    "n_nonmanifold_edges": 0,
    "n_nonmanifold_vertices": 0,
    "n_components": 1,
    "n_inside_out": 0,
    "self_intersecting": False,
}
OPEN = {"two_set": False, "two_set_by_index": False, "oriented": False}
UPRIGHT = [(0, 1), (3, 2), (5, 4), (6, 7)]  # the sides of the cube along z, as some face runs


@dataclass(frozen=True)
class Broken:
    """A mesh, the defects planted in it, and where the truth about it differs from SOUND."""

    mesh: Mesh
    defects: list[str]
    truth: dict
    suffix: str = ".ply"


def holes_and_sheets(random: np.random.Generator) -> dict[str, Broken]:
    """Faces missing, turned, or there too often."""
    ball = sphere()
    one, two, six, *_ = faces = apart(ball, 12, random=random)
    beside = np.flatnonzero(np.isin(ball.faces, ball.faces[two]).sum(axis=1) == 2)[0]
    fan = np.flatnonzero((ball.faces == ball.faces[six][0]).any(axis=1))
    n_rim = 3 + 4 + len(fan)
    same, turned, tripled = faces[:3], faces[3:5], faces[5:6]
    copies = [ball.faces[same], ball.faces[turned][:, ::-1], *[ball.faces[tripled]] * 2]
    overturned = random.choice(ball.n_faces, 40, replace=False)
    return {
        "sound": Broken(ball, [], {}),
        "missing_faces": Broken(
            without_faces(ball, [one, two, beside, *fan]),
            ["a face", "two neighbouring faces", "all faces around one vertex are missing"],
            OPEN | {"n_open_edges": n_rim, "n_holes": 3},
        ),
        "flipped_faces": Broken(
            flipped(ball, overturned), ["40 faces are turned round"], {"oriented": False}
        ),
        "duplicated_faces": Broken(
            with_faces(ball, np.vstack(copies)),
            [
                "three faces are there twice",
                "two faces are there twice, the copy turned round",
                "one face is there three times: its copies cancel, but for their direction",
            ],
            # Five faces with 3 uses of each of their sides, one with 4.
            OPEN
            | {"n_open_edges": 5 * 3, "n_holes": 5, "n_duplicate_faces": 7}
            | {"n_nonmanifold_edges": 18, "n_nonmanifold_vertices": 18},
        ),
        "inside_out": Broken(
            flipped(ball), ["every face looks inward"], {"n_inside_out": 1}, ".obj"
        ),
        "random_soup": Broken(
            random_soup(200, random=random),
            ["200 triangles that have nothing to do with each other, many of them crossing"],
            OPEN
            | {"n_open_edges": 600, "n_holes": 200, "n_components": 200}
            | {"self_intersecting": True},
        ),
    }


def one_sided() -> dict[str, Broken]:
    """Surfaces that cannot be oriented."""
    n, k = 48, 6
    band = moebius_band(n, k)
    return {
        "mobius_band": Broken(
            band, ["one side, one rim"], OPEN | {"n_open_edges": 2 * n, "n_holes": 1}
        ),
        "mobius_doubled": Broken(
            with_faces(band, band.faces[:, ::-1]),
            ["a Möbius band with a copy of each face turned round: nothing is left of its rim"],
            # All edges but the 2 n of the rim have 4 faces; Euler's number of the band is 0.
            {"n_duplicate_faces": 2 * n * k, "n_nonmanifold_edges": n * (3 * k - 1)}
            | {"n_nonmanifold_vertices": n * (k + 1)},
        ),
        "klein_figure8": Broken(
            klein_bottle(),
            ["closed with one side, so it passes through itself; yet it parts space in two sets"],
            {"oriented": False, "self_intersecting": True},
        ),
    }


def seams(random: np.random.Generator) -> dict[str, Broken]:
    """Index meshes that are open where space is closed, and the other way round."""
    box = cube()
    tees = box
    for a, b in UPRIGHT[1:]:
        tees = split_side(tees, a, b, [0.5])
    tees = split_side(split_side(tees, 0, 1, [0.25, 0.75]), 1, 0, [0.5])
    starred = pierced(box, [0.5, 0.25, 0.25])
    place = starred.vertices[8]  # in the face x = 0, away from its rims in y alone
    beside = [place[0], np.nextafter(place[1], 0), place[2]]
    ball = sphere(2)
    (face,) = apart(ball, 1, random=random)
    corner = ball.vertices[ball.faces[face, 0]]
    tube = ring(24, 16)
    last = np.flatnonzero((tube.faces >= 23 * 16).any(axis=1) & (tube.faces < 16).any(axis=1))
    cut = tube.faces.copy()
    cut[last] = np.where(cut[last] < 16, cut[last] + tube.n_vertices, cut[last])
    seam = Mesh(np.vstack([tube.vertices, tube.vertices[:16] - [0.0, 1e-6, 0.0]]), cut)
    crack = {"n_open_edges": 4, "n_holes": 1}
    return {
        "t_junctions": Broken(
            tees,
            [
                "three sides of a cube are cut in the middle on one face and whole on the other",
                "one side is cut at 1/4 and 3/4 on one face and at 1/2 on the other",
            ],
            {"two_set_by_index": False, "n_tjunction_edges": 3 * 3 + 5},
            ".obj",
        ),
        "unwelded": Broken(
            soup(ring()),
            ["every face has vertices of its own"],
            {"two_set_by_index": False},
            ".stl",
        ),
        "crack_one_ulp": Broken(
            torn(starred, [(0, 2)], [beside]),
            ["a corner of a face of a cube is one unit in the last place beside its vertex"],
            OPEN | crack,
        ),
        "crack_1e-6": Broken(
            torn(ball, [(face, 0)], [corner + 1e-6 * ball.triangles[face].mean(axis=0)]),
            ["a corner of a face of a sphere is about 1e-6 beside its vertex"],
            OPEN | crack,
        ),
        "crack_ring": Broken(
            seam,
            ["a torus is cut through, and the two rims are 1e-6 apart"],
            OPEN | {"n_open_edges": 2 * 16, "n_holes": 2},
        ),
    }


def shared_parts() -> dict[str, Broken]:
    """Two cubes that meet in a vertex, an edge or a wall."""
    box = cube()
    mirrored = flipped(Mesh(box.vertices * [1.0, -1.0, 1.0] + [0.0, 1.0, 0.0], box.faces))
    neighbours = joined(box, cube((1.0, 0.0, 0.0)))
    wall = np.flatnonzero((neighbours.triangles[12:, :, 0] == 1).all(axis=1)) + 12
    return {
        "cubes_sharing_vertex": Broken(
            merged(joined(box, cube((1.0, 1.0, 1.0)))),
            ["one vertex joins two cubes"],
            {"n_components": 2, "n_nonmanifold_vertices": 1},
        ),
        "cubes_sharing_edge": Broken(
            merged(joined(box, cube((1.0, 1.0, 0.0)))),
            ["four faces on the edge where two cubes meet"],
            {"n_nonmanifold_edges": 1, "n_nonmanifold_vertices": 2},
        ),
        "cubes_doubled_wall": Broken(
            merged(neighbours),
            ["the wall between two cubes is there twice, face on face"],
            # Four faces at the rim of the wall and at its diagonal.
            {"n_duplicate_faces": 2, "n_nonmanifold_edges": 5, "n_nonmanifold_vertices": 4},
        ),
        "cubes_crossed_wall": Broken(
            merged(joined(mirrored, cube((1.0, 0.0, 0.0)))),
            ["the wall between two cubes is there twice, cut along different diagonals"],
            {"n_nonmanifold_edges": 4, "n_nonmanifold_vertices": 4},
        ),
        "three_sheets": Broken(
            merged(without_faces(neighbours, wall)),
            ["the wall between two cubes is there once: three faces at each side of it"],
            OPEN
            | {"n_open_edges": 4, "n_holes": 1}
            | {"n_nonmanifold_edges": 4, "n_nonmanifold_vertices": 4},
        ),
    }


def crossings_and_nests() -> dict[str, Broken]:
    """Closed surfaces in each other's way."""
    inner = sphere(2, radius=0.5)
    return {
        "overlapping_spheres": Broken(
            joined(sphere(), sphere(center=(0.9, 0.13, 0.07))),
            ["two spheres pass through each other"],
            {"n_components": 2, "self_intersecting": True},
        ),
        "bowed_tube": Broken(
            bowed_tube(), ["a tube runs through itself"], {"self_intersecting": True}
        ),
        "nested_cavity": Broken(
            joined(sphere(), flipped(inner)),
            ["a cavity: nothing is wrong with it"],
            {"n_components": 2},
        ),
        "nested_same_side": Broken(
            joined(sphere(), inner),
            ["a sphere within a sphere, both looking outward: wound around twice"],
            {"n_components": 2},
        ),
    }


def extremes() -> dict[str, Broken]:
    """Faces thinner, units larger or smaller, and places further than arithmetic likes."""
    filled = cube()
    for a, b in UPRIGHT:
        filled = split_side(filled, a, b, [0.5], sliver=True)
    thin = 2.0**-43  # about 1e-13
    return {
        "degenerate_faces": Broken(
            with_faces(filled, [(0, 0, 5), (3, 3, 3)]),
            [
                "four faces without area close the T-junctions of a cube",
                "two faces repeat a corner",
            ],
            {"n_degenerate_faces": 6},
        ),
        "slivers": Broken(
            pierced(cube(), [0.5, 0.5 - thin, thin]),
            ["a third of the faces are 1 long and 1e-13 high, yet have an area"],
            {},
        ),
        "needles": Broken(
            pierced(cube(), [1 - 2 * thin, thin, thin]),
            ["faces with one side of 1e-13 at a corner of every face"],
            {},
        ),
        "needle_fan": Broken(needle_fan(), ["2000 needles meet at each of two vertices"], {}),
        "far_1e7": Broken(
            moved(sphere(), shift=(1e7, -1e7, 1e7)),
            ["a unit sphere so far away that float32 would see a point"],
            {},
        ),
        "tiny_1e-9": Broken(moved(ring(), scale=1e-9), ["a torus of 1e-9 units"], {}),
        "huge_1e9": Broken(moved(ring(), scale=1e9), ["a torus of 1e9 units"], {}, ".obj"),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="folder to write to")
    parser.add_argument("--seed", type=int, default=0, help="which faces are hit")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    random = np.random.default_rng(arguments.seed)
    everything = holes_and_sheets(random) | one_sided() | seams(random)
    everything |= shared_parts() | crossings_and_nests() | extremes()
    for name, broken in everything.items():
        path = arguments.out / (name + broken.suffix)
        write_mesh(path, broken.mesh, force=True)
        truth = {"file": path.name, "defects": broken.defects} | SOUND | broken.truth
        path.with_suffix(".json").write_text(json.dumps(truth, indent=2) + "\n")
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
        print(f"| {path.name} | {broken.mesh.n_vertices} | {broken.mesh.n_faces} | {digest} |")


if __name__ == "__main__":
    main()
