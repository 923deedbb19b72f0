"""meshsdf.surface.rounded: bounds hold, and what they leave open is decided by whole numbers."""

from fractions import Fraction

import numpy as np

from meshsdf.surface.rounded import (
    Rounded,
    above_ties,
    rounded_differences,
    sign,
    whole_differences,
)


def expression(x):
    """A polynomial of degree 4 that mostly cancels where x[3] is near x[0] x[1] / x[2]."""
    flat = x[0] * x[1] - x[2] * x[3]
    return flat * flat - (x[0] + x[1]) * x[2] * (x[3] - x[0])


def test_the_truth_is_never_farther_than_the_bound():
    rng = np.random.default_rng(0)
    values = rng.normal(size=(4, 500)) * 10.0 ** rng.integers(-30, 30, (4, 500))
    values[3, :250] = values[0, :250] * values[1, :250] / values[2, :250]
    rounded = expression([Rounded(v, np.zeros(500)) for v in values])
    exact = [expression([Fraction(float(v)) for v in column]) for column in values.T]
    for value, error, truth in zip(rounded.value, rounded.error, exact, strict=True):
        assert abs(Fraction(float(value)) - truth) <= Fraction(float(error))
    signs = sign(rounded)
    assert all(s in (0, (t > 0) - (t < 0)) for s, t in zip(signs.tolist(), exact, strict=True))
    assert (signs[250:] != 0).mean() > 0.9  # the bound is of use


def test_whole_numbers_keep_every_ratio_and_every_tie():
    values = np.array([[0.1, -0.1, 0.0, 3e-320], [1e300, 0.3, np.inf, -0.3]])
    for level in (0.0, 0.1, 1e-5):
        whole = whole_differences(values, level)
        flat = [n for array in whole for n in array]
        exact = [Fraction(float(v)) - Fraction(level) if np.isfinite(v) else -Fraction(level)
                 for v in values.T.ravel()]  # fmt: skip
        (scale,) = {n / e for n, e in zip(map(Fraction, flat), exact, strict=True) if e}
        assert scale > 0
        assert scale.numerator & (scale.numerator - 1) == 0
        assert scale.denominator == 1


def test_scaled_differences_are_as_near_the_exact_ones_as_they_say():
    values = np.random.default_rng(2).normal(size=(300, 4))
    values[0] = 5.0, -3.0, 1e-200, 1e200
    values[1] = 1e-300, 2e-300, -1e-300, 0.0
    for level in (0.0, 1.0 / 3):
        columns = rounded_differences(values, level)
        for row, cell in enumerate(values.tolist()):
            scale = Fraction(2) ** -int(np.frexp(max(*map(abs, cell), level))[1])
            for value, column in zip(cell, columns, strict=True):
                exact = scale * (Fraction(value) - Fraction(level))
                found = Fraction(float(column.value[row]))
                assert abs(found) < 2
                assert abs(found - exact) <= Fraction(float(column.error[row]))


def test_a_tie_becomes_positive_and_nothing_else_changes_sign():
    rng = np.random.default_rng(1)
    values = rng.integers(-3, 4, (4, 4000)).astype(float)
    whole = whole_differences(values.T, 0.0)

    def saddle(x):
        return x[0] * x[1] - x[2] * x[3]

    plain, moved = sign(saddle(whole)), sign(saddle(above_ties(whole)))
    assert np.array_equal(plain[plain != 0], moved[plain != 0])
    a, b, c, d = values
    slope = a + b - c - d  # the first derivative by what is added to all four
    tied = (plain == 0) & (slope != 0)
    assert tied.sum() > 100
    assert np.array_equal(moved[tied], np.sign(slope[tied]))
