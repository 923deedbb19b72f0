"""meshsdf.implicit.implicit: what a plain function becomes, and gradients by differences."""

import numpy as np
import pytest

from meshsdf.box import Box
from meshsdf.errors import ImplicitError
from meshsdf.implicit import (
    Exactness,
    Implicit,
    box,
    central_differences,
    complement,
    from_function,
    gyroid,
    plane,
    sphere,
    torus,
    union,
)


def points_around(n=500, size=3.0, seed=1):
    return np.random.default_rng(seed).uniform(-size, size, (n, 3))


def test_what_is_certain_of_several_is_the_least():
    assert min(Exactness.EXACT, Exactness.BOUND) is Exactness.BOUND
    assert min(Exactness.SIGN, Exactness.BOUND) is Exactness.SIGN


def test_every_shape_and_whatever_has_the_four_members_is_an_implicit():
    shapes = [sphere(1.0), box(np.ones(3)), torus(2.0, 0.5), plane(np.ones(3)), gyroid(1.0)]
    shapes += [union(*shapes), complement(shapes[0])]
    for shape in shapes:
        assert isinstance(shape, Implicit)

    class Own:
        exactness = Exactness.SIGN
        box = None

        def __call__(self, points):
            return points[:, 0]

        def gradient(self, points):
            return np.ones_like(points)

    assert isinstance(Own(), Implicit)
    assert not isinstance(np.sin, Implicit)


def test_differences_are_exact_for_quadratic_functions_and_of_order_two_for_others():
    points = points_around()
    matrix = np.array([[1.0, 2, 0], [2, -1, 3], [0, 3, 0.5]])
    slope = central_differences(
        lambda p: np.einsum("ni,ij,nj->n", p, matrix, p), points, np.full(len(points), 0.25)
    )
    np.testing.assert_allclose(slope, 2 * points @ matrix, atol=1e-12)
    errors, steps = [], [0.1, 0.05, 0.025, 0.0125]
    for step in steps:
        found = central_differences(lambda p: np.exp(p[:, 0]) * np.sin(p[:, 1]), points, step)
        x, y, _ = points.T
        expected = np.exp(x)[:, None] * np.stack([np.sin(y), np.cos(y), 0 * y], axis=1)
        errors.append(np.abs(found - expected).max())
        # Third derivatives along the axes are at most exp(3 + step)
        assert errors[-1] <= step**2 / 6 * np.exp(3 + step) + 1e-12
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(2, abs=0.05)


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("has_box", [True, False])
def test_gradients_without_a_derivative_are_right_at_any_scale(scale, has_box):
    ball = sphere(scale)
    plain = from_function(ball, Exactness.EXACT, box=ball.box if has_box else None)
    points = scale * points_around()
    away = np.linalg.norm(points, axis=1) > 0.3 * scale
    # The step is at most 5e-6 of 3 scale, the third derivative at most 3 / (0.3 scale)^2, and
    # values near 4 scale are right to 1e-15 of it
    error = (1.5e-5) ** 2 / 6 * 3 / 0.09 + 4e-15 / 4.8e-6 / 0.03
    difference = plain.gradient(points[away]) - ball.gradient(points[away])
    assert np.abs(difference).max() <= error
    at_origin = from_function(lambda p: p @ [1.0, 2.0, 3.0], Exactness.SIGN)
    np.testing.assert_allclose(at_origin.gradient(np.zeros((1, 3))), [[1, 2, 3]], rtol=1e-9)


def test_a_gradient_that_is_given_is_used():
    given = from_function(
        lambda p: p[:, 0], Exactness.EXACT, gradient=lambda p: np.full((len(p), 3), 7.0)
    )
    np.testing.assert_array_equal(given.gradient(np.zeros((2, 3))), np.full((2, 3), 7.0))


def test_no_points_have_no_values_and_no_gradients():
    nothing = np.empty((0, 3))
    for shape in (sphere(1.0), box(np.ones(3)), torus(2.0, 0.5), gyroid(1.0), plane(np.ones(3))):
        for one in (shape, union(shape, sphere(1.0)), from_function(shape, Exactness.SIGN)):
            assert one(nothing).shape == (0,)
            assert one.gradient(nothing).shape == (0, 3)


def test_numbers_of_any_kind_become_float64():
    sign = from_function(lambda p: p[:, 0] > 0, Exactness.SIGN)
    assert sign(np.array([[1.0, 0, 0], [-1, 0, 0]])).tolist() == [1.0, 0.0]
    single = from_function(lambda p: p[:, 0].astype(np.float32), Exactness.SIGN)
    assert single(np.ones((2, 3))).dtype == np.float64


def test_another_shape_or_no_numbers_are_refused():
    around = Box(np.zeros(3), np.ones(3))
    wrong = from_function(lambda p: p, Exactness.SIGN, box=around)
    with pytest.raises(ImplicitError, match=r"function gave float64 of the shape \(4, 3\) for 4"):
        wrong(np.ones((4, 3)))
    with pytest.raises(ImplicitError, match=r"gave complex128 of the shape \(4,\)"):
        from_function(lambda p: 1j * p[:, 0], Exactness.SIGN)(np.ones((4, 3)))
    slope = from_function(lambda p: p[:, 0], Exactness.SIGN, gradient=lambda p: p[:, 0])
    with pytest.raises(ImplicitError, match=r"gradient gave float64 of the shape \(4,\)"):
        slope.gradient(np.ones((4, 3)))
