"""meshsdf.report.hausdorff: intervals that contain the truth."""

import numpy as np
import pytest
from scipy.spatial import Delaunay

from meshsdf.errors import ReportError
from meshsdf.mesh import Mesh
from meshsdf.mesh.primitives import box_mesh, icosphere, tetrahedron
from meshsdf.report.hausdorff import hausdorff, one_sided_hausdorff
from meshsdf.report.tolerance import Tolerance
from meshsdf.spatial import ClosestPoint

ROUNDING = 1e-12  # 328 u times coordinates below 10, twice, and the closed formula's own


def folded_quad(height, *, along):
    """The quad (0,0,0) (1,0,0) (1,1,height) (0,1,0), folded along one diagonal or the other."""
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, height], [0, 1, 0]])
    faces = [[0, 1, 2], [0, 2, 3]] if along == "ac" else [[0, 1, 3], [1, 2, 3]]
    return Mesh(vertices, np.array(faces, np.int32))


def flat_square(seed, n=40):
    inner = np.random.default_rng(seed).random((n, 2))
    points = np.vstack([[[0, 0], [1, 0], [0, 1], [1, 1]], inner])
    faces = Delaunay(points).simplices.astype(np.int32)
    return Mesh(np.column_stack([points, np.zeros(len(points))]), faces)


def rough(mesh, amount, seed):
    noise = amount * np.random.default_rng(seed).normal(size=mesh.vertices.shape)
    return Mesh(mesh.vertices + noise, mesh.faces)


def placed(mesh, scale, offset):
    return Mesh(scale * mesh.vertices + offset, mesh.faces)


def samples_of(mesh, n, seed):
    rng = np.random.default_rng(seed)
    corners = mesh.triangles[rng.integers(0, mesh.n_faces, n)]
    return np.einsum("nk,nkx->nx", rng.dirichlet(np.ones(3), n), corners)


@pytest.mark.parametrize("height", [0.01, 0.1, 0.5, 1.0, 2.0, 3.0])
def test_the_fold_that_fools_vertices_has_the_distance_its_formula_says(height):
    # All four vertices are common, so every maximum over vertices is zero
    one, two = folded_quad(height, along="ac"), folded_quad(height, along="bd")
    found = hausdorff(one, two, tolerance=1e-12)
    forward = height / (1 + np.sqrt(1 + 2 * height**2))
    backward = height / (2 * np.sqrt(1 + height**2))
    for side, truth in ((found.forward, forward), (found.backward, backward)):
        assert side.distance.contains(truth)
        assert side.distance.width <= 1e-12
        assert side.is_within_tolerance
    assert found.distance.contains(max(forward, backward))


@pytest.mark.parametrize(("scale", "offset"), [(1, 0), (1e-9, 0), (1, 1e7), (1e9, 0)])
def test_the_fold_is_measured_anywhere_and_at_any_size(scale, offset):
    one = placed(folded_quad(1.0, along="ac"), scale, offset)
    two = placed(folded_quad(1.0, along="bd"), scale, offset)
    side = one_sided_hausdorff(one, two)
    truth = scale / (1 + np.sqrt(3))
    # Only the corners' own rounding, at the offset, moves the truth
    slack = scale * ROUNDING + 4 * 2.0**-53 * offset
    assert side.distance.lower - slack <= truth <= side.distance.upper + slack
    assert side.distance.width <= 1.1e-3 * truth


@pytest.mark.parametrize("mesh", [box_mesh(), icosphere(subdivisions=3), flat_square(0)])
def test_a_mesh_is_at_distance_zero_from_itself(mesh):
    found = hausdorff(mesh, mesh)
    assert found.distance.lower == 0
    assert found.distance.upper < ROUNDING
    assert found.forward.mean < ROUNDING


def test_a_part_is_at_distance_zero_from_the_whole_but_not_the_reverse():
    whole = icosphere(subdivisions=3)
    part = Mesh(whole.vertices, whole.faces[whole.triangles[:, :, 2].mean(axis=1) > 0])
    found = hausdorff(part, whole)
    assert found.forward.distance.upper < ROUNDING
    assert found.backward.distance.lower > 0.9


@pytest.mark.parametrize(("n", "m"), [(0, 40), (40, 60), (300, 400)])
def test_two_triangulations_of_one_square_coincide_to_the_tolerance(n, m):
    # No sample is ever off the other one; only bounds over several faces can prove that none is
    side = one_sided_hausdorff(flat_square(1, n), flat_square(2, m))
    assert side.distance.lower == 0
    assert side.distance.upper <= 1e-6 * np.sqrt(2) + ROUNDING
    assert side.n_evaluations < 100 * (n + m)


