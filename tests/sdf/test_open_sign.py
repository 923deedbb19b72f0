"""meshsdf.sdf.open_sign: signs of open meshes are those of exact generalised winding numbers."""

import os
import time
from pathlib import Path

import igl
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf.grid import NarrowBand
from meshsdf.io import read_mesh
from meshsdf.kernels.boundary_change import change
from meshsdf.kernels.boundary_winding import boundary_term
from meshsdf.kernels.crossings import count_crossings
from meshsdf.kernels.open_signs import sum_upwards, wind_points
from meshsdf.mesh import Mesh
from meshsdf.mesh.primitives import box_mesh, icosphere
from meshsdf.mesh.two_set import check
from meshsdf.sdf import mesh_to_band, mesh_to_grid
from meshsdf.sdf.lattice import Lattice
from meshsdf.sdf.lattice_winding import MEMBRANE, LatticeWinding
from meshsdf.sdf.placed_mesh import place
from meshsdf.surface import marching_cubes

# Rounding over the distance to the nearest edge: 1e-13 / 1e-4 voxels
ROUNDING = 1e-9
CLEAR = 1e-4  # voxels from the mesh; nearer to it either side may be told


def exact_winding(mesh: Mesh, points: np.ndarray) -> np.ndarray:
    """libigl's sum of the solid angles of all faces, of centred coordinates."""
    center = mesh.box.center
    faces = mesh.faces.astype(np.int64)
    wound = igl.winding_number(mesh.vertices - center, faces, points - center)
    return np.asarray(wound).reshape(-1)


