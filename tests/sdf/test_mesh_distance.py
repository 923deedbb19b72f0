"""meshsdf.sdf.mesh_distance: signed distance and closest place, for any points."""

import igl
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

import meshsdf
from meshsdf.errors import SdfError
from meshsdf.mesh import Mesh
from meshsdf.mesh.primitives import box_mesh, icosphere
from meshsdf.mesh.tubes import torus, trefoil_tube
from meshsdf.sdf import MeshDistance, mesh_to_band
from meshsdf.spatial.closest_point import ClosestPoint
from tests.mesh.unions import joined, united
from tests.models import model, needs_models


def queries(mesh: Mesh, seed: int, n: int = 3000) -> np.ndarray:
    """Points around the mesh, straight above its vertices, and level with them."""
    rng = np.random.default_rng(seed)
    center, size = mesh.box.center, mesh.box.size + 1e-3 * mesh.box.diagonal
    around = center + rng.uniform(-0.8, 0.8, (n, 3)) * size
    corners = mesh.vertices[rng.integers(0, len(mesh.vertices), n)]
    aligned = around.copy()
    for axes in ([0, 1], [0], [1, 2]):
        some = rng.integers(0, n, n // 4)
        aligned[np.ix_(some, axes)] = corners[np.ix_(some, axes)]
    return np.concatenate([around, aligned])


def assert_true(
    mesh: Mesh, points: np.ndarray, *, parity: bool = False, union: Mesh | None = None
) -> None:
    """Magnitude by libigl, sign by its exact winding numbers, the place by its own words.

    The magnitude is the distance to ``union``, if there is one, by which the mesh is bounded.
    """
    measure = MeshDistance(mesh, sign="parity" if parity else "winding")
    found = measure(points)
    center = mesh.box.center
    measured = mesh if union is None else union
    vertices, faces = measured.vertices - center, measured.faces.astype(np.int64)
    squared, _, _ = igl.point_mesh_squared_distance(points - center, vertices, faces)
    bound = measure.rounding_bound(points)
    distance = np.sqrt(squared)
    assert (np.abs(np.abs(found.distance) - distance) <= 4 * bound + 1e-7 * bound.max()).all()
    wound = np.rint(igl.winding_number(vertices, faces, points - center))
    inside = wound % 2 != 0 if parity else wound != 0
    clear = distance > 1e3 * bound  # where libigl's sum of angles is certain
    assert_array_equal(found.distance[clear] < 0, inside[clear])
    assert inside[clear].any()
    assert not inside[clear].all()
    again = np.einsum("nk,nkx->nx", found.barycentric, mesh.triangles[found.face_index] - center)
    assert_allclose(again, found.closest_point - center, atol=8 * np.spacing(np.abs(points).max()))


OVERLAPPING = (box_mesh(), box_mesh(center=(0.5, 0.25, 0.0)), icosphere(0.6))
NESTED = (icosphere(1.0), icosphere(0.5, subdivisions=2))
UNIONS = {"overlapping": united(*OVERLAPPING), "nested": NESTED[0]}
SHAPES = {
    "torus": torus(1.0, 0.4, n_major=24, n_minor=12),
    "trefoil": trefoil_tube(),
    "box": box_mesh((1.0, 2.0, 3.0)),
    "overlapping": joined(*OVERLAPPING),
    "nested": joined(*NESTED),
}


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("parity", [False, True])
def test_distance_and_sign_are_libigls(name, parity):
    mesh = SHAPES[name]
    union = None if parity else UNIONS.get(name)
    assert_true(mesh, queries(mesh, 1), parity=parity, union=union)


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 10**6), st.sampled_from([1e-9, 1.0, 1e9]), st.sampled_from([0.0, 1e6]))
def test_closed_soups_of_tetrahedra_are_exact(seed, scale, offset):
    rng = np.random.default_rng(seed)
    # Coordinates on a coarse lattice: shared planes, edges and rays through vertices
    corners = rng.integers(-6, 7, (8, 4, 3)) / 4.0
    volume = np.linalg.det(corners[:, 1:] - corners[:, :1])
    solid = corners[np.abs(volume) > 0.1]
    if len(solid) == 0:
        return
    tetrahedron = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    faces = (4 * np.arange(len(solid))[:, None, None] + tetrahedron).reshape(-1, 3)
    mesh = Mesh(solid.reshape(-1, 3), faces.astype(np.int32))
    axis = np.arange(-7, 8) / 4.0
    lattice = np.stack(np.meshgrid(axis, axis, axis), -1).reshape(-1, 3)
    points = np.concatenate([lattice, rng.uniform(-2, 2, (500, 3))])
    measure = MeshDistance(Mesh(scale * (mesh.vertices + offset), mesh.faces), sign="winding")
    found = measure(scale * (points + offset))
    wound = np.rint(igl.winding_number(mesh.vertices, mesh.faces.astype(np.int64), points))
    # On sheets within the union the number is a half, or nothing; and far away, moving and scaling
    # has already rounded the vertices
    near = ClosestPoint(mesh)(points).distance
    clear = near > 1e-8
    assert_array_equal((found.distance < 0)[clear], (wound != 0)[clear])


