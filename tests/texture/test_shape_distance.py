"""meshsdf.texture.shape_distance: distances sampled where a texture looks, and how far off."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf.mesh import Mesh, box_mesh, icosphere
from meshsdf.texture import shape_distance
from meshsdf.texture.procedural import procedural
from meshsdf.texture.shape_distance import SampledDistance, ShapeDistance
from meshsdf.texture.thickness import thickness

VOXEL = 0.02


def box_distance(points):
    """The signed distance of the cube of side 1 around the origin."""
    q = np.abs(points) - 0.5
    outside = np.linalg.norm(np.maximum(q, 0), axis=1)
    return outside + np.minimum(q.max(axis=1), 0)


def revolved(profile, n=96):
    """The closed mesh of a profile (m, 2), radius and height, whose ends are on the axis."""
    angles = 2 * np.pi * np.arange(n) / n
    rings = [
        np.stack([r * np.cos(angles), r * np.sin(angles), np.full(n, z)], axis=1)
        for r, z in profile[1:-1]
    ]
    ends = [[0.0, 0.0, profile[0][1]], [0.0, 0.0, profile[-1][1]]]
    vertices = np.concatenate([*rings, ends])
    i, j = np.arange(n), (np.arange(n) + 1) % n
    low, high = n * len(rings), n * len(rings) + 1
    faces = [np.stack([np.full(n, low), j, i], axis=1)]
    for ring in range(len(rings) - 1):
        a, b = n * ring, n * (ring + 1)
        faces += [np.stack([a + i, a + j, b + j], axis=1), np.stack([a + i, b + j, b + i], axis=1)]
    faces.append(
        np.stack([np.full(n, high), n * (len(rings) - 1) + i, n * (len(rings) - 1) + j], 1)
    )
    return Mesh(vertices, np.concatenate(faces).astype(np.int32))


def around(points, n=8):
    """Points (m, 2), radius and height, at n angles."""
    angles = np.random.default_rng(0).uniform(0, 2 * np.pi, (n, 1))
    r, z = points.T
    return np.stack([r * np.cos(angles), r * np.sin(angles), z + 0 * angles], axis=2).reshape(-1, 3)


def test_sampled_distances_are_near_and_say_no_more_than_the_band_knows():
    shape = ShapeDistance(box_mesh())
    near = shape.sampled(voxel_size=VOXEL, reach=0.2)
    assert isinstance(near, SampledDistance)
    points = np.random.default_rng(0).uniform(-1, 1, (20000, 3))
    true, found = box_distance(points), near(points)
    within = np.abs(true) < 0.2 - 2 * VOXEL
    assert 0.1 < within.mean() < 0.5
    assert (true[within] < 0).any()
    assert (true[within] > 0).any()
    # No function that changes by 1 per length is further from its interpolant
    assert np.abs(found - true)[within].max() <= np.sqrt(3) / 2 * VOXEL
    # Below the middle of a face it is linear: exact but for float32
    flat = np.abs(points[:, :2]).max(axis=1) < 0.25
    flat &= np.abs(np.abs(points[:, 2]) - 0.5) < 0.15
    assert flat.sum() > 100
    assert_allclose(found[flat], true[flat], atol=1e-6)
    # Beyond the band its sign is right, and so is what it says at least
    beyond = np.abs(true) > 0.2 + 2 * VOXEL
    assert_allclose(found[beyond], np.where(true[beyond] > 0, 0.2, -0.2), atol=1e-6)
    assert_array_equal(near(np.full((1, 3), 1e300)), near(np.full((1, 3), 7.0)))
    assert near(np.empty((0, 3))).shape == (0,)


def test_the_exact_distance_is_asked_where_a_band_would_be_too_large(monkeypatch):
    shape = ShapeDistance(box_mesh())
    assert shape.sampled(voxel_size=1e-6, reach=1e-5) is shape
    points = np.random.default_rng(1).uniform(-1, 1, (100, 3))
    assert_allclose(shape(points), box_distance(points), atol=1e-12)
    # Somewhat larger voxels are tried first
    monkeypatch.setattr(shape_distance, "MOST_BRICKS", 1200)
    coarser = shape.sampled(voxel_size=0.008, reach=0.03)
    assert isinstance(coarser, SampledDistance)
    assert 0.008 < coarser.band.voxel_size <= 0.016


def test_a_band_depends_on_its_two_numbers_alone():
    points = np.random.default_rng(2).uniform(-0.6, 0.6, (500, 3))
    one, other = ShapeDistance(box_mesh()), ShapeDistance(box_mesh())
    first = one.sampled(voxel_size=0.05, reach=0.2)(points)
    for voxel_size in (0.1, 0.07, 0.06):
        other.sampled(voxel_size=voxel_size, reach=0.3)
    assert_array_equal(other.sampled(voxel_size=0.05, reach=0.2)(points), first)
    assert_array_equal(one.sampled(voxel_size=0.05, reach=0.2)(points), first)


CYLINDER = np.array([[0, -1.0], [0.3, -1.0], [0.3, 1.0], [0, 1.0]])
SLOPE = 0.35  # radius of the cone by its height
CONE = np.array([[0, 0.0], [2 * SLOPE, 2.0], [0, 2.0]])


@pytest.mark.parametrize(
    ("mesh", "points", "diameters"),
    [
        # A plate: as thick as it is, away from its rim
        (box_mesh((2.0, 2.0, 0.25)), np.array([[0.1, 0.2, 0.125], [-0.3, 0, -0.125]]), [0.25] * 2),
        (icosphere(0.4, subdivisions=4), None, None),
        (revolved(CYLINDER), around(np.array([[0.3, 0.0], [0.3, 0.4]])), [0.6] * 16),
        # The ball that touches a cone at height z, with half of the angle a: 2 z tan a / cos a
        (
            revolved(CONE),
            around(np.array([[0.5 * SLOPE, 0.5], [0.8 * SLOPE, 0.8]])),
            [2 * z * SLOPE * np.sqrt(1 + SLOPE**2) for z in (0.5, 0.8)] * 8,
        ),
    ],
    ids=["plate", "ball", "cylinder", "cone"],
)
def test_meshes_are_as_thick_as_their_formulas_say_sampled_or_not(mesh, points, diameters):
    largest = 1.0
    if points is None:
        directions = np.random.default_rng(3).normal(size=(100, 3))
        points = 0.4 * directions / np.linalg.norm(directions, axis=1, keepdims=True)
        diameters = [0.8] * 100
    shape = ShapeDistance(mesh)
    voxel = largest / 64
    near = shape.sampled(voxel_size=voxel, reach=0.6)
    # Facets: sagittas of an icosphere's and of 96 sides are below 0.2 % of their radius. Sampling:
    # twice sqrt(3) / 2 voxels; see `thickness` for the rest
    bound = 0.01 * max(diameters)
    assert_allclose(thickness(shape, points, largest=largest), diameters, atol=bound)
    assert_allclose(
        thickness(near, points, largest=largest), diameters, atol=bound + np.sqrt(3) * voxel
    )


def test_thickness_does_not_jump_where_facets_meet_but_is_thin_at_sharp_edges():
    mesh = icosphere(0.4, subdivisions=1)  # bends by some 20 degrees; inscribed: 0.37
    shape = ShapeDistance(mesh)
    line = np.linspace([0.38, -0.2, 0.05], [0.38, 0.2, -0.02], 400)
    line *= 0.4 / np.linalg.norm(line, axis=1, keepdims=True)
    found = thickness(shape, line, largest=1.0)
    # Lines along normals pass the middle by up to 0.4 sin 21 degrees
    assert 2 * (0.37 - 0.4 * np.sin(np.radians(21))) < found.min() < found.max() < 0.8 + 1e-9
    assert np.abs(np.diff(found)).max() < 0.02
    cube = ShapeDistance(box_mesh())
    away = np.array([0.05, 0.1, 0.2, 0.4])  # nearer than 1/24 normals see the edge
    towards = np.stack([0.5 - away, 0 * away, 0 * away + 0.5], axis=1)
    assert_allclose(thickness(cube, towards, largest=1.0), 2 * away, atol=1 / 32)


@pytest.mark.parametrize(
    ("kind", "parameters"),
    [
        ("edge_wear", {"reach": 0.06}),
        ("cavity_dirt", {"reach": 0.3}),
        ("thickness", {"thin_length": 0.1, "thick_length": 1.2}),
    ],
)
def test_a_texture_of_sampled_distances_is_that_of_exact_ones_nearly(kind, parameters):
    mesh = icosphere(0.4, subdivisions=2)
    two = Mesh(
        np.concatenate([mesh.vertices, mesh.vertices + np.array([0.95, 0, 0])]),
        np.concatenate([mesh.faces, mesh.faces + np.int32(len(mesh.vertices))]),
    )
    shape = ShapeDistance(two)
    points = two.triangles.mean(axis=1)
    exact = procedural(kind, signed_distance=lambda p: shape(p), **parameters)
    sampled = procedural(kind, signed_distance=shape, **parameters)
    apart = np.abs(sampled.weight(points, 0.01) - exact.weight(points, 0.01))
    assert 0 < apart.max() < 0.1
    assert apart.mean() < 0.02
    # Of wide footprints distances are exact
    wide = np.full(len(points), 0.5)
    assert_array_equal(sampled.weight(points, wide), exact.weight(points, wide))
