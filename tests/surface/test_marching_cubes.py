"""meshsdf.surface.marching_cubes: closed, oriented and manifold, whatever the values."""

import importlib

import numpy as np
import pytest

from meshsdf.errors import SurfaceError
from meshsdf.grid import BrickIndex, Grid, NarrowBand
from meshsdf.surface import brick_field, marching_cubes
from tests.surface.bands import (
    band_of,
    mark_inside,
    nodes_of,
    sphere_distance,
)
from tests.surface.soundness import (
    assert_closed,
    assert_manifold,
    euler_characteristic,
    joined,
    open_edges,
    vertex_set,
    volume,
)


def unit_grid(values, sign="parity", origin=(0.0, 0.0, 0.0)):
    return Grid(np.asarray(values, float), 1.0, np.array(origin, float), sign)


def random_values(rng, n):
    """Small grids, some larger than a brick: integers with zeros and ties, and any floats."""
    for number in range(n):
        shape = rng.integers(2, 12 if number % 10 < 2 else 6, 3)
        yield rng.integers(-2, 3, shape) * 1.0 if number % 2 else rng.normal(size=shape)


def dyadic(rng, shape):
    """Values whose crossings are halves and quarters, so that sums of coordinates are exact."""
    return rng.choice([-1.0, 1.0, 3.0], shape)


@pytest.mark.parametrize("border", ["cap", "pad"])
def test_any_values_with_a_padded_or_capped_border_give_a_closed_manifold(border):
    meshes = []
    for values in random_values(np.random.default_rng(1), 200):
        meshes.append(marching_cubes(unit_grid(values), border=border))
        assert volume(meshes[-1]) >= 0
        assert (meshes[-1].n_faces == 0) == (values >= 0).all()
    everything = joined(meshes)
    assert everything.n_faces > 20_000
    assert_closed(everything)


def test_with_an_open_border_edges_are_open_in_the_border_planes_and_nowhere_else():
    for values in random_values(np.random.default_rng(2), 100):
        mesh = marching_cubes(unit_grid(values))
        assert_manifold(mesh)
        a, b = mesh.vertices[open_edges(mesh)].transpose(1, 0, 2)
        last = np.array(values.shape) - 1.0
        assert (((a == b) & ((a == 0) | (a == last))).any(axis=1)).all()


def test_a_grid_holds_the_faces_of_its_cells_one_by_one_and_none_where_data_are_missing():
    rng = np.random.default_rng(3)
    for share_missing in (0.0, 0.05, 0.2):
        values = dyadic(rng, (5, 4, 10))
        values[rng.random(values.shape) < share_missing] = np.nan
        cells = []
        for i, j, k in np.ndindex(4, 3, 9):
            cell = values[i : i + 2, j : j + 2, k : k + 2]
            if not np.isnan(cell).any():
                cells.append(marching_cubes(unit_grid(cell, origin=(i, j, k))).triangles)
        mesh = marching_cubes(unit_grid(values))
        alone = np.concatenate(cells).reshape(-1, 9)
        whole = mesh.triangles.reshape(-1, 9)
        assert np.array_equal(alone[np.lexsort(alone.T)], whole[np.lexsort(whole.T)])


def test_cells_without_data_leave_the_rest_manifold():
    rng = np.random.default_rng(4)
    meshes = []
    for values in random_values(rng, 80):
        values[rng.random(values.shape) < 0.1] = np.nan
        meshes += [marching_cubes(unit_grid(values), border=b) for b in ("open", "cap", "pad")]
    everything = joined(meshes)
    assert_manifold(everything)
    assert len(open_edges(everything)) > 2_000


@pytest.mark.parametrize(
    "values",
    [
        [[[13, -1], [-1, -7]], [[-1, 1], [7, -7]], [[15, -9], [-3, -1]]],
        [[[0, 0], [-0.2, 0.3]], [[-0.7, 0.5], [-0.2, -0.92]]],
        [[[1, -1], [-1, 1]], [[-1, 1], [1, -1]]],
    ],
)
def test_cells_known_to_break_other_programs_are_sound(values):
    for sign in (1, -1):
        for border in ("pad", "cap"):
            mesh = marching_cubes(unit_grid(sign * np.array(values)), border=border)
            assert_closed(mesh)
            assert mesh.n_faces > 0


