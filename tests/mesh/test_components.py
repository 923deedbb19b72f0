"""meshsdf.mesh.components: the parts of a mesh and which way they face."""

import numpy as np
import pytest

from meshsdf.mesh import check

from .shapes import cube, flipped, joined, make, without_faces


def test_measures_of_a_cube_far_from_the_origin():
    (part,) = check(cube((1e6, -2e6, 3e6), 2.0)).components
    assert part.n_faces == 12
    assert part.area == pytest.approx(24, rel=1e-12)
    assert part.volume == pytest.approx(8, rel=1e-12)
    assert part.closed
    assert part.oriented
    assert not part.inside_out
    assert part.box.lower.tolist() == [1e6, -2e6, 3e6]
    assert part.box.upper.tolist() == [1e6 + 2, -2e6 + 2, 3e6 + 2]


def test_a_turned_cube_is_inside_out_unless_it_can_be_a_cavity():
    turned = flipped(cube((1, 1, 1)), *range(12))
    assert [p.inside_out for p in check(turned).components] == [True]
    assert [p.inside_out for p in check(joined(cube((5, 0, 0)), turned)).components] == [
        False,
        True,
    ]
    nested = check(joined(cube(size=3.0), turned)).components
    assert [p.inside_out for p in nested] == [False, False]
    assert [round(p.volume) for p in nested] == [27, -1]


def test_open_and_closed_parts_are_told_apart():
    report = check(joined(without_faces(cube(), 0), cube((3, 0, 0))))
    assert [part.closed for part in report.components] == [False, True]
    assert [part.n_faces for part in report.components] == [11, 12]
    assert not report.two_set


def test_a_wall_tied_to_its_cube_by_t_junctions_only_is_the_same_part():
    rim = [(0, 0), (0, 0.5), (0, 1), (0.5, 1), (1, 1), (1, 0.5), (1, 0), (0.5, 0)]
    wall = make([(0, y, z) for y, z in [*rim, (0.5, 0.5)]], [(i, (i + 1) % 8, 8) for i in range(8)])
    report = check(joined(without_faces(cube(), 0, 1), wall))
    assert report.two_set
    assert not report.two_set_by_welding
    assert report.n_tjunction_edges == 12
    assert [part.n_faces for part in report.components] == [18]
    assert report.components[0].closed
    apart = check(joined(without_faces(cube(), 0, 1), make(wall.vertices - 1, wall.faces)))
    assert [part.closed for part in apart.components] == [False, False]


def test_vertices_where_sheets_touch_are_counted():
    assert check(cube()).n_nonmanifold_vertices == 0
    assert check(joined(cube(), cube((1, 1, 1)))).n_nonmanifold_vertices == 1
    shared_edge = check(joined(cube(), cube((1, 1, 0))))
    assert shared_edge.n_nonmanifold_vertices == 2
    assert shared_edge.n_nonmanifold_edges == 1
    assert check(without_faces(cube(), 0)).n_nonmanifold_vertices == 0


def test_sheets_that_lie_double_are_not_strict():
    doubled = check(joined(cube(), cube((1, 0, 0))))
    assert not doubled.strict
    assert doubled.n_duplicate_faces == doubled.n_opposed_duplicates == 2
    assert check(cube()).strict


def test_orientation_conflicts_are_edges_of_the_flipped_face():
    report = check(flipped(cube(), 4))
    assert report.n_orientation_conflicts == 3
    assert not report.components[0].oriented
    assert np.isfinite(report.components[0].volume)
