"""meshsdf.sdf.union: overlapping bodies are measured as their union."""

import sys
from dataclasses import replace

import igl
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf.errors import SdfError
from meshsdf.grid import NarrowBand
from meshsdf.io.npz import read_npz, write_npz
from meshsdf.mesh import Mesh, check, euler_number, icosphere, volume
from meshsdf.mesh.primitives import box_mesh
from meshsdf.sdf import MeshDistance, mesh_to_band, mesh_to_grid
from meshsdf.surface import marching_cubes
from tests.mesh.shapes import joined, make, without_faces
from tests.mesh.unions import lattice_boxes, moved, random_bodies, rotation, united

from .test_narrow_band import assert_exact, libigl_distances

few = settings(max_examples=4)
seeds = st.integers(0, 10**6)


def wound(mesh: Mesh, points: np.ndarray) -> np.ndarray:
    """Which points a sound mesh has inside, by libigl's winding numbers."""
    return igl.winding_number(np.array(mesh.vertices), mesh.faces.astype(np.int64), points) > 0.5


def assert_band_of(band: NarrowBand, union: Mesh) -> None:
    """All active values and signs are those of the union, and no node is missing."""
    assert_exact(band, union)
    values = band.active_values()
    clear = np.abs(values) > 1e-6 * band.voxel_size
    points = band.to_world(band.active_ijk())
    assert_array_equal((values < 0)[clear], wound(union, points)[clear])


def assert_points_of(mesh: Mesh, union: Mesh, seed: int = 0) -> None:
    """`MeshDistance` and `mesh_to_grid` measure the union, and name places on the mesh's faces."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(mesh.box.lower - 0.2, mesh.box.upper + 0.2, (2000, 3))
    measure = MeshDistance(mesh)
    found = measure(points)
    bound = measure.rounding_bound(points) + 1e-15
    assert (np.abs(np.abs(found.distance) - libigl_distances(union, points)) <= bound).all()
    clear = np.abs(found.distance) > 1e-9
    assert_array_equal((found.distance < 0)[clear], wound(union, points)[clear])
    feet = np.einsum("ni,nij->nj", found.barycentric, mesh.triangles[found.face_index])
    assert_allclose(feet, found.closest_point, atol=1e-14)
    assert found.barycentric.min() > -1e-14
    grid = mesh_to_grid(mesh, resolution=20)
    nodes = grid.origin + grid.voxel_size * np.argwhere(np.ones(grid.values.shape))
    values = grid.values.ravel()
    far = float(np.abs(values).max())
    assert_allclose(np.abs(values), libigl_distances(union, nodes), atol=far * 2.0**-24 + 1e-12)
    clear = np.abs(values) > 1e-6
    assert_array_equal((values < 0)[clear], wound(union, nodes)[clear])


def box_distance(points: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Closed formula: signed distance to a box."""
    outside = np.maximum(np.maximum(low - points, points - high), 0.0)
    inside = np.maximum(low - points, points - high).max(axis=1)
    return np.linalg.norm(outside, axis=1) + np.minimum(inside, 0.0)


@few
@given(seeds)
def test_the_band_of_overlapping_bodies_is_that_of_their_union(seed):
    bodies = random_bodies(seed)
    assert_band_of(mesh_to_band(joined(*bodies), resolution=64), united(*bodies))


@few
@given(seeds)
def test_points_and_grids_are_measured_to_the_union(seed):
    bodies = random_bodies(seed)
    assert_points_of(joined(*bodies), united(*bodies), seed)


@few
@given(seeds, st.sampled_from(["aligned", "off the lattice", "turned", "rounded"]))
def test_walls_between_boxes_on_a_lattice_are_gone(seed, kind):
    # Nodes lie on walls, in planes that boxes share, between sheets a rounding apart
    boxes, _ = lattice_boxes(seed)
    union, voxel = united(*boxes), 0.25
    if kind == "off the lattice":
        voxel = 0.23
    if kind == "turned":
        turn = rotation(seed)
        boxes, union = [moved(b, turn) for b in boxes], moved(union, turn)
    if kind == "rounded":  # tenths are not what floats hold
        boxes = [Mesh(b.vertices / 10.0 + 0.1 * i - 0.1 * i, b.faces) for i, b in enumerate(boxes)]
        union, voxel = Mesh(union.vertices / 10.0, union.faces), 0.025
    mesh = joined(*boxes)
    assert_band_of(mesh_to_band(mesh, voxel_size=voxel), union)
    assert_points_of(mesh, union, seed)


