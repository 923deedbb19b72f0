"""meshsdf.implicit.primitives: distances that are distances."""

import numpy as np
import pytest

from meshsdf.errors import ImplicitError
from meshsdf.implicit import Exactness, box, gyroid, plane, sphere, torus
from tests.implicit.exactness import (
    assert_exact,
    assert_gradient,
    assert_one_lipschitz,
    random_points,
)

CENTER = np.array([0.3, -0.2, 0.5])
SHAPES = {
    "sphere": sphere(1.3, CENTER),
    "box": box(np.array([1.0, 2.0, 3.0]), CENTER),
    "torus": torus(1.5, 0.4, CENTER),
    "plane": plane(np.array([1.0, -2.0, 2.0]), 0.7),
}


@pytest.mark.parametrize("name", SHAPES)
def test_values_are_distances_and_gradients_point_away(name):
    shape = SHAPES[name]
    assert shape.exactness is Exactness.EXACT
    points = random_points()
    values = shape(points)
    assert values.min() < 0 < values.max()
    assert_exact(shape, points)
    assert_gradient(shape, points)


def test_values_where_they_are_known():
    at = np.array([[0.0, 0, 0], [3, 4, 0], [0, 0, 2]])
    np.testing.assert_array_equal(sphere(2.0)(at), [-2, 3, 0])
    np.testing.assert_array_equal(box(np.array([2.0, 2, 4]))(at), [-1, np.hypot(2, 3), 0])
    np.testing.assert_allclose(torus(4.0, 1.0)(at), [3, 0, np.sqrt(20) - 1], rtol=1e-15)
    np.testing.assert_array_equal(plane(np.array([0.0, 0, 5]), 5)(at), [-1, -1, 1])


@pytest.mark.parametrize("name", ["sphere", "box", "torus"])
def test_the_box_touches_the_surface_and_holds_it(name):
    shape = SHAPES[name]
    points = random_points(20_000)
    on_surface = points - shape(points)[:, None] * shape.gradient(points)
    found = on_surface.min(axis=0), on_surface.max(axis=0)
    assert (found[0] >= shape.box.lower - 1e-12).all()
    assert (found[1] <= shape.box.upper + 1e-12).all()
    np.testing.assert_allclose(found, [shape.box.lower, shape.box.upper], atol=0.05)
    assert SHAPES["plane"].box is None


def test_a_gyroid_is_a_bound_with_the_steepest_slope_that_is_one():
    shape = gyroid(2.5)
    assert shape.exactness is Exactness.BOUND
    assert shape.box is None
    points = random_points()
    assert_one_lipschitz(shape, points)
    assert_gradient(shape, points)
    assert np.linalg.norm(shape.gradient(points), axis=1).max() <= 1 + 1e-12
    np.testing.assert_allclose(np.linalg.norm(shape.gradient(np.zeros((1, 3)))), 1, rtol=1e-15)
    shifted = points + np.array([2.5, -5.0, 7.5])
    np.testing.assert_allclose(shape(shifted), shape(points), atol=1e-13)


def test_where_many_points_are_nearest_one_direction_is_given():
    assert sphere(1.0).gradient(np.zeros((1, 3))).tolist() == [[0, 0, 0]]
    assert torus(2.0, 0.5).gradient(np.array([[0.0, 0, 3]])).tolist() == [[0, 0, 1]]
    assert torus(2.0, 0.5).gradient(np.array([[2.0, 0, 0]])).tolist() == [[0, 0, 0]]
    assert np.linalg.norm(box(np.ones(3)).gradient(np.zeros((1, 3)))) == 1


def test_what_the_caller_gave_is_copied():
    center = np.zeros(3)
    ball = sphere(1.0, center)
    center[0] = 9
    assert ball(np.zeros((1, 3))) == -1


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: sphere(0), "radius is 0"),
        (lambda: sphere(np.nan), "radius is nan"),
        (lambda: box(np.array([1.0, -1, 1])), r"size is -1\.0"),
        (lambda: torus(1.0, 1.0), r"minor_radius is 1\.0, major_radius only 1\.0"),
        (lambda: torus(np.inf, 1.0), "major_radius is inf"),
        (lambda: plane(np.zeros(3)), r"normal is 0\.0"),
        (lambda: gyroid(-2), "period is -2"),
    ],
)
def test_lengths_must_be_above_zero(build, message):
    with pytest.raises(ImplicitError, match=message):
        build()
