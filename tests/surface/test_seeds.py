"""meshsdf.surface.seeds: one seed on every component, whatever the distances between them."""

import numpy as np
import pytest

from meshsdf.box import Box
from meshsdf.errors import SurfaceError
from meshsdf.implicit import (
    Exactness,
    box,
    difference,
    from_function,
    gyroid,
    sphere,
    torus,
    union,
)
from meshsdf.surface import continue_surface, find_seeds
from tests.surface.soundness import assert_closed, euler_characteristic


def spheres_apart(rng, n, gap):
    """n spheres of many sizes in the unit cube, no two nearer than ``gap``."""
    centers, radii = [], []
    while len(radii) < n:
        center, radius = rng.uniform(0, 1, 3), rng.uniform(0.02, 0.1)
        distance = np.linalg.norm(np.reshape(centers, (-1, 3)) - center, axis=1)
        if (distance > np.array(radii) + radius + gap).all():
            centers.append(center)
            radii.append(radius)
    return [sphere(r, c) for r, c in zip(radii, centers, strict=True)]


def assert_one_each(shape, n, voxel_size, **choices):
    """n seeds, each in a cell that is crossed, and their surface is the whole."""
    seeds = find_seeds(shape, voxel_size=voxel_size, **choices)
    assert len(seeds) == n
    corners = seeds[:, None] + voxel_size * (np.stack(np.indices((2, 2, 2)), -1) - 0.5).reshape(
        -1, 3
    )
    inside = shape(corners.reshape(-1, 3)).reshape(-1, 8) < choices.get("level", 0.0)
    assert (inside.any(axis=1) & ~inside.all(axis=1)).all()
    grown = continue_surface(shape, voxel_size=voxel_size, seeds=seeds, **choices)
    whole = continue_surface(shape, voxel_size=voxel_size, **choices)
    np.testing.assert_array_equal(grown.vertices, whole.vertices)
    np.testing.assert_array_equal(grown.faces, whole.faces)
    return whole


def test_fifty_random_spheres_have_fifty_seeds():
    rng = np.random.default_rng(1)
    for _ in range(3):
        balls = spheres_apart(rng, 50, gap=0.03)  # more than the diagonal of a cell
        mesh = assert_one_each(union(*balls), 50, 1 / 64)
        assert_closed(mesh)
        assert euler_characteristic(mesh) == 100


def test_two_spheres_far_apart_and_a_small_one_beside_a_large_one():
    far = np.array([1e4, 2e4, -3e4])
    assert_one_each(union(sphere(1.0), sphere(0.5, far)), 2, 0.125)
    assert_one_each(union(sphere(8.0), sphere(0.2, np.array([8.5, 0, 0]))), 2, 0.125)


def test_nested_spheres():
    shells = [difference(sphere(r), sphere(r - 0.3)) for r in (1.0, 2.0, 3.0)]
    assert_one_each(union(*shells), 6, 0.1)


def test_a_torus_a_box_and_a_gyroid():
    assert_one_each(torus(1.0, 0.3), 1, 0.1)
    assert_one_each(box(np.array([1.0, 2.0, 3.0])), 1, 0.1)
    around = Box(np.zeros(3), np.full(3, 3.0))
    assert_one_each(gyroid(1.5), 1, 0.1, box=around)
    assert_one_each(sphere(1.0), 1, 0.1, level=0.25)


def test_a_sphere_of_a_few_cells_is_found_wherever_it_lies():
    rng = np.random.default_rng(2)
    for center in rng.uniform(-50, 50, (60, 3)):
        # A ball of this radius holds a node, whatever its center
        tiny = sphere(0.5 * np.sqrt(3) + 1e-9, center)
        assert_one_each(tiny, 1, 1.0, box=Box(np.full(3, -60.0), np.full(3, 60.0)))


def test_a_bound_with_a_small_slope_costs_more_and_misses_nothing():
    balls = union(*spheres_apart(np.random.default_rng(3), 10, gap=0.05))
    low = from_function(lambda p: 0.5 * balls(p), Exactness.BOUND, box=balls.box)
    assert_one_each(low, 10, 1 / 40)


def test_seeds_come_in_order_and_none_from_nothing():
    row = union(*(sphere(0.3, np.array([x, 0.0, 0.0])) for x in (5.0, 1.0, 3.0)))
    assert (np.diff(find_seeds(row, voxel_size=0.1)[:, 0]) > 1).all()
    assert find_seeds(sphere(1.0), voxel_size=0.1, level=-2.0).shape == (0, 3)


def test_a_function_known_by_its_sign_cannot_be_searched():
    sign = from_function(lambda p: np.sign(p[:, 0]), Exactness.SIGN, box=sphere(1.0).box)
    with pytest.raises(SurfaceError, match="only known by its sign"):
        find_seeds(sign, voxel_size=0.1)
