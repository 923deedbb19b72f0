"""meshsdf.spatial.ray_hits: the nearest hit along rays, and nothing slips through."""

import igl
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf.errors import SpatialError
from meshsdf.mesh import Mesh
from meshsdf.mesh.primitives import box_mesh, icosphere
from meshsdf.mesh.tubes import trefoil_tube
from meshsdf.spatial.ray_hits import RayHits

U = 2.0**-53


def random_soup(seed, m=200):
    """Triangles of all sizes; some are segments and points."""
    rng = np.random.default_rng(seed)
    size = 10.0 ** rng.uniform(-3, 0, (m, 1, 1))
    corners = rng.normal(size=(m, 1, 3)) + size * rng.normal(size=(m, 3, 3))
    corners[::10, 1] = corners[::10, 0]
    corners[::20, 2] = corners[::20, 0]
    corners[5::10, 2] = 0.5 * (corners[5::10, 0] + corners[5::10, 1])
    return Mesh(corners.reshape(-1, 3), np.arange(3 * m, dtype=np.int32).reshape(-1, 3))


def random_rays(seed, n=1500, size=1.0):
    """From all around and inside, towards all sides, of lengths from 1e-6 to 1e6."""
    rng = np.random.default_rng(seed)
    origins = size * 10.0 ** rng.uniform(-1, 1.5, (n, 1)) * rng.normal(size=(n, 3))
    aims = size * rng.normal(size=(n, 3))
    return origins, 10.0 ** rng.uniform(-6, 6, (n, 1)) * (aims - origins)


def by_brute_force(origins, directions, triangles):
    """Moeller and Trumbore's formula, each ray against each face, in extended precision.

    Returns the nearest distance and face, and how far the ray's passing a face or missing it is
    from being doubtful, in barycentrics.
    """
    o, d = (array[:, None].astype(np.longdouble) for array in (origins, directions))
    a, b, c = (triangles[None, :, k].astype(np.longdouble) for k in range(3))
    length = np.sqrt((d * d).sum(-1))
    across = np.cross(d, c - a)
    determinant = ((b - a) * across).sum(-1)
    sides = np.maximum(np.abs(b - a), np.abs(c - a)).max(-1)
    has_area = np.abs(np.cross(b - a, c - a)).max(-1) > 1e-12 * sides**2
    safe = np.where(has_area & (determinant != 0), determinant, 1)
    v = ((o - a) * across).sum(-1) / safe
    other = np.cross(o - a, b - a)
    w = (d * other).sum(-1) / safe
    t = ((c - a) * other).sum(-1) / safe
    least = np.minimum(np.minimum(v, w), 1 - v - w)
    is_hit = has_area & (least >= 0) & (t >= 0)
    distance = np.where(is_hit, t * length, np.inf)
    doubt = np.where(has_area & (t >= 0), np.abs(least), np.inf).min(axis=1)
    nearest = distance.argmin(axis=1)
    shortest = distance.min(axis=1)
    return shortest.astype(float), np.where(shortest < np.inf, nearest, -1), doubt.astype(float)


