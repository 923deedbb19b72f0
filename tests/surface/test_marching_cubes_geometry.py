"""meshsdf.surface.marching_cubes: how near the surface is, and what independent programs say."""

import igl
import manifold3d
import numpy as np
import pytest
import trimesh
from numpy.testing import assert_allclose
from scipy.spatial import cKDTree

from meshsdf.grid import Grid
from meshsdf.surface import marching_cubes
from tests.surface.bands import band_of, grid_of, sphere_distance, torus_distance
from tests.surface.soundness import assert_closed, euler_characteristic, volume

CENTER = np.array([0.013, -0.027, 0.041])
MAJOR, MINOR = 1.0, 0.4


def ball(points):
    return sphere_distance(points, CENTER)


def torus(points):
    return torus_distance(points, MAJOR, MINOR)


def error_bound(voxel_size, curvature):
    """Edge interpolation (1/8) plus linear triangles within a cell (3/8), times kappa' h^2."""
    return 0.5 * voxel_size**2 * curvature / (1 - np.sqrt(3) * voxel_size * curvature)


def face_samples(mesh, n=6):
    """Points of a barycentric lattice on every face, corners and sides included."""
    weights = np.array([(i, j, n - i - j) for i in range(n + 1) for j in range(n + 1 - i)]) / n
    return np.einsum("pc,mcx->mpx", weights, mesh.triangles).reshape(-1, 3)


def fitted_order(sizes, errors):
    return np.polyfit(np.log(sizes), np.log(errors), 1)[0]


def test_a_ball_is_met_from_inside_within_the_bound_and_to_second_order():
    sizes, far, lost, off = [1 / 8, 1 / 16, 1 / 32], [], [], []
    for h in sizes:
        n = round(1.25 / h)
        mesh = marching_cubes(grid_of(ball, (-n,) * 3, (2 * n + 1,) * 3, h))
        assert_closed(mesh)
        assert euler_characteristic(mesh) == 2
        # The distance to the centre is convex: interpolated it is too large, so that vertices
        # lie inside, and the deepest point of a face is its point nearest to the centre.
        centers = np.broadcast_to(CENTER, (mesh.n_faces, 3))
        nearest = trimesh.triangles.closest_point(mesh.triangles, centers)
        deepest = 1 - np.linalg.norm(nearest - CENTER, axis=1)
        assert ball(mesh.vertices).max() <= 1e-14
        assert deepest.max() <= error_bound(h, 1.0)
        far.append(np.sqrt((deepest**2).mean()))
        lost.append(4 / 3 * np.pi - volume(mesh))
        area = np.linalg.norm(np.cross(*np.diff(mesh.triangles, axis=1).transpose(1, 0, 2)), axis=1)
        off.append(4 * np.pi - area.sum() / 2)
    for errors in (far, lost, off):
        assert min(errors) > 0
        assert abs(fitted_order(sizes, errors) - 2) <= 0.1


def test_a_torus_keeps_its_hole_and_is_met_to_second_order():
    sizes, deviation, lost = [1 / 8, 1 / 16, 1 / 32], [], []
    for h in sizes:
        n = int(np.ceil(1.6 / (8 * h)))
        mesh = marching_cubes(band_of(torus, (-n, -n, -n), (2 * n,) * 3, h))
        assert_closed(mesh)
        assert euler_characteristic(mesh) == 0
        errors = np.abs(torus(face_samples(mesh)))
        # Float32 values: half a unit in the last place of the largest stored, at most doubled
        assert errors.max() <= error_bound(h, max(1 / MINOR, 1 / (MAJOR - MINOR))) + 2 * 2**-24
        deviation.append(np.sqrt((errors**2).mean()))
        lost.append(2 * np.pi**2 * MAJOR * MINOR**2 - volume(mesh))
    assert abs(fitted_order(sizes, deviation) - 2) <= 0.1
    assert abs(fitted_order(sizes, lost) - 2) <= 0.1


def ball_normal(points):
    away = points - CENTER
    return away / np.linalg.norm(away, axis=1, keepdims=True)


def torus_normal(points):
    ring = points * [1, 1, 0]
    away = points - MAJOR * ring / np.linalg.norm(ring, axis=1, keepdims=True)
    return away / np.linalg.norm(away, axis=1, keepdims=True)


