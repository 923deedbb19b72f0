"""meshsdf.mesh.crack_repair and rim_graph: how far vertices move to close a crack, and a proof."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf.mesh import Mesh, check
from meshsdf.mesh.primitives import box_mesh, icosphere
from meshsdf.mesh.rim_graph import complement_is_connected, segment_distances
from meshsdf.sdf import choose_sign, mesh_to_band

from .shapes import soup_of, without_faces


def cracked(width: float) -> Mesh:
    """A sphere in two halves whose rims are ``width`` apart along x."""
    ball = icosphere(1.0, subdivisions=3)
    right = ball.triangles.mean(axis=1)[:, 0] > 0
    left, moved = ball.faces[~right], ball.faces[right] + ball.n_vertices
    vertices = np.concatenate([ball.vertices, ball.vertices + np.array([width, 0, 0])])
    return Mesh(vertices, np.concatenate([left, moved]))


@pytest.mark.parametrize("width", [1e-14, 1e-9, 1e-4, 0.01])
def test_a_crack_is_as_wide_as_it_was_made(width):
    report = check(cracked(width), self_intersections=False)
    assert not report.two_set
    assert_allclose(report.crack_width, width, rtol=1e-2)  # 1e-14 is 45 spacings of floats near 1
    assert_allclose(report.repair.certain_beyond, 3 * report.crack_width)
    assert report.recommended_sign == "winding"
    assert "only cracks" in report.describe() or "only a crack" in report.describe()


def test_signs_beyond_the_certificate_are_those_of_the_whole_ball():
    width = 0.004
    mesh = cracked(width)
    band = mesh_to_band(mesh, voxel_size=0.02)
    assert band.sign == "winding"
    points, values = band.to_world(band.active_ijk()), band.active_values()
    beyond = check(mesh, self_intersections=False).repair.certain_beyond
    assert band.uncertain_voxels == (np.abs(values) <= beyond).sum() > 0
    assert_array_equal(band.uncertain_ijk(), band.active_ijk()[np.abs(values) <= beyond])
    clear = (np.abs(values) > beyond) & (np.abs(np.linalg.norm(points, axis=1) - 1) > 0.02)
    assert clear.sum() > 1000
    assert ((values < 0) == (np.linalg.norm(points, axis=1) < 1))[clear].all()


def test_cracks_wider_than_half_a_voxel_get_winding_numbers():
    report = check(cracked(0.01), self_intersections=False)
    assert choose_sign(report, voxel_size=0.05).by_crossings
    wide = choose_sign(report, voxel_size=0.015)
    assert not wide.by_crossings
    assert wide.method == "winding"


def test_a_hole_is_no_crack():
    for mesh in (without_faces(icosphere(1.0), 0), without_faces(box_mesh(), 0, 1)):
        assert check(mesh, self_intersections=False).repair is None


def test_a_soup_with_corners_jittered_by_rounding_closes():
    rng = np.random.default_rng(1)
    soup = soup_of(icosphere(1.0, subdivisions=2))
    jittered = Mesh(soup.vertices + rng.normal(size=soup.vertices.shape) * 1e-12, soup.faces)
    report = check(jittered, self_intersections=False)
    assert not report.two_set
    assert report.crack_width < 1e-11
    assert report.repair.oriented


def test_segment_distances_have_their_closed_form():
    p, q = np.zeros(3), np.array([1.0, 0, 0])
    r = np.array([[0.5, 1, -1], [2.0, 0, 0], [0.2, 0.3, 0], [0.0, 1, 1], [0.5, 0, -1]])
    s = np.array([[0.5, 1, 1], [3.0, 0, 0], [0.8, 0.3, 0], [-1.0, 5, 5], [0.5, 0, 1]])
    assert_allclose(segment_distances(p, q, r, s), [1, 1, 0.3, np.sqrt(2), 0], atol=1e-15)


def test_segment_distances_are_never_above_dense_samples():
    rng = np.random.default_rng(2)
    p, q = rng.normal(size=(2, 3))
    r, s = rng.normal(size=(2, 200, 3))
    t = np.linspace(0, 1, 60)
    one = p + t[:, None] * (q - p)
    two = r[:, None] + t[:, None] * (s - r)[:, None]
    sampled = np.linalg.norm(one[None, :, None] - two[:, None], axis=-1).min(axis=(1, 2))
    found = segment_distances(p, q, r, s)
    assert (found <= sampled + 1e-12).all()
    assert (found >= sampled - 0.1).all()


def test_a_thin_loop_leaves_space_in_one_piece_and_a_cage_is_not_proved():
    angle = np.linspace(0, 2 * np.pi, 20, endpoint=False)
    ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    loop = np.stack([np.arange(20), (np.arange(20) + 1) % 20], axis=1)
    assert complement_is_connected(ring, loop, 1e-3)
    assert not complement_is_connected(ring, loop, 0.3)
    cage = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    edges = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])
    assert complement_is_connected(cage, edges, 0.05)
    assert not complement_is_connected(cage, edges, 0.45)
