"""meshsdf.mesh.primitives and tubes: closed, oriented, and as close to the surface as stated."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial import cKDTree

from meshsdf.errors import MeshError
from meshsdf.mesh.measures import area, euler_number, face_normals, is_watertight, volume
from meshsdf.mesh.primitives import box_mesh, cylinder, icosphere, tetrahedron
from meshsdf.mesh.tubes import TREFOIL_REACH, closed_tube, torus, trefoil_tube

CENTER = (3.0, -2.0, 5.0)
SHAPES = {
    "icosphere": (lambda **kwargs: icosphere(2.0, subdivisions=3, **kwargs), 2),
    "box_mesh": (lambda **kwargs: box_mesh((1.0, 2.0, 3.0), **kwargs), 2),
    "tetrahedron": (lambda **kwargs: tetrahedron(2.0, **kwargs), 2),
    "cylinder": (lambda **kwargs: cylinder(1.0, 3.0, n_around=7, **kwargs), 2),
    "torus": (lambda **kwargs: torus(2.0, 0.5, n_major=20, n_minor=9, **kwargs), 0),
    "trefoil_tube": (lambda **kwargs: trefoil_tube(0.3, n_along=90, n_around=9, **kwargs), 0),
}
ROUNDING = 1e-14  # a few eps times coordinates below 10


def samples(mesh, seed=0):
    """(7 m, 3) points on every face: its middle and random places."""
    weights = np.random.default_rng(seed).dirichlet(np.ones(3), (mesh.n_faces, 7))
    weights[:, 0] = 1 / 3
    return np.einsum("mws,msx->mwx", weights, mesh.triangles).reshape(-1, 3)


@pytest.mark.parametrize("name", SHAPES)
def test_every_shape_is_closed_faces_outward_and_has_its_genus(name):
    build, euler = SHAPES[name]
    mesh = build()
    assert is_watertight(mesh)
    assert volume(mesh) > 0
    assert euler_number(mesh) == euler
    assert_array_equal(np.unique(mesh.faces), np.arange(mesh.n_vertices))
    assert mesh.vertices.dtype == np.float64


@pytest.mark.parametrize("name", SHAPES)
def test_a_center_moves_the_shape_and_the_same_call_gives_the_same_bytes(name):
    build, _ = SHAPES[name]
    mesh, moved, again = build(), build(center=CENTER), build(center=CENTER)
    assert_allclose(moved.vertices, mesh.vertices + CENTER, rtol=0, atol=2 * ROUNDING)
    assert_array_equal(moved.faces, mesh.faces)
    assert moved.vertices.tobytes() == again.vertices.tobytes()


@pytest.mark.parametrize("subdivisions", range(6))
def test_the_sphere_has_exactly_the_stated_sag_and_all_of_it_inside(subdivisions):
    mesh = icosphere(2.0, subdivisions=subdivisions)
    assert mesh.n_faces == 20 * 4**subdivisions
    assert_allclose(np.linalg.norm(mesh.vertices, axis=1), 2.0, rtol=ROUNDING)
    # The planes' distances to the centre; every face's foot point lies inside the face.
    nearest = np.einsum("ij,ij->i", face_normals(mesh), mesh.triangles[:, 0]).min()
    stated = 2 * (1 - 1 / np.sqrt(1 + (3 - np.sqrt(5)) ** 2 / 4**subdivisions))
    assert_allclose(2 - nearest, stated, rtol=0, atol=1e-14)
    assert stated < 0.3 * 2 / 4**subdivisions


def test_box_and_tetrahedron_are_exact():
    box = box_mesh((1.0, 2.0, 4.0), center=CENTER)
    assert (area(box), volume(box), box.n_faces) == (28.0, 8.0, 12)
    assert_array_equal(box.box.lower, [2.5, -3, 3])
    assert_array_equal(box.box.upper, [3.5, -1, 7])
    solid = tetrahedron(3.0)
    sides = solid.triangles - np.roll(solid.triangles, 1, axis=1)
    assert_allclose(np.linalg.norm(sides, axis=2), 3.0, rtol=ROUNDING)
    assert_allclose(volume(solid), 27 / (6 * np.sqrt(2)), rtol=ROUNDING)
    assert_allclose(solid.vertices.mean(axis=0), 0, atol=ROUNDING)


def test_the_cylinder_is_the_prism_over_a_regular_polygon():
    n, radius, height = 12, 1.5, 4.0
    prism = cylinder(radius, height, n_around=n)
    base = n / 2 * radius**2 * np.sin(2 * np.pi / n)
    around = 2 * n * radius * np.sin(np.pi / n)
    assert_allclose(volume(prism), base * height, rtol=1e-14)
    assert_allclose(area(prism), 2 * base + around * height, rtol=1e-14)
    level_normals = face_normals(prism)[: 2 * n]
    inward = radius - np.einsum("ij,ij->i", level_normals, prism.triangles[: 2 * n, 0])
    assert_allclose(inward, radius * (1 - np.cos(np.pi / n)), atol=1e-14)


@pytest.mark.parametrize(("n_major", "n_minor"), [(6, 5), (24, 9), (40, 40)])
def test_the_torus_keeps_its_sag_and_its_closed_volume(n_major, n_minor):
    major, minor = 2.0, 0.6
    mesh = torus(major, minor, n_major=n_major, n_minor=n_minor)
    a, b = 2 * np.pi / n_major, 2 * np.pi / n_minor
    smooth = 2 * np.pi**2 * major * minor**2
    assert_allclose(volume(mesh), smooth * np.sin(a) * np.sin(b) / (a * b), rtol=1e-13)
    x, y, z = samples(mesh).T
    off = np.hypot(np.hypot(x, y) - major, z) - minor
    steps = (major + minor) / n_major**2 + 2 * minor / (n_major * n_minor) + minor / n_minor**2
    bound = np.pi**2 / 2 * steps
    assert np.abs(off).max() <= bound
    assert np.abs(off).max() > bound / 8, "the bound says nothing"


def test_torus_area_converges_with_order_two():
    exact = 4 * np.pi**2 * 2.0 * 0.6
    counts = np.array([16, 32, 64, 128])
    meshes = [torus(2.0, 0.6, n_major=n, n_minor=n) for n in counts.tolist()]
    errors = [exact - area(mesh) for mesh in meshes]
    slope = np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert -2.05 < slope < -1.95


def knot(t):
    curve = [np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t), -np.sin(3 * t)]
    return np.column_stack(curve)


@pytest.mark.parametrize(("n_along", "n_around"), [(60, 12), (120, 8), (200, 20)])
def test_the_trefoil_keeps_its_sag(n_along, n_around):
    radius, n = 0.3, 40_000
    mesh = trefoil_tube(radius, n_along=n_along, n_around=n_around)
    tree = cKDTree(knot(2 * np.pi * np.arange(n) / n))
    # Points on the knot are 28.83 / 40000 apart, so distances of at least radius / 2 are off
    # by less than (that / 2)² / radius.
    rounding = (28.83 / n / 2) ** 2 / radius
    assert np.abs(tree.query(mesh.vertices)[0] - radius).max() <= rounding
    off = np.abs(tree.query(samples(mesh))[0] - radius).max()
    steps = (12.2 + 9.4 * radius) / n_along**2 + 6.2 * radius / (n_along * n_around)
    bound = np.pi**2 / 2 * (steps + radius / n_around**2)
    assert bound / 8 < off <= bound + rounding


def test_the_trefoil_does_not_touch_itself_up_to_its_reach():
    t = 2 * np.pi * np.arange(2000) / 2000
    points = knot(t)
    tangents = np.gradient(points, axis=0)[1:-1]
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    points = points[1:-1]
    # Federer 1959, theorem 4.18: the reach is the least |b - a|² / (2 distance(b, tangent at a)).
    reach = np.inf
    for a, tangent in zip(points[::10], tangents[::10], strict=True):
        away = points - a
        square = (away**2).sum(axis=1)
        across = np.sqrt(np.maximum(square - (away @ tangent) ** 2, 0))
        far = square > 0.05**2
        reach = min(reach, (square[far] / (2 * across[far])).min())
    assert TREFOIL_REACH < reach < TREFOIL_REACH + 0.01


def test_a_tube_closes_without_a_jump_in_twist():
    n_around = 24
    mesh = trefoil_tube(0.3, n_along=120, n_around=n_around)
    rings = mesh.vertices.reshape(120, n_around, 3)
    middles = rings.mean(axis=1, keepdims=True)
    spokes = (rings - middles) / np.linalg.norm(rings - middles, axis=2, keepdims=True)
    turn = np.linalg.norm(np.roll(spokes, -1, axis=0) - spokes, axis=2).max(axis=1)
    assert turn[-1] <= turn.max()
    assert turn.max() < 3 * 2 * np.pi / 120 * 3.1 / 2, "a ring turns much more than its neighbours"


def test_a_straight_stretch_and_a_planar_circle_make_the_torus():
    n = 32
    angle = 2 * np.pi * np.arange(n) / n
    circle = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    along = np.column_stack([-np.sin(angle), np.cos(angle), 0 * angle])
    tube = closed_tube(2.0 * circle, along, radius=0.5, n_around=16)
    ring_torus = torus(2.0, 0.5, n_major=n, n_minor=16)
    assert is_watertight(tube)
    assert_allclose(volume(tube), volume(ring_torus), rtol=1e-13)


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: icosphere(0.0), "radius is 0"),
        (lambda: icosphere(float("nan")), "radius is nan"),
        (lambda: icosphere(1.0, subdivisions=11), "subdivisions is 11"),
        (lambda: icosphere(1.0, center=(0.0, 1.0)), r"\[0.0, 1.0\] is not a place"),
        (lambda: box_mesh((1.0, -2.0, 1.0)), "size along y is -2"),
        (lambda: tetrahedron(-1.0), "edge is -1"),
        (lambda: cylinder(1.0, float("inf")), "height is inf"),
        (lambda: cylinder(1.0, 1.0, n_around=2), "n_around is 2"),
        (lambda: torus(1.0, 1.0), "radius 1 fills the hole of the ring of radius 1"),
        (lambda: torus(1.0, 0.5, n_minor=2), "n_minor is 2"),
        (lambda: trefoil_tube(0.61), "radius 0.61 with sag .* could run into itself"),
        (lambda: trefoil_tube(0.3, n_along=8), "strands are 1.214 apart"),
        (
            lambda: closed_tube(np.zeros((2, 3)), np.ones((2, 3)), radius=1.0, n_around=9),
            "number of points is 2",
        ),
    ],
)
def test_a_shape_that_cannot_be_says_why(build, message):
    with pytest.raises(MeshError, match=message):
        build()
