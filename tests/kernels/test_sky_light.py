"""meshsdf.kernels.sky_light: what part of an even sky arrives, against closed formulas."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf.kernels.sky_light import mean_sums, sky_sums
from meshsdf.mesh import Mesh
from meshsdf.mesh.measures import face_normals
from meshsdf.mesh.primitives import box_mesh, icosphere
from meshsdf.ray.shading import N_SETS, ray_sets
from meshsdf.spatial.ray_hits import RayHits

EVEN = np.array([1.0, 0, 0, 0, 1, 0, 0, 1, 0])


def sums_of(mesh, points, normals, *, n_rays=64, sky=EVEN, longest=np.inf, facets=None, homes=None):
    """The sums of all 16 sets together, at (n, 3) points that lie on nothing."""
    rays = RayHits(mesh)
    total = np.zeros((len(points), 2))
    for number in range(N_SETS):
        sums = np.empty((len(points), 2))
        sets, lifts = np.full(len(points), number), np.zeros(len(points))
        homes = np.zeros(len(points), np.int32) if homes is None else homes
        sky_sums(
            *(points, normals, normals if facets is None else facets, lifts, sets),
            *(homes, 0, len(points), rays.center, longest, ray_sets(n_rays), sky),
            *(rays.corners, *rays.tree, rays.homes_and_parents()[1], sums),
        )
        total += sums
    return total


def wall(height, half_width=1e4):
    """From y = 0 upward, at x = 0."""
    corners = np.array([[0.0, 0, -1], [0, 0, 1], [0, 1, 1], [0, 1, -1]])
    faces = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    return Mesh(corners * [1, height, half_width], faces)


def test_a_long_wall_hides_the_share_of_its_formula():
    distance = np.array([0.1, 0.3, 1.0, 3.0])
    points = np.column_stack([distance, np.zeros(4), np.zeros(4)])
    normals = np.tile([0.0, 1, 0], (4, 1))
    sums = sums_of(wall(1.0), points, normals)
    # View factor of a strip from the floor: (1 - cos of the angle up to its top) / 2
    hidden = 0.5 * (1 - distance / np.hypot(distance, 1.0))
    # 1024 even rays: some 1/32 of them lie on the border, half of those on the wrong side
    assert_allclose(1 - sums[:, 1] / sums[:, 0], hidden, atol=1 / 64)


def test_what_is_farther_than_the_longest_ray_hides_nothing():
    points, normals = np.array([[1.0, 0, 0]]), np.array([[0.0, 1, 0]])
    sums = sums_of(wall(1.0), points, normals, longest=0.999)
    assert_array_equal(sums[:, 0], sums[:, 1])
    assert (np.diff(sums_of(wall(1.0), points, normals, longest=1.1)) < 0).all()


def test_a_room_without_windows_is_dark_and_the_outside_of_it_is_not():
    rng = np.random.default_rng(0)
    normals = rng.normal(size=(50, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    inside = rng.uniform(-0.49, 0.49, (50, 3))
    assert (sums_of(box_mesh(), inside, normals, n_rays=4)[:, 1] == 0).all()
    outside = 2 * normals
    sums = sums_of(box_mesh(), outside, normals, n_rays=4)
    assert_array_equal(sums[:, 0], sums[:, 1])


def test_where_in_the_tree_a_search_starts_changes_nothing():
    rng = np.random.default_rng(1)
    mesh = icosphere(subdivisions=3)
    dents = 1 - 0.3 * rng.random(mesh.n_vertices)
    mesh = Mesh(mesh.vertices * dents[:, None], mesh.faces)
    rays, faces, normals = RayHits(mesh), np.arange(mesh.n_faces), face_normals(mesh)
    points = mesh.triangles.mean(axis=1) + 1e-3 * normals
    homes, parents = rays.homes_and_parents()
    assert_array_equal(rays.tree[0].ravel()[parents[1:]], np.arange(1, len(parents)))
    from_root = sums_of(mesh, points, normals, n_rays=4)
    assert np.mean(from_root[:, 1] < from_root[:, 0]) > 0.1
    assert from_root[:, 1].max() > 0
    for start in (homes, homes[rng.permutation(faces)]):
        assert_array_equal(sums_of(mesh, points, normals, n_rays=4, homes=start), from_root)
    # Every ray by itself, from the root
    directions = ray_sets(4)[:, :, None] @ axes_around(normals)[:, None, None]
    directions = directions.reshape(len(points), -1, 3)
    blocked = rays.is_blocked(np.repeat(points, 64, axis=0), directions.reshape(-1, 3))
    arriving = 64 - blocked.reshape(-1, 64).sum(axis=1)
    assert_array_equal(from_root, np.column_stack([np.full(len(points), 64), arriving]))


def axes_around(normals):
    """Two axes across each unit normal, and itself, as rows (Duff et al. 2017, JCGT 6(1))."""
    x, y, z = normals.T
    side = np.where(z >= 0, 1.0, -1.0)
    a = -1 / (side + z)
    b = x * y * a
    across = np.column_stack([1 + side * x * x * a, side * b, -side * x])
    return np.stack([across, np.column_stack([b, side + y * y * a, -y]), normals], axis=1)


def test_the_homes_of_faces_are_the_leaves_that_hold_them():
    rays = RayHits(icosphere(subdivisions=2))
    homes, _ = rays.homes_and_parents()
    leaf = -2 - rays.tree[0].ravel()[homes]
    place = np.argsort(rays.face_of_slot) - leaf // 8
    assert place.min() == 0
    assert (place <= leaf % 8).all()


@pytest.mark.parametrize("n_rays", [1, 4, 64])
def test_the_rays_are_as_dense_as_the_cosine(n_rays):
    rays = ray_sets(n_rays)
    assert rays.shape == (N_SETS, n_rays, 3)
    every = rays.reshape(-1, 3)
    assert_allclose(np.linalg.norm(every, axis=1), 1, atol=1e-15)
    assert every[:, 2].min() > 0
    # The mean of a cosine-weighted hemisphere, and the mean square of its height
    tolerance = 1.5 / len(every) ** 0.75
    assert_allclose(every.mean(axis=0), [0, 0, 2 / 3], atol=tolerance)
    assert_allclose((every**2).mean(axis=0), [0.25, 0.25, 0.5], atol=tolerance)


def test_rays_turn_with_the_normal_and_stay_above_the_face():
    # The sky is bright along one axis: the sum is that of the rays' heights along it
    rng = np.random.default_rng(1)
    normals = rng.normal(size=(200, 3))
    normals[:3] = [[0, 0, 1], [0, 0, -1], [1, 0, 0]]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    points = 100 * normals
    for axis in np.eye(3):
        sky = np.concatenate([[0.0, 1, 0], axis, axis])
        sums = sums_of(box_mesh(), points, normals, sky=sky)[:, 0] / (64 * N_SETS)
        assert_allclose(sums, 2 / 3 * normals @ axis, atol=0.01)
    # With a face that looks along +x, no ray goes towards -x
    facets = np.tile([1.0, 0, 0], (200, 1))
    sky = np.array([0.0, 0, 1, 0, 1, 0, -1, 0, 0])
    assert (sums_of(box_mesh(), points, normals, sky=sky, facets=facets)[:, 0] == 0).all()


def plane_of(height, width):
    """Points of a plane at the pixels, their columns and rows, and the index image."""
    rows, columns = np.indices((height, width)).reshape(2, -1)
    points = np.column_stack([columns, -rows, np.zeros(height * width)]).astype(float)
    index = np.arange(height * width, dtype=np.int32).reshape(height, width)
    return points, columns, rows, index


def means_of(points, columns, rows, index, normals, sums, *, back=2):
    n = len(points)
    result = np.empty((n, 2))
    lifts = np.full(n, 0.25)
    mean_sums(
        *(columns, rows, points, normals, lifts, 0, n, back, 12.0),
        *(index, points, normals, sums, result),
    )
    return result


def test_means_are_those_of_the_4_x_4_pixels_on_the_same_plane():
    points, columns, rows, index = plane_of(9, 11)
    normals = np.tile([0.0, 0, 1], (99, 1))
    sums = np.random.default_rng(2).random((99, 2))
    result = means_of(points, columns, rows, index, normals, sums).reshape(9, 11, 2)
    image = sums.reshape(9, 11, 2)
    assert_allclose(result[5, 6], image[3:7, 4:8].mean(axis=(0, 1)), atol=1e-15)
    assert_allclose(result[0, 0], image[:2, :2].mean(axis=(0, 1)), atol=1e-15)
    other = means_of(points, columns, rows, index, normals, sums, back=1)
    assert_allclose(other.reshape(9, 11, 2)[5, 6], image[4:8, 5:9].mean(axis=(0, 1)), atol=1e-15)
    nothing = means_of(points, columns, rows, np.full_like(index, -1), normals, sums)
    assert (nothing == 0).all()


def test_pixels_beyond_a_step_a_corner_or_a_hole_do_not_count():
    points, columns, rows, index = plane_of(8, 8)
    normals = np.tile([0.0, 0, 1], (64, 1))
    sums = np.random.default_rng(3).random((64, 2))
    right = columns >= 4
    alone = sums.reshape(8, 8, 2)[2:6, 1:4].mean(axis=(0, 1))
    step = points + np.outer(right, [0, 0, 3.0])  # 12 lifts
    corner = np.where(right[:, None], [1.0, 0, 0], normals)
    hole = np.where(right.reshape(8, 8), np.int32(-1), index)
    for case in (
        (step, columns, rows, index, normals),
        (points, columns, rows, index, corner),
        (points, columns, rows, hole, normals),
    ):
        result = means_of(*case, sums).reshape(8, 8, 2)
        assert_allclose(result[4, 3], alone, atol=1e-15)