def soup(seed: int, n_faces: int, size: float, *, shared: bool = False) -> Mesh:
    """Random triangles, apart or sharing their corners at random."""
    rng = np.random.default_rng(seed)
    if shared:
        vertices = rng.uniform(-1, 1, (max(4, n_faces // 2), 3))
        faces = np.array([rng.choice(len(vertices), 3, replace=False) for _ in range(n_faces)])
    else:
        middles = rng.uniform(-1, 1, (n_faces, 1, 3))
        vertices = (middles + size * rng.normal(size=(n_faces, 3, 3))).reshape(-1, 3)
        faces = np.arange(3 * n_faces).reshape(-1, 3)
    return Mesh(vertices, faces.astype(np.int32))


def half_ball(tilt: float = 0.0) -> Mesh:
    """Upper half of an icosphere, rim in a plane up to the steps of its triangles."""
    ball = icosphere(1.0, subdivisions=3)
    c, s = np.cos(tilt), np.sin(tilt)
    turned = ball.vertices @ np.array([[1.0, 0, 0], [0, c, -s], [0, s, c]])
    return Mesh(turned, ball.faces[ball.triangles.mean(axis=1)[:, 2] > 0])


def lidless_box(at: float = 0.0) -> Mesh:
    box = box_mesh()
    return Mesh(box.vertices + at, box.faces[:-2])


def box_with_t_junctions() -> Mesh:
    """A lidless box, one face cut so that edges cancel only on their common line."""
    box = lidless_box()
    a, b, c = box.faces[0]
    vertices = np.concatenate([box.vertices, [(box.vertices[a] + box.vertices[b]) / 2]])
    m = len(box.vertices)
    cut = [[a, m, c], [m, b, c]]
    return Mesh(vertices, np.concatenate([box.faces[1:], cut]).astype(np.int32))


def flipped_ball() -> Mesh:
    """A closed ball of which some faces look inwards: edges used twice the same way."""
    ball = icosphere(1.0, subdivisions=2)
    faces = ball.faces.copy()
    faces[:40] = faces[:40, ::-1]
    return Mesh(ball.vertices, faces)


SHAPES = {
    "one triangle": soup(0, 1, 0.5),
    "soup": soup(1, 30, 0.4),
    "shared corners": soup(2, 40, 1.0, shared=True),
    "half ball": half_ball(),
    "tilted half ball": half_ball(0.7),
    "lidless box on the lattice": lidless_box(),
    "T-junctions": box_with_t_junctions(),
    "flipped faces": flipped_ball(),
    "far from the origin": lidless_box(at=12345.0),
}


def lattice_windings(mesh: Mesh, band: NarrowBand) -> tuple[np.ndarray, np.ndarray]:
    """Index coordinates of all nodes of the band's bricks, and the lattice scheme's W there."""
    lattice = Lattice.around(mesh.welded.points, band.voxel_size, np.zeros(3), 3.0)
    winding = LatticeWinding(place(mesh.welded, lattice, cancel="unsigned"), band.index)
    placed, index, local = winding.placed, winding.index, winding.local
    counts = np.zeros((index.n_bricks, 512), np.int32)
    lost = count_crossings(
        placed.points,
        placed.faces,
        placed.edge_line,
        placed.line_ends,
        np.arange(len(placed.faces), dtype=np.int32),
        8 * local[0, 0],
        8 * local[-1, 0] + 8,
        index.root,
        index.pages,
        0,
        True,
        counts,
    )
    assert lost == 0
    sum_upwards(local, counts, winding.top)
    offsets = np.indices((8, 8, 8)).reshape(3, -1).T
    nodes = (8 * local[:, None, :] + offsets).reshape(-1, 3)
    wound = np.empty(len(nodes))
    wind_points(winding.boundary.arrays, nodes.astype(np.float64), counts.ravel(), wound)
    return nodes + 8 * index.origin, wound


def compare(mesh: Mesh, band: NarrowBand, rng: np.random.Generator) -> None:
    """Compare W and the signs at 2,000 random nodes of the band with libigl's."""
    nodes, wound = lattice_windings(mesh, band)
    some = rng.choice(len(nodes), min(2000, len(nodes)), replace=False)
    expected = exact_winding(mesh, band.to_world(nodes[some]))
    values = band.value_at(nodes[some])
    clear = np.abs(values) > CLEAR * band.voxel_size
    assert_allclose(wound[some][clear], expected[clear], atol=ROUNDING)
    sure = clear & (np.abs(np.abs(expected) - 0.5) > ROUNDING)
    assert_array_equal(values[sure] < 0, np.abs(expected[sure]) > 0.5)


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("voxel_size", [1 / 16, 0.0371])
def test_every_node_has_the_exact_winding_number(name, voxel_size):
    mesh = SHAPES[name]
    unsigned = mesh_to_band(mesh, voxel_size=voxel_size, sign="unsigned")
    nodes, wound = lattice_windings(mesh, unsigned)
    clear = unsigned.value_at(nodes) > CLEAR * voxel_size
    some = np.flatnonzero(clear)[:: max(1, len(nodes) // 3000)]
    expected = exact_winding(mesh, unsigned.to_world(nodes[some]))
    assert_allclose(wound[some], expected, atol=ROUNDING)


@settings(deadline=None, max_examples=10)
@given(st.integers(0, 10**6), st.sampled_from([1, 3, 20]), st.sampled_from([1.0, 1e-9, 1e9]))
def test_signs_of_any_soup_are_those_of_exact_winding_numbers(seed, n_faces, scale):
    mesh = soup(seed, n_faces, 0.5)
    mesh = Mesh(mesh.vertices * scale, mesh.faces)
    band = mesh_to_band(mesh, resolution=20, sign="winding")
    compare(mesh, band, np.random.default_rng(seed))


@pytest.mark.parametrize("name", SHAPES)
def test_the_surface_of_every_open_mesh_is_closed(name):
    band = mesh_to_band(SHAPES[name], resolution=24, sign="winding")
    compare(SHAPES[name], band, np.random.default_rng(0))
    surface = marching_cubes(band)
    if surface.n_faces:
        assert check(surface, self_intersections=False).two_set


@pytest.mark.parametrize("depth", [0.25, 1.0])
@pytest.mark.parametrize("center", [0.013, 0.0])
@pytest.mark.parametrize("removed", [0, 2, 4, 6, 8, 10])
def test_the_membrane_of_a_flat_hole_is_the_flat_lid(depth, center, removed):
    # Seen from a point of the lid, the lid fills half the sky, so the rest winds by 1/2
    h = 1 / 64
    box = box_mesh(size=(1.0, 1.0, depth), center=(center, center, center))
    faces = np.delete(box.faces, [removed, removed + 1], axis=0)
    band = mesh_to_band(Mesh(box.vertices, faces), voxel_size=h, sign="winding")
    axis = np.arange(-42, 43)
    ijk = np.stack(np.meshgrid(axis, axis, axis), -1).reshape(-1, 3)
    away = (np.abs(band.to_world(ijk) - box.box.center) - box.box.size / 2).max(axis=1)
    lid = box.triangles[removed]
    flat = np.flatnonzero(np.ptp(lid, axis=0) == 0)[0]
    # On the box itself either side may be told, on the lid it is outside
    clear = np.abs(away) > CLEAR * h
    assert_array_equal(band.value_at(ijk)[clear] < 0, away[clear] < 0)
    on_lid = np.isclose(band.to_world(ijk)[:, flat], lid[0, flat], atol=1e-9 * h) & (
        band.value_at(ijk) > h
    )
    assert on_lid.any() or center != 0.0
    assert (band.value_at(ijk)[on_lid] > 0).all()
    assert check(marching_cubes(band), self_intersections=False).two_set


def test_the_winding_number_on_the_axis_of_a_funnel_is_that_of_its_disc():
    n, height = 4096, 1.0
    angle = 2 * np.pi * np.arange(n) / n
    rim = np.stack([np.cos(angle), np.sin(angle), np.zeros(n)], axis=1)
    around = np.arange(n)
    faces = np.stack([np.full(n, n), around, (around + 1) % n], axis=1).astype(np.int32)
    funnel = Mesh(np.concatenate([rim, [[0.0, 0.0, height]]]), faces)
    band = mesh_to_band(funnel, voxel_size=1 / 8, sign="unsigned")
    nodes, wound = lattice_windings(funnel, band)
    on_axis = (nodes[:, :2] == 0).all(axis=1)
    z = band.to_world(nodes[on_axis])[:, 2]
    # Disc of radius 1 from height z: 2 pi (1 - |z| / sqrt(1 + z^2)); the rim's chords sag 3e-7
    share = 0.5 * (1 - np.abs(z) / np.sqrt(1 + z * z))
    expected = np.where(z > 0, np.where(z < height, 1 - share, -share), share)
    clear = (np.abs(z - height) > CLEAR) & (z != 0)
    assert ((z > 0) & (z < height)).any()
    assert_allclose(wound[on_axis][clear], expected[clear], atol=1e-6)


def test_nodes_on_and_above_boundary_edges_and_vertices_are_answered():
    # Rim on lattice nodes, and a triangle seen end on by vertical lines
    upright = np.array([[0.0, 0, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1], [1, 0, 1]])
    mesh = Mesh(upright, np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4]], np.int32))
    band = mesh_to_band(mesh, voxel_size=0.125, sign="winding")
    assert np.isfinite(band.values).all()
    compare(mesh, band, np.random.default_rng(0))


def test_uncertain_voxels_are_those_whose_number_lies_near_one_half():
    mesh = lidless_box()
    band = mesh_to_band(mesh, resolution=30, sign="winding")
    nodes = (8 * band.index.coordinates[:, None] + np.indices((8, 8, 8)).reshape(3, -1).T).reshape(
        -1, 3
    )
    off = np.abs(np.abs(exact_winding(mesh, band.to_world(nodes))) - 0.5)
    # Those on the rim and at equal distance to the margin may count or not
    low = (off < MEMBRANE - 1e-9).sum() - (band.value_at(nodes) == 0).sum()
    assert low <= band.uncertain_voxels <= (off < MEMBRANE + 1e-9).sum() + 4 * 31
    assert band.facts()["uncertain_voxels"] == band.uncertain_voxels > 0
    listed = {tuple(node) for node in band.uncertain_ijk().tolist()}
    assert len(listed) == band.uncertain_voxels
    assert {tuple(node) for node in nodes[off < MEMBRANE - 1e-9].tolist()} - listed <= {
        tuple(node) for node in nodes[np.abs(band.value_at(nodes)) < 1e-30].tolist()
    }
    assert mesh_to_grid(mesh, resolution=30, sign="winding").uncertain_voxels > 0
    closed = mesh_to_band(box_mesh(), resolution=30)
    assert "uncertain_voxels" not in closed.facts()


@pytest.mark.parametrize("n_faces", [1, 5, 200])
def test_expansions_and_the_linear_model_stay_within_their_bounds(n_faces):
    mesh = soup(n_faces, n_faces, 0.2)
    lattice = Lattice.around(mesh.welded.points, 0.02, np.zeros(3), 3.0)
    placed = place(mesh.welded, lattice, cancel="unsigned")
    band = mesh_to_band(mesh, voxel_size=0.02, sign="unsigned")
    arrays = LatticeWinding(placed, band.index).boundary.arrays
    rng = np.random.default_rng(0)
    low, high = placed.points.min(axis=0) - 40, placed.points.max(axis=0) + 40
    n_expanded = n_linear = 0
    for p in rng.uniform(low, high, (300, 3)):
        exact, _ = boundary_term(arrays, tuple(p), 0.0)
        near, error = boundary_term(arrays, tuple(p), 1e-3)
        assert abs(near - exact) <= error + 1e-11
        n_expanded += error > 0
        slope, bent, _, is_cut = change(arrays, tuple(p), 3.5, 0.5, 1e-3)
        if np.isfinite(bent) and not is_cut:
            step = rng.uniform(-3.5, 3.5, 3)
            there, _ = boundary_term(arrays, tuple(p + step), 0.0)
            assert abs(there - exact - step @ slope) <= bent + 1e-11
            n_linear += 1
    assert n_linear > 0
    assert n_expanded > 0 or n_faces == 1


def test_many_boundary_edges_agree_and_stay_fast():
    mesh = soup(7, 5000, 0.1)
    mesh_to_band(soup(7, 500, 0.1), resolution=16, sign="winding")  # compiled by now
    start = time.perf_counter()
    band = mesh_to_band(mesh, resolution=32, sign="winding")
    assert time.perf_counter() - start < 10  # exact sums of 0.3 ms a node would take 30
    rng = np.random.default_rng(0)
    slots = rng.integers(0, band.index.n_bricks, 2000)
    nodes = 8 * band.index.coordinates[slots] + rng.integers(0, 8, (2000, 3))
    expected = np.abs(exact_winding(mesh, band.to_world(nodes)))
    values = band.value_at(nodes)
    sure = (np.abs(values) > CLEAR * band.voxel_size) & (np.abs(expected - 0.5) > ROUNDING)
    assert_array_equal(values[sure] < 0, expected[sure] > 0.5)
    assert check(marching_cubes(band), self_intersections=False).two_set


@pytest.mark.parametrize("n_faces", [40, 500])
def test_the_number_of_threads_changes_no_sign(monkeypatch, n_faces):
    mesh = soup(8, n_faces, 0.3)
    here = mesh_to_band(mesh, resolution=24, sign="winding")
    for threads in (1, 5):
        monkeypatch.setattr("meshsdf.kernels.parallel.n_threads", lambda n=threads: n)
        monkeypatch.setattr("meshsdf.sdf.lattice_winding.n_threads", lambda n=threads: n)
        there = mesh_to_band(mesh, resolution=24, sign="winding")
        assert_array_equal(here.values, there.values)
        assert_array_equal(here.uncertain, there.uncertain)


@pytest.mark.skipif("MESHSDF_MODELS" not in os.environ, reason="MESHSDF_MODELS names no folder")
@pytest.mark.parametrize("name", ["stanford-bunny.obj", "camelhead.off", "teapot.obj"])
def test_open_scans_have_exact_signs(name):
    mesh = read_mesh(Path(os.environ["MESHSDF_MODELS"]) / name)
    band = mesh_to_band(mesh, resolution=64, sign="winding")
    compare(mesh, band, np.random.default_rng(0))
    assert check(marching_cubes(band), self_intersections=False).two_set


def test_inner_nodes_on_a_wall_keep_their_sign():
    # Two open boxes that overlap, walls on lattice planes: inside the union distance 0 is inside
    one, two = box_mesh(), box_mesh(center=(0.5, 0.0, 0.0))
    top = [
        f for f in range(12) if np.ptp(one.triangles[f, :, 2]) == 0 and one.triangles[f, 0, 2] > 0
    ]
    both = Mesh(
        np.concatenate([one.vertices, two.vertices]),
        np.concatenate([np.delete(one.faces, top[0], axis=0), two.faces + 8]),
    )
    band = mesh_to_band(both, voxel_size=1 / 16)
    assert band.uncertain_voxels is not None
    assert (
        band.value_at(np.array([[0, 0, -4]]))[0] < 0
    )  # the wall x = 0 of the second, in the first
