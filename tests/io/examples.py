"""Small meshes and volumes that the tests of meshsdf.io write and read."""

import os
from pathlib import Path

import numpy as np
import pytest

from meshsdf.grid import BrickIndex, NarrowBand
from meshsdf.mesh import Material, Mesh

TETRAHEDRON = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
TETRAHEDRON_FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], np.int32)

needs_models = pytest.mark.skipif(
    "MESHSDF_MODELS" not in os.environ, reason="MESHSDF_MODELS names no folder of models"
)


def model(name: str) -> Path:
    """A file of the folder that MESHSDF_MODELS names."""
    return Path(os.environ["MESHSDF_MODELS"]) / name


def tetrahedron(**attributes) -> Mesh:
    """The corner tetrahedron, volume 1/6, faces counter-clockwise from outside."""
    return Mesh(TETRAHEDRON, TETRAHEDRON_FACES, **attributes)


def awkward_mesh(seed: int) -> Mesh:
    """Positions that decimal text only keeps when it is written in full, from 1e-300 to 1e300."""
    random = np.random.default_rng(seed)
    vertices = random.normal(size=(40, 3)) * 10.0 ** random.integers(-300, 300, (40, 3))
    vertices[:2] = [[-0.0, 0.1, 1 / 3], [5e-324, np.nextafter(1, 2), -np.finfo(float).max]]
    corners = np.concatenate([random.permutation(40) for _ in range(6)])
    return Mesh(vertices, corners.reshape(-1, 3).astype(np.int32))


def painted_tetrahedron() -> Mesh:
    """uv, colours (some very dark), two materials, one with an image of 3 x 2 pixels."""
    image = np.arange(18, dtype=np.uint8).reshape(2, 3, 3) * 14
    gold = Material("dark gold", np.array([0.5, 0.25, 0.01, 1], np.float32), image, "gold.png")
    blue = Material("blue", np.array([0, 0, 1, 0.5], np.float32))
    colors = np.array([[0, 0.001, 1, 1], [0.2, 0.5, 0.8, 0.5], [1, 1, 1, 0], [0.02, 0, 0.3, 1]])
    return tetrahedron(
        uv=np.array([[0.0, 0], [1, 0], [0.25, 0.5], [0.1, 1]]),
        vertex_colors=colors.astype(np.float32),
        material_index=np.array([0, 0, 1, 1], np.int32),
        materials=(gold, blue),
    )


def signed_volume(mesh: Mesh) -> float:
    """Volume by the divergence theorem; negative when faces are clockwise from outside."""
    a, b, c = mesh.triangles.transpose(1, 0, 2)
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def narrow_band(seed: int, *, n_bricks: int = 5, with_faces: bool = False) -> NarrowBand:
    """A band of random numbers on scattered bricks, with inside and outside brick codes."""
    random = np.random.default_rng(seed)
    coordinates = np.unique(random.integers(-40, 40, (n_bricks, 3)), axis=0)
    index = BrickIndex.from_coordinates(coordinates)
    index.root[index.root == -1] = random.choice([-1, -2], np.count_nonzero(index.root == -1))
    index.pages[0][index.pages[0] == -1] = -2
    n = len(coordinates)
    shape = (n, 8, 8, 8)
    return NarrowBand(
        index,
        random.normal(size=shape).astype(np.float32),
        random.integers(0, 2**64, (n, 8), np.uint64),
        float(random.uniform(0.01, 2)),
        random.normal(size=3),
        3.0,
        str(random.choice(["parity", "winding", "unsigned"])),
        random.integers(-1, 99, shape, np.int32) if with_faces else None,
        random.random((*shape, 2), np.float32) if with_faces else None,
    )