@pytest.mark.parametrize(("scale", "offset"), [(1, 0), (1e-9, 0), (1e9, 0), (1, 1e6), (1e-3, 1e3)])
def test_hits_are_those_of_brute_force(scale, offset):
    soup = random_soup(0)
    mesh = Mesh(scale * soup.vertices + offset, soup.faces)
    origins, directions = random_rays(1)
    origins, directions = scale * origins + offset, scale * directions
    hits = RayHits(mesh)(origins, directions)
    center = mesh.box.center
    truth, face, doubt = by_brute_force(origins - center, directions, mesh.triangles - center)
    # The corners move by 16 u (|p - c| + r); the smallest faces are 1e-3 of the mesh's size
    bound = 16 * U * (np.linalg.norm(origins - center, axis=1) + mesh.box.diagonal)
    clear = doubt > 1e3 * bound / (1e-3 * scale)
    assert clear.mean() > 0.95
    assert 0.2 < (face[clear] >= 0).mean() < 0.8
    assert_array_equal(hits.face_index[clear], face[clear])
    hit = clear & (face >= 0)
    normals = np.cross(*np.moveaxis(np.diff(mesh.triangles[face[hit]], axis=1), 1, 0))
    slant = np.abs(np.einsum("nx,nx->n", normals, directions[hit]))
    slant /= np.linalg.norm(normals, axis=1) * np.linalg.norm(directions[hit], axis=1)
    error = np.abs(hits.distance[hit] - truth[hit])
    # A sliver's plane turns when its corners move: allow for its longest side over its height
    sides = np.linalg.norm(np.diff(mesh.triangles[face[hit]], axis=1), axis=2).max(axis=1)
    thin = sides**2 / np.linalg.norm(normals, axis=1)
    assert (error <= 4 * thin * bound[hit] / slant).all()
    missed = clear & (face < 0)
    assert np.isinf(hits.distance[missed]).all()
    assert (hits.barycentric[missed] == 0).all()


def test_libigl_finds_the_same_hits():
    mesh = trefoil_tube(n_along=60, n_around=12)
    rng = np.random.default_rng(2)
    origins = 3 * rng.normal(size=(200, 3))
    directions = rng.normal(size=(200, 3)) - origins
    hits = RayHits(mesh)(origins, directions)
    faces = mesh.faces.astype(np.int64)
    length = np.linalg.norm(directions, axis=1)
    n_hit = 0
    for n, (origin, direction) in enumerate(zip(origins, directions, strict=True)):
        found = igl.ray_mesh_intersect(origin, direction, mesh.vertices, faces)
        assert (len(found) > 0) == (hits.face_index[n] >= 0)
        if len(found):
            n_hit += 1
            assert found[0][0] == hits.face_index[n]
            # its numbers are float32
            assert_allclose(hits.distance[n], found[0][1] * length[n], rtol=1e-5)
    assert 20 < n_hit < 180


def targets(mesh):
    """Vertices, edges' middles, and other places on edges, as numbers can say them."""
    a, b, _ = np.moveaxis(mesh.triangles, 1, 0)
    return np.concatenate([mesh.vertices, 0.5 * (a + b), 0.7 * a + 0.3 * b])


@pytest.mark.parametrize("offset", [0.0, 1e5], ids=["at the origin", "far from it"])
def test_no_ray_from_inside_slips_through_a_vertex_or_an_edge(offset):
    ball = icosphere(subdivisions=4, center=(offset, offset, -offset))
    aims = targets(ball)
    rng = np.random.default_rng(3)
    origins = rng.uniform(-0.4, 0.4, (25, 3)) + ball.box.center
    origins[0] = ball.box.center
    pairs = np.stack(np.broadcast_arrays(origins[:, None], aims[None]), axis=2).reshape(-1, 2, 3)
    rays = pairs[:, 0].copy(), pairs[:, 1] - pairs[:, 0]
    assert len(pairs) > 100_000
    cast = RayHits(ball)
    hits = cast(*rays)
    assert (hits.face_index >= 0).all()
    # Aimed at a place, they arrive there
    truth = np.linalg.norm(rays[1], axis=1)
    assert_allclose(hits.distance, truth, rtol=1e-12 + 64 * U * offset)
    assert cast.is_blocked(*rays).all()
    assert cast.is_blocked(*rays, 1.001 * truth).all()
    assert not cast.is_blocked(*rays, 0.999 * truth).any()


