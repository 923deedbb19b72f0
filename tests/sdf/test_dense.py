"""meshsdf.sdf.dense: the distance at every node of the box, near and far."""

import igl
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf.errors import MemoryLimitError
from meshsdf.mesh import Mesh
from meshsdf.mesh.primitives import box_mesh, icosphere
from meshsdf.mesh.tubes import torus, trefoil_tube
from meshsdf.sdf import mesh_to_band, mesh_to_grid
from tests.oracles import closest_by_brute_force


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


def soup_of(corners: np.ndarray) -> Mesh:
    """Unconnected triangles (m, 3, 3)."""
    faces = np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3)
    return Mesh(corners.reshape(-1, 3), faces)


def assert_exact_everywhere(mesh: Mesh, **options) -> np.ndarray:
    """Every node, near or far, has libigl's distance; return the grid's values."""
    grid = mesh_to_grid(mesh, **options)
    center = mesh.box.center
    faces = mesh.faces.astype(np.int64)
    points, vertices = nodes(grid) - center, mesh.vertices - center
    squared, _, _ = igl.point_mesh_squared_distance(points, vertices, faces)
    # float32 of the value, 1e-7 voxel of slack in the band, and the spacing of far coordinates
    atol = 2e-7 * grid.voxel_size + 4 * np.spacing(np.abs(mesh.vertices).max())
    assert_allclose(np.abs(grid.values.ravel()), np.sqrt(squared), rtol=2.0**-23, atol=atol)
    return grid.values


@settings(deadline=None, max_examples=25)
@given(
    st.integers(0, 10**6),
    st.sampled_from([1, 3, 20, 200]),
    st.sampled_from([0.01, 0.1, 1.0]),
    st.sampled_from([1e-12, 1e-9, 1.0, 1e9, 1e15]),
    st.sampled_from([0.0, 1e6]),
)
def test_every_node_of_any_soup_has_its_exact_distance(seed, n, size, scale, offset):
    rng = np.random.default_rng(seed)
    corners = rng.uniform(-1, 1, (n, 1, 3)) + size * rng.normal(size=(n, 3, 3))
    soup = soup_of(scale * (corners + offset))
    # A translation puts the first node anywhere in its brick
    translation = scale * rng.uniform(0, 1, 3)
    assert_exact_everywhere(
        soup, resolution=25 + seed % 9, half_width=1.5, sign="unsigned", translation=translation
    )


def test_the_inside_of_a_fine_sphere_is_exact_where_all_faces_are_equally_near():
    mesh = icosphere(1.0, subdivisions=4)
    values = assert_exact_everywhere(mesh, resolution=40, half_width=1.0)
    assert values.min() < -0.99


def test_a_fan_of_needles_is_exact():
    n = 500
    angle = 2 * np.pi * np.arange(n) / n
    rim = np.stack([np.cos(angle), np.sin(angle), 0.3 * np.cos(7 * angle)], axis=1)
    apex = np.broadcast_to([0.1, 0.0, 0.9], rim.shape)
    fan = soup_of(np.stack([apex, rim, np.roll(rim, -1, axis=0)], axis=1))
    assert_exact_everywhere(fan, resolution=36, sign="unsigned")


def test_slivers_flatter_than_rounding_are_exact():
    rng = np.random.default_rng(1)
    a, b = rng.uniform(-1, 1, (2, 30, 3))
    c = a + rng.uniform(0, 1, (30, 1)) * (b - a) + rng.normal(size=(30, 3)) * 1e-16
    along = np.stack([a, b, c], axis=1)
    along[::2, :, 1] = 0.25  # with nodes in their very plane
    grid = mesh_to_grid(soup_of(along), voxel_size=1 / 8, sign="unsigned")
    # The oracle is extended precision: libigl answers too much for such slivers
    expected = closest_by_brute_force(nodes(grid), along)
    atol = 2e-7 * grid.voxel_size
    assert_allclose(grid.values.ravel(), expected, rtol=2.0**-23, atol=atol)


def test_one_large_triangle_is_exact():
    corners = np.array([[[0.0, 0, 0], [3, 1, 0.5], [0.5, 2, 2]]])
    assert_exact_everywhere(soup_of(corners), resolution=50, half_width=1.0, sign="unsigned")


def test_large_and_small_faces_side_by_side_are_exact():
    room = box_mesh(size=(6.0, 6.0, 6.0))
    crumb = icosphere(0.05, subdivisions=3)
    faces = np.concatenate([room.faces, crumb.faces + len(room.vertices)])
    mesh = Mesh(np.concatenate([room.vertices, crumb.vertices]), faces.astype(np.int32))
    assert_exact_everywhere(mesh, resolution=48, half_width=2.0, sign="parity")


def test_the_number_of_threads_changes_no_byte(monkeypatch):
    mesh = trefoil_tube()
    here = mesh_to_grid(mesh, resolution=50)
    for threads in (1, 5):
        monkeypatch.setattr("meshsdf.kernels.parallel.n_threads", lambda n=threads: n)
        assert_array_equal(mesh_to_grid(mesh, resolution=50).values, here.values)


def test_progress_reaches_the_far_field_and_an_exception_in_it_stops_the_work():
    told = []

    def stop(stage: str, share: float) -> None:
        told.append(stage)
        if stage == "far field":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        mesh_to_grid(torus(1.0, 0.3), resolution=30, progress=stop)
    assert told[-1] == "far field"
