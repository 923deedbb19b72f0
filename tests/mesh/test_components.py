"""meshsdf.mesh.components: the parts of a mesh and which way they face."""

import numpy as np
import pytest

from meshsdf.mesh import check

from .shapes import cube, flipped, joined, soup_of, with_t_junction, without_faces


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


def test_parts_that_meet_at_a_t_junction_only_are_one():
    # Both edges of a wall are split, so no edge ties its faces to the rest except the other two
    mesh = soup_of(cube())
    for face in range(3):
        a, b, _ = mesh.faces[face]
        mesh = with_t_junction(mesh, face, 0.5 * (mesh.vertices[a] + mesh.vertices[b]))
    report = check(mesh)
    assert report.two_set
    assert report.n_components == 1
    assert report.components[0].closed


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
    assert doubled.n_duplicate_faces in (0, 2)  # two if the diagonals of the wall agree
    assert check(cube()).strict


def test_orientation_conflicts_are_edges_of_the_flipped_face():
    report = check(flipped(cube(), 4))
    assert report.n_orientation_conflicts == 3
    assert not report.components[0].oriented
    assert np.isfinite(report.components[0].volume)
