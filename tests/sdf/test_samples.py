"""meshsdf.sdf.samples: points around a mesh, and exact signed distances there."""

import inspect

import igl
import numpy as np
import pytest
from scipy import stats

from meshsdf.errors import MemoryLimitError, SdfError
from meshsdf.mesh import Mesh, box_mesh, check, icosphere, torus
from meshsdf.sdf import deepsdf_counts, normalization, sample_distances
from meshsdf.sdf.samples import KINDS, VARIANCES
from tests.mesh.test_crack_repair import cracked

SURPRISE = 1e-3
"""A right sampler fails one such test in a thousand seeds; the seeds here are fixed."""


def long_box():
    return box_mesh((4.0, 2.0, 1.0), center=(10.0, 20, 30))


def box_distance(points, size=(4.0, 2, 1), center=(10.0, 20, 30)):
    """Signed distance to an axis-aligned box, by its formula."""
    q = np.abs(points - center) - np.array(size) / 2
    outside = np.linalg.norm(np.maximum(q, 0), axis=1)
    return outside + np.minimum(q.max(axis=1), 0)


def of_kind(samples, kind):
    return samples.kind == KINDS.index(kind)


@pytest.mark.parametrize("normalize", ["none", "unit-sphere", "unit-cube"])
@pytest.mark.parametrize("is_double", [False, True])
def test_distances_are_those_of_the_points_as_stored(normalize, is_double):
    counts = {"near": 2000, "uniform": 1000, "surface": 500}
    found = sample_distances(long_box(), counts, normalize=normalize, is_double=is_double)
    assert found.counts() == counts
    assert found.points.dtype == found.distance.dtype == (np.float64 if is_double else np.float32)
    space = found.normalization
    truth = box_distance(found.points.astype(float) / space.scale + space.center) * space.scale
    # Rounding of the stored distance; that of coordinates up to 30 in float64 is far below
    exact = 1e-14 * 32 if is_double else 2.0**-24 * np.abs(truth) + 1e-12
    off = ~of_kind(found, "surface")
    assert (np.abs(found.distance - truth)[off] <= np.broadcast_to(exact, truth.shape)[off]).all()
    assert (found.distance[of_kind(found, "surface")] == 0).all()
    assert np.abs(truth[~off]).max() < (1e-13 if is_double else 4e-6)
    assert (found.distance < 0).sum() > 500
    assert (found.distance > 0).sum() > 500


def test_distances_are_those_of_libigl():
    mesh = torus(1.0, 0.4, n_major=40, n_minor=24)
    found = sample_distances(mesh, 4000, is_double=True, closest=True)
    squares, faces, closest = igl.point_mesh_squared_distance(
        found.points, mesh.vertices, mesh.faces.astype(np.int64)
    )
    np.testing.assert_allclose(np.abs(found.distance), np.sqrt(squares), rtol=0, atol=1e-13)
    winding = igl.winding_number(mesh.vertices, mesh.faces.astype(np.int64), found.points)
    np.testing.assert_array_equal(found.distance < 0, winding > 0.5)
    np.testing.assert_allclose(found.closest_point, closest, rtol=0, atol=1e-12)
    # Beyond edges several faces are as near, so theirs and ours may differ there
    assert (found.face_index == faces).mean() > 0.9
    again, _, _ = igl.point_mesh_squared_distance(
        found.closest_point[:50], mesh.vertices, mesh.faces[found.face_index[:50]].astype(np.int64)
    )
    assert again.max() < 1e-24


def test_uniform_samples_fill_their_box_evenly():
    for normalize, margin in (("none", 0.2), ("unit-sphere", 0.03), ("unit-cube", 0.5)):
        options = {"normalize": normalize, "margin": margin, "seed": 5, "is_double": True}
        found = sample_distances(long_box(), {"uniform": 27_000}, **options)
        box = found.normalization.domain
        places = (found.points - box.lower) / box.size
        for axis in range(3):
            assert stats.kstest(places[:, axis], "uniform").pvalue > SURPRISE
        cells = (places * 6).astype(int) @ [36, 6, 1]
        assert stats.chisquare(np.bincount(cells, minlength=216)).pvalue > SURPRISE


