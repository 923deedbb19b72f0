"""meshsdf.mesh.measures: sizes against closed formulas and trimesh, counts against Euler."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf.mesh import Mesh
from meshsdf.mesh.measures import (
    area,
    euler_number,
    face_areas,
    face_normals,
    genus,
    is_watertight,
    n_boundary_loops,
    n_components,
    volume,
    welded,
)
from meshsdf.mesh.primitives import box_mesh, cylinder, icosphere, tetrahedron
from meshsdf.mesh.tubes import torus, trefoil_tube

NO_FACES = Mesh(np.zeros((2, 3)), np.zeros((0, 3), dtype=np.int32))
CLOSED = [
    icosphere(2.0, subdivisions=2),
    box_mesh((1.0, 2.0, 3.0), center=(4.0, 5.0, 6.0)),
    cylinder(1.0, 2.0, n_around=9),
    torus(1.0, 0.3, n_major=12, n_minor=8),
    trefoil_tube(0.2, n_along=60, n_around=8),
]


def joined(*meshes):
    """One mesh of several, sharing no vertex."""
    offsets = np.cumsum([0, *(mesh.n_vertices for mesh in meshes)])[:-1]
    faces = [mesh.faces + np.int32(offset) for mesh, offset in zip(meshes, offsets, strict=True)]
    return Mesh(np.vstack([mesh.vertices for mesh in meshes]), np.vstack(faces))


def without(mesh, *faces):
    return Mesh(mesh.vertices, np.delete(mesh.faces, faces, axis=0))


def inside_out(mesh):
    return Mesh(mesh.vertices, mesh.faces[:, ::-1])


@pytest.mark.parametrize("mesh", CLOSED, ids=lambda mesh: f"{mesh.n_faces} faces")
def test_measures_agree_with_trimesh(mesh):
    other = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    assert_allclose(area(mesh), other.area, rtol=1e-12)
    assert_allclose(volume(mesh), other.volume, rtol=1e-12)
    assert_allclose(face_areas(mesh), other.area_faces, rtol=1e-12)
    assert_allclose(face_normals(mesh), other.face_normals, atol=1e-12)
    assert euler_number(mesh) == other.euler_number
    assert is_watertight(mesh) == (other.is_watertight and other.is_winding_consistent)
    assert n_components(mesh) == other.body_count


def test_a_triangle_has_the_area_and_normal_of_heron():
    triangle = Mesh(np.array([[0.0, 0, 0], [3, 0, 0], [0, 4, 0]]), np.array([[0, 1, 2]], np.int32))
    assert face_areas(triangle).tolist() == [6.0]
    assert face_normals(triangle).tolist() == [[0.0, 0.0, 1.0]]


def test_the_sphere_approaches_its_formulas_from_below_with_order_two():
    levels = np.arange(1, 6)
    meshes = [icosphere(1.0, subdivisions=int(level)) for level in levels]
    for exact, measure in [(4 * np.pi, area), (4 / 3 * np.pi, volume)]:
        errors = np.array([exact - measure(mesh) for mesh in meshes])
        assert (errors > 0).all()
        # Halving the edges quarters the error.
        assert_allclose(errors[2:-1] / errors[3:], 4, rtol=0.03)


def test_turning_the_faces_over_turns_the_sign_and_the_normals():
    mesh = CLOSED[0]
    assert_allclose(volume(inside_out(mesh)), -volume(mesh), rtol=1e-13)
    assert_allclose(face_normals(inside_out(mesh)), -face_normals(mesh), atol=1e-15)
    assert area(inside_out(mesh)) == pytest.approx(area(mesh), rel=1e-14)


def test_a_hollow_is_subtracted():
    shell = joined(box_mesh((4.0, 4.0, 4.0)), inside_out(box_mesh((2.0, 2.0, 2.0))))
    assert volume(shell) == 56.0
    assert n_components(shell) == 2
    assert euler_number(shell) == 4


@given(scale=st.integers(-60, 60), turn=st.permutations(range(3)))
@settings(max_examples=20, deadline=None)
def test_powers_of_two_and_relabelled_axes_change_sizes_exactly_as_they_must(scale, turn):
    mesh = CLOSED[2]
    sign = np.linalg.det(np.eye(3)[turn])
    other = Mesh(2.0**scale * mesh.vertices[:, turn], mesh.faces)
    assert_allclose(area(other), 4.0**scale * area(mesh), rtol=1e-14)
    assert_allclose(volume(other), sign * 8.0**scale * volume(mesh), rtol=1e-13)
    assert_allclose(face_normals(other), sign * face_normals(mesh)[:, turn], atol=1e-14)


def test_volume_does_not_fade_far_from_the_origin():
    far = 2.0**30  # 1e9, where the spacing of doubles is 2**-22: cube corners stay exact
    cube = box_mesh((1.0, 1.0, 1.0), center=(far, -far, far))
    assert volume(cube) == 1.0
    sphere = icosphere(1.0, center=(1e7, 1e7, 1e7))
    # Corners move by up to 2**-30 (half a spacing), so volume by at most area times that.
    assert abs(volume(sphere) - volume(icosphere(1.0))) < 4 * np.pi * np.sqrt(3) * 2.0**-30


def test_normals_survive_tiny_units_and_are_zero_without_area():
    speck = tetrahedron(1e-200)
    assert_allclose(face_normals(speck), face_normals(tetrahedron(1.0)), atol=1e-12)
    line = Mesh(np.array([[0.0, 0, 0], [1, 1, 1], [2, 2, 2]]), np.array([[0, 1, 2]], np.int32))
    assert_array_equal(face_normals(line), np.zeros((1, 3)))
    assert face_areas(line).tolist() == [0.0]


def test_watertight_needs_every_edge_twice_and_in_both_directions():
    cube = box_mesh()
    flipped = Mesh(cube.vertices, np.vstack([cube.faces[:1, ::-1], cube.faces[1:]]))
    unwelded = Mesh(
        cube.triangles.reshape(-1, 3).copy(), np.arange(36, dtype=np.int32).reshape(12, 3)
    )
    repeated = Mesh(cube.vertices, np.vstack([cube.faces, [[0, 0, 1]]]).astype(np.int32))
    doubled = Mesh(cube.vertices, np.vstack([cube.faces, cube.faces]))
    assert is_watertight(cube)
    assert is_watertight(joined(cube, torus()))
    for broken in (flipped, unwelded, repeated, doubled, without(cube, 3), NO_FACES):
        assert not is_watertight(broken)


def test_loops_count_the_holes_by_index():
    sphere = icosphere(1.0, subdivisions=2)
    assert n_boundary_loops(sphere) == 0
    holes = without(sphere, 0, 100, 200)
    assert n_boundary_loops(holes) == 3
    assert euler_number(holes) == 2 - 3
    open_cylinder = without(cylinder(n_around=10), *range(20, 40))
    assert n_boundary_loops(open_cylinder) == 2
    soup = Mesh(
        sphere.triangles.reshape(-1, 3).copy(), np.arange(960, dtype=np.int32).reshape(-1, 3)
    )
    assert n_boundary_loops(soup) == n_components(soup) == 320


def test_components_meet_at_shared_edges_only():
    two = joined(box_mesh(), box_mesh(center=(1.0, 1.0, 0.0)))
    assert n_components(two) == 2
    corner = two.faces.copy()
    corner[corner == 8] = 6  # one end of the edge along which they touch becomes one vertex
    touching = Mesh(two.vertices, corner)
    assert n_components(touching) == 2
    assert euler_number(touching) == 3
    assert is_watertight(touching)
    corner[corner == 9] = 7
    hinged = Mesh(two.vertices, corner)
    assert n_components(hinged) == 1
    assert not is_watertight(hinged)


def test_unused_vertices_count_for_nothing_and_no_faces_measure_zero():
    cube = box_mesh()
    loose = Mesh(np.vstack([cube.vertices, [[1e6, 0, 0]]]), cube.faces)
    assert (euler_number(loose), n_components(loose), volume(loose)) == (2, 1, 1.0)
    counts = (euler_number(NO_FACES), n_components(NO_FACES), n_boundary_loops(NO_FACES))
    assert counts == (0, 0, 0)
    assert (area(NO_FACES), volume(NO_FACES)) == (0.0, 0.0)
    assert face_normals(NO_FACES).shape == (0, 3)


def test_edges_that_shrank_to_a_point_change_no_count_of_the_welded_shape():
    ball = icosphere(1.0, subdivisions=1)
    a, b = ball.faces[0, :2]
    vertices = ball.vertices.copy()
    vertices[a] = vertices[b]
    joined = welded(Mesh(vertices, ball.faces))
    assert joined.n_faces == ball.n_faces - 2
    assert (euler_number(joined), n_components(joined), is_watertight(joined)) == (2, 1, True)


def test_genus_counts_the_handles_of_all_components():
    ring = torus(1.0, 0.3, n_major=12, n_minor=8)
    assert genus(icosphere(2.0, subdivisions=2)) == 0
    assert genus(ring) == 1
    assert genus(joined(ring, box_mesh(), ring)) == 2
    assert genus(Mesh(ring.vertices, ring.faces[1:])) is None


def test_bodies_that_touch_at_a_vertex_keep_their_own_genus():
    # The far corner of one box is the near corner of the other: one vertex, two fans
    two = welded(joined(box_mesh(), box_mesh(center=(1.0, 1.0, 1.0))))
    assert two.n_vertices == 15
    assert is_watertight(two)
    assert genus(two) == 0
