"""meshsdf.texture.camera_projection: pictures thrown back, and what was hidden from them."""

import igl
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf.errors import TextureError
from meshsdf.implicit import sphere
from meshsdf.mesh import Mesh
from meshsdf.mesh.primitives import icosphere
from meshsdf.mesh.tubes import trefoil_tube
from meshsdf.spatial.image import Image
from meshsdf.texture.camera_projection import CameraProjection

EYE, TARGET = np.array([2.0, -3.0, 1.5]), np.array([0.1, 0.2, -0.1])
UP = np.array([0.0, 0.0, 1.0])
WHITE = Image.from_linear(np.ones((1, 1, 3), np.float32))


def from_eye(image, **more):
    return CameraProjection(image, EYE, TARGET, UP, **more)


def on_sphere(n, seed=0):
    points = np.random.default_rng(seed).normal(size=(n, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True)


@pytest.mark.parametrize("aspect", [None, 0.7])
def test_a_picture_comes_back_from_a_plane_that_its_rays_meet(aspect):
    rng = np.random.default_rng(0)
    picture = rng.integers(0, 256, (24, 36, 3), dtype=np.uint8)
    image = Image.from_srgb(picture)
    # Rays through the middles of all pixels, by the pinhole's formula, to the plane z = 0.3
    forward = (TARGET - EYE) / np.linalg.norm(TARGET - EYE)
    right = np.cross(forward, UP) / np.linalg.norm(np.cross(forward, UP))
    up = np.cross(right, forward)
    row, column = np.indices((24, 36)).reshape(2, -1)
    high = np.tan(np.radians(20))
    wide = high * (36 / 24 if aspect is None else aspect)
    x, y = (2 * (column + 0.5) / 36 - 1) * wide, (1 - 2 * (row + 0.5) / 24) * high
    directions = forward + x[:, None] * right + y[:, None] * up
    plane_normal = -forward + 0.3 * up
    far = ((TARGET - EYE) @ plane_normal) / (directions @ plane_normal)
    assert (far > 0).all()
    points = EYE + far[:, None] * directions
    paint = from_eye(image, field_of_view=40, aspect=aspect)
    colors = paint(points, np.tile(plane_normal, (len(points), 1)))
    stored = image.texels.reshape(-1, 4)
    # 1e-15 of rounding in the plane's points, times 36 texels and distances of some units
    assert_allclose(colors, stored, atol=1e-6)


@pytest.mark.parametrize("kind", ["none", "field", "mesh"])
def test_the_far_side_of_a_sphere_stays_bare(kind):
    points = on_sphere(4000)
    hides = {"none": None, "field": sphere(1.0), "mesh": icosphere(subdivisions=5)}[kind]
    paint = from_eye(WHITE, field_of_view=60, hides=hides)
    reached = paint(points, points if kind == "none" else None)[:, 3] > 0
    facing = points @ EYE - 1  # zero on the rim
    distance = np.linalg.norm(TARGET - EYE)
    # Behind the rim the way to the eye is a chord of twice the cosine between normal and way. The
    # field meets it if it is longer than two texels of 1e-3 of the distance; the icosphere, whose
    # faces lie up to 4e-4 within the sphere, if it sinks deeper: a cosine of sqrt(2 * 4e-4).
    cosine = {"none": 1e-12, "field": 1e-3 * distance, "mesh": 0.03}[kind]
    rim = cosine * (np.linalg.norm(EYE) + 1)
    clear = np.abs(facing) > rim
    assert clear.sum() > 3000
    assert_array_equal(reached[clear], facing[clear] > 0)
    assert reached.any()
    assert not reached.all()


def test_what_a_mesh_hides_is_what_libigl_says():
    knot = trefoil_tube(n_along=80, n_around=12)
    rng = np.random.default_rng(1)
    face = rng.integers(0, knot.n_faces, 400)
    weights = rng.dirichlet(np.ones(3), 400)
    points = np.einsum("nk,nkx->nx", weights, knot.triangles[face])
    eye = knot.box.center + np.array([0.7, 0.5, 3.0]) * knot.box.diagonal
    paint = CameraProjection(WHITE, eye, knot.box.center, field_of_view=40, hides=knot, texel=1e-6)
    reached = paint(points)[:, 3] > 0
    faces, hidden = knot.faces.astype(np.int64), np.zeros(400, bool)
    for k, way in enumerate(eye - points):
        hits = igl.ray_mesh_intersect(points[k], way, knot.vertices, faces)
        hidden[k] = any(1e-6 < hit[1] < 1 for hit in hits or [])  # beyond the point's own face
    assert 40 < reached.sum() < 360
    assert_array_equal(reached, ~hidden)


def test_a_wall_in_between_hides_and_one_behind_does_not():
    square = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    wall = Mesh(square, np.array([[0, 1, 2], [0, 2, 3]], np.int32))
    eye, target = np.array([0.0, 0.0, 4.0]), np.zeros(3)
    points = np.array([[0.0, 0, -1], [0, 0, 1], [1.4, 0, -1], [0, 0, 0], [0, 0, -0.003]])

    def slab(p):
        return np.maximum(np.abs(p[:, :2]).max(axis=1) - 1, np.abs(p[:, 2]) - 0.005)

    seen = CameraProjection(WHITE, eye, target, field_of_view=60, hides=wall)(points)
    assert_array_equal(seen[:, 3] > 0, [False, True, True, True, True])
    seen = CameraProjection(WHITE, eye, target, field_of_view=60, hides=slab)(points[:3])
    assert_array_equal(seen[:, 3] > 0, [False, True, True])


def test_nothing_lies_behind_the_eye_or_beyond_the_picture():
    paint = CameraProjection(WHITE, np.zeros(3), np.array([0.0, 0, -1]), field_of_view=90)
    points = np.array([[0, 0, -2], [0, 0, 2], [2.5, 0, -2], [0, -2.5, -2], [0, 0, 0], [9, 0, -2]])
    far_off = paint(points.astype(float))[:, 3]
    assert far_off[0] == 1
    assert far_off[1] == far_off[4] == far_off[5] == 0
    fine = Image.from_linear(np.ones((16, 16, 3), np.float32))
    paint = CameraProjection(fine, np.zeros(3), np.array([0.0, 0, -1]), field_of_view=90)
    assert_array_equal(paint(points.astype(float))[:, 3], [1, 0, 0, 0, 0, 0])


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"field_of_view": 180}, "field of view is 180"),
        ({"field_of_view": 0}, "field_of_view is 0"),
        ({"aspect": -1}, "aspect is -1"),
        ({"texel": 0}, "texel is 0"),
        ({"hides": lambda p: p}, "the distance gave float64"),
        ({"hides": lambda p: np.full(len(p), np.nan)}, "or NaN, for 1 points"),
    ],
)
def test_what_makes_no_camera_is_refused(more, said):
    with pytest.raises(TextureError, match=said):
        from_eye(WHITE, **more)(TARGET[None])
    with pytest.raises(TextureError, match="one point"):
        CameraProjection(WHITE, EYE, EYE)
    with pytest.raises(TextureError, match="three finite"):
        CameraProjection(WHITE, EYE, np.full(3, np.nan))
