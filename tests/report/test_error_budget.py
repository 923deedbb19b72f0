"""meshsdf.report.error_budget: where a round trip loses, between bounds that hold."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import KDTree

from meshsdf.errors import ReportError
from meshsdf.mesh import Mesh
from meshsdf.mesh.primitives import box_mesh, icosphere, tetrahedron
from meshsdf.report.error_budget import ErrorBudget, error_budget
from meshsdf.report.hausdorff import hausdorff
from meshsdf.sdf import mesh_to_band
from meshsdf.spatial import ClosestPoint
from meshsdf.surface import dual_contouring, marching_cubes
from tests.oracles import closest_by_brute_force
from tests.report.zero_samples import dense_values, fine_roots, samples_of, turned

SIDES = ("zero_set_to_mesh", "mesh_to_zero_set", "surface_to_zero_set", "zero_set_to_surface")
EMPTY = Mesh(np.zeros((3, 3)), np.empty((0, 3), np.int32))


@pytest.mark.parametrize(
    ("mesh", "method"),
    [
        (icosphere(subdivisions=2), "marching cubes"),
        (turned(box_mesh(), 2), "dual contouring"),
        (turned(tetrahedron(), 5), "marching cubes"),
    ],
)
def test_the_parts_add_up_to_no_less_than_the_whole(mesh, method):
    band = mesh_to_band(mesh, resolution=10)
    surface = marching_cubes(band) if method == "marching cubes" else dual_contouring(band, mesh)
    found = error_budget(mesh, band, surface)
    whole = hausdorff(mesh, surface)
    there = found.mesh_to_zero_set.upper + found.zero_set_to_surface.upper
    back = found.surface_to_zero_set.upper + found.zero_set_to_mesh.upper
    assert whole.forward.distance.lower <= there
    assert whole.backward.distance.lower <= back
    # And no part is more than the whole and the other part
    assert found.mesh_to_zero_set.lower <= (
        whole.forward.distance.upper + found.surface_to_zero_set.upper
    )
    assert found.zero_set_to_mesh.lower <= (
        found.zero_set_to_surface.upper + whole.backward.distance.upper
    )
    assert found.is_within_tolerance
    for name in SIDES:
        assert getattr(found, name).width <= 0.0101 * band.voxel_size


@pytest.mark.parametrize("body", [turned(box_mesh(), 3), tetrahedron()])
def test_no_sample_is_beyond_the_upper_ends_and_they_nearly_reach_the_lower(body):
    band = mesh_to_band(body, resolution=8)
    surface = marching_cubes(band)
    found = error_budget(body, band, surface)
    values, low = dense_values(band)
    roots = band.voxel_size * (fine_roots(values, 4) + low) + band.translation
    spacing = np.sqrt(3) / 4 * band.voxel_size
    tree = KDTree(roots)
    for mesh, to_zero, from_zero in (
        (body, found.mesh_to_zero_set, found.zero_set_to_mesh),
        (surface, found.surface_to_zero_set, found.zero_set_to_surface),
    ):
        few = roots[:: len(roots) // 300 + 1]
        seen = closest_by_brute_force(few, mesh.triangles).max()
        assert seen <= from_zero.upper + 1e-12
        assert from_zero.lower <= ClosestPoint(mesh).distances(roots).distance.max() + spacing
        seen = tree.query(samples_of(mesh, 20_000, 0))[0].max()
        assert seen - spacing <= to_zero.upper
        assert to_zero.lower <= seen + 0.1 * band.voxel_size


def test_a_sphere_is_interpolated_to_second_order():
    # |F - f| <= h^2 / 8 times the sum of the second derivatives, 2 / rho, rho > 1 - sqrt(3) h
    ball = icosphere(subdivisions=4)
    sag = 1 - np.linalg.norm(ball.triangles.mean(axis=1), axis=1).min()
    sizes, middles = (0.25, 0.125), []
    for h in sizes:
        band = mesh_to_band(ball, voxel_size=h)
        found = error_budget(ball, band, marching_cubes(band), tolerance=4e-3 * h)
        most = h**2 / (4 * (1 - np.sqrt(3) * h))
        assert found.interpolation.lower <= most + 2 * sag
        middles.append(found.interpolation.middle)
        assert found.extraction.upper < h**2
    assert 3.0 < middles[0] / middles[1] < 5.0


def test_at_a_sharp_edge_the_mesh_is_off_by_a_part_of_a_voxel_at_any_size():
    # Both lattices meet the cube in the same way, so the distance is the same part of a voxel
    shares = []
    for h in (0.25, 0.125):
        band = mesh_to_band(box_mesh(), voxel_size=h, translation=np.full(3, 0.3 * h))
        found = error_budget(box_mesh(), band, marching_cubes(band))
        shares.append(found.mesh_to_zero_set.scaled(1 / h))
        assert found.mesh_to_zero_set.lower > found.zero_set_to_mesh.upper
    assert 0.1 < shares[0].lower < 1
    assert shares[0].lower <= shares[1].upper
    assert shares[1].lower <= shares[0].upper


def test_samples_of_half_precision_move_the_level_set_by_no_more_than_is_said():
    ball = icosphere(subdivisions=3)
    band = mesh_to_band(ball, resolution=12)
    halved = replace(band, values=band.values.astype(np.float16).astype(np.float32))
    surface = marching_cubes(band)
    one, two = error_budget(ball, band, surface), error_budget(ball, halved, surface)
    assert one.sample_error < 2.0**-24 * 4 * band.voxel_size + 1e-12
    assert one.sample_error <= one.sampling < 1.2 * one.sample_error
    assert 2.0**-13 * band.voxel_size < two.sample_error < 2.0**-11 * 4 * band.voxel_size
    # Halfway to the next sample of either, the other's zeros are no farther than between the two
    zeros = [dense_values(other) for other in (band, halved)]
    points = [band.voxel_size * (fine_roots(values, 4) + low) for values, low in zeros]
    seen = KDTree(points[0]).query(points[1])[0]
    spacing = np.sqrt(3) / 4 * band.voxel_size
    assert seen.max() <= two.sampling + spacing


def test_samples_that_are_off_are_found_out():
    ball = icosphere(subdivisions=3)
    band = mesh_to_band(ball, resolution=16)
    change = 0.02 * band.voxel_size
    less = np.where(band.active_mask(), band.values - np.float32(change), band.values)
    grown = replace(band, values=less)
    found = error_budget(ball, grown, marching_cubes(grown))
    assert found.sample_error == pytest.approx(change, rel=1e-3)
    assert change <= found.sampling < 1.2 * change


def test_an_open_sheet_is_compared_with_the_shell_one_voxel_off():
    square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    sheet = Mesh(square, np.array([[0, 1, 2], [0, 2, 3]], np.int32))
    band = mesh_to_band(sheet, resolution=10, sign="unsigned")
    found = error_budget(sheet, band, marching_cubes(band, level=band.voxel_size))
    assert found.level == band.voxel_size
    for side in (found.zero_set_to_mesh, found.mesh_to_zero_set):
        assert 0.9 * band.voxel_size < side.lower
        assert side.upper < 1.2 * band.voxel_size


def test_a_limit_leaves_wider_intervals_that_are_still_true():
    body = turned(box_mesh(), 4)
    band = mesh_to_band(body, resolution=8)
    surface = marching_cubes(band)
    narrow = error_budget(body, band, surface)
    wide = error_budget(body, band, surface, max_evaluations=1)
    assert narrow.is_within_tolerance
    assert not wide.is_within_tolerance
    assert "Not all intervals" in wide.describe()
    for name in SIDES:
        few, many = getattr(wide, name), getattr(narrow, name)
        assert few.lower <= many.upper
        assert many.lower <= few.upper


def test_the_same_call_gives_the_same_bits():
    body = icosphere(subdivisions=2)
    band = mesh_to_band(body, resolution=8)
    surface = marching_cubes(band)
    one, two = error_budget(body, band, surface), error_budget(body, band, surface)
    assert one.to_json() == two.to_json()


def test_it_is_told_in_words_and_as_json():
    body = icosphere(subdivisions=2)
    band = mesh_to_band(body, resolution=8)
    found = error_budget(body, band, marching_cubes(band))
    assert isinstance(found, ErrorBudget)
    told = json.loads(json.dumps(found.to_json()))
    for name in (*SIDES, "interpolation", "extraction"):
        assert told[name]["lower"] == getattr(found, name).lower
        assert told[name]["upper"] == getattr(found, name).upper
    assert told["sampling"] == found.sampling
    assert "interpolation between them" in found.describe()
    unknown = replace(found, sampling=np.inf)
    assert unknown.to_json()["sampling"] is None
    assert "Nothing bounds" in unknown.describe()


def test_what_cannot_be_compared_is_refused():
    body = icosphere(subdivisions=1)
    band = mesh_to_band(body, resolution=8)
    surface = marching_cubes(band)
    with pytest.raises(ReportError, match="the mesh has no faces"):
        error_budget(EMPTY, band, surface)
    with pytest.raises(ReportError, match="the surface has no faces"):
        error_budget(body, band, EMPTY)
    with pytest.raises(ReportError, match="the tolerance is 0"):
        error_budget(body, band, surface, tolerance=0.0)
    with pytest.raises(ReportError, match="the level is 9, but the band ends at"):
        error_budget(body, band, surface, level=9.0)
    outside = replace(band, values=np.abs(band.values))
    with pytest.raises(ReportError, match="no value of the band crosses the level 0"):
        error_budget(body, outside, surface)
