"""meshsdf.mesh.sampling: points on a surface, each place as likely as any other."""

import igl
import numpy as np
import pytest
from scipy import stats

from meshsdf.errors import MeshError
from meshsdf.mesh import Mesh, box_mesh, icosphere, torus
from meshsdf.mesh.sampling import sample_surface

SURPRISE = 1e-3
"""A right sampler fails one such test in a thousand seeds; the seeds here are fixed."""


def areas_of(mesh):
    a, b, c = (mesh.triangles[:, i] for i in range(3))
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)


@pytest.mark.parametrize("scale", [1.0, 1e-12, 1e12])
def test_faces_are_hit_as_often_as_their_area_says(scale):
    shape = torus(1.0, 0.4, n_major=20, n_minor=12)
    mesh = Mesh(scale * shape.vertices + scale, shape.faces)
    found = sample_surface(mesh, 200_000, seed=3)
    seen = np.bincount(found.face_index, minlength=mesh.n_faces)
    expected = areas_of(mesh) / areas_of(mesh).sum() * len(found.points)
    assert expected.min() > 20
    assert stats.chisquare(seen, expected).pvalue > SURPRISE


def test_within_a_face_the_points_are_uniform():
    triangle = np.array([[0.0, 0, 0], [3, 0, 0], [0, 2, 0]])
    found = sample_surface(Mesh(triangle, np.array([[0, 1, 2]], np.int32)), 50_000)
    x, y = found.points[:, 0] / 3, found.points[:, 1] / 2
    # In the triangle x + y <= 1, y / (1 - x) is uniform and x has the distribution 1 - (1 - x)^2
    assert stats.kstest(y / (1 - x), "uniform").pvalue > SURPRISE
    assert stats.kstest(1 - (1 - x) ** 2, "uniform").pvalue > SURPRISE
    assert stats.kstest(1 - (1 - y) ** 2, "uniform").pvalue > SURPRISE
    # The corners share the chance evenly: each weight has the density 2 (1 - w)
    for weight in found.barycentric.T:
        assert stats.kstest(weight, stats.beta(1, 2).cdf).pvalue > SURPRISE


def test_points_lie_on_their_faces_which_libigl_finds_nearest():
    mesh = icosphere(2.0, subdivisions=2, center=(5.0, -3, 1))
    found = sample_surface(mesh, 5_000, seed=1)
    squares, faces, _ = igl.point_mesh_squared_distance(
        found.points, mesh.vertices, mesh.faces.astype(np.int64)
    )
    assert np.sqrt(squares.max()) < 1e-14
    assert (faces == found.face_index).mean() > 0.999
    np.testing.assert_allclose(found.barycentric.sum(axis=1), 1, rtol=1e-15)
    assert found.barycentric.min() >= 0
    again = np.einsum("ni,nij->nj", found.barycentric, mesh.triangles[found.face_index])
    np.testing.assert_allclose(again, found.points, rtol=0, atol=1e-14)
    away = np.einsum("ni,ni->n", found.normals, found.points - [5.0, -3, 1])
    assert away.min() > 1.8
    np.testing.assert_allclose(np.linalg.norm(found.normals, axis=1), 1, rtol=1e-14)


def test_faces_without_area_are_never_drawn():
    box = box_mesh()
    needles = np.array([[0, 0, 1], [2, 2, 2], [3, 4, 3]], np.int32)
    faces = np.concatenate([needles, box.faces[:6], needles, box.faces[6:], needles])
    mesh = Mesh(box.vertices, faces)
    found = sample_surface(mesh, 10_000)
    assert areas_of(mesh)[found.face_index].min() > 0.1


def test_the_seed_alone_decides():
    mesh = box_mesh()
    one, two, other = (sample_surface(mesh, 100, seed=seed).points for seed in (7, 7, 8))
    assert one.tobytes() == two.tobytes() != other.tobytes()
    assert sample_surface(mesh, 0).points.shape == (0, 3)


@pytest.mark.parametrize(
    ("faces", "words"),
    [(np.empty((0, 3), np.int32), "none of the 0"), (np.array([[0, 1, 1]], np.int32), "of the 1")],
)
def test_a_mesh_without_area_is_refused(faces, words):
    with pytest.raises(MeshError, match=words):
        sample_surface(Mesh(np.eye(3), faces), 10)
