"""meshsdf.implicit.csg: what booleans of shapes are, and how exact they remain."""

import numpy as np
import pytest

from meshsdf.errors import ImplicitError
from meshsdf.implicit import (
    Exactness,
    box,
    complement,
    difference,
    from_function,
    gyroid,
    intersection,
    plane,
    sphere,
    torus,
    union,
)
from tests.implicit.exactness import (
    assert_exact,
    assert_gradient,
    assert_one_lipschitz,
    random_points,
)

X = np.array([1.0, 0.0, 0.0])
EXACT, BOUND, SIGN = Exactness.EXACT, Exactness.BOUND, Exactness.SIGN


def test_inside_is_inside_any_all_or_the_first_and_no_other():
    a, b, c = sphere(1.5, -0.7 * X), box(np.full(3, 2.0), 0.7 * X), torus(1.2, 0.5)
    points = random_points(size=2.5)
    in_a, in_b, in_c = (shape(points) < 0 for shape in (a, b, c))
    np.testing.assert_array_equal(union(a, b, c)(points) < 0, in_a | in_b | in_c)
    np.testing.assert_array_equal(intersection(a, b, c)(points) < 0, in_a & in_b & in_c)
    np.testing.assert_array_equal(difference(a, b, c)(points) < 0, in_a & ~in_b & ~in_c)
    np.testing.assert_array_equal(complement(a)(points) < 0, ~in_a)


def test_booleans_of_bounds_are_bounds_with_their_own_gradient():
    a, b, c = sphere(1.5, -0.7 * X), box(np.full(3, 2.0), 0.7 * X), gyroid(1.7)
    for build in (union, intersection, difference):
        shape = build(a, b, c)
        assert shape.exactness is BOUND
        assert_one_lipschitz(shape, random_points())
        assert_gradient(shape, random_points())


@pytest.mark.parametrize(
    "shape",
    [
        union(sphere(1.0, -1.5 * X), box(np.ones(3), 1.5 * X), torus(1.0, 0.3, 3 * X[[1, 1, 0]])),
        difference(sphere(2.0), sphere(0.7, 0.5 * X)),
        difference(sphere(2.0), sphere(0.5, 0.8 * X), torus(0.5, 0.2, -0.8 * X)),
        difference(sphere(1.0, -1.5 * X), sphere(1.0, 1.5 * X)),
        complement(torus(1.0, 0.3)),
        union(sphere(1.3)),
    ],
)
def test_what_is_said_to_be_exact_is(shape):
    assert shape.exactness is EXACT
    assert_exact(shape, random_points())


def test_what_is_not_exact_is_not_said_to_be():
    lens = np.sqrt(1 - 0.75**2)  # radius of the circle where spheres 1.5 apart meet
    near, far = sphere(1.0), sphere(1.0, 1.5 * X)
    both = union(near, far)
    assert both.exactness is BOUND
    np.testing.assert_allclose(-both(0.75 * X[None]), 0.25)  # the circle is nearest, at ``lens``
    assert -both(0.75 * X[None])[0] < lens - 0.4
    common = intersection(near, far)
    assert common.exactness is BOUND
    above = np.array([[0.75, 2.0, 0.0]])
    assert common(above)[0] < 2.0 - lens - 0.05  # the distance to the circle
    bitten = difference(near, far)
    assert bitten.exactness is BOUND
    assert bitten(above)[0] < 2.0 - lens - 0.05
    assert difference(near, sphere(0.7, 0.5 * X)).exactness is BOUND  # it sticks out
    # Boxes that share a face: the face is inside the union, yet the value is zero there
    blocks = union(box(np.ones(3)), box(np.ones(3), X))
    assert blocks.exactness is BOUND
    assert blocks(0.5 * X[None]) == 0


def test_a_shape_known_by_its_sign_makes_everything_so():
    sign = from_function(lambda p: np.sign(p[:, 0]), SIGN, box=sphere(0.1).box)
    apart = sphere(1.0, 9 * X)
    for shape in (union(apart, sign), intersection(apart, sign), difference(apart, sign)):
        assert shape.exactness is SIGN
    assert complement(sign).exactness is SIGN


def test_boxes_hold_what_is_inside():
    a, b = sphere(1.0), sphere(1.0, 1.5 * X)
    np.testing.assert_array_equal(union(a, b).box.upper, [2.5, 1, 1])
    np.testing.assert_array_equal(union(a, b).box.lower, [-1, -1, -1])
    common = intersection(a, b, plane(X)).box
    np.testing.assert_array_equal([common.lower, common.upper], [[0.5, -1, -1], [1, 1, 1]])
    np.testing.assert_array_equal(difference(a, b).box.upper, [1, 1, 1])
    assert union(a, gyroid(1.0)).box is None
    assert intersection(gyroid(1.0), plane(X)).box is None
    assert complement(a).box is None
    empty = intersection(a, sphere(1.0, 9 * X)).box
    assert (empty.size >= 0).all()


def test_no_shapes_are_refused():
    for build in (union, intersection):
        with pytest.raises(ImplicitError, match="there are no shapes"):
            build()
