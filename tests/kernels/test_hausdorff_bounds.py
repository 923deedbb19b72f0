"""meshsdf.kernels.hausdorff_bounds: no point of a piece is farther than its bound."""

import numpy as np
import pytest
from scipy.spatial import Delaunay

from meshsdf.kernels.hausdorff_bounds import lipschitz_bound, upper_bounds
from meshsdf.mesh import Mesh
from meshsdf.mesh.primitives import box_mesh, icosphere
from meshsdf.report.branch_and_bound import faces_around
from meshsdf.spatial import ClosestPoint


def flat_mesh(seed, n=60):
    points = np.random.default_rng(seed).random((n, 2))
    faces = Delaunay(points).simplices.astype(np.int32)
    return Mesh(np.column_stack([points, np.zeros(n)]), faces)


def mirrored_in_part(mesh, seed):
    """Faces in either orientation: walks around a vertex must not rely on it."""
    faces = mesh.faces.copy()
    over = np.random.default_rng(seed).random(len(faces)) < 0.5
    faces[over] = faces[over, ::-1]
    return Mesh(mesh.vertices, faces)


TARGETS = {
    "sphere": icosphere(subdivisions=1),
    "box": box_mesh(),
    "flat": flat_mesh(0),
    "mixed": mirrored_in_part(icosphere(subdivisions=1), 1),
    "terrain": Mesh(
        flat_mesh(2).vertices + [[0, 0, 0.3]] * np.sin(range(60))[:, None], flat_mesh(2).faces
    ),
}


def bounds(target, corners, *, with_fans, enough=0.0):
    closest = ClosestPoint(target)
    points = (corners - closest.center).reshape(-1, 3)
    squares, slots = closest.search(points, np.empty(0, np.int32))
    pieces = np.arange(len(points), dtype=np.int32).reshape(-1, 3)
    around = faces_around(target) if with_fans else np.empty((0, 6), np.int32)
    last = 5 if with_fans else 3
    known = (enough, last, closest.frames, closest.corners, closest.face_of_slot, around)
    upper = np.empty(len(pieces))
    upper_bounds(points, squares, slots, pieces, 0, len(pieces), *known, upper)
    lipschitz = np.array([lipschitz_bound(points, squares, piece) for piece in pieces])
    return upper, lipschitz


@pytest.mark.parametrize("with_fans", [False, True])
@pytest.mark.parametrize("name", TARGETS)
def test_no_sample_of_a_piece_is_beyond_its_bound(name, with_fans):
    target, rng = TARGETS[name], np.random.default_rng(3)
    n, m = 400, 60
    # Pieces of all sizes around random places of the surface, some of them needles
    place = target.triangles[rng.integers(target.n_faces, size=n)]
    place = np.einsum("nk,nkx->nx", rng.dirichlet(np.ones(3), n), place)
    corners = rng.normal(size=(n, 3, 3))
    corners[::4, 1] = corners[::4, 0] + 0.02 * corners[::4, 1]
    corners = place[:, None] + 10 ** rng.uniform(-2.5, 0, (n, 1, 1)) * corners
    if name == "flat":
        corners[::2, :, 2] = 0
    upper, lipschitz = bounds(target, corners, with_fans=with_fans)
    weights = np.concatenate([np.eye(3), rng.dirichlet([0.7] * 3, m)])
    samples = np.einsum("sk,nkx->nsx", weights, corners).reshape(-1, 3)
    seen = ClosestPoint(target)(samples).distance.reshape(n, -1).max(axis=1)
    assert (seen <= upper + 1e-13).all()
    assert (upper <= lipschitz + 1e-15).all()
    assert (upper < 0.9 * lipschitz).mean() > 0.1


def test_a_piece_between_two_faces_apart_gets_the_distance_of_its_farthest_point():
    # Planes z = 0 and z = 1; on a piece across z = 1/2, that is 1/2 where nothing else is nearer
    vertices = 50 * np.array([[-1.0, -1, 0], [1, -1, 0], [0, 1, 0]])
    vertices = np.vstack([vertices, vertices + np.array([0, 0, 1])])
    target = Mesh(vertices, np.array([[0, 1, 2], [3, 4, 5]], np.int32))
    rng = np.random.default_rng(5)
    corners = rng.uniform(-1, 1, (200, 3, 3))
    corners[:, :, 2] = rng.uniform(0.1, 0.9, (200, 3))
    upper, lipschitz = bounds(target, corners, with_fans=False)
    heights = np.sort(corners[:, :, 2], axis=1)
    across = (heights[:, 0] < 0.5) & (heights[:, 2] > 0.5)
    assert across.sum() > 100
    np.testing.assert_allclose(upper[across], 0.5, atol=1e-9)
    farthest = np.minimum(heights, 1 - heights).max(axis=1)
    np.testing.assert_allclose(upper[~across], farthest[~across], atol=1e-13)
    assert (lipschitz[across] > 0.5).all()


def test_pieces_of_the_surface_itself_over_one_two_or_a_fan_of_faces_have_bound_zero():
    # Four faces around the origin in one plane
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]])
    faces = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]], np.int32)
    target = Mesh(vertices, faces)
    one = [[0.1, 0.1, 0], [0.3, 0.1, 0], [0.1, 0.3, 0]]
    two = [[0.1, 0.2, 0], [-0.1, 0.3, 0], [0.3, 0.3, 0]]
    fan = [[0.3, 0.1, 0], [-0.2, 0.2, 0], [-0.1, -0.3, 0]]
    pieces = np.array([one, two, fan])
    upper, lipschitz = bounds(target, pieces, with_fans=True)
    assert lipschitz.min() > 0.05
    assert upper.max() < 1e-15
    assert bounds(target, pieces, with_fans=False)[0][2] > 0.05


def test_neighbours_are_found_by_position_in_a_soup():
    box = box_mesh()
    soup = Mesh(box.triangles.reshape(-1, 3), np.arange(36, dtype=np.int32).reshape(-1, 3))
    around = faces_around(soup)
    assert len(np.unique(around[:, :3])) == 8
    for face, row in enumerate(around):
        for k in range(3):
            other = around[row[3 + k]]
            assert face in other[3:]
            assert {row[k], row[(k + 1) % 3]} <= set(other[:3])
    single = faces_around(Mesh(np.eye(3), np.array([[0, 1, 2]], np.int32)))
    assert (single[0, 3:] == -1).all()
