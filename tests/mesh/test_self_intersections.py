"""meshsdf.mesh.self_intersections: which pairs of faces count as crossing."""

import numpy as np
import pytest

from meshsdf.mesh import check, find_self_intersections

from .shapes import cube, joined, klein_bottle, make, soup_of, with_faces, with_t_junction


def all_pairs(triangles: np.ndarray) -> int:
    """Count crossing pairs by solving for every edge against every triangle."""
    n_pairs = 0
    for i in range(len(triangles)):
        for j in range(i + 1, len(triangles)):
            crossing = False
            for a, b in ((i, j), (j, i)):
                o, u, v = triangles[b][0], *(triangles[b][1:] - triangles[b][0])
                for e in range(3):
                    p, q = triangles[a][e], triangles[a][(e + 1) % 3]
                    s, t, w = np.linalg.solve(np.stack([u, v, p - q], axis=1), p - o)
                    crossing |= bool(s > 0 and t > 0 and s + t < 1 and 0 < w < 1)
            n_pairs += crossing
    return n_pairs


def test_random_triangles_agree_with_solving_every_pair():
    rng = np.random.default_rng(7)
    triangles = rng.uniform(0, 1, (60, 1, 3)) + rng.normal(size=(60, 3, 3)) * 0.2
    faces = np.arange(180, dtype=np.int32).reshape(-1, 3)
    found = find_self_intersections(triangles.reshape(-1, 3), faces)
    assert found.n_pairs == all_pairs(triangles) > 20
    assert found.first_pair is not None
    assert found.first_place is not None
    low, high = found.first_pair
    assert low < high
    for face in (low, high):  # the place lies on both planes
        a, b, c = triangles[face]
        normal = np.cross(b - a, c - a)
        assert normal @ (found.first_place - a) == pytest.approx(0, abs=1e-12)


def test_the_order_of_faces_does_not_change_the_count():
    rng = np.random.default_rng(9)
    points = rng.uniform(0, 1, (300, 3))
    faces = np.arange(300, dtype=np.int32).reshape(-1, 3)
    count = find_self_intersections(points, faces).n_pairs
    assert find_self_intersections(points, faces[::-1].copy()).n_pairs == count > 0


def test_sound_shapes_touching_shapes_and_doubled_walls_do_not_cross():
    shapes = [
        cube(),
        soup_of(cube((0.1, 0.2, 0.3), 0.7)),
        with_t_junction(cube(), 0, (0, 0, 0.5)),
        joined(cube(), cube((1, 1, 1))),
        joined(cube(), cube((1, 1, 0))),
        joined(cube(), cube((1, 0, 0))),
        with_faces(cube(), (0, 1, 3)),
        with_faces(cube(), (0, 0, 3)),
    ]
    for mesh in shapes:
        assert check(mesh).n_self_intersections == 0


def test_overlapping_cubes_cross_even_where_edges_meet_diagonals():
    for offset in ((0.5, 0.5, 0.5), (0.5, 0.4, 0.3)):
        report = check(joined(cube(), cube(offset)))
        assert report.n_self_intersections > 0
        place = report.first_self_intersection
        assert ((place >= np.array(offset) - 1e-15) & (place <= 1)).all()


def test_an_edge_that_passes_the_rim_of_a_face_counts_and_one_that_ends_there_does_not():
    face = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    passing = [(0.5, 0, -1), (0.5, 0, 1), (0.5, -5, 0.1)]
    ending = [(0.5, 0, 0), (0, -1, 1), (1, -1, 1)]
    for other, count in ((passing, 1), (ending, 0)):
        for turned in ((0, 1, 2), (2, 1, 0)):
            mesh = make([*face, *other], [turned, (3, 4, 5)])
            assert check(mesh).n_self_intersections == count


def test_faces_that_share_a_corner_count_only_if_they_meet_elsewhere():
    corner, base = (0.0, 0, 0), [(1.0, -1, 0), (1.0, 1, 0)]
    through_the_base = [(0.8, 0.1, -1), (0.6, 0, 1)]
    over_the_base = [(2.0, 0, -1), (0.5, 0, 1)]  # the base's far edge passes this one
    beside = [(2.0, 5, -1), (0.5, 5, 1)]
    for other, count in ((through_the_base, 1), (over_the_base, 1), (beside, 0)):
        mesh = make([corner, *base, *other], [(0, 1, 2), (0, 3, 4)])
        assert check(mesh).n_self_intersections == count, other


def test_an_immersed_klein_bottle_crosses_itself():
    assert check(klein_bottle()).n_self_intersections > 0


def test_no_faces_do_not_cross():
    found = find_self_intersections(np.zeros((0, 3)), np.empty((0, 3), dtype=np.int32))
    assert (found.n_pairs, found.first_pair, found.first_place) == (0, None, None)


def test_when_not_asked_nothing_is_said():
    report = check(joined(cube(), cube((0.5, 0.4, 0.3))), self_intersections=False)
    assert report.n_self_intersections is None
    assert report.first_self_intersection is None
    assert "cross" not in report.describe()