def test_a_level_equal_to_many_samples_leaves_no_hole():
    ball = np.rint(2 * sphere_distance(nodes_of((-9, -9, -9), (19, 19, 19)), radius=6.2)) / 2
    for level in (0.0, 0.5, -1.0):
        assert np.count_nonzero(ball == level) > 50
        for topology in ("manifold", "trilinear"):
            mesh = marching_cubes(unit_grid(ball), level=level, topology=topology)
            assert_closed(mesh)
            assert euler_characteristic(mesh) == 2


def test_a_node_without_data_takes_the_eight_cells_around_it_and_no_other():
    slope = np.broadcast_to((np.arange(6.0) - 2.5)[:, None, None], (6, 5, 5)).copy()
    whole = marching_cubes(unit_grid(slope))
    slope[2, 2, 2] = np.nan
    rest = marching_cubes(unit_grid(slope))
    assert area_of_sheet(whole) == 16
    assert area_of_sheet(rest) == 12
    slope[2, 2, 2], slope[4, 2, 2] = -0.5, np.nan  # no cell around it is crossed
    assert area_of_sheet(marching_cubes(unit_grid(slope))) == 16


def area_of_sheet(mesh):
    """Area of a flat mesh across the first axis."""
    a, b, c = mesh.triangles.transpose(1, 0, 2)
    return np.cross(b - a, c - a)[:, 0].sum() / 2


def test_infinite_and_huge_values_give_finite_vertices_in_the_right_cells():
    rng = np.random.default_rng(5)
    values = rng.choice([-np.inf, -1.7e308, -1.0, 5e-324, 1.7e308, np.inf], (9, 9, 9))
    for border in ("open", "cap", "pad"):
        mesh = marching_cubes(unit_grid(values), border=border)
        assert_manifold(mesh)
        assert mesh.vertices.min() >= -0.5
        assert mesh.vertices.max() <= 8.5
    inf = np.inf
    line = marching_cubes(unit_grid(np.broadcast_to([[[-inf]], [[1.0]]], (2, 2, 2))))
    assert (line.vertices[:, 0] == 0.5).all()


def test_a_capped_block_is_a_box_of_twelve_triangles_and_a_padded_one_is_half_a_voxel_larger():
    solid = unit_grid(np.full((2, 2, 2), -1.0), origin=(5, 6, 7))
    cap = marching_cubes(solid, border="cap")
    assert (cap.n_vertices, cap.n_faces, volume(cap)) == (8, 12, 1.0)
    assert np.array_equal(cap.box.lower, [5, 6, 7])
    pad = marching_cubes(solid, border="pad")
    assert np.array_equal(pad.box.lower, [4.5, 5.5, 6.5])
    assert np.array_equal(pad.box.upper, [6.5, 7.5, 8.5])
    assert marching_cubes(solid).n_faces == 0


def test_cap_faces_fill_the_inside_of_the_border_planes_and_are_labelled():
    values = np.broadcast_to((np.arange(4) - 1.5)[:, None, None], (4, 3, 5))  # a slab below 1.5
    mesh = marching_cubes(unit_grid(values), border="cap")
    assert_closed(mesh)
    assert volume(mesh) == pytest.approx(1.5 * 2 * 4, rel=1e-14)
    assert [material.name for material in mesh.materials] == ["surface", "cap"]
    normals = np.cross(*np.diff(mesh.triangles, axis=1).transpose(1, 0, 2))
    on_slope = (mesh.triangles[:, :, 0] == 1.5).all(axis=1)
    assert np.array_equal(mesh.material_index == 0, on_slope)
    cap_area = np.linalg.norm(normals[~on_slope], axis=1).sum() / 2
    assert cap_area == pytest.approx(2 * 4 + 2 * 1.5 * (2 + 4), rel=1e-14)
    for border in ("open", "pad"):
        assert marching_cubes(unit_grid(values), border=border).material_index is None


@pytest.mark.parametrize("topology", ["manifold", "trilinear"])
def test_without_its_cap_faces_a_capped_surface_is_the_open_one(topology):
    rng = np.random.default_rng(11)
    for values in random_values(rng, 60):
        grid = unit_grid(values)
        cap = marching_cubes(grid, border="cap", topology=topology)
        rest = cap.triangles[cap.material_index == 0].reshape(-1, 9)
        alone = marching_cubes(grid, topology=topology).triangles.reshape(-1, 9)
        assert np.array_equal(rest, alone)
        capped = cap.triangles[cap.material_index == 1]
        last = np.array(values.shape) - 1.0
        in_plane = ((capped == 0) | (capped == last)).all(axis=1)
        assert in_plane.any(axis=1).all()