def test_progress_only_grows_and_ends_with_all_of_the_gap():
    told = []
    a, b = rough(icosphere(subdivisions=3), 0.05, 0), icosphere(subdivisions=3)
    one_sided_hausdorff(a, b, progress=lambda stage, share: told.append((stage, share)))
    shares = [share for stage, share in told if stage == "hausdorff"]
    assert shares == sorted(shares)
    assert 0.9 < shares[-1] <= 1


@pytest.mark.parametrize("body", [box_mesh((1, 2, 3)), tetrahedron(), icosphere(subdivisions=2)])
def test_a_convex_solid_moved_by_t_is_off_by_the_whole_way(body):
    # The point of A extreme against t has A + t beyond a plane at distance |t|, touched by p + t
    t = np.array([0.05, -0.02, 0.01])
    found = hausdorff(body, placed(body, 1.0, t))
    for side in (found.forward, found.backward):
        assert side.distance.lower - ROUNDING <= np.linalg.norm(t)
        assert side.distance.upper + ROUNDING >= np.linalg.norm(t)
        assert side.distance.width <= 1.1e-3 * np.linalg.norm(t)


def test_similar_spheres_are_apart_by_the_difference_of_radii_and_a_sag():
    inner, outer = icosphere(1.0, subdivisions=3), icosphere(1.1, subdivisions=3)
    found = hausdorff(inner, outer)
    assert found.backward.distance.contains(0.1)  # vertex to vertex along a radius
    assert found.forward.distance.lower >= 0.1 - 0.3 * 1.1 / 64
    assert found.forward.distance.upper <= 0.1 + ROUNDING


@pytest.mark.parametrize("seed", range(4))
def test_no_sample_is_beyond_the_upper_end_and_the_witness_reaches_the_lower(seed):
    a = rough(icosphere(subdivisions=2), 0.05, seed)
    b = rough(icosphere(subdivisions=3), 0.02, seed + 10)
    found = hausdorff(a, b)
    for side, source, target in ((found.forward, a, b), (found.backward, b, a)):
        closest = ClosestPoint(target)
        seen = closest.distances(samples_of(source, 100_000, seed)).distance.max()
        assert seen <= side.distance.upper
        assert side.distance.lower >= 0.98 * seen
        assert side.distance.width <= 1.01e-3 * side.distance.upper
        witness = closest(side.witness[None])
        assert witness.distance[0] >= side.distance.lower
        own = ClosestPoint(Mesh(source.vertices, source.faces[[side.source_face]]))
        assert own(side.witness[None]).distance[0] < ROUNDING
        there = ClosestPoint(Mesh(target.vertices, target.faces[[side.target_face]]))
        assert there(side.witness[None]).distance[0] <= side.distance.upper
        assert there(side.nearest[None]).distance[0] < ROUNDING
        apart = np.linalg.norm(side.witness - side.nearest)
        assert apart == pytest.approx(witness.distance[0], abs=ROUNDING)
    assert found.distance == found.forward.distance.largest(found.backward.distance)
    assert found.farthest.distance.lower == found.distance.lower


def test_a_smaller_tolerance_narrows_the_interval_inside_the_wider_one():
    a, b = rough(icosphere(subdivisions=2), 0.05, 0), icosphere(subdivisions=3)
    before = None
    for tolerance in (1e-2, 1e-4, 1e-6):
        side = one_sided_hausdorff(a, b, tolerance=tolerance)
        assert side.is_within_tolerance
        assert side.distance.width <= tolerance + ROUNDING
        if before is not None:
            assert before.lower <= side.distance.lower
            assert side.distance.upper <= before.upper
        before = side.distance


def test_an_interval_can_be_asked_for_as_a_share_of_itself_or_of_a_voxel():
    a, b = rough(icosphere(subdivisions=2), 0.05, 0), icosphere(subdivisions=3)
    share = one_sided_hausdorff(a, b, tolerance=Tolerance(relative=1e-5)).distance
    assert share.width <= 1e-5 * share.lower
    voxels = one_sided_hausdorff(a, b, tolerance=Tolerance.in_voxels(0.01, 0.1)).distance
    assert 1e-5 * share.lower < voxels.width <= 1e-3
    assert voxels == one_sided_hausdorff(a, b, tolerance=1e-3).distance
    either = one_sided_hausdorff(a, b, tolerance=Tolerance(absolute=1e-3, relative=1e-5)).distance
    assert either == voxels


