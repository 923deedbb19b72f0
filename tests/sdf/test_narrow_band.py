"""meshsdf.sdf.narrow_band: every stored distance is the distance, every sign the sign."""

import inspect

import igl
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf.errors import MemoryLimitError, SdfError
from meshsdf.grid import NarrowBand
from meshsdf.mesh import Mesh
from meshsdf.mesh.measures import euler_number, n_components
from meshsdf.mesh.primitives import box_mesh, icosphere
from meshsdf.mesh.tubes import torus
from meshsdf.mesh.two_set import check
from meshsdf.sdf import choose_sign, mesh_to_band
from meshsdf.surface import marching_cubes

# Values are float32 of a float64 distance: half an ulp of 3 voxels, plus 1e-7 voxel of slack
ROUNDING = 3 * 2.0**-24 + 1e-7


def libigl_distances(mesh: Mesh, points: np.ndarray) -> np.ndarray:
    """Unsigned distances by libigl, exact in float64, of centred coordinates."""
    center = mesh.box.center
    vertices = np.ascontiguousarray(mesh.vertices - center)
    faces = np.ascontiguousarray(mesh.faces, np.int64)
    squared, _, _ = igl.point_mesh_squared_distance(points - center, vertices, faces)
    return np.sqrt(squared)


def assert_exact(band: NarrowBand, mesh: Mesh) -> None:
    """Active values are the distances, and no nearer node is missing."""
    h = band.voxel_size
    found = np.abs(band.active_values())
    expected = libigl_distances(mesh, band.to_world(band.active_ijk()))
    assert_allclose(found / h, expected / h, atol=ROUNDING)
    assert found.max() < band.background
    low, high = band.active_box()
    box = np.stack(np.meshgrid(*map(np.arange, low - 2, high + 3), indexing="ij"), -1)
    ijk = box.reshape(-1, 3)
    near = libigl_distances(mesh, band.to_world(ijk)) < band.background * (1 - 1e-6)
    active = {tuple(node) for node in band.active_ijk().tolist()}
    missing = [node for node in ijk[near].tolist() if tuple(node) not in active]
    assert not missing


