"""meshsdf.report.statistics: means, percentiles and lost parts between proven bounds."""

import json

import igl
import numpy as np
import pytest

from meshsdf import marching_cubes, mesh_to_band
from meshsdf.errors import ReportError
from meshsdf.mesh import Mesh
from meshsdf.mesh.primitives import box_mesh, icosphere
from meshsdf.report.hausdorff import one_sided_hausdorff
from meshsdf.report.lost_parts import lost_parts
from meshsdf.report.statistics import one_sided_statistics
from meshsdf.report.tolerance import Tolerance

ROUNDING = 4096 * 2.0**-53 * 10  # as documented, coordinates below 5 on either side
EMPTY = Mesh(np.zeros((3, 3)), np.empty((0, 3), np.int32))
ONE_FACE = np.array([[0, 1, 2]], np.int32)
FLOOR = Mesh(np.array([[-9.0, -9, 0], [9, -9, 0], [0, 9, 0]]), ONE_FACE)


def folded_quad(height, *, along):
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, height], [0, 1, 0]])
    faces = [[0, 1, 2], [0, 2, 3]] if along == "ac" else [[0, 1, 3], [1, 2, 3]]
    return Mesh(vertices, np.array(faces, np.int32))


def rough(mesh, amount, seed):
    noise = amount * np.random.default_rng(seed).normal(size=mesh.vertices.shape)
    return Mesh(mesh.vertices + noise, mesh.faces)


def placed(mesh, scale, offset):
    return Mesh(scale * mesh.vertices + offset, mesh.faces)


def joined(*meshes):
    starts = np.cumsum([0, *(mesh.n_vertices for mesh in meshes)])
    faces = [mesh.faces + np.int32(n) for mesh, n in zip(meshes, starts, strict=False)]
    return Mesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(faces))


def soup(n, seed):
    rng = np.random.default_rng(seed)
    corners = rng.uniform(-1, 1, (n, 1, 3)) + rng.normal(0, 0.3, (n, 3, 3))
    return Mesh(corners.reshape(-1, 3), np.arange(3 * n, dtype=np.int32).reshape(-1, 3))


def with_degenerate_faces(mesh):
    a, b = mesh.faces[0, 0], mesh.faces[7, 1]
    extra = np.array([[a, a, b], [a, a, a], [b, a, b]], np.int32)
    return Mesh(mesh.vertices, np.concatenate([mesh.faces, extra]))