def test_zero_counts_as_outside_and_the_surface_then_passes_through_the_node():
    values = np.ones((3, 3, 3))
    values[1, 1, 1] = 0
    assert marching_cubes(unit_grid(values)).n_faces == 0
    values[1, 1, 1] = -1
    values[2, 1, 1] = 0
    mesh = marching_cubes(unit_grid(values))
    assert [2.0, 1.0, 1.0] in mesh.vertices.tolist()
    assert_closed(mesh)


def test_scaling_values_by_a_power_of_two_changes_no_bit():
    values = np.random.default_rng(6).normal(size=(9, 8, 7))
    mesh = marching_cubes(unit_grid(values))
    for power in (-300, -30, 300):
        other = marching_cubes(unit_grid(values * 2.0**power))
        assert np.array_equal(other.vertices, mesh.vertices)
        assert np.array_equal(other.faces, mesh.faces)


def test_exchanging_axes_exchanges_coordinates():
    rng = np.random.default_rng(7)
    values = rng.normal(size=(17, 9, 12))
    mesh = marching_cubes(unit_grid(values), border="pad")
    for order in ([1, 2, 0], [1, 0, 2]):
        other = marching_cubes(unit_grid(values.transpose(order)), border="pad")
        back = np.argsort(order)
        moved = other.vertices[:, back]
        assert np.array_equal(moved[np.lexsort(moved.T[::-1])], vertex_set(mesh))
        assert other.n_faces == mesh.n_faces
        assert len(open_edges(other)) == 0
        # Diagonals inside a cube may differ, and with them the volume between two of them.
        assert volume(other) == pytest.approx(volume(mesh), rel=0.01)


def test_where_no_face_alternates_a_change_of_sign_turns_the_surface_inside_out():
    ball = sphere_distance(nodes_of((-7, -7, -7), (15, 15, 15)), (0.1, 0.2, 0.3), 5.0)
    mesh, turned = marching_cubes(unit_grid(ball)), marching_cubes(unit_grid(-ball))
    assert np.array_equal(vertex_set(mesh), vertex_set(turned))
    assert volume(mesh) > 0 > volume(turned)
    assert_closed(turned)


def test_translation_is_added_to_the_nodes():
    band = band_of(sphere_distance, (-2, -2, -2), (4, 4, 4), 0.125)
    moved = NarrowBand(
        band.index, band.values, band.active, 0.125, np.array([10.0, 0, -3]), 3.0, "parity"
    )
    difference = marching_cubes(moved).vertices - marching_cubes(band).vertices
    np.testing.assert_allclose(difference, [[10, 0, -3]] * len(difference), atol=4e-15)


@pytest.mark.parametrize("topology", ["manifold", "trilinear"])
def test_the_number_of_threads_and_pieces_changes_no_bit(monkeypatch, topology):
    noise = np.random.default_rng(13).integers(-2, 3, (41, 7, 9))
    volumes = band_of(sphere_distance, (-5, -5, -5), (10, 10, 10), 0.03), unit_grid(noise)
    meshes = [marching_cubes(volume, border="cap", topology=topology) for volume in volumes]
    parallel = importlib.import_module("meshsdf.kernels.parallel")
    for threads, smallest in ((1, 2**30), (5, 512), (3, 64)):
        for module in (parallel, brick_field):
            monkeypatch.setattr(module, "n_threads", lambda threads=threads: threads)
        monkeypatch.setattr(brick_field, "NODES_PER_PIECE", smallest)
        for given, mesh in zip(volumes, meshes, strict=True):
            other = marching_cubes(given, border="cap", topology=topology)
            assert np.array_equal(other.vertices, mesh.vertices)
            assert np.array_equal(other.faces, mesh.faces)


