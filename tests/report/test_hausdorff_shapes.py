"""meshsdf.report.hausdorff: shapes whose distance is known in closed form."""

import igl
import numpy as np
import pytest

from meshsdf.mesh import Mesh
from meshsdf.mesh.primitives import box_mesh, icosphere
from meshsdf.report.hausdorff import hausdorff, one_sided_hausdorff
from meshsdf.report.tolerance import Tolerance

NARROW = Tolerance(relative=1e-9)
ROUNDING = 1e-12  # 328 u times coordinates below 10, twice


def mesh_of(vertices, faces):
    return Mesh(np.array(vertices, float), np.array(faces, np.int32))


def segments(*ends):
    """Faces without area, one per segment (a, b)."""
    return mesh_of([point for end in ends for point in end], [[2 * i, 2 * i + 1, 2 * i] for i in
                   range(len(ends))])  # fmt: skip


def ring(n, radius, height=0.0):
    angle = 2 * np.pi * np.arange(n) / n
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.full(n, height)])


def assert_narrow(side, truth):
    assert side.distance.lower - ROUNDING <= truth <= side.distance.upper + ROUNDING
    assert side.distance.width <= 1e-9 * truth
    assert side.is_within_tolerance


def test_the_letter_v_is_farthest_from_its_hull_at_the_middle_of_its_mouth():
    # From (0, 2) to the line through (0, 0) and (1, 2); no vertex is off the other shape
    letter = segments(([0, 0, 0], [1, 2, 0]), ([0, 0, 0], [-1, 2, 0]))
    hull = mesh_of([[0, 0, 0], [1, 2, 0], [-1, 2, 0]], [[0, 1, 2]])
    found = hausdorff(hull, letter, tolerance=NARROW)
    assert found.forward.distance.contains(2 / np.sqrt(5))
    np.testing.assert_allclose(found.forward.witness, [0, 2, 0], atol=1e-4)
    np.testing.assert_allclose(np.abs(found.forward.nearest), [0.8, 1.6, 0], atol=1e-4)
    assert found.backward.distance.upper < ROUNDING
    ends = (hull.vertices.copy(), hull.faces.astype(np.int64))
    other = mesh_of([*letter.vertices, [0, 0, 0]], letter.faces)
    assert igl.hausdorff(*ends, other.vertices.copy(), other.faces.astype(np.int64)) < ROUNDING


def test_a_segment_between_two_points_is_farthest_in_the_middle():
    line = segments(([-1, 0, 0], [1, 0, 0]))
    points = mesh_of([[-1, 0, 0], [1, 0, 0]], [[0, 0, 0], [1, 1, 1]])
    side = one_sided_hausdorff(line, points, tolerance=NARROW)
    assert_narrow(side, 1.0)
    np.testing.assert_allclose(side.witness, 0, atol=1e-8)
    np.testing.assert_allclose(np.abs(side.nearest), [1, 0, 0], atol=1e-15)


@pytest.mark.parametrize("length", [0.5, 1.0, 1.7, 20.0])
def test_parallel_segments_are_apart_by_their_overhang(length):
    short, long = segments(([0, 0, 0], [1, 0, 0])), segments(([0, 0, 1], [length, 0, 1]))
    found = hausdorff(long, short, tolerance=NARROW)
    assert_narrow(found.forward, np.hypot(max(length - 1, 0), 1))
    assert_narrow(found.backward, np.hypot(max(1 - length, 0), 1))


def test_skew_segments():
    # Along x at height 0, along y at height 3: the ends are farthest
    found = hausdorff(segments(([-1, 0, 0], [1, 0, 0])), segments(([0, -2, 3], [0, 2, 3])))
    assert found.forward.distance.contains(np.hypot(1, 3))
    assert found.backward.distance.contains(np.hypot(2, 3))


def test_a_square_is_farthest_from_its_frame_at_the_centre():
    corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    square = mesh_of(corners, [[0, 1, 2], [0, 2, 3]])
    frame = segments(*((corners[i], corners[i - 1]) for i in range(4)))
    assert_narrow(one_sided_hausdorff(square, frame, tolerance=NARROW), 0.5)


@pytest.mark.parametrize("tilt", [0.0, 0.7])
def test_a_triangle_is_farthest_from_its_corners_at_its_circumcentre(tilt):
    corners = ring(3, 2.0) @ [[1, 0, 0], [0, np.cos(tilt), np.sin(tilt)], [0, 0, 1]]
    one = Mesh(corners, np.array([[0, 1, 2]], np.int32))
    points = mesh_of(corners, [[0, 0, 0], [1, 1, 1], [2, 2, 2]])
    a, b, c = (np.linalg.norm(corners[i] - corners[i - 1]) for i in range(3))
    area = 0.5 * np.linalg.norm(np.cross(corners[1] - corners[0], corners[2] - corners[0]))
    assert_narrow(one_sided_hausdorff(one, points, tolerance=NARROW), a * b * c / (4 * area))


def test_a_disc_and_its_rim_and_a_disc_above():
    # Regular polygons: the centre is as far from the rim as the middles of its sides
    n = 24
    rim = ring(n, 1.0)
    faces = [[0, i, i + 1] for i in range(1, n - 1)]
    disc = mesh_of(rim, faces)
    edge = segments(*((rim[i], rim[i - 1]) for i in range(n)))
    assert_narrow(one_sided_hausdorff(disc, edge, tolerance=NARROW), np.cos(np.pi / n))
    turned = mesh_of(ring(n, 1.0, 0.25), (np.array(faces) + 5) % n)
    found = hausdorff(disc, turned, tolerance=NARROW)
    assert_narrow(found.forward, 0.25)
    assert_narrow(found.backward, 0.25)


@pytest.mark.parametrize("factor", [1.01, 1.5, 4.0])
def test_concentric_spheres_are_apart_by_the_difference_of_radii(factor):
    # Outwards, a vertex is farthest from the face plane below it: not less than from the sphere
    inner, outer = icosphere(subdivisions=3), icosphere(factor, subdivisions=3)
    found = hausdorff(inner, outer)
    assert found.backward.distance.contains(factor - 1)  # vertex to vertex along a radius
    sag = 1 - np.linalg.norm(inner.triangles.mean(axis=1), axis=1).min()
    assert factor * (1 - sag) - 1 - ROUNDING <= found.forward.distance.lower
    assert found.forward.distance.upper <= (factor - 1) * 1.0011


def test_nested_boxes():
    # Inwards from corner to corner; outwards from (0, y, +-0.5) to the sides at x = +-1.5
    found = hausdorff(box_mesh((1, 1, 1)), box_mesh((3, 4, 5)), tolerance=NARROW)
    assert_narrow(found.backward, np.linalg.norm([1, 1.5, 2]))
    assert_narrow(found.forward, 1.5)