def without_some(mesh):
    return Mesh(mesh.vertices, mesh.faces[: -(mesh.n_faces // 5)])


def sampled(source, target, n, seed):
    """Distances at points spread evenly over the source, and whether each is inside."""
    rng = np.random.default_rng(seed)
    edges = source.triangles[:, 1:] - source.triangles[:, :1]
    areas = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    # One random place in each of n equal parts of the area
    place = (np.arange(n) + rng.random(n)) / n * areas.sum()
    face = np.minimum(np.searchsorted(np.cumsum(areas), place), source.n_faces - 1)
    points = np.einsum("nk,nkx->nx", rng.dirichlet(np.ones(3), n), source.triangles[face])
    faces = target.faces.astype(np.int64)
    squares = igl.point_mesh_squared_distance(points, target.vertices, faces)[0]
    return np.sqrt(squares), points


def assert_holds(found, distances):
    """Every interval holds the sampled value, to five standard errors of it."""
    n = len(distances)
    for enclosure, values, power in (
        (found.mean, distances, 1.0),
        (found.rms, distances**2, 0.5),
    ):
        error = 5 * values.std() / np.sqrt(n) + 1e-9 * values.mean()
        middle = values.mean()
        low, high = max(middle - error, 0.0) ** power, (middle + error) ** power
        assert enclosure.lower <= high + ROUNDING
        assert low <= enclosure.upper + ROUNDING
    for percent, enclosure in found.percentiles.items():
        share = percent / 100
        error = 5 * np.sqrt(share * (1 - share) / n)
        low, high = np.quantile(distances, np.clip([share - error, share + error], 0, 1))
        assert enclosure.lower <= high + ROUNDING
        assert low <= enclosure.upper + ROUNDING
    shares = found.shares
    assert (np.diff(shares.thresholds) > 0).all()
    assert (shares.lower <= shares.upper).all()
    seen = np.searchsorted(np.sort(distances), shares.thresholds, side="right") / n
    error = 5 * np.sqrt(np.maximum(seen * (1 - seen), 1 / n) / n)
    near = np.searchsorted(np.sort(distances), shares.thresholds - ROUNDING) / n
    assert (shares.lower <= seen + error).all()
    assert (shares.upper >= near - error).all()
    assert shares.lower[-1] == 1


def test_nothing_is_said_to_be_farther_than_the_largest_distance():
    plate = box_mesh((4.0, 4.0, 0.1))
    target = rough(icosphere(subdivisions=3), 0.02, seed=5)
    most = one_sided_hausdorff(plate, target).distance.upper
    loose = one_sided_statistics(plate, target, max_evaluations=1)
    found = one_sided_statistics(plate, target, max_evaluations=1, at_most=most)
    ends = [found.mean.upper, found.rms.upper, *(t.upper for t in found.percentiles.values())]
    assert max(ends) <= most
    assert loose.rms.upper > most  # or the limit would not have been needed
    assert found.rms.lower == loose.rms.lower
    assert found.shares.thresholds[-1] <= max(most, loose.shares.thresholds[-1])
    assert_holds(found, sampled(plate, target, 20_000, seed=6)[0])


def heights(*values):
    return Mesh(np.column_stack([[0.0, 1, 0], [0, 0, 1], values]), ONE_FACE)


def test_a_triangle_above_a_plane_has_the_moments_and_percentiles_of_its_heights():
    found = one_sided_statistics(
        heights(1.0, 2, 3), FLOOR, tolerance=1e-3, percentiles=(12.5, 50, 87.5, 100)
    )
    assert found.mean.contains(2.0)
    assert found.rms.contains(np.sqrt(25 / 6))
    # The area below height 1 + s is s² / 2 up to the middle corner, and mirrored above it
    for percent, truth in {12.5: 1.5, 50: 2.0, 87.5: 2.5, 100: 3.0}.items():
        assert found.percentiles[percent].lower - ROUNDING <= truth
        assert truth <= found.percentiles[percent].upper + ROUNDING
        assert found.percentiles[percent].width < 3e-3
    assert found.is_within_tolerance
    assert found.signed_mean is None
    assert found.volume_difference is None


@pytest.mark.parametrize("height", [0.0, 1e-3, 0.5])
def test_a_parallel_triangle_is_at_one_distance(height):
    found = one_sided_statistics(heights(height, height, height), FLOOR)
    for enclosure in (found.mean, found.rms, *found.percentiles.values()):
        assert enclosure.lower - ROUNDING <= height <= enclosure.upper + ROUNDING
        assert enclosure.width < 0.01 * height + 5e-5


def test_a_triangle_through_a_plane_counts_both_sides():
    # Height z = -1 + 2 x over the corner triangle: E|z| = 1/3 + 2 * (1/4 * 1/3) = 1/2
    found = one_sided_statistics(heights(-1.0, 1, -1), FLOOR, tolerance=1e-4)
    assert found.mean.contains(0.5)
    assert found.rms.contains(np.sqrt(1 / 3))
    assert found.mean.width < 1e-4


@pytest.mark.parametrize("tilt", [1e-3, 0.1, 1.0])
def test_a_tilted_plane_is_nearer_than_its_height_by_the_cosine(tilt):
    source = heights(0.0, tilt, 0.0)
    found = one_sided_statistics(source, FLOOR)
    assert found.mean.contains(tilt / 3)
    assert found.normal_deviation == pytest.approx(np.degrees(np.arctan(tilt)))
    slope = Mesh(FLOOR.vertices + tilt * FLOOR.vertices[:, :1] * [0, 0, 1], ONE_FACE)
    turned = one_sided_statistics(heights(1.0, 1, 1), slope)
    # Distance (1 - tilt x) cos, the mean of x is 1/3
    assert turned.mean.contains((1 - tilt / 3) / np.hypot(1, tilt))


def test_the_distance_from_a_point_is_that_of_its_formula():
    # A triangle seen from the origin above a tiny target: d² = 4 + x² + y², E = 4 + 1/6 + 1/6
    tiny = Mesh(1e-9 * heights(0.0, 0, 0).vertices, ONE_FACE)
    found = one_sided_statistics(heights(2.0, 2, 2), tiny, tolerance=1e-3)
    assert found.rms.lower - 1e-8 <= np.sqrt(4 + 1 / 3) <= found.rms.upper + 1e-8
    assert found.rms.width < 3e-3


def test_concentric_spheres_are_apart_by_the_difference_of_radii_but_for_the_sag():
    inner, outer = icosphere(1.0, subdivisions=3), icosphere(1.1, subdivisions=3)
    sag = 1.1 * 0.02  # faces of 162 degrees: (edge / 2)² / 2, with edges below 0.2
    found = one_sided_statistics(inner, outer)
    assert 0.1 - sag <= found.mean.lower <= found.mean.upper <= 0.1
    assert found.signed_mean.upper <= -0.1 + sag
    assert found.volume_difference == pytest.approx(4 / 3 * np.pi * (1 - 1.331), rel=0.05)
    back = one_sided_statistics(outer, inner)
    assert back.signed_mean.lower >= 0.1 - sag
    assert back.normal_deviation < 5


@pytest.mark.parametrize("height", [0.01, 0.5, 1.0])
def test_the_fold_that_fools_vertices_has_the_sampled_mean(height):
    one, two = folded_quad(height, along="ac"), folded_quad(height, along="bd")
    found = one_sided_statistics(one, two)
    assert_holds(found, sampled(one, two, 200_000, 0)[0])
    assert found.is_within_tolerance
    assert found.mean.lower > 0.01 * height


BALL = icosphere(subdivisions=3)
PAIRS = {
    "rough spheres": (rough(BALL, 0.02, 0), BALL),
    "very rough": (
        rough(icosphere(subdivisions=1), 0.2, 1),
        rough(icosphere(subdivisions=2), 0.1, 2),
    ),
    "open target": (BALL, without_some(rough(BALL, 0.01, 3))),
    "open source": (without_some(BALL), rough(BALL, 0.01, 3)),
    "moved box": (placed(box_mesh(), 1.0, [0.03, 0.02, 0.05]), box_mesh()),
    "box in ball": (box_mesh(), BALL),
    "soups": (soup(40, 4), soup(60, 5)),
    "soup near ball": (soup(20, 4), icosphere(subdivisions=1)),
    "degenerate faces": (with_degenerate_faces(rough(BALL, 0.02, 6)), with_degenerate_faces(BALL)),
    "crossing sheets": (BALL, joined(rough(BALL, 0.02, 7), placed(BALL, 1.0, [0.4, 0, 0]))),
    "thin wall": (BALL, joined(placed(BALL, 0.98, 0), Mesh(BALL.vertices, BALL.faces[:, ::-1]))),
    "turned inside out": (rough(BALL, 0.01, 8), Mesh(BALL.vertices, BALL.faces[:, ::-1])),
}


@pytest.mark.parametrize("name", PAIRS)
def test_samples_agree_with_every_interval(name):
    source, target = PAIRS[name]
    found = one_sided_statistics(source, target, tolerance=Tolerance(1e-6, 0.05))
    assert_holds(found, sampled(source, target, 200_000, 1)[0])


@pytest.mark.parametrize("body", [icosphere(subdivisions=3), box_mesh((1.0, 1.3, 0.7))])
@pytest.mark.parametrize("resolution", [8, 24])
def test_a_round_trip_is_known_to_the_tolerance(body, resolution):
    back = marching_cubes(mesh_to_band(body, resolution=resolution))
    for source, target in ((body, back), (back, body)):
        found = one_sided_statistics(source, target, tolerance=Tolerance(1e-6, 0.01))
        assert found.is_within_tolerance
        for enclosure in (found.mean, found.rms):
            assert enclosure.width <= max(0.01 * enclosure.upper, 1e-6) + 2 * ROUNDING
        distances, points = sampled(source, target, 200_000, 2)
        assert_holds(found, distances)
        winding = igl.winding_number(target.vertices, target.faces.astype(np.int64), points[::20])
        signed = np.where(winding > 0.5, -1, 1) * distances[::20]
        error = 5 * signed.std() / np.sqrt(len(signed))
        assert found.signed_mean.lower - error <= signed.mean() <= found.signed_mean.upper + error


@pytest.mark.parametrize(("scale", "offset"), [(1e-6, 0.0), (1e6, 0.0), (1.0, 1e6)])
def test_units_and_places_do_not_matter(scale, offset):
    source, target = PAIRS["rough spheres"]
    truth = one_sided_statistics(source, target)
    found = one_sided_statistics(placed(source, scale, offset), placed(target, scale, offset))
    slack = 4 * 2.0**-53 * offset + ROUNDING
    for one, two in ((found.mean, truth.mean), (found.rms, truth.rms)):
        assert one.lower / scale <= two.upper + slack
        assert two.lower <= one.upper / scale + slack
        assert one.width / scale <= 1.5 * two.width + slack


def test_a_budget_leaves_wider_intervals_that_are_still_true():
    source, target = PAIRS["very rough"]
    spent = []
    for budget in (0, 3000, 9000):
        found = one_sided_statistics(source, target, max_evaluations=budget, tolerance=1e-6)
        assert not found.is_within_tolerance
        assert_holds(found, sampled(source, target, 50_000, 3)[0])
        spent.append((found.n_evaluations, found.mean.width))
    assert spent[0][0] < spent[1][0] < spent[2][0] < 60_000
    assert spent[0][1] > spent[1][1] > spent[2][1]


@pytest.mark.parametrize("relative", [1e-6, 0.01, 1.0])
def test_a_part_of_no_distance_at_all_is_reached(relative):
    square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    one, other = [[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]]
    halves = [Mesh(square, np.array(faces, np.int32)) for faces in (one, other)]
    for source, target in (halves, (box_mesh(), box_mesh())):
        told = []
        found = one_sided_statistics(
            source,
            target,
            tolerance=Tolerance(relative=relative),
            progress=lambda stage, share, told=told: told.append(share),
        )
        assert found.is_within_tolerance
        assert found.mean.lower == found.rms.lower == 0
        assert max(found.mean.upper, found.rms.upper) < 1e-11  # rounding of coordinates up to 1
        assert np.isfinite(told).all()


def test_the_same_call_gives_the_same_bits():
    source, target = PAIRS["rough spheres"]
    one, two = (one_sided_statistics(source, target) for _ in range(2))
    assert json.dumps(one.to_json()) == json.dumps(two.to_json())


def test_json_holds_plain_numbers():
    source, target = PAIRS["rough spheres"]
    found = one_sided_statistics(source, target, voxel_size=1.0)
    told = json.loads(json.dumps(found.to_json(), allow_nan=False))
    assert told["mean_bounds"] == {"lower": found.mean.lower, "upper": found.mean.upper}
    assert list(told["percentiles"]) == ["50", "90", "95", "99"]
    assert told["percentiles"]["90"]["upper"] == found.percentiles[90.0].upper
    assert told["lost_parts"] == []


def test_progress_stays_between_nothing_and_all():
    told = []
    source, target = PAIRS["very rough"]
    one_sided_statistics(source, target, progress=lambda stage, share: told.append(share))
    assert told
    assert min(told) >= 0
    assert max(told) <= 1


def test_a_lost_part_is_found_where_it_is_and_how_large():
    rod = placed(box_mesh((0.1, 0.1, 2.0)), 1.0, [4.0, 0, 0])
    crumb = placed(icosphere(subdivisions=1), 0.2, [0, 6.0, 0])
    source = joined(BALL, crumb, rod)
    found = lost_parts(source, BALL, 0.1)
    assert [part.n_faces for part in found] == [rod.n_faces, crumb.n_faces]
    assert found[0].area == pytest.approx(2 * 0.01 + 4 * 0.2)
    np.testing.assert_allclose(found[0].center, [4, 0, 0], atol=1e-12)
    # The corners of the rod are sqrt(4.05² + 0.05² + 1) from the centre, faces sag below 0.005
    truth = np.sqrt(4.05**2 + 0.05**2 + 1) - 1
    assert truth <= found[0].largest.upper
    assert found[0].largest.lower <= truth + 0.01
    assert lost_parts(BALL, source, 0.1) == ()
    same = one_sided_statistics(source, BALL, voxel_size=0.1).lost_parts
    assert [part.n_faces for part in same] == [12, 80]


def test_a_part_with_one_near_point_is_not_lost():
    # The plate's corners are all far from the ball, its middle touches it
    plate = Mesh(np.array([[-5.0, -5, 1], [5, -5, 1], [0, 5, 1]]), ONE_FACE)
    assert lost_parts(plate, BALL, 0.1) == ()
    assert len(lost_parts(placed(plate, 1.0, [0, 0, 0.2]), BALL, 0.1)) == 1


@pytest.mark.parametrize(
    ("source", "target", "name"), [(EMPTY, BALL, "source"), (BALL, EMPTY, "target")]
)
def test_a_mesh_without_faces_is_refused(source, target, name):
    with pytest.raises(ReportError, match=f"the {name} mesh has no faces"):
        one_sided_statistics(source, target)


def test_a_source_without_area_is_refused():
    line = Mesh(np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]]), ONE_FACE)
    with pytest.raises(ReportError, match="the 1 faces of the source have no area"):
        one_sided_statistics(line, BALL)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"percentiles": (0,)}, "0 is no percentage"),
        ({"percentiles": (101,)}, "101 is no percentage"),
        ({"voxel_size": 0.0}, "the voxel size is 0"),
        ({"tolerance": 0.0}, "the tolerance is 0"),
    ],
)
def test_numbers_that_make_no_sense_are_refused(options, words):
    with pytest.raises(ReportError, match=words):
        one_sided_statistics(BALL, BALL, **options)
    with pytest.raises(ReportError, match="the voxel size is -1"):
        lost_parts(BALL, BALL, -1)
