"""meshsdf.spatial.winding_number: how often a mesh winds around a point."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf.errors import SpatialError
from meshsdf.mesh import Mesh
from meshsdf.mesh.primitives import icosphere
from meshsdf.spatial.winding_number import winding_number

SPHERE = icosphere(1.0, subdivisions=3)


def points_off_the_sphere(seed):
    """Inside (radius below 0.95) and outside (above 1.05); the sag is below 0.005."""
    rng = np.random.default_rng(seed)
    directions = rng.normal(size=(600, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    radius = np.where(np.arange(600) < 300, rng.uniform(0, 0.95, 600), rng.uniform(1.05, 4, 600))
    return radius[:, None] * directions, np.arange(600) < 300


def test_it_is_one_inside_and_zero_outside():
    points, inside = points_off_the_sphere(0)
    assert_allclose(winding_number(SPHERE, points, exact=True), inside, atol=1e-12)
    assert_array_equal(winding_number(SPHERE, points) > 0.5, inside)
    assert_allclose(winding_number(SPHERE, points), inside, atol=0.05)


def test_faces_turned_over_change_its_sign():
    points, inside = points_off_the_sphere(1)
    over = Mesh(SPHERE.vertices, np.ascontiguousarray(SPHERE.faces[:, ::-1]))
    assert_allclose(winding_number(over, points, exact=True), -1.0 * inside, atol=1e-12)


@pytest.mark.parametrize(("scale", "offset"), [(1e-9, 0.0), (1.0, 1e7), (1e9, 0.0)])
def test_size_and_place_do_not_matter(scale, offset):
    points, inside = points_off_the_sphere(2)
    mesh = Mesh(scale * SPHERE.vertices + offset, SPHERE.faces)
    assert_array_equal(winding_number(mesh, scale * points + offset) > 0.5, inside)


def test_half_a_sphere_covers_half_of_the_view_from_its_centre():
    upper = SPHERE.triangles[:, :, 2].mean(axis=1) > 0
    half = Mesh(SPHERE.vertices, SPHERE.faces[upper])
    # By symmetry of the icosphere through the centre, exactly half
    assert_allclose(winding_number(half, np.zeros((1, 3)), exact=True), upper.mean(), atol=1e-2)


def test_nothing_winds_around_nothing():
    empty = Mesh(np.zeros((0, 3)), np.empty((0, 3), np.int32))
    assert_array_equal(winding_number(empty, np.zeros((4, 3))), np.zeros(4))
    assert winding_number(SPHERE, np.empty((0, 3))).shape == (0,)


def test_points_that_are_not_finite_are_counted():
    with pytest.raises(SpatialError, match="1 of 2 points are NaN"):
        winding_number(SPHERE, np.array([[0.0, 0, 0], [np.nan, 0, 0]]))