@pytest.mark.parametrize("distance", [1e3, 1e7, 1e9, 1e11, 1e13])
def test_no_ray_from_far_away_slips_through_a_closed_mesh(distance):
    ball = icosphere(subdivisions=3)
    rng = np.random.default_rng(4)
    aims = np.tile(targets(ball), (8, 1))
    # Towards the near side, at slants where the rounding of the origin does not miss the ball
    directions = 0.7 * rng.normal(size=aims.shape) - aims
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    near = np.einsum("nx,nx->n", directions, aims) < -0.3
    aims, directions = aims[near], directions[near]
    assert len(aims) > 10_000
    origins = aims - distance * directions
    hits = RayHits(ball)(origins, directions)
    assert (hits.face_index >= 0).all()
    # The origin is rounded by up to u * distance along each axis, the slope adds at most 1 / 0.3
    assert_allclose(hits.distance, distance, rtol=32 * U)


def test_a_ray_within_a_face_hits_the_neighbours_edge():
    cast = RayHits(box_mesh())
    along = np.eye(3)[[0, 0, 2, 1]]
    origins = np.array([[-2.0, 0.5, 0.1], [-2.0, 0.5, 0.5], [0.5, -0.5, -3.0], [0.5, -9.0, 0.5]])
    hits = cast(origins, along)
    assert_array_equal(hits.distance, [1.5, 1.5, 2.5, 8.5])
    # One ulp beyond the face, there is nothing
    origins[0, 1] = np.nextafter(0.5, 1)
    assert np.isinf(cast(origins[:1], along[:1]).distance[0])


