"""meshsdf.surface.edge_roots: crossings of many functions, never much slower than bisection."""

import numpy as np
import pytest

from meshsdf.surface.edge_roots import edge_roots

TOLERANCE = 2.0**-41 + 2.0**-52  # of the edge, and rounding of numbers below 1


class Counted:
    """Functions of the fraction, one for each edge; counts how often each is asked."""

    def __init__(self, function, n):
        self.function = function
        self.count = np.zeros(n, int)

    def __call__(self, edge, share):
        self.count[edge] += 1
        return self.function(edge, share)

    def roots(self, level=0.0):
        edge = np.arange(len(self.count))
        ends = (self.function(edge, np.full(len(edge), end)) for end in (0.0, 1.0))
        return edge_roots(self, *ends, level)


def exact_roots(n=2000):
    return np.random.default_rng(1).uniform(1e-6, 1 - 1e-6, n)


def test_smooth_functions_are_solved_to_the_tolerance_in_few_steps():
    root = exact_roots()
    rise = np.random.default_rng(2).choice([-1.0, 1.0], len(root))
    for bend in (0.0, 0.3, 3.0, 10.0):
        smooth = Counted(
            lambda e, t, bend=bend: rise[e] * (np.exp(bend * (t - root[e])) - 1 + t - root[e]),
            len(root),
        )
        assert np.abs(smooth.roots() - root).max() <= TOLERANCE
        assert smooth.count.mean() < 12
        assert smooth.count.max() <= 16


@pytest.mark.parametrize("power", [3, 9, 21])
def test_flat_and_steep_functions_never_take_more_steps_than_bisection_and_six(power):
    root = exact_roots()
    flat = Counted(lambda e, t: np.sign(t - root[e]) * np.abs(t - root[e]) ** power, len(root))
    steep = Counted(
        lambda e, t: np.sign(t - root[e]) * np.abs(t - root[e]) ** (1 / power), len(root)
    )
    step = Counted(lambda e, t: np.where(t < root[e], 1.0, -1.0), len(root))
    for function in (flat, steep, step):
        assert np.abs(function.roots() - root).max() <= TOLERANCE
        assert function.count.max() <= 46
    assert step.count.min() >= 38  # nothing but the sign is known


def test_infinite_values_and_missing_ones_tell_the_side_and_no_more():
    root = exact_roots()
    for above in (np.inf, np.nan):
        function = Counted(lambda e, t, above=above: np.where(t < root[e], -1.0, above), len(root))
        found = function.roots()
        if np.isinf(above):
            assert np.abs(found - root).max() <= TOLERANCE
        assert function.count.max() <= 46
    huge = Counted(lambda e, t: np.where(t < root[e], -1.7e308, 1.7e308), len(root))
    assert np.abs(huge.roots() - root).max() <= TOLERANCE


def test_an_end_or_a_point_at_the_level_is_the_root():
    ends = np.array([3.0, 2.0, 2.0]), np.array([2.0, 3.0, 4.0])
    asked = []

    def line(edge, share):
        asked.extend(edge)
        return ends[0][edge] * (1 - share) + ends[1][edge] * share

    np.testing.assert_array_equal(edge_roots(line, *ends, 3.0), [0.0, 1.0, 0.5])
    assert asked == [2]  # the middle, proposed by the secant