def test_a_volume_without_a_change_of_sign_gives_an_empty_mesh():
    for values in (np.ones((4, 4, 4)), np.full((9, 9, 9), -1.0), np.full((3, 3, 3), np.nan)):
        mesh = marching_cubes(unit_grid(values))
        assert (mesh.n_vertices, mesh.n_faces) == (0, 0)
    empty = NarrowBand(
        BrickIndex.from_coordinates(np.empty((0, 3), np.int64)), np.empty((0, 8, 8, 8), np.float32),
        np.empty((0, 8), np.uint64), 1.0, np.zeros(3), 3.0, "parity",
    )  # fmt: skip
    assert marching_cubes(empty).n_faces == 0


def test_float32_values_are_compared_with_the_level_as_it_is():
    third = np.float32(1 / 3)  # a little above 1/3
    values = np.full((3, 3, 3), 1, np.float32)
    values[1, 1, 1] = third
    grid = Grid(values, 1.0, np.zeros(3))
    assert marching_cubes(grid, level=1 / 3).n_faces == 0
    assert marching_cubes(grid, level=float(np.nextafter(float(third), 1))).n_faces == 8
    assert marching_cubes(grid, level=1e300).n_faces == 0


def test_progress_tells_stages_up_to_the_end():
    told = []
    marching_cubes(unit_grid(dyadic(np.random.default_rng(0), (9, 9, 9))),
                   progress=lambda stage, fraction: told.append((stage, fraction)))  # fmt: skip
    assert {stage for stage, _ in told} == {"counting", "surface"}
    assert told[-1] == ("surface", 1.0)


@pytest.mark.parametrize("level", [np.nan, np.inf, -np.inf])
def test_a_level_must_be_finite(level):
    with pytest.raises(SurfaceError, match=f"level is {level}"):
        marching_cubes(unit_grid(np.ones((3, 3, 3))), level=level)


def test_a_level_beyond_the_band_is_refused_with_the_range():
    band = band_of(sphere_distance, (-2, -2, -2), (4, 4, 4), 0.125)
    for level in (0.375, -0.375, 1.0):
        with pytest.raises(SurfaceError, match=r"between -0\.375 and 0\.375"):
            marching_cubes(band, level=level)
    assert_closed(marching_cubes(band, level=0.374))


def test_an_unsigned_volume_needs_a_level_above_zero_and_then_gets_a_shell():
    shell = np.abs(sphere_distance(nodes_of((-9, -9, -9), (19, 19, 19)), radius=5.0))
    with pytest.raises(SurfaceError, match=r"unsigned(.|\n)*such as the voxel size, 1"):
        marching_cubes(unit_grid(shell, "unsigned"))
    mesh = marching_cubes(unit_grid(shell, "unsigned"), level=1.0)
    assert_closed(mesh)
    assert volume(mesh) == pytest.approx(4 / 3 * np.pi * (6**3 - 4**3), rel=0.05)


def test_a_grid_without_a_cell_is_refused():
    with pytest.raises(SurfaceError, match="5 x 1 x 4 nodes"):
        marching_cubes(unit_grid(np.ones((5, 1, 4))))


def test_a_border_of_another_name_is_refused():
    check = importlib.import_module("meshsdf.surface.marching_cubes").check_choices
    with pytest.raises(SurfaceError, match=r"border is 'closed'(.|\n)*'open', 'cap', 'pad'"):
        check("closed", "manifold", 0.0, "marching_cubes")


def test_more_vertices_than_faces_can_name_are_refused(monkeypatch):
    monkeypatch.setattr("meshsdf.surface.limits.MAX_VERTICES", 5)
    one_inside = np.pad([[[-1.0]]], 1, constant_values=1.0)
    with pytest.raises(SurfaceError, match="6 vertices, faces can name 5"):
        marching_cubes(unit_grid(one_inside))


def test_missing_bricks_that_contradict_each_other_are_refused():
    band = band_of(sphere_distance, (-4, -4, -4), (8, 8, 8), 1 / 16)
    taken = band.index.lookup(np.array([[-4, -4, -4], [-3, -4, -4], [0, 0, 2]]))
    assert (taken < 0).any()
    outside = np.array([b for b in np.ndindex(4, 4, 4) if band.index.lookup(np.array([b]))[0] < 0
                        and band.index.lookup(np.array([b]) - 1)[0] >= 0])  # fmt: skip
    mark_inside(band.index, outside[-1:])
    with pytest.raises(SurfaceError, match="one inside and one outside"):
        marching_cubes(band)