@pytest.mark.parametrize("turn", [np.eye(3), rotation(4)])
def test_touching_cubes_that_fill_a_box_have_its_closed_formula(turn):
    low, high = np.array([-1.5, -1, -0.5]), np.array([1.5, 1, 0.5])
    cubes = [
        moved(box_mesh(center=low + 0.5 + np.array(cell)), turn) for cell in np.ndindex(3, 2, 1)
    ]
    # Two bars more that overlap them, in planes of theirs
    bars = [moved(box_mesh((3.0, 1.0, 1.0), center=(0.0, y, 0.0)), turn) for y in (0.5, 0.25)]
    mesh = joined(*cubes, *bars)
    band = mesh_to_band(mesh, voxel_size=0.125, half_width=8)
    points = band.to_world(band.active_ijk())
    expected = box_distance(points @ turn, low, high)
    assert_allclose(band.active_values(), expected, atol=0.125 * (8 * 2.0**-24 + 1e-7))
    assert band.active_values().min() < -0.49
    surface = marching_cubes(band)
    assert euler_number(surface) == 2
    assert volume(surface) == pytest.approx(6.0, rel=0.02)  # edges are cut off


def test_a_ball_within_a_ball_vanishes_and_a_cavity_stays():
    ball, kernel = icosphere(1.0), icosphere(0.5)
    alone = mesh_to_band(ball, resolution=48)
    nested = mesh_to_band(joined(ball, kernel), resolution=48)
    assert_allclose(nested.values, alone.values, rtol=0, atol=1e-30)
    assert nested.n_inner_faces == kernel.n_faces
    hollow = joined(ball, Mesh(kernel.vertices, kernel.faces[:, ::-1]))
    band = mesh_to_band(hollow, resolution=48)
    assert band.n_inner_faces == 0
    assert band.value_at(np.zeros((1, 3), np.int64)) == band.background
    points = np.array([[0.0, 0, 0], [0.75, 0, 0], [0.6, 0, 0]])
    # Either ball sags inwards by at most 0.0012 of its radius
    assert_allclose(MeshDistance(hollow)(points).distance, [0.5, -0.25, -0.1], atol=0.0012)
    assert_allclose(MeshDistance(joined(ball, kernel))(points).distance[0], -1.0, atol=0.0012)


def test_a_gap_of_a_thousandth_of_a_voxel_stays_open():
    h, gap = 1 / 16, 1 / 16000
    mesh = joined(box_mesh(), box_mesh(center=(1 + gap, 0, 0)))
    band = mesh_to_band(mesh, voxel_size=h)
    assert band.n_inner_faces == 0
    on_wall = band.value_at(np.array([[8, 0, 0], [9, 0, 0]]))
    assert_allclose(on_wall, [0.0, -(h - gap)], atol=1e-7)
    in_gap = MeshDistance(mesh)(np.array([[0.5 + gap / 2, 0.1, 0.2]])).distance
    assert in_gap == pytest.approx(gap / 2, rel=1e-9)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_no_node_lies_between_sheets_that_count_as_one(axis):
    # The boxes are 2e-14 apart, nearer than what counts as touching; nodes lie on the first wall
    step = np.eye(3)[axis]
    mesh = joined(box_mesh(), box_mesh(center=step * (1 + 2e-14)))
    band = mesh_to_band(mesh, voxel_size=0.125)
    assert band.n_inner_faces == 4
    nodes = np.rint(4 * step + np.array([[0, 0, 0], [1, 2, 1], [2, 1, 2]]) * (1 - step))
    nodes = nodes.astype(np.int64)
    places = band.to_world(nodes)
    depth = box_distance(places, -np.full(3, 0.5), np.full(3, 0.5) + step)
    assert depth.max() < -0.2
    assert_allclose(band.value_at(nodes), np.maximum(depth, -band.background), atol=1e-6)
    grid = mesh_to_grid(mesh, voxel_size=0.125)
    i, j, k = np.rint((places - grid.origin) / 0.125).astype(int).T
    assert_allclose(grid.values[i, j, k], depth, atol=1e-6)
    assert_allclose(MeshDistance(mesh)(places + 1e-14 * step).distance, depth, atol=1e-12)


def test_three_boxes_through_one_point():
    corners = [(0, 0, 0), (-0.5, 0, 0), (-1, -1, -1), (0, -1, -0.5)]
    boxes = [box_mesh(center=np.array(c) + 0.5) for c in corners]
    assert_band_of(mesh_to_band(joined(*boxes), resolution=40), united(*boxes))
    assert_points_of(joined(*boxes), united(*boxes))


def test_parity_and_unsigned_measure_all_faces_as_ever():
    mesh = joined(*random_bodies(7))
    for sign in ("parity", "unsigned"):
        band = mesh_to_band(mesh, resolution=40, sign=sign)
        assert_exact(band, mesh)
        assert band.n_inner_faces == 0
        assert "n_inner_faces" not in band.facts()