def test_the_box_is_the_unit_one_that_the_mesh_fills_but_for_the_margin():
    mesh = long_box()
    vertices = mesh.vertices - [10, 20, 30]
    sphere = normalization(mesh, "unit-sphere", margin=0.25)
    np.testing.assert_allclose(sphere.normalized(mesh.vertices), vertices * sphere.scale)
    radius = np.linalg.norm(sphere.normalized(mesh.vertices), axis=1).max()
    assert radius == pytest.approx(1 / 1.25)
    assert [*sphere.domain.lower, *sphere.domain.upper] == [-1] * 3 + [1] * 3
    cube = normalization(mesh, "unit-cube", margin=0.25)
    assert np.abs(cube.normalized(mesh.vertices)).max() == pytest.approx(0.5 / 1.25)
    assert [*cube.domain.lower, *cube.domain.upper] == [-0.5] * 3 + [0.5] * 3
    plain = normalization(mesh, margin=0.25)
    assert plain.normalized(mesh.vertices).tobytes() == mesh.vertices.tobytes()
    np.testing.assert_allclose(plain.domain.lower, [7.5, 18.5, 29])
    np.testing.assert_allclose(plain.domain.upper, [12.5, 21.5, 31])
    there = np.random.default_rng(0).normal(size=(50, 3))
    np.testing.assert_allclose(cube.normalized(cube.world(there)), there, atol=1e-14)


def test_vertices_that_no_face_uses_change_nothing():
    box = long_box()
    stray = Mesh(np.concatenate([box.vertices, [[1e6, 0, 0]]]), box.faces)
    one, two = (sample_distances(m, 100, normalize="unit-sphere") for m in (box, stray))
    assert one.points.tobytes() == two.points.tobytes()
    assert one.distance.tobytes() == two.distance.tobytes()


def test_steps_off_the_surface_are_normal_with_the_two_variances():
    # On a wide flat square the step along the normal is the height; its edges are far away
    corners = np.array([[-50.0, -50, 0], [50, -50, 0], [50, 50, 0], [-50, 50, 0]])
    square = Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], np.int32))
    options = {"sign": "unsigned", "is_double": True, "normalize": "unit-sphere", "margin": 0.1}
    found = sample_distances(square, {"near": 20_000}, **options)
    for first, variance in enumerate(VARIANCES):
        height = found.points[first::2, 2]
        assert stats.kstest(height, stats.norm(0, np.sqrt(variance)).cdf).pvalue > SURPRISE
    # Both steps of a pair start at one place
    apart = found.points[0::2, :2] - found.points[1::2, :2]
    both = np.sqrt(sum(VARIANCES))
    assert stats.kstest(apart[:, 0], stats.norm(0, both).cdf).pvalue > SURPRISE
    world = sample_distances(square, {"near": 20_000}, sign="unsigned", margin=0.1)
    assert world.points[:, 2].std() == pytest.approx(
        found.points[:, 2].std() / found.normalization.scale, rel=1e-6
    )


def test_a_number_is_split_as_deepsdf_does():
    assert deepsdf_counts(50) == {"near": 47, "uniform": 3}
    found = sample_distances(icosphere(subdivisions=1), 500)
    assert found.counts() == {"near": 470, "uniform": 30, "surface": 0}
    assert found.normals is None
    assert found.n == 500


def test_normals_point_where_the_distance_grows():
    mesh = icosphere(1.0, subdivisions=4)
    found = sample_distances(mesh, {"near": 2000, "uniform": 2000, "surface": 2000}, is_double=True)
    np.testing.assert_allclose(np.linalg.norm(found.normals, axis=1), 1, atol=1e-9)
    away = found.points / np.linalg.norm(found.points, axis=1, keepdims=True)
    far = np.linalg.norm(found.points, axis=1) > 0.2
    assert np.einsum("ni,ni->n", found.normals, away)[far].min() > 0.97
    # Forward differences of libigl's distance agree
    step = 1e-6
    some = np.flatnonzero(np.abs(found.distance) > 0.01)[:500]
    ends = found.points[some] + step * found.normals[some]
    squares, _, _ = igl.point_mesh_squared_distance(
        ends, mesh.vertices, mesh.faces.astype(np.int64)
    )
    grown = np.sqrt(squares) * np.sign(found.distance[some]) - found.distance[some]
    np.testing.assert_allclose(grown, step, rtol=1e-6)


def test_the_seed_alone_decides_and_kinds_do_not_disturb_each_other(monkeypatch):
    mesh, counts = icosphere(subdivisions=3), {"near": 3000, "surface": 1000}
    one, two = (sample_distances(mesh, counts, seed=4, closest=True) for _ in range(2))
    for name in ("points", "distance", "kind", "normals", "closest_point", "face_index"):
        assert getattr(one, name).tobytes() == getattr(two, name).tobytes()
    monkeypatch.setattr("meshsdf.kernels.parallel.n_threads", lambda: 1)
    alone = sample_distances(mesh, counts, seed=4, closest=True)
    assert alone.points.tobytes() == one.points.tobytes()
    assert alone.distance.tobytes() == one.distance.tobytes()
    other = sample_distances(mesh, counts, seed=5)
    assert other.points.tobytes() != one.points.tobytes()
    near = sample_distances(mesh, {"near": 3000}, seed=4)
    assert near.points.tobytes() == one.points[:3000].tobytes()