def test_points_on_the_surface_are_at_no_distance():
    mesh = SHAPES["torus"]
    a, b, c = mesh.triangles.swapaxes(0, 1)
    points = np.concatenate([a, (a + b) / 2, (a + b + c) / 3])
    measure = MeshDistance(mesh)
    assert (np.abs(measure(points).distance) <= 2 * measure.rounding_bound(points)).all()


@pytest.mark.parametrize("angle", [0.0, 0.3, 1.1])
def test_no_ray_leaks_through_t_junctions(angle):
    box = box_mesh(size=(3.0, 3.0, 3.0))
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )
    vertices, faces = [*np.round(box.vertices @ turn.T * 2**20) / 2**20], []
    for f, (a, b, c) in enumerate(box.faces.tolist()):
        if f % 2 == 0:
            vertices.append((vertices[a] + vertices[b]) / 2)  # exact: 20 fractional bits
            faces += [[a, len(vertices) - 1, c], [len(vertices) - 1, b, c]]
        else:
            faces.append([a, b, c])
    mesh = Mesh(np.array(vertices), np.array(faces, np.int32))
    points = queries(mesh, 2, n=20_000)
    # Points whose ray runs along an edge, within rounding of it
    rng = np.random.default_rng(3)
    a, b = rng.integers(0, len(vertices), (2, 4000))
    along = mesh.vertices[a] + rng.uniform(0, 1, (4000, 1)) * (mesh.vertices[b] - mesh.vertices[a])
    along[:, 2] = rng.uniform(-2, 2, 4000)
    points = np.concatenate([points, along])
    depth = np.abs(points @ turn).max(axis=1) - 1.5
    clear = np.abs(depth) > 1e-5
    for sign in ("parity", "winding"):
        found = MeshDistance(mesh, sign=sign)(points)
        assert_array_equal(found.distance[clear] < 0, depth[clear] < 0)
        # Turned corners are rounded to 2**-21
        assert_allclose(found.distance[depth < -1e-5], depth[depth < -1e-5], atol=2e-6)


def test_a_sheet_that_comes_twice_is_not_measured_and_keeps_the_numbers_of_faces():
    box = box_mesh(size=(2.0, 2.0, 2.0))
    wall = np.array([[0, -1.0, -1], [0, 1, -1], [0, 1, 1], [0, -1, 1]])
    sheet = np.array([[8, 9, 10], [8, 10, 11]], np.int32)
    parted = Mesh(np.concatenate([box.vertices, wall]), np.concatenate([sheet, sheet, box.faces]))
    points = np.random.default_rng(4).uniform(-1.5, 1.5, (500, 3))
    found, plain = MeshDistance(parted, sign="parity")(points), MeshDistance(box)(points)
    assert_array_equal(found.distance, plain.distance)
    assert_array_equal(found.face_index, plain.face_index + 4)


def test_an_open_mesh_is_signed_by_generalised_winding_numbers():
    lid_off = Mesh(box_mesh().vertices, box_mesh().faces[:-2])
    measure = MeshDistance(lid_off)
    assert measure.sign == "winding"
    assert measure.warnings
    points = queries(lid_off, 5)
    faces = lid_off.faces.astype(np.int64)
    wound = np.abs(igl.winding_number(lid_off.vertices.copy(), faces, points))
    found = measure(points).distance
    clear = (np.abs(wound - 0.5) > 1e-9) & (np.abs(found) > 1e-5)
    assert_array_equal(found[clear] < 0, wound[clear] > 0.5)
    assert (found < 0).any()


