"""meshsdf.mesh.holes: rims as loops, and how far they reach."""

import numpy as np
import pytest

from meshsdf.mesh import check
from meshsdf.mesh.holes import trace_holes

from .shapes import cube, joined, make, moebius_band, without_faces


def test_a_missing_wall_is_one_square_hole_where_it_was():
    (hole,) = check(without_faces(cube((1, 2, 3), 2.0), 0, 1)).holes  # the wall x = 1
    assert hole.n_edges == len(hole.points) == 4
    assert hole.closed
    assert hole.length == 8.0
    assert hole.center.tolist() == [1, 3, 4]
    assert {tuple(p) for p in hole.points.tolist()} == {
        (1.0, y, z) for y in (2.0, 4.0) for z in (3.0, 5.0)
    }


def test_holes_that_touch_at_a_vertex_are_cut_apart_and_the_longest_comes_first():
    report = check(joined(without_faces(cube(), 0), without_faces(cube((1, 1, 1), 2.0), 0)))
    assert [hole.n_edges for hole in report.holes] == [3, 3]
    assert report.holes[0].length == 2 * report.holes[1].length
    bow_tie = np.array([(0, 1), (2, 0), (1, 2), (3, 4), (0, 3), (4, 0)], dtype=np.int32)
    points = np.array([(0.0, 0, 0), (1, 0, 0), (1, 1, 0), (-2, 0, 0), (-2, -2, 0)])
    assert [len(hole.points) for hole in trace_holes(points, bow_tie)] == [3, 3]


def test_the_rim_of_a_moebius_band_is_one_loop():
    (hole,) = check(moebius_band(20)).holes
    assert hole.n_edges == 40


def test_the_hull_of_a_round_rim_reaches_its_bound():
    n = 2000
    angle = 2 * np.pi * np.arange(n) / n
    rim = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    cone = make([*rim, (0, 0, 3.0)], [(i, (i + 1) % n, n) for i in range(n)])
    (hole,) = check(cone, self_intersections=False).holes
    assert hole.n_edges == n
    # The centre of the disc is 1 away; a polygon of n sides is shorter by (π/n)²/6
    assert hole.reach == pytest.approx(1, rel=(np.pi / n) ** 2)


def test_no_point_of_a_hull_is_further_from_its_rim_than_the_bound():
    rng = np.random.default_rng(3)
    for n in (3, 4, 7, 20):
        corners = rng.normal(size=(n, 3)) * rng.uniform(0.1, 3, 3)
        segments = np.stack([np.arange(n), (np.arange(n) + 1) % n], axis=1).astype(np.int32)
        (hole,) = trace_holes(corners, segments)
        inside = rng.dirichlet(np.full(n, 0.5), 500) @ corners
        rim = np.concatenate(
            [
                np.linspace(p, q, 50)
                for p, q in zip(hole.points, np.roll(hole.points, -1, axis=0), strict=True)
            ]
        )
        distance = np.linalg.norm(inside[:, None] - rim[None], axis=2).min(axis=1)
        step = hole.length / 49  # the sampled rim is coarser than the rim
        assert distance.max() <= hole.reach + step / 2


def test_fillings_within_the_hulls_agree_beyond_the_certain_distance():
    from . import oracle_two_set as oracle

    open_box = without_faces(cube(), 0, 1)
    report = check(open_box)
    (hole,) = report.holes
    rng = np.random.default_rng(6)
    points = rng.uniform(-0.7, 1.7, (200, 3))
    rim = np.concatenate(
        [
            np.linspace(p, q, 40)
            for p, q in zip(hole.points, np.roll(hole.points, -1, axis=0), strict=True)
        ]
    )
    far = np.linalg.norm(points[:, None] - rim[None], axis=2).min(axis=1) > report.certain_beyond
    direction = rng.normal(size=(1, 3))
    signs = []
    for apex in (hole.center, hole.points[0] * 0.6 + hole.points[2] * 0.4, hole.points[1]):
        n = open_box.n_vertices
        corners = [*open_box.vertices, *hole.points, apex]
        cone = [(n + i, n + (i + 1) % 4, n + 4) for i in range(4)]
        filled = make(corners, [*open_box.faces, *cone])
        assert check(filled).two_set
        signs.append([oracle.ray_votes(filled, p, direction)[0] for p in points[far]])
    assert signs[0] == signs[1] == signs[2]
    assert {0, 1} == set(signs[0])
