"""meshsdf.ray.normals: smooth where the surface is, with creases kept."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from meshsdf.mesh import Mesh
from meshsdf.mesh.measures import face_normals
from meshsdf.mesh.primitives import box_mesh, cylinder, icosphere
from meshsdf.ray.normals import is_fine, smooth_normals


@pytest.mark.parametrize("subdivisions", [3, 4, 5])
def test_on_a_sphere_they_point_away_from_the_middle(subdivisions):
    ball = icosphere(subdivisions=subdivisions)
    sine = np.linalg.norm(np.cross(smooth_normals(ball), ball.triangles), axis=2)
    # A corner is seen from the middle of its face at an angle of up to 0.58 edges h. Around most
    # vertices these cancel, but not where six faces differ: there the sides of the icosahedron
    # were, and the mean is off by the difference of their sizes, of O(h)
    longest = np.linalg.norm(np.diff(ball.triangles, axis=1), axis=2).max()
    assert sine.max() <= 0.04 * longest
    assert np.median(sine) <= 0.01 * longest


def test_the_creases_of_a_box_are_kept():
    box = box_mesh((1.0, 2.0, 3.0))
    expected = np.repeat(face_normals(box)[:, None], 3, axis=1)
    assert_allclose(smooth_normals(box), expected, atol=1e-15)
    # but they are not if the crease angle is wider than a right angle
    assert np.abs(smooth_normals(box, crease=91) - expected).max() > 0.4


def test_a_cylinder_is_round_at_its_side_and_flat_at_its_ends():
    tube = cylinder(n_around=40)
    normals, corners = smooth_normals(tube), tube.triangles
    at_end = np.abs(face_normals(tube)[:, 2]) > 0.5
    assert_allclose(np.abs(normals[at_end, :, 2]), 1, atol=1e-12)
    side = normals[~at_end]
    assert_allclose(side[..., :2], corners[~at_end, :, :2], atol=1e-12)


def test_vertices_that_are_not_joined_are_joined_by_their_positions():
    ball = icosphere(subdivisions=2)
    torn = Mesh(ball.triangles.reshape(-1, 3), np.arange(960, dtype=np.int32).reshape(-1, 3))
    assert_allclose(smooth_normals(torn), smooth_normals(ball), atol=1e-14)


def test_faces_wound_the_other_way_keep_their_side_and_do_not_disturb_their_neighbours():
    ball = icosphere(subdivisions=3)
    faces = ball.faces.copy()
    faces[::3] = faces[::3, ::-1]
    mixed, normals = smooth_normals(Mesh(ball.vertices, faces)), smooth_normals(ball)
    assert_allclose(mixed[1::3], normals[1::3], atol=1e-12)
    assert_allclose(mixed[::3], -normals[::3, ::-1], atol=1e-12)


def test_a_crowded_vertex_and_faces_without_area_do_no_harm():
    fan = cylinder(n_around=600)
    assert_allclose(np.linalg.norm(smooth_normals(fan), axis=2), 1, atol=1e-12)
    flat = Mesh(np.eye(3), np.array([[0, 1, 2], [0, 0, 1], [1, 1, 1]], np.int32))
    normals = smooth_normals(flat)
    assert_allclose(normals[0], 1 / np.sqrt(3), atol=1e-15)
    assert (normals[1:] == 0).all()


def test_small_faces_are_fine_and_large_ones_are_not():
    assert is_fine(icosphere(subdivisions=4))
    assert not is_fine(icosphere(subdivisions=2))
    assert not is_fine(box_mesh())