def random_soup(seed: int, n_faces: int, scale: float) -> Mesh:
    """Triangles that share vertices at random: edges with many faces, slivers, crossings."""
    rng = np.random.default_rng(seed)
    vertices = rng.uniform(-1, 1, (max(4, n_faces // 2), 3)) * scale
    faces = np.array([rng.choice(len(vertices), 3, replace=False) for _ in range(n_faces)])
    return Mesh(vertices, faces.astype(np.int32))


@settings(deadline=None, max_examples=15)
@given(st.integers(0, 10**6), st.sampled_from([1, 2, 5, 30]), st.sampled_from([1e-9, 1.0, 1e9]))
def test_the_band_of_any_soup_is_its_exact_distance(seed, n_faces, scale):
    soup = random_soup(seed, n_faces, scale)
    band = mesh_to_band(soup, resolution=20, sign="unsigned")
    assert_exact(band, soup)


@pytest.mark.parametrize("half_width", [1.0, 2.5, 7.0])
def test_the_band_is_as_wide_as_asked(half_width):
    soup = random_soup(3, 12, 1.0)
    band = mesh_to_band(soup, resolution=24, half_width=half_width, sign="unsigned")
    assert_exact(band, soup)


def test_lattice_aligned_faces_edges_and_vertices_are_exact():
    box = box_mesh(size=(2.0, 1.0, 0.5))
    assert_exact(mesh_to_band(box, voxel_size=0.125), box)


def test_slivers_and_needles_are_exact():
    rng = np.random.default_rng(0)
    a, b = rng.uniform(-1, 1, (2, 40, 3))
    c = a + rng.uniform(0, 1, (40, 1)) * (b - a) + rng.normal(size=(40, 3)) * 1e-7
    vertices = np.concatenate([a, b, c])
    faces = np.arange(120, dtype=np.int32).reshape(3, 40).T
    needles = Mesh(vertices, np.ascontiguousarray(faces))
    assert_exact(mesh_to_band(needles, resolution=32, sign="unsigned"), needles)


def test_a_fan_of_many_faces_around_one_vertex_is_exact():
    n = 400
    angle = 2 * np.pi * np.arange(n) / n
    rim = np.stack([np.cos(angle), np.sin(angle), 0.3 * np.cos(7 * angle)], axis=1)
    vertices = np.concatenate([[[0.1, 0.0, 0.9]], rim])
    faces = np.stack([np.zeros(n), 1 + np.arange(n), 1 + (np.arange(n) + 1) % n], axis=1)
    fan = Mesh(vertices, faces.astype(np.int32))
    assert_exact(mesh_to_band(fan, resolution=32, sign="unsigned"), fan)


def test_the_sphere_has_its_closed_form():
    mesh = icosphere(1.0, subdivisions=5)
    band = mesh_to_band(mesh, resolution=40)
    radius = np.linalg.norm(band.to_world(band.active_ijk()), axis=1)
    # A chord sags at most edge^2 / 2 inside the unit sphere; the mesh is never outside it
    sag = 0.04**2 / 2
    error = band.active_values() - (radius - 1)
    assert error.min() >= -1e-6
    assert error.max() <= sag
    assert (band.active_values() < 0).any()
    assert (band.active_values() > 0).any()


def test_signs_are_those_of_exact_winding_numbers():
    mesh = torus(1.0, 0.4, n_major=40, n_minor=20)
    for sign in ("parity", "winding"):
        band = mesh_to_band(mesh, resolution=30, sign=sign)
        values = band.active_values()
        clear = np.abs(values) > 1e-4 * band.voxel_size
        points = band.to_world(band.active_ijk())
        wound = igl.winding_number(mesh.vertices.copy(), mesh.faces.astype(np.int64), points)
        assert_array_equal(values[clear] < 0, np.abs(wound[clear]) > 0.5)


def test_missing_bricks_know_their_side():
    band = mesh_to_band(icosphere(1.0, subdivisions=3), resolution=100)
    axis = np.arange(-70, 71, 5)
    ijk = np.stack(np.meshgrid(axis, axis, axis), -1).reshape(-1, 3)
    radius = np.linalg.norm(band.to_world(ijk), axis=1)
    clear = np.abs(radius - 1) > 0.05
    assert_array_equal(band.value_at(ijk)[clear] < 0, radius[clear] < 1)
    slots = band.index.lookup(ijk // 8)
    assert (slots[clear & (radius < 0.5)] == -2).any()


def test_overlapping_shells_are_a_union_for_winding_and_have_a_hole_for_parity():
    one, two = box_mesh(), box_mesh(center=(0.5, 0.0, 0.0))
    both = Mesh(
        np.concatenate([one.vertices, two.vertices]), np.concatenate([one.faces, two.faces + 8])
    )
    middle = np.array([[4, 0, 0]])  # (0.25, 0, 0) lies in both
    assert mesh_to_band(both, voxel_size=1 / 16, sign="winding").value_at(middle) < 0
    assert mesh_to_band(both, voxel_size=1 / 16, sign="parity").value_at(middle) > 0


def test_an_inner_sheet_on_the_nodes_leaves_no_surface_inside_the_union():
    # Walls exactly on lattice planes: inner nodes at distance 0 must not count as outside
    one, two = box_mesh(), box_mesh(center=(0.5, 0.0, 0.0))
    both = Mesh(
        np.concatenate([one.vertices, two.vertices]), np.concatenate([one.faces, two.faces + 8])
    )
    band = mesh_to_band(both, voxel_size=1 / 16, sign="winding")
    on_sheet = np.array([[8, 0, 0], [0, 0, 0]])  # x = 0.5 and x = 0, walls inside the union
    assert (band.value_at(on_sheet) < 0).all()
    surface = marching_cubes(band)
    assert n_components(surface) == 1
    assert euler_number(surface) == 2


def test_inside_out_is_still_inside():
    box = box_mesh()
    turned = Mesh(box.vertices, box.faces[:, ::-1])
    assert_array_equal(
        mesh_to_band(turned, resolution=16).values, mesh_to_band(box, resolution=16).values
    )


def test_a_sheet_that_comes_twice_is_no_boundary():
    box = box_mesh(size=(2.0, 2.0, 2.0))
    wall = np.array([[0, -1.0, -1], [0, 1, -1], [0, 1, 1], [0, -1, 1]])
    sheet = np.array([[8, 9, 10], [8, 10, 11]], np.int32)
    vertices = np.concatenate([box.vertices, wall])
    parted = Mesh(vertices, np.concatenate([box.faces, sheet, sheet]))
    band = mesh_to_band(parted, voxel_size=0.125, sign="parity")
    assert_array_equal(band.values, mesh_to_band(box, voxel_size=0.125).values)


@pytest.mark.parametrize("angle", [0.0, 0.3, 1.1])
def test_no_sign_leaks_through_t_junctions(angle):
    # One triangle of each face is split at a point exactly on an edge its neighbour keeps whole
    box = box_mesh(size=(3.0, 3.0, 3.0))
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )
    vertices, faces = [*np.round(box.vertices @ turn.T * 2**20) / 2**20], []
    for f, (a, b, c) in enumerate(box.faces.tolist()):
        if f % 2 == 0:
            vertices.append((vertices[a] + vertices[b]) / 2)  # exact: 20 fractional bits
            m = len(vertices) - 1
            faces += [[a, m, c], [m, b, c]]
        else:
            faces.append([a, b, c])
    junctions = Mesh(np.array(vertices), np.array(faces, np.int32))
    for sign in ("parity", "winding"):
        band = mesh_to_band(junctions, voxel_size=1 / 7, sign=sign)
        axis = np.arange(-24, 25)
        ijk = np.stack(np.meshgrid(axis, axis, axis), -1).reshape(-1, 3)
        local = band.to_world(ijk) @ turn  # back to the unturned box
        depth = np.abs(local).max(axis=1) - 1.5
        clear = np.abs(depth) > 1e-5
        assert_array_equal(band.value_at(ijk)[clear] < 0, depth[clear] < 0)


def test_an_open_box_gets_an_inside_and_a_closed_sign_field():
    box = box_mesh()
    lid_off = Mesh(box.vertices, box.faces[:-2])
    band = mesh_to_band(lid_off, resolution=32)
    assert band.sign == "winding"
    assert band.value_at(np.array([[0, 0, 0]])) < 0
    assert band.value_at(np.array([[40, 0, 0]])) > 0
    # Neighbouring nodes differ in sign only where a brick says so
    low, high = band.active_box()
    nodes = np.stack(np.meshgrid(*map(np.arange, low - 9, high + 10), indexing="ij"), -1)
    shape = nodes.shape[:3]
    inside = (band.value_at(nodes.reshape(-1, 3)) < 0).reshape(shape)
    missing = (band.index.lookup(nodes.reshape(-1, 3) // 8) < 0).reshape(shape)
    for axis in range(3):
        a, b = np.moveaxis(inside, axis, 0)[:-1], np.moveaxis(inside, axis, 0)[1:]
        gone = np.moveaxis(missing, axis, 0)
        assert not ((a != b) & gone[:-1] & gone[1:]).any()


def test_a_flat_sheet_has_no_inside_and_stays_unsigned():
    sheet = Mesh(
        np.array([[0, 0, 0.01], [1, 0, 0.01], [1, 1, 0.01], [0, 1, 0.01]]),
        np.array([[0, 1, 2], [0, 2, 3]], np.int32),
    )
    band = mesh_to_band(sheet, resolution=16)
    assert band.sign == "unsigned"
    assert (band.values >= 0).all()


def test_closest_faces_and_barycentrics_lead_to_the_closest_point():
    mesh = torus(1.0, 0.3, n_major=24, n_minor=12)
    band = mesh_to_band(mesh, resolution=30, closest=True)
    mask = band.active_mask()
    faces = band.closest_face[mask]
    second, third = band.barycentric[mask].astype(float).T
    weights = np.stack([1 - second - third, second, third], axis=1)
    feet = np.einsum("nc,ncd->nd", weights, mesh.triangles[faces])
    distance = np.linalg.norm(feet - band.to_world(band.active_ijk()), axis=1)
    assert_allclose(distance, np.abs(band.active_values()), atol=1e-6)
    assert (band.closest_face[~mask] == -1).all()


def test_moving_by_whole_voxels_moves_the_band_and_changes_no_value():
    mesh = icosphere(1.0, subdivisions=3)
    h = 1 / 16
    for shift in (np.array([3.0, -40, 8]), np.array([1e7, -1e7, 3e6])):
        moved = Mesh(mesh.vertices + shift, mesh.faces)
        here, there = mesh_to_band(mesh, voxel_size=h), mesh_to_band(moved, voxel_size=h)
        nodes = here.active_ijk()
        step = np.rint(shift / h).astype(np.int64)
        # Vertices near 1e7 are rounded to 1.9e-9, 3e-8 voxels
        inner = np.abs(here.active_values()) < 2.9 * h
        assert_allclose(
            there.value_at(nodes[inner] + step) / h,
            here.value_at(nodes[inner]) / h,
            atol=4e-7,
        )


def test_scaling_scales_the_values():
    mesh = torus(1.0, 0.3, n_major=16, n_minor=8)
    here = mesh_to_band(mesh, resolution=25)
    for scale in (1e-9, 2.0**-40, 1e12):
        scaled = mesh_to_band(Mesh(mesh.vertices * scale, mesh.faces), resolution=25)
        assert scaled.index.n_bricks == here.index.n_bricks
        assert_allclose(scaled.values / scale, here.values, rtol=1e-6, atol=1e-7)


def test_a_translation_moves_the_nodes_not_the_mesh():
    box = box_mesh()
    shifted = mesh_to_band(box, voxel_size=0.1, translation=np.array([0.03, 0.05, 0.0]))
    assert_exact(shifted, box)
    assert_allclose(shifted.to_world(np.zeros((1, 3), np.int64)), [[0.03, 0.05, 0.0]])


def test_the_number_of_threads_changes_no_byte(monkeypatch):
    mesh = torus(1.0, 0.3, n_major=40, n_minor=20)
    here = mesh_to_band(mesh, resolution=60, closest=True)
    for threads in (1, 5):
        monkeypatch.setattr("meshsdf.kernels.parallel.n_threads", lambda n=threads: n)
        monkeypatch.setattr("meshsdf.sdf.band_builder.n_threads", lambda n=threads: n)
        there = mesh_to_band(mesh, resolution=60, closest=True)
        for name in ("values", "active", "closest_face", "barycentric"):
            assert_array_equal(getattr(here, name), getattr(there, name))
        assert_array_equal(here.index.coordinates, there.index.coordinates)
        assert_array_equal(here.index.pages, there.index.pages)


def test_progress_is_told_and_can_stop_the_work():
    told = []

    def stop(stage: str, fraction: float) -> None:
        told.append((stage, fraction))
        if stage == "distance":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        mesh_to_band(icosphere(1.0), resolution=64, progress=stop)
    assert {stage for stage, _ in told} >= {"bricks", "sign", "distance"}


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"resolution": 0}, "resolution is 0"),
        ({"resolution": -3}, "resolution is -3"),
        ({"resolution": float("nan")}, "resolution is nan"),
        ({"voxel_size": float("inf")}, "voxel_size is inf"),
        ({}, "neither of resolution and voxel_size"),
        ({"resolution": 10, "voxel_size": 0.1}, "both of resolution and voxel_size"),
        ({"resolution": 10, "half_width": 0.5}, "half_width is 0.5 voxels"),
    ],
)
def test_options_that_make_no_sense_are_refused(options, words):
    with pytest.raises(SdfError, match=words):
        mesh_to_band(box_mesh(), **options)


def test_an_unknown_sign_method_is_refused():
    unchecked = inspect.unwrap(choose_sign)  # the tests' type check would be first otherwise
    with pytest.raises(SdfError, match='no sign method "guess"'):
        unchecked(check(box_mesh()), "guess")


def test_parity_is_refused_where_crossings_decide_nothing():
    box = box_mesh()
    with pytest.raises(SdfError, match="4 open edges"):
        mesh_to_band(Mesh(box.vertices, box.faces[:-2]), resolution=8, sign="parity")


def test_faces_without_area_are_refused():
    line = Mesh(np.array([[0.0, 0, 0], [1, 1, 1], [2, 2, 2]]), np.array([[0, 1, 2]], np.int32))
    with pytest.raises(SdfError, match="all 1 faces are degenerate"):
        mesh_to_band(line, resolution=8, sign="unsigned")


def test_a_band_that_would_not_fit_is_refused_before_the_work():
    with pytest.raises(MemoryLimitError, match=r"about .* would be needed"):
        mesh_to_band(icosphere(1.0), resolution=1e7)
    with pytest.raises(MemoryLimitError, match=r"1 MB are allowed"):
        mesh_to_band(icosphere(1.0), resolution=200, max_memory=1e6)


def test_coordinates_too_coarse_for_the_voxels_are_refused():
    far = Mesh(box_mesh().vertices + 1e15, box_mesh().faces)
    with pytest.raises(SdfError, match="are stored to"):
        mesh_to_band(far, resolution=100, sign="unsigned")


def test_vertices_closer_than_rounding_do_no_harm():
    # Apart by 1e-18 of the size: one place in voxels, two in the file
    box = box_mesh()
    vertices = np.concatenate([box.vertices, box.vertices + 1e-18])
    vertices[8:, 0] = np.nextafter(vertices[8:, 0], 9)
    faces = box.faces.copy()
    faces[::2] += 8
    band = mesh_to_band(Mesh(vertices + 1e3, faces), resolution=16)
    assert band.value_at(np.rint((np.full((1, 3), 1e3)) / band.voxel_size).astype(np.int64)) < 0


def test_walls_along_the_lattice_lines_keep_their_sides():
    # Faces parallel to the scan lines, a hair from vertical, and exactly on the nodes
    for shear in (0.0, 1e-15, 1e-9, 1e-3):
        box = box_mesh(size=(2.0, 2.0, 2.0))
        vertices = box.vertices.copy()
        vertices[:, 0] += shear * vertices[:, 2]
        band = mesh_to_band(Mesh(vertices, box.faces), voxel_size=0.125)
        axis = np.arange(-12, 13)
        ijk = np.stack(np.meshgrid(axis, axis, axis), -1).reshape(-1, 3)
        points = band.to_world(ijk)
        depth = np.abs(points - [shear, 0, 0] * points[:, 2:]).max(axis=1) - 1
        clear = np.abs(depth) > 1e-8
        assert_array_equal(band.value_at(ijk)[clear] < 0, depth[clear] < 0)


def test_the_order_of_the_faces_changes_only_their_numbers():
    mesh = torus(1.0, 0.3, n_major=24, n_minor=12)
    order = np.random.default_rng(0).permutation(mesh.n_faces)
    shuffled = Mesh(mesh.vertices, mesh.faces[order])
    here = mesh_to_band(mesh, resolution=40, closest=True)
    there = mesh_to_band(shuffled, resolution=40, closest=True)
    assert here.values.tobytes() == there.values.tobytes()
    assert here.active.tobytes() == there.active.tobytes()
    assert_array_equal(here.index.coordinates, there.index.coordinates)
    mask = here.active_mask()
    # Where two faces are equally near, either may be named
    same = here.closest_face[mask] == order[there.closest_face[mask]]
    assert same.mean() > 0.5
