"""meshsdf.report.compare: two meshes side by side, for programs and for people."""

import json

import numpy as np
import pytest

from meshsdf.errors import ReportError
from meshsdf.mesh import Mesh
from meshsdf.mesh.primitives import box_mesh, icosphere
from meshsdf.report.compare import compare
from meshsdf.report.hausdorff import hausdorff

SMALL, LARGE = box_mesh((1, 1, 1)), box_mesh((1.2, 1.2, 1.2))
EMPTY = Mesh(np.zeros((3, 3)), np.empty((0, 3), np.int32))


def test_two_boxes_differ_by_their_corners_and_their_measures():
    found = compare(SMALL, LARGE, voxel_size=0.05)
    corner = 0.1 * np.sqrt(3)
    assert found.distance.contains(corner)
    assert found.forward.distance.contains(0.1)
    assert found.in_voxels(0.1) == pytest.approx(2)
    assert found.in_percent(0.1) == pytest.approx(10 / np.sqrt(3))
    assert (found.before.volume, found.after.volume) == pytest.approx((1, 1.728))
    assert (found.before.area, found.after.area) == pytest.approx((6, 6 * 1.44))
    assert found.before.euler_number == found.after.euler_number == 2
    assert found.before.n_components == 1
    assert found.before.is_watertight


def test_an_open_mesh_has_no_volume():
    sphere = icosphere(subdivisions=1)
    found = compare(sphere, Mesh(sphere.vertices, sphere.faces[1:]))
    assert found.before.volume is not None
    assert found.after.volume is None
    assert not found.after.is_watertight
    assert json.loads(json.dumps(found.to_json()))["measures"]["b"]["volume"] is None


def test_json_holds_plain_numbers_and_the_same_ones():
    found = compare(SMALL, LARGE, voxel_size=0.05)
    told = json.loads(json.dumps(found.to_json(), allow_nan=False))
    assert told["hausdorff"] == {"lower": found.distance.lower, "upper": found.distance.upper}
    assert told["forward"]["mean"] == found.forward.mean
    assert told["forward"]["witness"] == found.forward.witness.tolist()
    assert told["backward"]["rms"] == found.backward.rms
    assert told["hausdorff_voxels"]["upper"] == pytest.approx(20 * found.distance.upper)
    assert told["measures"]["a"]["n_faces"] == 12
    without = compare(SMALL, LARGE).to_json()
    assert "voxel_size" not in without
    assert "hausdorff_voxels" not in without


def test_the_table_names_every_row_in_every_unit():
    table = compare(SMALL, LARGE, voxel_size=0.05).describe()
    for word in ("world units", "% of diagonal", "voxels", "at most", "mean", "rms", "Euler"):
        assert word in table
    assert "3.4641" in table  # 0.1 sqrt(3) in voxels of 0.05
    assert "voxels" not in compare(SMALL, LARGE).describe()
    assert "met its limit" not in table


def test_it_is_the_hausdorff_distance_with_the_same_tolerance():
    found = compare(SMALL, LARGE, tolerance=1e-3)
    assert found.distance == hausdorff(SMALL, LARGE, tolerance=1e-3).distance


def test_one_point_has_no_percentages():
    point = Mesh(np.zeros((1, 3)), np.zeros((1, 3), np.int32))
    found = compare(point, SMALL)
    assert found.in_percent(1.0) is None
    assert found.to_json()["hausdorff_percent_of_diagonal"] is None
    assert "-" in found.describe()


@pytest.mark.parametrize(("a", "b", "name"), [(EMPTY, SMALL, "A"), (SMALL, EMPTY, "B")])
def test_a_mesh_without_faces_is_refused(a, b, name):
    with pytest.raises(ReportError, match=f"mesh {name} has no faces, so nothing can be close"):
        compare(a, b)


def test_a_voxel_size_of_zero_is_refused():
    with pytest.raises(ReportError, match="the voxel size is 0"):
        compare(SMALL, LARGE, voxel_size=0.0)


def test_statistics_stand_in_place_of_the_estimates():
    found = compare(SMALL, LARGE)
    for side, statistics in (
        (found.forward, found.forward_statistics),
        (found.backward, found.backward_statistics),
    ):
        assert side.mean == statistics.mean.middle
        assert side.rms == statistics.rms.middle
    told = json.loads(json.dumps(found.to_json(), allow_nan=False))["forward"]
    assert told["mean_bounds"]["lower"] <= told["mean"] <= told["mean_bounds"]["upper"]
    assert told["rms_bounds"]["lower"] <= told["rms"] <= told["rms_bounds"]["upper"]
    assert told["mean_is_estimate"] is False
    assert list(told["percentiles"]) == ["50", "90", "95", "99"]
    # All of the small box is 0.1 inside the large one
    assert found.forward_statistics.mean.contains(0.1)
    assert found.forward_statistics.signed_mean.contains(-0.1)
    assert found.forward_statistics.volume_difference == pytest.approx(1 - 1.728)


def test_without_statistics_the_means_are_estimates():
    found = compare(SMALL, LARGE, statistics=False)
    assert found.forward_statistics is None
    assert found.forward.mean == pytest.approx(0.1)
    assert "mean_bounds" not in found.to_json()["forward"]
    assert found.to_json()["forward"]["mean_is_estimate"]
    line = next(line for line in found.describe().splitlines() if line.startswith("A to B, mean"))
    assert "≈ 0.1" in line


def test_genus_and_holes_are_counted():
    found = compare(SMALL, Mesh(LARGE.vertices, LARGE.faces[1:]), statistics=False)
    assert (found.before.genus, found.before.n_boundary_loops) == (0, 0)
    assert (found.after.genus, found.after.n_boundary_loops) == (None, 1)
