"""meshsdf.spatial.closest_point: the nearest place on a mesh."""

import igl
import numpy as np
import pytest
import trimesh
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf.errors import SpatialError
from meshsdf.mesh import Mesh
from meshsdf.mesh.primitives import box_mesh, icosphere
from meshsdf.spatial import ClosestPoint
from tests.oracles import closest_by_brute_force


def random_soup(seed, m=160):
    """Triangles of all sizes; some are segments and points."""
    rng = np.random.default_rng(seed)
    corners = rng.normal(size=(m, 1, 3)) + 10.0 ** rng.uniform(-3, 0, (m, 1, 1)) * rng.normal(
        size=(m, 3, 3)
    )
    corners[::10, 1] = corners[::10, 0]
    corners[::20, 2] = corners[::20, 0]
    corners[5::10, 2] = 0.5 * (corners[5::10, 0] + corners[5::10, 1])
    return Mesh(corners.reshape(-1, 3), np.arange(3 * m, dtype=np.int32).reshape(-1, 3))


def queries_of(mesh, seed):
    """On vertices, edges and faces, near, inside the box, and far."""
    rng = np.random.default_rng(seed)
    a, b, c = np.moveaxis(mesh.triangles, 1, 0)
    size = mesh.box.diagonal
    on = np.concatenate([a, 0.5 * (a + b), (a + b + c) / 3])
    near = on + 1e-3 * size * rng.normal(size=on.shape)
    inside = mesh.box.lower + rng.random((300, 3)) * mesh.box.size
    far = mesh.box.center + 100 * size * rng.normal(size=(100, 3))
    return np.concatenate([on, near, inside, far])


def moved(mesh, scale, offset):
    return Mesh(scale * mesh.vertices + offset, mesh.faces)


@pytest.mark.parametrize(("scale", "offset"), [(1, 0), (1e-9, 0), (1e6, 0), (1, 1e7), (1e-3, 1e4)])
def test_distances_are_those_of_brute_force_within_the_bound(scale, offset):
    mesh = moved(random_soup(0), scale, offset)
    points = queries_of(mesh, 1)
    closest = ClosestPoint(mesh)
    found = closest(points)
    # The twin is given centred coordinates: one of the bounds is for that
    truth = closest_by_brute_force(points - mesh.box.center, mesh.triangles - mesh.box.center)
    bound = closest.rounding_bound(points)
    assert_array_equal(np.abs(found.distance - truth) <= 2 * bound, True)
    assert (found.distance[: mesh.n_faces] <= bound[: mesh.n_faces]).all()
    assert (found.distance[-100:] > mesh.box.diagonal).all()


@pytest.mark.parametrize(("scale", "offset"), [(1, 0), (1e-9, 0), (1, 1e7)])
def test_point_face_and_barycentrics_tell_the_same_place(scale, offset):
    mesh = moved(random_soup(2), scale, offset)
    points = queries_of(mesh, 3)
    closest = ClosestPoint(mesh)
    found = closest(points)
    corners = mesh.triangles[found.face_index] - mesh.box.center
    assert found.barycentric.min() >= 0
    assert_allclose(found.barycentric.sum(axis=1), 1, atol=4 * 2.0**-53)
    again = np.einsum("nk,nkx->nx", found.barycentric, corners)
    gap = np.linalg.norm(again - (points - mesh.box.center), axis=1)
    assert (np.abs(gap - found.distance) <= 2 * closest.rounding_bound(points)).all()
    # Adding the centre back rounds once more, by the size of the coordinates themselves
    atol = 4 * 2.0**-53 * np.abs(mesh.vertices).max()
    assert_allclose(found.point, again + mesh.box.center, rtol=0, atol=atol)