def test_closest_places_are_given_on_the_faces_of_the_mesh():
    bodies = random_bodies(11)
    mesh = joined(*bodies)
    band = mesh_to_band(mesh, resolution=48, closest=True)
    assert band.n_inner_faces > 0
    mask = band.active_mask()
    second, third = band.barycentric[mask].astype(float).T
    weights = np.stack([1 - second - third, second, third], axis=1)
    feet = np.einsum("nc,ncd->nd", weights, mesh.triangles[band.closest_face[mask]])
    nodes = band.to_world(band.active_ijk())
    assert_allclose(np.linalg.norm(feet - nodes, axis=1), np.abs(band.active_values()), atol=1e-6)
    assert libigl_distances(united(*bodies), feet).max() < 1e-6


def crossing_bar(overlap: float) -> tuple[Mesh, Mesh]:
    """A square bar that turns three corners and runs into its own first leg, and its union."""
    path = np.array([(0, 0), (3, 0), (3, 3), (0.5, 3), (0.5, 0.25 - overlap)], float)
    steps = np.diff(path, axis=0)
    steps /= np.linalg.norm(steps, axis=1, keepdims=True)
    left = np.stack([-steps[:, 1], steps[:, 0]], axis=1)
    offset = np.vstack([left[:1], left[:-1] + left[1:], left[-1:]]) * 0.25
    rim = [np.column_stack([p, np.full(5, z)]) for p in (path + offset, path - offset)
           for z in (-0.25, 0.25)]  # fmt: skip
    points = np.stack(rim, axis=1).reshape(-1, 3)  # four around every place on the path
    faces = []
    for i in range(4):
        for a, b in ((0, 1), (1, 3), (3, 2), (2, 0)):
            a, b, c, d = 4 * i + a, 4 * i + b, 4 * i + 4 + b, 4 * i + 4 + a
            faces += [(a, b, c), (a, c, d)]
    faces += [(0, 2, 3), (0, 3, 1), (16, 17, 19), (16, 19, 18)]
    bar = make(points, faces)
    assert volume(bar) > 0
    legs = [((0, -0.25), (3.25, 0.25)), ((2.75, -0.25), (3.25, 3.25)), ((0.25, 2.75), (3.25, 3.25))]
    legs += [((0.25, 0.25 - overlap), (0.75, 3.25))]
    ends = [np.column_stack([leg, (-0.25, 0.25)]) for leg in legs]
    return bar, united(*(box_mesh(high - low, center=(low + high) / 2) for low, high in ends))


def test_one_body_that_runs_into_itself_is_a_union_too():
    bar, union = crossing_bar(0.3)
    assert check(bar, self_intersections=False).n_components == 1
    assert volume(bar) > volume(union) + 0.05
    for turn in (np.eye(3), rotation(6)):
        band = mesh_to_band(moved(bar, turn), resolution=50)
        assert band.n_inner_faces > 0
        assert_band_of(band, moved(union, turn))
        assert_points_of(moved(bar, turn), moved(union, turn))
    [warning] = MeshDistance(bar).warnings
    assert "overlaps or touches itself: distances are to the union" in warning


def test_an_overlap_between_the_nodes_is_found_once_crossings_are_counted():
    bar, union = crossing_bar(1e-4)
    options = {"resolution": 20, "translation": np.full(3, 0.01)}
    assert mesh_to_band(bar, **options).n_inner_faces == 0
    band = mesh_to_band(bar, report=check(bar), **options)
    assert band.n_inner_faces > 0
    assert_band_of(band, union)


def test_faces_without_area_and_sheets_that_come_twice_change_nothing():
    mesh = joined(box_mesh(), box_mesh(center=(0.5, 0.25, 0.25)))
    a, b = mesh.vertices[mesh.faces[0, :2]]
    points = np.vstack([mesh.vertices, [(a + b) / 2, (2, 0, 0), (3, 0, 0), (2, 1, 0)]])
    n = mesh.n_vertices
    sheet = [(n + 1, n + 2, n + 3), (n + 3, n + 2, n + 1)]
    flat = [(*mesh.faces[0, :2], n), (*mesh.faces[0, 1::-1], n)]
    more = make(points, np.vstack([sheet[:1], mesh.faces, flat, sheet[1:]]))
    here, there = (
        mesh_to_band(m, voxel_size=0.05, sign="winding", closest=True) for m in (mesh, more)
    )
    assert_array_equal(there.values, here.values)
    mask = here.active_mask()
    assert_array_equal(there.closest_face[mask], here.closest_face[mask] + 1)
    assert_array_equal(there.barycentric, here.barycentric)
    assert here.n_inner_faces == there.n_inner_faces