@pytest.mark.parametrize("limit", [{"max_evaluations": 0}, {"time_budget": 0.0}])
def test_a_limit_leaves_a_wider_interval_that_is_still_true(limit):
    one, two = folded_quad(1.0, along="ac"), folded_quad(1.0, along="bd")
    side = one_sided_hausdorff(one, two, tolerance=1e-9, **limit)
    assert not side.is_within_tolerance
    assert side.n_evaluations == 4
    assert side.distance.width > 1e-3
    assert side.distance.contains(1 / (1 + np.sqrt(3)))
    found = hausdorff(one, two, tolerance=1e-9, **limit)
    assert found.distance.contains(1 / (1 + np.sqrt(3)))
    assert not found.backward.is_within_tolerance


def test_a_budget_that_lasts_changes_nothing():
    a, b = rough(icosphere(subdivisions=2), 0.05, 0), icosphere(subdivisions=3)
    found = hausdorff(a, b, time_budget=1000, max_evaluations=10**6)
    assert found.distance == hausdorff(a, b).distance
    assert found.forward.is_within_tolerance


@pytest.mark.parametrize(
    ("limit", "words"),
    [({"time_budget": -1.0}, "the limit is -1"), ({"max_evaluations": -5}, "the limit is -5"),
     ({"time_budget": float("nan")}, "the limit is nan")],
)  # fmt: skip
def test_a_limit_below_zero_is_refused(limit, words):
    with pytest.raises(ReportError, match=words):
        one_sided_hausdorff(box_mesh(), box_mesh(), **limit)


def test_means_can_be_left_out():
    side = one_sided_hausdorff(icosphere(subdivisions=1), box_mesh(), means=False)
    assert side.mean is side.rms is None
    other = one_sided_hausdorff(icosphere(subdivisions=1), box_mesh())
    assert side.distance == other.distance
    assert 0 < other.mean < other.rms < other.distance.upper


def test_mean_and_rms_are_exact_for_a_triangle_above_a_plane():
    # Heights 1, 2, 3 at the corners: the mean is 2, the mean square (1 + 4 + 9 + 2 + 6 + 3) / 6
    source = Mesh(np.array([[0.0, 0, 1], [1, 0, 2], [0, 1, 3]]), np.array([[0, 1, 2]], np.int32))
    far = 100.0 * np.array([[-1.0, -1, 0], [1, -1, 0], [0, 1, 0]])
    side = one_sided_hausdorff(source, Mesh(far, source.faces))
    assert side.mean == pytest.approx(2, abs=1e-12)
    assert side.rms == pytest.approx(np.sqrt(25 / 6), abs=1e-12)
    assert side.distance.contains(3.0)


def test_faces_without_area_count_as_segments_and_points():
    target = flat_square(3)
    segment = np.array([[0.5, 0.5, 0.0], [0.5, 0.5, 2.0], [0.5, 0.5, 1.0]])
    side = one_sided_hausdorff(Mesh(segment, np.array([[0, 1, 2]], np.int32)), target)
    assert side.distance.contains(2.0)
    back = one_sided_hausdorff(target, Mesh(segment, np.array([[0, 0, 0]], np.int32)))
    assert back.distance.contains(np.sqrt(0.5))


def test_the_same_call_gives_the_same_bits():
    a, b = rough(icosphere(subdivisions=3), 0.05, 0), icosphere(subdivisions=3)
    one, two = one_sided_hausdorff(a, b), one_sided_hausdorff(a, b)
    assert one.distance == two.distance
    assert (one.mean, one.rms, one.n_evaluations) == (two.mean, two.rms, two.n_evaluations)
    assert (one.witness == two.witness).all()


EMPTY = Mesh(np.zeros((3, 3)), np.empty((0, 3), np.int32))


@pytest.mark.parametrize(
    ("a", "b", "name"), [(EMPTY, box_mesh(), "source"), (box_mesh(), EMPTY, "target")]
)
def test_a_mesh_without_faces_is_refused(a, b, name):
    with pytest.raises(ReportError, match=f"the {name} mesh has no faces"):
        one_sided_hausdorff(a, b)


def test_coordinates_that_cannot_be_squared_are_refused():
    far = placed(box_mesh(), 1e31, 0)
    with pytest.raises(ReportError, match=r"coordinates of the source mesh reach 5e\+30"):
        one_sided_hausdorff(far, box_mesh())
    with pytest.raises(ReportError, match=r"coordinates of the target mesh reach 5e\+30"):
        one_sided_hausdorff(box_mesh(), far)


def test_a_tolerance_of_zero_is_refused():
    with pytest.raises(ReportError, match="the tolerance is 0"):
        one_sided_hausdorff(box_mesh(), box_mesh(), tolerance=0.0)