def test_a_flat_sheet_has_distances_and_no_inside():
    sheet = Mesh(
        np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]),
        np.array([[0, 1, 2], [0, 2, 3]], np.int32),
    )
    points = np.array([[0.5, 0.5, 0.25], [0.5, 0.5, -0.25], [2.0, 0.5, 0.0]])
    for sign in ("auto", "unsigned"):
        found = MeshDistance(sheet, sign=sign)(points).distance
        assert_allclose(found, [0.25, 0.25, 1.0], rtol=1e-14)
    with pytest.raises(SdfError, match="4 open edges"):
        MeshDistance(sheet, sign="parity")


def test_it_agrees_with_the_band_at_its_nodes():
    mesh = SHAPES["overlapping"]
    band = mesh_to_band(mesh, resolution=40)
    found = MeshDistance(mesh)(band.to_world(band.active_ijk())).distance
    # float32 of up to 3 voxels, and 1e-7 voxel
    atol = (3 * 2.0**-24 + 1e-7) * band.voxel_size
    assert_allclose(found, band.active_values(), rtol=0, atol=atol)


@needs_models
@pytest.mark.parametrize("name", ["armadillo.obj", "fandisk.obj", "spot.obj"])
def test_real_meshes_agree_with_libigl(name):
    mesh = meshsdf.read_mesh(model(name))
    measure = MeshDistance(mesh)
    points = queries(mesh, 6, n=1000)
    found = measure(points)
    faces = mesh.faces.astype(np.int64)
    wound = igl.winding_number(mesh.vertices.copy(), faces, points)
    squared, _, _ = igl.point_mesh_squared_distance(points, mesh.vertices.copy(), faces)
    assert_allclose(np.abs(found.distance), np.sqrt(squared), rtol=1e-9, atol=1e-7)
    clear = np.sqrt(squared) > 1e-6 * mesh.box.diagonal
    assert_array_equal(found.distance[clear] < 0, np.abs(wound[clear]) > 0.5)


def test_neither_order_nor_threads_change_a_bit(monkeypatch):
    mesh = SHAPES["trefoil"]
    points = queries(mesh, 7, n=20_000)
    measure = MeshDistance(mesh)
    here = measure(points)
    order = np.random.default_rng(8).permutation(len(points))
    monkeypatch.setattr("meshsdf.kernels.parallel.n_threads", lambda: 1)
    there = measure(points[order])
    for name in ("distance", "closest_point", "face_index", "barycentric"):
        assert_array_equal(getattr(there, name), getattr(here, name)[order])


def test_no_points_give_no_answers_and_bad_ones_are_counted():
    measure = MeshDistance(box_mesh())
    assert measure(np.empty((0, 3))).distance.shape == (0,)
    points = np.zeros((10, 3))
    points[[3, 7], 1] = np.nan, np.inf
    with pytest.raises(SdfError, match=r"2 of 10 points .* \(first: point 3\)"):
        measure(points)


def test_meshes_that_bound_nothing_are_refused():
    with pytest.raises(SdfError, match="no faces, so nothing is near"):
        MeshDistance(Mesh(np.zeros((2, 3)), np.empty((0, 3), np.int32)))
    line = Mesh(np.array([[0.0, 0, 0], [1, 1, 1], [2, 2, 2]]), np.array([[0, 1, 2]], np.int32))
    with pytest.raises(SdfError, match="all 1 faces are degenerate"):
        MeshDistance(line, sign="unsigned")


def test_progress_is_told_and_an_exception_in_it_stops_the_work():
    measure = MeshDistance(box_mesh())
    told = []
    measure(np.zeros((40_000, 3)), progress=lambda stage, share: told.append((stage, share)))
    assert ("closest points", 1.0) in told
    assert told[-1] == ("sign", 1.0)

    def stop(stage, share):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        measure(np.zeros((40_000, 3)), progress=stop)