@pytest.mark.parametrize(("distance", "normal"), [(ball, ball_normal), (torus, torus_normal)])
def test_normals_of_faces_converge_to_first_order(distance, normal):
    sizes, mean, worst = [1 / 8, 1 / 16, 1 / 32], [], []
    for h in sizes:
        n = round(1.5 / h)
        mesh = marching_cubes(grid_of(distance, (-n,) * 3, (2 * n + 1,) * 3, h))
        across = np.cross(*np.diff(mesh.triangles, axis=1).transpose(1, 0, 2))
        area = np.linalg.norm(across, axis=1)
        is_wide = area > 1e-9 * h**2  # of slivers at nodes on the surface rounding takes the rest
        across = across[is_wide] / area[is_wide, None]
        cosine = (across * normal(mesh.triangles.mean(axis=1)[is_wide])).sum(axis=1)
        angle = np.arccos(np.clip(cosine, -1, 1))
        mean.append(np.average(angle, weights=area[is_wide]))
        worst.append(angle.max())
    assert abs(fitted_order(sizes, mean) - 1) <= 0.1
    assert fitted_order(sizes, worst) >= 0.8
    assert worst[-1] < 0.2


def test_where_signs_leave_no_choice_both_promises_give_one_mesh():
    grid = grid_of(torus, (-13, -13, -5), (27, 27, 11), 1 / 8)
    one, other = (marching_cubes(grid, topology=t) for t in ("manifold", "trilinear"))
    assert np.array_equal(one.vertices, other.vertices)
    assert np.array_equal(one.faces, other.faces)


def test_other_levels_of_a_band_are_offset_surfaces():
    h = 1 / 16
    band = band_of(ball, (-3, -3, -3), (6, 6, 6), h)
    for level in (-2 * h, -0.5 * h, 2 * h):
        mesh = marching_cubes(band, level=level)
        assert_closed(mesh)
        radius = np.linalg.norm(face_samples(mesh) - CENTER, axis=1)
        assert np.abs(radius - (1 + level)).max() <= error_bound(h, 1 / (1 - 2 * h))


def test_a_plane_is_met_exactly():
    normal = np.array([2.0, 3.0, 6.0]) / 7
    mesh = marching_cubes(grid_of(lambda p: p @ normal - 0.1, (-8, -8, -8), (17, 17, 17), 0.125))
    assert mesh.n_faces > 100
    # Sums and products of numbers below 4: a few units in the last place of 4
    assert_allclose(mesh.vertices @ normal, 0.1, rtol=0, atol=8 * np.spacing(4.0))
    a, b, c = mesh.triangles.transpose(1, 0, 2)
    assert (np.cross(b - a, c - a) @ normal > 0).all()


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_libigl_finds_the_same_crossing_points(seed):
    values = np.random.default_rng(seed).normal(size=(9, 14, 11))
    nodes = np.stack(np.meshgrid(*map(np.arange, values.shape), indexing="ij"), -1).astype(float)
    order = "F"  # libigl counts x fastest
    theirs, _, _ = igl.marching_cubes(
        values.ravel(order), np.stack([nodes[..., a].ravel(order) for a in range(3)], axis=1),
        *values.shape, 0.25,
    )  # fmt: skip
    ours = marching_cubes(Grid(values, 1.0, np.zeros(3)), level=0.25).vertices
    assert len(ours) == len(theirs) > 1000
    for one, other in ((ours, theirs), (theirs, ours)):
        assert cKDTree(one).query(other)[0].max() <= 1e-12


@pytest.mark.parametrize("border", ["pad", "cap"])
def test_trimesh_and_manifold_accept_smooth_and_noisy_surfaces(border):
    noise = np.random.default_rng(3).normal(size=(20, 21, 22))
    for grid in (grid_of(torus, (-13, -13, -5), (27, 27, 11), 0.125), Grid(noise, 1.0, CENTER)):
        mesh = marching_cubes(grid, border=border)
        seen = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
        assert seen.is_watertight
        assert seen.is_winding_consistent
        assert seen.volume > 0
        solid = manifold3d.Manifold(
            manifold3d.Mesh64(np.array(mesh.vertices), np.array(mesh.faces, np.uint64))
        )
        assert solid.status() == manifold3d.Error.NoError
        assert solid.volume() == pytest.approx(seen.volume, rel=1e-6)
        if grid.values is not noise:
            assert solid.genus() == 1
