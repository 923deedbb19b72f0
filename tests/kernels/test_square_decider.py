"""meshsdf.kernels.square_decider and its fallback: never wrong, whatever the numbers."""

from fractions import Fraction

import numpy as np
import pytest

from meshsdf.kernels.square_decider import (
    ANTIDIAGONAL,
    BILINEAR,
    DIAGONAL,
    JOINED,
    MEAN,
    UNDECIDED,
    classify_squares,
)
from meshsdf.surface.square_rows import decide_exactly


def verdicts(squares, level, rule):
    """(n,) verdicts of the kernel for (n, 4) corners a, b, c, d."""
    out = []
    for corners in squares:
        a, b, c, d = corners
        values = np.array([[a, d], [b, c]])
        cases = np.empty((1, 1), np.uint8)
        classify_squares(values, (values < level).astype(np.uint8), level, rule, cases)
        assert cases[0, 0] & 15 in (5, 10)
        out.append(cases[0, 0] >> 4)
    return np.array(out)


def truth(squares, level, rule):
    """(n,) whether the saddle, or the mean, is below the level, in fractions."""
    out = []
    for corners in squares:
        a, b, c, d = (Fraction(float(v)) - Fraction(level) for v in corners)
        value = a + b + c + d if rule == MEAN else (a * c - b * d) / (a + c - b - d)
        out.append(value < 0)
    return np.array(out)


def alternating(rng, n, level):
    """(n, 4) corners in which products and sums tie, nearly tie, or do not."""
    p, q, r = rng.integers(1, 2**26, (3, n)).astype(float)
    squares = np.stack([level + p, level - p * q, level + q * r, level - r], axis=1)
    third = n // 3
    squares[:third] = level + rng.uniform(0.5, 1, (third, 1)) * [1, -1, 1, -1]
    up = rng.choice([-np.inf, np.inf], n)
    squares[::2, 2] = np.nextafter(squares[::2, 2], up[::2])
    turned = rng.random(n) < 0.5
    squares[turned] = np.roll(squares[turned], 1, axis=1)
    inside = squares < level
    good = (inside[:, 0] == inside[:, 2]) & (inside[:, 1] == inside[:, 3])
    return squares[good & (inside[:, 0] != inside[:, 1])]


@pytest.mark.parametrize("rule", [BILINEAR, MEAN])
@pytest.mark.parametrize("level", [0.0, 0.1, -1e6, 3e-7])
def test_ties_and_values_one_unit_off_a_tie_are_decided_as_fractions_decide_them(rule, level):
    squares = alternating(np.random.default_rng(1), 1500, level)
    assert len(squares) > 1000
    expected = truth(squares, level, rule)
    assert expected.any()
    assert not expected.all()
    np.testing.assert_array_equal(verdicts(squares, level, rule), expected)


def test_products_beyond_the_range_of_floats_are_left_open_and_decided_in_fractions():
    rng = np.random.default_rng(2)
    squares = alternating(rng, 300, 0.0)
    n_open = 0
    for scale in (2.0**-1040, 2.0**-300, 2.0**300, 2.0**960):
        scaled = squares * scale
        # The smallest scale rounds values away to zero: what is left is decided
        scaled = scaled[(np.sign(scaled) == np.sign(squares)).all(axis=1)]
        expected = truth(scaled, 0.0, BILINEAR)
        found = verdicts(scaled, 0.0, BILINEAR)
        n_open += np.count_nonzero(found == UNDECIDED)
        exact = np.array([decide_exactly(tuple(s), 0.0, BILINEAR) == JOINED for s in scaled])
        np.testing.assert_array_equal(exact, expected)
        np.testing.assert_array_equal(found[found != UNDECIDED], expected[found != UNDECIDED])
    assert n_open > 100


def test_infinite_corners_count_as_one_number_larger_than_all_others():
    inf, huge = np.inf, 1.7e308
    assert decide_exactly((inf, -inf, inf, -inf), 0.0, BILINEAR) != JOINED  # a tie
    assert decide_exactly((-inf, huge, -inf, huge), 0.0, BILINEAR) == JOINED
    assert decide_exactly((-inf, 1.0, -1.0, huge), 0.0, BILINEAR) == JOINED
    assert decide_exactly((-inf, inf, -1.0, 2.0), 0.0, BILINEAR) != JOINED
    assert decide_exactly((-inf, inf, -2.0, 1.0), 0.0, MEAN) == JOINED
    squares = [(-inf, inf, -1.0, 2.0)]
    assert verdicts(squares, 0.0, BILINEAR) == verdicts(squares, 0.0, MEAN) == UNDECIDED


def test_a_diagonal_joins_what_it_runs_through():
    squares = [(-1.0, 2.0, -1.0, 2.0), (2.0, -1.0, 2.0, -1.0)]
    np.testing.assert_array_equal(verdicts(squares, 0.0, DIAGONAL), [1, 0])
    np.testing.assert_array_equal(verdicts(squares, 0.0, ANTIDIAGONAL), [0, 1])
