"""meshsdf.report.enclosure: a number between two others."""

import math

import pytest

from meshsdf.errors import ReportError
from meshsdf.report.enclosure import Enclosure, ceil_digits, floor_digits


def test_both_ends_belong_to_it():
    interval = Enclosure(1.0, 2.0)
    assert interval.contains(1.0)
    assert interval.contains(2.0)
    assert not interval.contains(math.nextafter(2.0, 3.0))
    assert interval.width == 1.0
    assert interval.middle == 1.5


def test_another_unit_scales_both_ends():
    assert Enclosure(1.0, 2.0).scaled(0.5) == Enclosure(0.5, 1.0)


def test_the_larger_of_two_numbers_is_at_least_either_lower_end():
    assert Enclosure(1.0, 5.0).largest(Enclosure(2.0, 3.0)) == Enclosure(2.0, 5.0)


@pytest.mark.parametrize(("lower", "upper"), [(2.0, 1.0), (math.nan, 1.0), (0.0, math.nan)])
def test_an_empty_enclosure_is_refused(lower, upper):
    with pytest.raises(ReportError, match="nothing lies between"):
        Enclosure(lower, upper)


def test_printed_ends_still_enclose_the_truth():
    assert str(Enclosure(0.12345678, 0.12345712)) == "[0.123456, 0.123458]"
    for value in (0.1, 1 / 3, 2 / 3, 1e-15 / 7, 12345678.9, 0.0):
        assert float(floor_digits(value)) <= value <= float(ceil_digits(value))
