"""meshsdf.report.tolerance: how wide an interval may stay."""

import numpy as np
import pytest

from meshsdf.errors import ReportError
from meshsdf.report.tolerance import Tolerance


def test_the_larger_of_a_length_and_a_share_counts():
    tolerance = Tolerance(absolute=0.01, relative=0.1)
    assert tolerance.width(0.05) == 0.01
    assert tolerance.width(1.0) == 0.1
    assert Tolerance.in_voxels(0.5, np.float64(0.25)).width(100.0) == 0.125
    assert Tolerance.of(2).width(1.0) == 2.0
    assert Tolerance.of(tolerance) is tolerance


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({}, "the tolerance is 0"),
        ({"absolute": -1.0}, "the tolerance is -1"),
        ({"relative": float("nan")}, "the tolerance is nan"),
        ({"absolute": 1.0, "relative": float("inf")}, "the tolerance is inf"),
    ],
)
def test_what_no_interval_can_meet_is_refused(arguments, words):
    with pytest.raises(ReportError, match=words):
        Tolerance(**arguments)
    with pytest.raises(ReportError, match="the tolerance is 0"):
        Tolerance.in_voxels(0.0, 1.0)