def test_libigl_and_trimesh_agree():
    mesh = icosphere(subdivisions=3, center=(1.0, 2.0, 3.0))
    points = queries_of(mesh, 4)
    found = ClosestPoint(mesh)(points)
    square, _, foot = igl.point_mesh_squared_distance(
        points, mesh.vertices, mesh.faces.astype(np.int64)
    )
    scale = 1 + np.linalg.norm(points, axis=1)
    assert (np.abs(found.distance - np.sqrt(square)) <= 1e-13 * scale).all()
    near = slice(0, 500)
    other = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    foot, distance, _ = trimesh.proximity.closest_point_naive(other, points[near])
    assert_allclose(found.distance[near], distance, atol=1e-7)  # its slack near edges
    assert_allclose(found.point[near], foot, atol=1e-7)


def test_a_box_has_the_distances_its_formula_says():
    rng = np.random.default_rng(5)
    points = 2 * rng.normal(size=(2000, 3))
    beyond = np.abs(points) - [0.5, 1.0, 1.5]
    outside = np.linalg.norm(np.maximum(beyond, 0), axis=1)
    truth = np.where(beyond.max(axis=1) > 0, outside, -beyond.max(axis=1))
    found = ClosestPoint(box_mesh((1.0, 2.0, 3.0)))(points)
    assert (beyond.max(axis=1) < 0).any()
    assert_allclose(found.distance, truth, atol=64 * 2.0**-53 * 12)


def test_neither_order_nor_seeds_change_a_single_bit():
    mesh = random_soup(6)
    points = queries_of(mesh, 7)
    closest = ClosestPoint(mesh)
    found = closest(points)
    rng = np.random.default_rng(8)
    order = rng.permutation(len(points))
    seeds = rng.integers(0, mesh.n_faces, len(points)).astype(np.int32)
    again = closest(points[order], seed_faces=seeds)
    for name in ("distance", "point", "face_index", "barycentric"):
        assert_array_equal(getattr(again, name), getattr(found, name)[order])
    short = closest.distances(points, seed_faces=found.face_index)
    assert_array_equal(short.distance, found.distance)
    assert_array_equal(short.face_index, found.face_index)


def test_of_equal_faces_the_lowest_is_named():
    triangle = np.random.default_rng(9).normal(size=(3, 3))
    mesh = Mesh(triangle, np.tile(np.array([[0, 1, 2]], np.int32), (50, 1)))
    found = ClosestPoint(mesh)(np.random.default_rng(10).normal(size=(100, 3)))
    assert (found.face_index == 0).all()


def test_no_points_give_no_answers():
    found = ClosestPoint(box_mesh())(np.empty((0, 3)))
    assert found.distance.shape == (0,)
    assert found.point.shape == (0, 3)


def test_the_points_stay_as_they_are():
    points = np.random.default_rng(11).normal(size=(1000, 3))
    before = points.copy()
    ClosestPoint(box_mesh())(points)
    assert_array_equal(points, before)


def test_a_mesh_without_faces_is_refused():
    empty = Mesh(np.zeros((2, 3)), np.empty((0, 3), np.int32))
    with pytest.raises(SpatialError, match="no faces, so nothing is closest"):
        ClosestPoint(empty)


def test_points_that_are_not_finite_are_counted():
    points = np.zeros((10, 3))
    points[[3, 7], 1] = np.nan, np.inf
    with pytest.raises(SpatialError, match=r"2 of 10 points .* \(first: point 3\)"):
        ClosestPoint(box_mesh())(points)


@pytest.mark.parametrize(
    ("seeds", "message"), [([0] * 3, "3 seed faces for 2 points"), ([0, 12], "from 0 to 12")]
)
def test_seeds_that_are_no_faces_are_refused(seeds, message):
    with pytest.raises(SpatialError, match=message):
        ClosestPoint(box_mesh())(np.zeros((2, 3)), seed_faces=np.array(seeds, np.int32))


def test_progress_ends_at_one_and_an_exception_in_it_stops_the_search():
    closest = ClosestPoint(box_mesh())
    points = np.zeros((40_000, 3))
    told = []
    closest(points, progress=lambda stage, share: told.append((stage, share)))
    assert told[-1] == ("closest points", 1.0)

    def stop(stage, share):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        closest(points, progress=stop)
