"""meshsdf.report.mean_estimate: mean and rms without proof, and near the truth all the same."""

import numpy as np
import pytest

from meshsdf import read_mesh
from meshsdf.mesh import Mesh
from meshsdf.mesh.primitives import box_mesh
from meshsdf.report.hausdorff import one_sided_hausdorff
from meshsdf.report.roundtrip import roundtrip
from meshsdf.report.statistics import one_sided_statistics
from meshsdf.report.tolerance import Tolerance

from ..models import model, needs_models
from .trips import turned_box

FEW_PERCENT = 0.05
"""Of mean and rms: two samples per voxel of these surfaces at least, and half of it is proved."""


def both(source: Mesh, target: Mesh) -> tuple[float, float]:
    side = one_sided_hausdorff(source, target, tolerance=1e-2)
    return side.mean, side.rms


def test_the_distance_from_a_line_is_averaged_over_a_square():
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)
    square = Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], np.int32))
    # A needle along y: the distance is |x|, nearest 0 at no corner and far from linear inside
    needle = Mesh(np.array([[0, -9, 0], [0, 9, 0], [0, 9, 0]], float), square.faces[:1])
    mean, rms = both(square, needle)
    assert mean == pytest.approx(0.5, rel=1e-3)
    assert rms == pytest.approx(3**-0.5, rel=1e-3)


def test_a_peak_at_every_corner_of_a_large_face_does_not_stand_for_the_face():
    # The box less a little at its corners: all area but that coincides with the target
    box, low = box_mesh((1.0, 1.0, 1.0)), box_mesh((1.0, 1.0, 0.98))
    mean, rms = both(box, low)
    # 0.01 on top and bottom, and min(h, ...) on strips of the four sides that are 0.01 high
    assert mean == pytest.approx((2 * 0.01 + 8 * 0.01**2 / 2) / 6, rel=0.02)
    assert rms == pytest.approx(((2 * 0.01**2 + 8 * 0.01**3 / 3) / 6) ** 0.5, rel=0.02)


def test_estimates_of_a_round_trip_are_near_what_is_proved():
    plain, proved = (
        roundtrip(turned_box(), [24], details=details).rows[0] for details in (False, True)
    )
    told = [row.to_json()["forward"] for row in (plain, proved)]
    assert [side["mean_is_estimate"] for side in told] == [True, False]
    for name in ("mean", "rms"):
        bounds = told[1][f"{name}_bounds"]
        assert bounds["lower"] <= told[1][name] <= bounds["upper"]
        assert told[0][name] == pytest.approx(told[1][name], rel=FEW_PERCENT)


@needs_models
@pytest.mark.parametrize("name", ["fandisk.obj", "cheburashka.obj"])
def test_estimates_on_real_models_are_near_what_is_proved(name):
    mesh = read_mesh(model(name))
    row = roundtrip(mesh, [96]).rows[0]
    proved = one_sided_statistics(mesh, row.surface, tolerance=Tolerance(relative=0.04))
    for kind in ("mean", "rms"):
        estimate, span = getattr(row.comparison.forward, kind), getattr(proved, kind)
        assert span.lower * (1 - FEW_PERCENT) <= estimate <= span.upper * (1 + FEW_PERCENT)
