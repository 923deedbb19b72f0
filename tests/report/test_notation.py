"""meshsdf.report.notation: few digits, and never on the wrong side of the truth."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from meshsdf.report.notation import count, interval, place, read, written

floats = st.floats(-1e300, 1e300).filter(lambda x: x == 0 or abs(x) > 1e-300)
digits = st.integers(2, 6)


@given(floats, digits)
def test_what_is_written_lies_on_the_asked_side_of_the_truth(value, n):
    below, above = read(written(value, "down", n)), read(written(value, "up", n))
    # Reading back rounds once more, by less than a unit in the last place of a float
    slack = abs(value) * 2.0**-52
    assert below <= value + slack
    assert above >= value - slack
    assert above - below <= 1.0000001 * abs(value) * 10.0 ** (1 - n)
    assert below - slack <= read(written(value, digits=n)) <= above + slack


@given(st.integers(-(10**15), 10**15))
def test_whole_numbers_keep_all_their_digits(n):
    assert read(written(n)) == n


def test_numbers_look_as_people_write_them():
    assert written(0.5) == "0.5"
    assert written(86482) == "86\u202f482"
    assert written(1234.5, digits=5) == "1234.5"
    assert written(-0.00012345) == "−0.0001234"
    assert written(1.23456e-7, "up") == "1.235 × 10⁻⁷"
    assert written(2e9) == "2 × 10⁹"
    assert written(12345.6, "down", 3) == "12\u202f300"
    assert (written(0.0), written(-0.0), written(None)) == ("0", "0", "–")
    assert (written(True), written(False)) == ("yes", "no")


def test_intervals_show_both_ends_and_estimates_say_what_they_are():
    assert interval({"lower": 0.87131, "upper": 0.87139}) == "[0.8713, 0.8714]"
    assert interval({"lower": 0.5, "upper": 0.5}) == "0.5"
    assert interval({"lower": 0.12345, "upper": 0.12345}) == "[0.1234, 0.1235]"
    assert interval({"estimate": 0.25}) == "≈ 0.25"
    assert interval(None) == "–"


def test_places_and_counts():
    assert place([1.0, -0.25, 1e-12]) == "(1, −0.25, 0)"
    assert [count(n, "hole") for n in (0, 1, 2)] == ["no holes", "1 hole", "2 holes"]
    assert count(2, "vertex", "vertices") == "2 vertices"


@pytest.mark.parametrize("value", [float("inf"), float("nan")])
def test_what_is_no_number_is_shown_as_such(value):
    assert written(value) == str(value)
