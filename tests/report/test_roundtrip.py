"""meshsdf.report.roundtrip: one row per resolution and method, with details where asked."""

import numpy as np
import pytest

from meshsdf.errors import ReportError
from meshsdf.mesh import Mesh
from meshsdf.mesh.measures import face_areas
from meshsdf.mesh.primitives import icosphere
from meshsdf.report.error_budget import error_budget
from meshsdf.report.roundtrip import roundtrip
from meshsdf.report.words import roundtrip_table
from meshsdf.sdf import mesh_to_band
from meshsdf.spatial.closest_point import ClosestPoint
from meshsdf.surface import marching_cubes

from .trips import facts, turned_box

BALL = icosphere(subdivisions=2)


def test_details_are_measured_only_where_asked_and_of_the_finest_row():
    plain = roundtrip(turned_box(), [12]).rows[0]
    coarse, fine = facts("box")[0].rows
    assert plain.details is None
    assert set(plain.seconds) == {"distance", "surface", "compare"}
    assert coarse.details.forward_statistics.mean.contains(mean_of(coarse.surface))
    assert coarse.details.budget is None
    assert fine.details.forward_statistics.mean.contains(mean_of(fine.surface))
    assert fine.details.sharp_edges.n_edges == 12
    assert set(fine.seconds) == {"distance", "surface", "compare", "details"}
    assert plain.comparison.distance == fine.comparison.distance
    # What a report needs beside is no part of the time told
    assert fine.trip_seconds == pytest.approx(sum(fine.seconds.values()) - fine.seconds["details"])


def test_the_table_prints_what_is_proved_and_marks_estimates():
    plain = roundtrip(turned_box(), [12])
    proved = facts("box")[0]
    row = proved.rows[1].comparison
    for name in ("mean", "rms"):
        assert getattr(row.forward_statistics, name).contains(getattr(row.forward, name))
    assert roundtrip_table(plain).count("≈") == 2
    assert "≈" not in roundtrip_table(proved)


def mean_of(surface: Mesh) -> float:
    """The mean distance of the box to a surface, by many even samples of each face."""
    box = turned_box()
    u, v = np.meshgrid(*2 * [(np.arange(120) + 0.5) / 120])
    # Folding the square's upper half onto its lower one leaves samples even over the triangle
    u, v = np.where(u + v > 1, 1 - u, u).ravel(), np.where(u + v > 1, 1 - v, v).ravel()
    weights = np.column_stack([1 - u - v, u, v])
    points = np.einsum("kc,mcx->mkx", weights, box.triangles).reshape(-1, 3)
    distances = ClosestPoint(surface)(points).distance.reshape(box.n_faces, -1)
    areas = face_areas(box)
    return float(areas @ distances.mean(axis=1) / areas.sum())


def test_the_budget_is_that_of_the_band_and_surface_of_the_row():
    fine = facts("box")[0].rows[1]
    band = mesh_to_band(turned_box(), resolution=12)
    tolerance = 0.01 * band.voxel_size
    again = error_budget(turned_box(), band, marching_cubes(band), tolerance=tolerance)
    assert fine.details.budget.to_json() == again.to_json()
    # Both steps together cannot lose less than the round trip did
    steps = again.interpolation.upper + again.extraction.upper
    assert fine.comparison.distance.lower <= steps


def test_nothing_that_came_back_has_no_details():
    row = facts("plate", (6, 7))[0].rows[0]
    assert row.comparison is None
    assert row.details is None
    assert not row.is_within(1e9)
    assert row.to_json()["hausdorff"] is None


def test_every_method_has_a_row_for_every_resolution():
    trip = roundtrip(BALL, [8, 16], methods=("marching-cubes", "dual-contouring"))
    found = [(row.resolution, row.method) for row in trip.rows]
    assert found == [
        (8, "marching-cubes"),
        (8, "dual-contouring"),
        (16, "marching-cubes"),
        (16, "dual-contouring"),
    ]
    assert trip.last("dual-contouring") is trip.rows[3]
    assert trip.order("marching-cubes") > 0.5
    assert roundtrip(BALL, [8]).order("marching-cubes") is None


@pytest.mark.parametrize("lacking", ["resolution", "method"])
def test_nothing_asked_for_is_refused(lacking):
    options = {"methods": ()} if lacking == "method" else {}
    with pytest.raises(ReportError, match=f"no {lacking} given"):
        roundtrip(BALL, [] if lacking == "resolution" else [8], **options)
