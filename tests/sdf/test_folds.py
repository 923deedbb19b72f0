"""Flat edges and straight vertices are left out of the scan, and no node misses its distance."""

import numpy as np
import pytest
import trimesh

from meshsdf import Mesh, mesh_to_band
from meshsdf.mesh.primitives import box_mesh
from meshsdf.sdf.lattice import Lattice
from meshsdf.sdf.placed_mesh import place

TURN = trimesh.transformations.euler_matrix(0.3, 0.6, 0.1)[:3, :3]


def cut_box(times, turn=TURN):
    """A turned box of sides 2, 1.4 and 1 with every face cut in four, some times."""
    mesh = box_mesh([2, 1.4, 1], center=[1, 0.7, 0.5])
    vertices = mesh.vertices @ turn.T
    faces = mesh.faces
    for _ in range(times):
        vertices, faces = trimesh.remesh.subdivide(vertices, faces)
    return Mesh(np.asarray(vertices), np.asarray(faces, np.int32))


def features(mesh, voxel_size):
    ends = np.stack([mesh.box.lower, mesh.box.upper])
    lattice = Lattice.around(ends, voxel_size, np.zeros(3), 3.0)
    return place(mesh.welded, lattice, cancel="unsigned").features(3.0)


def test_only_the_twelve_edges_and_eight_corners_of_a_box_are_scanned():
    found = features(cut_box(3), 0.1)
    assert len(found.ends) == 12 * 2**3
    assert len(found.corners) == 8


def test_a_bent_sheet_keeps_its_folds():
    x, y = np.meshgrid(np.linspace(0, 1, 9), np.linspace(0, 1, 9), indexing="ij")
    for bend, n_inner in ((0.0, 0), (1e-12, 0), (1e-5, 8)):
        vertices = np.stack([x, y, bend * np.abs(x - 0.5)], axis=-1).reshape(-1, 3)
        corner = np.add.outer(9 * np.arange(8), np.arange(8)).ravel()
        faces = np.concatenate(
            [
                np.stack([corner, corner + 9, corner + 10], 1),
                np.stack([corner, corner + 10, corner + 1], 1),
            ]
        )
        found = features(Mesh(vertices, faces.astype(np.int32)), 0.02)
        assert len(found.ends) == 32 + n_inner  # the rim, and the fold along x = 1/2


@pytest.mark.parametrize("resolution", [12, 40])
@pytest.mark.parametrize("half_width", [1.0, 3.0, 20.0])
def test_distances_to_a_cut_box_are_those_of_the_box(resolution, half_width):
    mesh = cut_box(4)
    band = mesh_to_band(mesh, resolution=resolution, half_width=half_width)
    points = band.to_world(band.active_ijk()) @ TURN
    outside = np.maximum(np.maximum(-points, points - [2, 1.4, 1]), 0)
    inside = np.minimum(points, [2, 1.4, 1] - points).min(axis=1)
    expected = np.where(inside > 0, -inside, np.linalg.norm(outside, axis=1))
    assert np.abs(band.active_values() - expected).max() < 2e-7 * half_width * band.voxel_size
    whole = mesh_to_band(cut_box(0), resolution=resolution, half_width=half_width)
    assert band.n_active == whole.n_active
