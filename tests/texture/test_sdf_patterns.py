"""meshsdf.texture.sdf_patterns: curvature, occlusion and thickness of shapes with known ones."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from meshsdf.errors import TextureError
from meshsdf.implicit import box, sphere, torus
from meshsdf.mesh.primitives import box_mesh
from meshsdf.sdf.mesh_distance import MeshDistance
from meshsdf.texture.sdf_patterns import (
    CavityDirt,
    EdgeWear,
    Thickness,
    mean_curvature,
    occlusion,
    thickness,
)


def on_sphere(radius, n=200):
    directions = np.random.default_rng(0).normal(size=(n, 3))
    return radius * directions / np.linalg.norm(directions, axis=1, keepdims=True)


@pytest.mark.parametrize("radius", [0.5, 2.0])
def test_a_sphere_bends_by_one_over_its_radius(radius):
    # The fourth derivatives of |p| are at most 9 / r^3, and the step 1e-3
    found = mean_curvature(sphere(radius), on_sphere(radius), 1e-3)
    assert_allclose(found, 1 / radius, rtol=1e-5)
    assert_allclose(
        mean_curvature(lambda p: -sphere(radius)(p), on_sphere(radius)), -1 / radius, rtol=1e-5
    )


def test_the_curvature_needs_no_distance_but_a_zero_set():
    found = mean_curvature(lambda p: 7 * ((p**2).sum(axis=1) - 4.0), on_sphere(2.0))
    assert_allclose(found, 0.5, rtol=1e-7)


def test_a_torus_bends_as_its_formula_says():
    major, minor = 2.0, 0.5
    around, about = np.random.default_rng(1).uniform(0, 2 * np.pi, (2, 100))
    radius = major + minor * np.cos(about)
    points = np.stack(
        [radius * np.cos(around), radius * np.sin(around), minor * np.sin(about)], axis=1
    )
    expected = (major + 2 * minor * np.cos(about)) / (2 * minor * radius)
    assert_allclose(mean_curvature(torus(major, minor), points), expected, rtol=1e-4)


def test_the_error_of_the_curvature_falls_with_the_square_of_the_step():
    errors = [
        np.abs(mean_curvature(sphere(1.0), on_sphere(1.0), step) - 1).max()
        for step in (0.1, 0.05, 0.025)
    ]
    assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), 2, atol=0.1)


def test_open_places_are_not_occluded_and_a_corner_is_by_its_formula():
    # Normals over 0.05 are off by at most 0.05^2 / 8 on this sphere, distances by its square
    assert_allclose(occlusion(sphere(1.0), on_sphere(1.0), 0.5), 0, atol=5e-7)
    # A floor z = 0 beside a wall x = 0: a tap at height t is min(t, x) from the shape
    away = np.array([0.05, 0.15, 0.25, 0.6])
    points = np.stack([away, 0 * away, 0 * away], axis=1)
    heights = 0.5 * np.arange(1, 6) / 5
    weights = 0.5 ** np.arange(5) / (2 - 0.5**4)
    expected = (1 - np.minimum(heights, away[:, None]) / heights) @ weights
    found = occlusion(lambda p: np.minimum(p[:, 0], p[:, 2]), points, 0.5)
    assert_allclose(found, expected, atol=1e-9)


def test_a_slab_is_as_thick_as_it_is_and_a_ball_as_its_diameter():
    def slab(points):
        return np.abs(points[:, 2]) - 0.15

    points = np.random.default_rng(2).uniform(-1, 1, (100, 3))
    points[:, 2] = np.where(points[:, 2] > 0, 0.15, -0.15)
    assert_allclose(thickness(slab, points, largest=2.0), 0.3, atol=1e-8)
    # Normals are measured over s, a 24th of the largest: they are off by (s / r)^2 / 8 at
    # most, and the line passes the middle of the ball by as much, in radii; half as much for dives
    bound = 2 * 0.7 * (2.0 / 24 / 0.7) ** 2 * 1.5 / 8
    found = thickness(sphere(0.7), on_sphere(0.7), largest=2.0)
    assert_allclose(found, 1.4, atol=bound)
    assert found.max() <= 1.4 + 1e-12
    # Longer ways end at the largest; points a little off the surface see the same
    assert_allclose(thickness(sphere(0.7), on_sphere(0.7), largest=1.0), 1.0, atol=1e-5)
    assert_allclose(thickness(sphere(0.7), on_sphere(0.71), largest=2.0), 1.4, atol=bound)


def test_a_mesh_is_a_shape_too():
    measure = MeshDistance(box_mesh())
    points = np.array([[0.5, 0.1, 0.2], [0.1, -0.5, -0.1]])
    found = thickness(lambda p: measure(p).distance, points, largest=3.0)
    # The largest balls at these places of a cube touch the nearest of its other sides
    assert_allclose(found, [0.6, 0.8], atol=1e-8)


def test_paint_wears_off_at_edges_and_dirt_gathers_in_corners():
    cube = box(np.array([1.0, 1.0, 1.0]))
    half = abs(float(cube(np.zeros((1, 3)))[0]))
    middle, edge = np.array([[half, 0, 0]]), np.array([[half, half, 0]])
    wear = EdgeWear(distance=cube, paint=(0, 0, 1), bare=(1, 0, 0))
    assert_allclose(wear(middle), [[0, 0, 1, 1]], atol=1e-6)
    assert wear(edge)[0, 0] > 0.5
    dirt = CavityDirt(
        distance=lambda p: np.minimum(p[:, 0], p[:, 2]), clean=(1, 1, 1), dirt=(0, 0, 0)
    )
    shades = dirt(np.array([[0.01, 0, 0], [1.0, 0, 0]]))[:, 0]
    assert shades[0] < 0.2
    assert shades[1] == 1
    thin = Thickness(distance=sphere(0.01), thin=(1, 0, 0), thick=(0, 0, 1))
    assert_allclose(thin(on_sphere(0.01, 3))[:, 0], 1, atol=1e-6)


def test_refusals_say_what_is_wrong():
    with pytest.raises(TextureError, match=r"thick_length is 0.01, thin_length 0.02"):
        Thickness(distance=sphere(1.0), thick_length=0.01)
    with pytest.raises(TextureError, match="largest is 0"):
        thickness(sphere(1.0), np.zeros((1, 3)), largest=0)
    with pytest.raises(TextureError, match=r"an array of shape \(1, 1\) for 7 points"):
        occlusion(lambda p: p[:1, :1], np.zeros((1, 3)), 1.0)