def test_more_pieces_are_drawn_apart(monkeypatch):
    monkeypatch.setattr("meshsdf.sdf.samples.PIECE", 500)
    seen = []
    found = sample_distances(
        icosphere(subdivisions=2),
        {"near": 1200, "uniform": 1},
        progress=lambda stage, share: seen.append((stage, share)),
    )
    assert len(np.unique(found.points, axis=0)) == found.n == 1201
    assert {stage for stage, _ in seen} == {"samples"}
    shares = [share for _, share in seen]
    assert shares == sorted(shares)
    assert shares[-1] == 1


def open_hemisphere():
    ball = icosphere(subdivisions=3)
    return Mesh(ball.vertices, ball.faces[ball.triangles[:, :, 2].max(axis=1) < 0.3])


def test_doubtful_sides_of_open_meshes_are_counted():
    mesh = open_hemisphere()
    found = sample_distances(mesh, {"uniform": 4000}, is_double=True)
    winding = np.abs(igl.winding_number(mesh.vertices, mesh.faces.astype(np.int64), found.points))
    assert found.sign == "winding"
    np.testing.assert_array_equal(found.distance < 0, winding > 0.5)
    n = int((np.abs(winding - 0.5) < 0.05).sum())
    assert n > 20
    assert found.n_uncertain == n
    assert f"{n} samples: the side is not certain" in found.warnings
    assert any("hole" in warning for warning in found.warnings)
    assert sample_distances(icosphere(subdivisions=2), 500).n_uncertain == 0


def test_samples_nearer_than_zipped_cracks_are_wide_are_counted():
    mesh = cracked(1e-3)
    beyond = check(mesh, self_intersections=False).repair.certain_beyond
    found = sample_distances(mesh, {"near": 20_000}, variances=(1e-4,), is_double=True)
    squares, _, _ = igl.point_mesh_squared_distance(
        found.points, mesh.vertices, mesh.faces.astype(np.int64)
    )
    n = int((np.sqrt(squares) <= beyond).sum())
    assert 100 < n < 19_000
    assert found.n_uncertain == n


def test_faces_inside_a_union_get_the_distance_to_its_boundary():
    outer, inner = box_mesh((4.0, 4, 4)), box_mesh((1.0, 1, 1))
    vertices = np.concatenate([outer.vertices, inner.vertices])
    nested = Mesh(vertices, np.concatenate([outer.faces, inner.faces + np.int32(8)]))
    found = sample_distances(nested, {"surface": 2000}, sign="winding")
    on_inner = np.abs(found.points).max(axis=1) < 1
    assert 50 < on_inner.sum() < 500
    np.testing.assert_allclose(found.distance[on_inner], -1.5, rtol=1e-6)
    assert (found.distance[~on_inner] == 0).all()
    assert any("have a distance that is not 0" in warning for warning in found.warnings)


def test_coarse_steps_of_the_type_are_told():
    far = icosphere(1.0, subdivisions=2, center=(1e5, 0, 0))
    assert "take float64" in sample_distances(far, 100).warnings[-1]
    assert not sample_distances(far, 100, is_double=True).warnings
    assert not sample_distances(far, 100, normalize="unit-cube").warnings


@pytest.mark.parametrize(
    ("counts", "options", "words"),
    [
        ({"close": 3}, {}, "no kind 'close'"),
        ({"near": 0}, {}, "0 samples"),
        ({}, {}, "0 samples"),
        (0, {}, "0 samples"),
        ({"near": -1, "uniform": 5}, {}, "samples are asked for"),
        (10, {"variances": ()}, "variances are none"),
        (10, {"variances": (0.1, 0.0)}, "variances are 0.1, 0"),
        (10, {"seed": -1}, "seed is -1"),
        (10, {"margin": -0.1}, "margin is -0.1"),
        (10, {"margin": np.nan}, "margin is nan"),
    ],
)
def test_what_cannot_be_drawn_is_refused(counts, options, words):
    with pytest.raises(SdfError, match=words):
        sample_distances(box_mesh(), counts, **options)


def test_an_unknown_normalization_is_refused():
    unchecked = inspect.unwrap(normalization)
    with pytest.raises(SdfError, match="'box' is unknown"):
        unchecked(box_mesh(), "box")
    with pytest.raises(SdfError, match="all vertices lie in one place"):
        normalization(Mesh(np.ones((3, 3)), np.array([[0, 1, 2]], np.int32)))


def test_too_many_are_refused_before_any_is_drawn():
    with pytest.raises(MemoryLimitError, match="100 kB are allowed"):
        sample_distances(box_mesh(), 10**6, max_memory=1e5)
