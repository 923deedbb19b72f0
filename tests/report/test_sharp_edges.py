"""meshsdf.report.sharp_edges: which edges are sharp, and how far they are from a surface."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from meshsdf.mesh import Mesh
from meshsdf.mesh.primitives import box_mesh, icosphere
from meshsdf.report.sharp_edges import sharp_edges, sharp_segments
from meshsdf.spatial.closest_point import ClosestPoint

SMALL, LARGE = box_mesh((1, 1, 1)), box_mesh((1.2, 1.2, 1.2))


def measured(source, target, voxel_size=0.05, tolerance=1e-4):
    return sharp_edges(source, target, voxel_size=voxel_size, tolerance=tolerance)


def test_a_box_has_twelve_sharp_edges_and_its_diagonals_are_none():
    segments = sharp_segments(SMALL)
    lengths = np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1)
    assert lengths == pytest.approx(np.ones(12))
    assert len(sharp_segments(icosphere(subdivisions=3))) == 0


def test_faces_that_disagree_about_their_front_make_no_edge_sharp():
    turned = SMALL.faces.copy()
    turned[::3] = turned[::3, ::-1]
    assert len(sharp_segments(Mesh(SMALL.vertices, turned))) == 12
    soup = SMALL.triangles.reshape(-1, 3)  # every face with corners of its own
    assert len(sharp_segments(Mesh(soup, np.arange(36, dtype=np.int32).reshape(-1, 3)))) == 12


def test_the_angle_is_where_it_says():
    def roof(degrees):
        half = np.radians(degrees) / 2  # each side slopes by half the turn
        side = [np.cos(half), -np.sin(half)]
        points = [[0, 0, 0], [0, 1, 0], [side[0], 0, side[1]], [-side[0], 0, side[1]]]
        return Mesh(np.array(points, float), np.array([[0, 2, 1], [0, 1, 3]], np.int32))

    assert [len(sharp_segments(roof(degrees), 30)) for degrees in (29.9, 30.1)] == [0, 1]


def test_between_two_boxes_the_distances_are_those_of_corners():
    outwards = measured(SMALL, LARGE)
    assert outwards.distance.contains(0.1)
    assert outwards.distance.width <= 1.1e-4
    assert (outwards.kept.lower, outwards.kept.upper) == (0, 0)
    assert outwards.length == pytest.approx(12)
    inwards = measured(LARGE, SMALL)
    assert inwards.distance.contains(0.1 * np.sqrt(3))
    assert np.abs(inwards.witness) == pytest.approx([0.6] * 3, abs=1e-3)


def test_edges_that_lie_on_the_other_surface_are_kept():
    same = measured(SMALL, SMALL)
    assert same.distance.lower == 0
    assert same.distance.upper <= 1.01e-4  # as narrow as asked
    assert (same.kept.lower, same.kept.upper) == (1, 1)


def test_the_share_kept_is_that_of_the_length_within_a_tenth_of_a_voxel():
    corner = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
    wedge = Mesh(corner, np.array([[0, 1, 2], [1, 0, 3]], np.int32))
    # Along its sharp edge, x from 0 to 1 at y = z = 0, a sloping sheet is x / sqrt(2) away
    sheet = np.array([[0, -9, 0], [0, 9, 0], [9, -9, -9], [9, 9, -9]], float)
    slope = Mesh(sheet, np.array([[0, 1, 2], [1, 3, 2]], np.int32))
    found = measured(wedge, slope, voxel_size=1.0)
    assert found.n_edges == 1
    assert found.distance.contains(1 / np.sqrt(2))
    assert found.kept.contains(0.1 * np.sqrt(2))
    assert found.kept.width < 0.1


seeds = st.integers(0, 2**32 - 1)


@given(seeds)
@settings(max_examples=20)
def test_no_sample_is_farther_and_none_of_a_fine_set_is_much_nearer(seed):
    random = np.random.default_rng(seed)
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], np.int32)
    source, target = (Mesh(random.normal(size=(4, 3)), faces) for _ in range(2))
    segments = sharp_segments(source)
    found = measured(source, target, tolerance=1e-3)
    parts = np.linspace(0, 1, 401)[:, None, None]
    points = ((1 - parts) * segments[:, 0] + parts * segments[:, 1]).reshape(-1, 3)
    seen = ClosestPoint(target)(points).distance.max()
    spacing = np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1).max() / 400
    assert seen <= found.distance.upper
    # Between two samples the distance grows by at most half of their spacing
    assert found.distance.lower <= seen + spacing / 2
    assert found.distance.width <= 1.01e-3
    assert ClosestPoint(target)(found.witness[None]).distance[0] >= found.distance.lower


def test_a_smooth_mesh_has_nothing_to_measure():
    assert measured(icosphere(subdivisions=2), SMALL) is None