def test_cracks_are_zipped_for_the_union_and_stay_in_the_distance():
    width = 1e-6
    rng = np.random.default_rng(0)
    bodies = [
        icosphere(1.0, subdivisions=3),
        icosphere(0.8, subdivisions=3, center=(0.7, 0.1, 0.2)),
    ]
    cracked = []
    for body in bodies:  # the upper half has vertices of its own, a little off
        upper = body.triangles.mean(axis=1)[:, 2] > body.box.center[2]
        points = body.vertices + width * rng.normal(size=body.vertices.shape)
        faces = body.faces + body.n_vertices * upper[:, None]
        cracked.append(make(np.vstack([body.vertices, points]), faces))
    mesh, union = joined(*cracked), united(*bodies)
    band = mesh_to_band(mesh, resolution=40)
    assert check(mesh, self_intersections=False).repair is not None
    assert band.n_inner_faces > 0
    points = band.to_world(band.active_ijk())
    off = np.abs(band.active_values()) - libigl_distances(union, points)
    assert np.abs(off).max() < 10 * width
    clear = np.abs(band.active_values()) > 20 * width
    assert_array_equal((band.active_values() < 0)[clear], wound(union, points)[clear])
    found = MeshDistance(mesh)(points[::50])
    assert_allclose(found.distance, band.active_values()[::50], atol=1e-6)


def test_faces_in_a_crack_are_kept_where_they_touch_what_is_left():
    # Two faces are split at their common edge, at places a little apart. A sliver fills half of the
    # crack, and has no width once that is zipped.
    box = box_mesh((2.0, 2.0, 2.0))
    a, b, c = box.faces[0]
    [other] = [f for f in range(1, 12) if {a, b} < set(box.faces[f])]
    d = next(v for v in box.faces[other] if v not in (a, b))
    m, n = box.n_vertices, box.n_vertices + 1
    middle = box.vertices[[a, b]].mean(axis=0)
    pulled = [middle + 1e-9 * (box.vertices[v] - middle) for v in (d, c)]
    points = np.vstack([box.vertices, *pulled])
    halves = [(a, n, c), (n, b, c), (b, m, d), (m, a, d)]
    faces = np.vstack([np.delete(box.faces, [0, other], axis=0), halves, [(a, m, n)]])
    mesh = joined(make(points, faces), box_mesh((1.0, 1.0, 4.0)))
    assert check(mesh, self_intersections=False).repair is not None
    band = mesh_to_band(mesh, resolution=32)
    union = united(box, box_mesh((1.0, 1.0, 4.0)))
    assert band.n_inner_faces > 0
    found = libigl_distances(union, band.to_world(band.active_ijk()))
    assert_allclose(np.abs(band.active_values()), found, atol=1e-6)


def test_an_open_mesh_keeps_all_its_faces():
    mesh = without_faces(joined(box_mesh(), box_mesh(center=(0.5, 0.25, 0.25))), 0, 1)
    band = mesh_to_band(mesh, resolution=24)
    assert band.sign == "winding"
    assert band.n_inner_faces == 0
    assert_exact(replace(band, values=np.abs(band.values)), mesh)


def test_bodies_that_cancel_are_refused():
    box = box_mesh()
    other = box_mesh().faces.copy()
    other[:2] = [(0, 1, 2), (1, 3, 2)]  # the other diagonal
    undone = joined(box, Mesh(box.vertices, other[:, ::-1]))
    for build in (lambda: mesh_to_band(undone, resolution=8), lambda: MeshDistance(undone)):
        with pytest.raises(SdfError, match="faces cancel"):
            build()


def test_the_number_of_threads_changes_no_byte(monkeypatch):
    mesh = joined(*random_bodies(13))
    here = mesh_to_band(mesh, resolution=60, closest=True)
    homes = ("kernels.parallel", "mesh.meetings", "mesh.face_pieces", "mesh.outer_boundary")
    for threads in (1, 5):
        for home in (*homes, "sdf.band_builder"):
            monkeypatch.setattr(sys.modules[f"meshsdf.{home}"], "n_threads", lambda n=threads: n)
        there = mesh_to_band(mesh, resolution=60, closest=True)
        for name in ("values", "active", "closest_face", "barycentric"):
            assert_array_equal(getattr(here, name), getattr(there, name))
        assert_array_equal(here.index.pages, there.index.pages)


def test_a_file_remembers_how_many_faces_are_inner(tmp_path):
    mesh = joined(box_mesh(), box_mesh(center=(0.5, 0.25, 0.25)))
    for name, volume_of in (("band", mesh_to_band), ("grid", mesh_to_grid)):
        written = volume_of(mesh, resolution=16)
        write_npz(tmp_path / f"{name}.npz", written)
        assert read_npz(tmp_path / f"{name}.npz").n_inner_faces == written.n_inner_faces == 12
        assert written.facts()["n_inner_faces"] == 12