def test_every_line_crosses_a_closed_surface_an_even_number_of_times():
    knot = trefoil_tube(n_along=90, n_around=16)
    cast = RayHits(knot)
    rng = np.random.default_rng(5)
    aims = rng.uniform(knot.box.lower, knot.box.upper, (3000, 3))
    directions = rng.normal(size=(3000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    origins = aims - 3 * knot.box.diagonal * directions
    crossings = np.zeros(3000, int)
    normals = np.cross(*np.moveaxis(np.diff(knot.triangles, axis=1), 1, 0))
    while True:
        hits = cast(origins, directions)
        on = hits.face_index >= 0
        if not on.any():
            break
        enters = np.einsum("nx,nx->n", normals[hits.face_index], directions) < 0
        assert (enters[on] == (crossings[on] % 2 == 0)).all()
        crossings[on] += 1
        origins[on] += ((hits.distance + 1e-9)[:, None] * directions)[on]
    assert (crossings % 2 == 0).all()
    assert set(np.unique(crossings)) >= {0, 2, 4}


def test_barycentrics_tell_the_place_and_it_lies_on_the_ray():
    mesh = random_soup(6)
    origins, directions = random_rays(7)
    hits = RayHits(mesh)(origins, directions)
    on = hits.face_index >= 0
    weights = hits.barycentric[on]
    assert weights.min() >= 0
    assert_allclose(weights.sum(axis=1), 1, atol=4 * U)
    place = np.einsum("nk,nkx->nx", weights, mesh.triangles[hits.face_index[on]])
    unit = directions[on] / np.linalg.norm(directions[on], axis=1, keepdims=True)
    gap = np.linalg.norm(np.cross(place - origins[on], unit), axis=1)
    reach = np.linalg.norm(origins[on] - mesh.box.center, axis=1) + mesh.box.diagonal
    assert (gap <= 32 * U * reach).all()


def test_neither_order_nor_threads_nor_length_of_directions_change_a_bit(monkeypatch):
    mesh = random_soup(8)
    origins, directions = random_rays(9, n=40_000)
    cast = RayHits(mesh)
    hits = cast(origins, directions)
    order = np.random.default_rng(10).permutation(len(origins))
    monkeypatch.setattr("meshsdf.kernels.parallel.n_threads", lambda: 1)
    again = RayHits(mesh)(origins[order], 4.0 * directions[order])
    for name in ("distance", "face_index", "barycentric"):
        assert_array_equal(getattr(again, name), getattr(hits, name)[order])


def test_of_faces_at_one_distance_the_lowest_is_named():
    once = random_soup(11)
    order = np.random.default_rng(12).permutation(2 * once.n_faces)
    twice = np.concatenate([once.faces, once.faces])[order]
    number = np.tile(np.arange(once.n_faces), 2)[order]
    first = {}
    for place, face in enumerate(number):
        first.setdefault(face, place)
    rays = random_rays(13)
    expected = RayHits(once)(*rays).face_index
    found = RayHits(Mesh(once.vertices, twice))(*rays).face_index
    assert (expected >= 0).sum() > 300
    assert_array_equal(found, [first[face] if face >= 0 else -1 for face in expected])


def test_a_hit_at_the_origin_or_at_the_very_end_counts_and_nothing_behind():
    cast = RayHits(box_mesh())
    down = np.array([[0.0, 0.0, -3.0]])
    on_top, above = np.array([[0.1, 0.2, 0.5]]), np.array([[0.1, 0.2, 2.5]])
    assert cast(on_top, down).distance[0] == 0
    assert cast.is_blocked(above, down, 2.0)[0]
    assert not cast.is_blocked(above, down, np.nextafter(2.0, 0))[0]
    assert not cast.is_blocked(above, -down)[0]
    assert np.isinf(cast(above, -down).distance[0])
    assert cast.is_blocked(on_top, down, 0)[0]


def test_blocked_is_what_is_hit_within_the_length():
    mesh = random_soup(12)
    origins, directions = random_rays(13)
    cast = RayHits(mesh)
    distance = cast(origins, directions).distance
    longest = np.random.default_rng(14).exponential(2.0, len(origins))
    assert_array_equal(cast.is_blocked(origins, directions, longest), distance <= longest)
    assert 0.1 < (distance <= longest).mean() < 0.9


def test_the_arrays_stay_as_they_are_and_may_be_of_any_layout():
    origins, directions = random_rays(15, n=100)
    cast = RayHits(random_soup(16))
    hits = cast(origins, directions)
    strided = np.repeat(origins, 2, axis=0)[::2]
    frozen = directions.copy()
    frozen.flags.writeable = False
    assert_array_equal(cast(strided, frozen).distance, hits.distance)
    assert not frozen.flags.writeable
    assert_array_equal(frozen, directions)


def test_no_rays_give_no_answers():
    cast = RayHits(box_mesh())
    none = np.empty((0, 3))
    assert cast(none, none).barycentric.shape == (0, 3)
    assert cast.is_blocked(none, none).shape == (0,)


def test_what_is_no_ray_is_counted():
    cast = RayHits(box_mesh())
    origins, directions = np.zeros((10, 3)), np.ones((10, 3))
    directions[[2, 5]] = 0
    with pytest.raises(SpatialError, match=r"2 of 10 directions are zero \(first: ray 2\)"):
        cast(origins, directions)
    origins[7, 1] = np.nan
    with pytest.raises(SpatialError, match=r"1 of 10 origins are NaN .* \(first: ray 7\)"):
        cast.is_blocked(origins, directions)
    with pytest.raises(SpatialError, match="10 origins and 9 directions"):
        cast(origins, directions[:9])
    lengths = np.array([1.0, -1.0, np.nan])
    rays = np.zeros((3, 3)), np.ones((3, 3))
    with pytest.raises(SpatialError, match="2 lengths are negative or NaN"):
        cast.is_blocked(*rays, lengths)
    with pytest.raises(SpatialError, match="2 lengths for 3 rays"):
        cast.is_blocked(*rays, lengths[:2])


def test_a_mesh_without_faces_or_of_astronomic_size_is_refused():
    with pytest.raises(SpatialError, match="no faces, so nothing can be hit"):
        RayHits(Mesh(np.zeros((2, 3)), np.empty((0, 3), np.int32)))
    with pytest.raises(SpatialError, match=r"coordinates reach 1e\+31"):
        RayHits(Mesh(1e31 * np.eye(3), np.array([[0, 1, 2]], np.int32)))
