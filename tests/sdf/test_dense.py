"""meshsdf.sdf.dense: the distance at every node of the box, near and far."""

import igl
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf.errors import MemoryLimitError
from meshsdf.mesh import Mesh
from meshsdf.mesh.primitives import box_mesh, icosphere
from meshsdf.mesh.tubes import torus, trefoil_tube
from meshsdf.sdf import mesh_to_band, mesh_to_grid


def nodes(grid) -> np.ndarray:
    """(n, 3) world positions of all nodes."""
    ijk = np.indices(grid.values.shape).reshape(3, -1).T
    return grid.origin + grid.voxel_size * ijk


@pytest.mark.parametrize("mesh", [torus(1.0, 0.3), trefoil_tube()], ids=["torus", "trefoil"])
def test_every_node_has_libigls_distance_and_the_exact_sign(mesh):
    grid = mesh_to_grid(mesh, resolution=30)
    points = nodes(grid)
    faces = mesh.faces.astype(np.int64)
    squared, _, _ = igl.point_mesh_squared_distance(points, mesh.vertices.copy(), faces)
    distance = np.sqrt(squared)
    found = grid.values.ravel().astype(float)
    # float32 of the value, and 1e-7 voxel of slack in the band
    assert_allclose(np.abs(found), distance, rtol=2.0**-23, atol=2e-7 * grid.voxel_size)
    clear = distance > 1e-4 * grid.voxel_size
    wound = igl.winding_number(mesh.vertices.copy(), faces, points)
    assert_array_equal(found[clear] < 0, np.abs(wound[clear]) > 0.5)
    assert (found < 0).any()
    assert distance.max() > 3.5 * grid.voxel_size


def test_a_box_far_away_has_its_closed_form():
    center = np.array([1e6, -2e6, 5e5])
    box = box_mesh(size=(1.0, 1.0, 1.0))
    grid = mesh_to_grid(Mesh(box.vertices + center, box.faces), voxel_size=1 / 16, half_width=6)
    local = np.abs(nodes(grid) - center) - 0.5
    outside = np.linalg.norm(np.maximum(local, 0), axis=1)
    expected = outside + np.minimum(local.max(axis=1), 0)
    # Coordinates near 2e6 are stored to 2.3e-10
    assert_allclose(grid.values.ravel(), expected, rtol=2.0**-23, atol=1e-8)


def test_the_grid_lies_on_the_bands_lattice_and_agrees_with_it():
    mesh = icosphere(1.0, subdivisions=3)
    band, grid = mesh_to_band(mesh, voxel_size=0.07), mesh_to_grid(mesh, voxel_size=0.07)
    first = np.rint((grid.origin - band.translation) / 0.07).astype(np.int64)
    ijk = band.active_ijk() - first
    assert_array_equal(grid.values[tuple(ijk.T)], band.active_values().astype(np.float32))


def test_sheets_that_cancel_are_not_measured_far_from_the_surface_either():
    box = box_mesh(size=(2.0, 2.0, 2.0))
    wall = np.array([[0, -1.0, -1], [0, 1, -1], [0, 1, 1], [0, -1, 1]])
    sheet = np.array([[8, 9, 10], [8, 10, 11]], np.int32)
    parted = Mesh(np.concatenate([box.vertices, wall]), np.concatenate([box.faces, sheet, sheet]))
    grid = mesh_to_grid(parted, resolution=24, sign="parity")
    assert_array_equal(grid.values, mesh_to_grid(box, resolution=24).values)


def test_an_open_mesh_gets_unsigned_or_wound_signs_everywhere():
    box = box_mesh()
    lid_off = Mesh(box.vertices, box.faces[:-2])
    signed = mesh_to_grid(lid_off, resolution=16)
    assert signed.sign == "winding"
    assert (signed.values < 0).any()
    unsigned = mesh_to_grid(lid_off, resolution=16, sign="unsigned")
    assert not unsigned.is_signed
    assert (unsigned.values >= 0).all()


def test_a_grid_that_would_not_fit_is_refused_with_its_size():
    with pytest.raises(MemoryLimitError, match=r"4\.\d+ GB would be needed"):
        mesh_to_grid(icosphere(1.0), resolution=1000, max_memory=1e9)
