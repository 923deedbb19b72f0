"""meshsdf.texture.project: images over space along axes, around them, and onto boxes."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf.errors import TextureError
from meshsdf.spatial.image import Image
from meshsdf.srgb import srgb_rgba
from meshsdf.texture.camera_projection import CameraProjection
from meshsdf.texture.project import Cylindrical, Decal, Planar, Spherical, Triplanar

ULP = 2.0**-24
GOLD = np.array([213, 170, 59], np.uint8)
TURN = 2 * np.pi


def noise_image(height=16, width=32, seed=0):
    rng = np.random.default_rng(seed)
    return Image.from_linear(rng.random((height, width, 4)).astype(np.float32))


def gold():
    return Image.from_srgb(np.tile(GOLD, (6, 9, 1)))


def on_sphere(n, seed=0):
    points = np.random.default_rng(seed).normal(size=(n, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True)


def camera(image, **more):
    eye, target = np.array([0.0, 0.0, 3.0]), np.zeros(3)
    return CameraProjection(image, eye, target, field_of_view=60, **more)


ALL = {
    "planar": lambda image, **more: Planar(image, width=0.7, height=1.3, **more),
    "cylindrical": lambda image, **more: Cylindrical(image, height=0.9, **more),
    "spherical": Spherical,
    "triplanar": lambda image, **more: Triplanar(image, width=0.4, **more),
    "decal": lambda image, **more: Decal(image, width=3, height=3, depth=3, **more),
    "camera": camera,
}


@pytest.mark.parametrize("name", ALL)
@pytest.mark.parametrize("footprint", [0.0, 0.01, 0.2])
def test_a_colour_comes_back_exactly_from_every_projection_that_faces_it(name, footprint):
    points = on_sphere(2000)
    points = points[points[:, 2] > 0.4] * 0.8
    colors = ALL[name](gold())(points, points, footprint)
    reached = colors[:, 3] > 0
    assert reached.all()
    assert_array_equal(np.rint(255 * srgb_rgba(colors))[:, :3], np.tile(GOLD, (len(points), 1)))


@pytest.mark.parametrize("name", ALL)
def test_moving_texture_and_points_together_changes_nothing(name):
    image, points = noise_image(), on_sphere(500) * 0.9
    matrix = np.eye(4)
    turn, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
    matrix[:3, :3], matrix[:3, 3] = 2.5 * turn, [3, -1, 2]
    moved = points @ matrix[:3, :3].T + matrix[:3, 3]
    still = ALL[name](image)(points, points, 0.05)
    along = ALL[name](image, matrix=matrix)(moved, points @ turn.T, 0.05 * 2.5)
    same = np.abs(along - still).max(axis=1) <= 1e-5
    assert same.mean() > 0.998  # all but those on the rim, where rounding decides
    through = ALL[name](image, matrix=matrix, space="world")(points, points, 0.05)
    assert_array_equal(through, still)


@pytest.mark.parametrize("name", [name for name in ALL if name != "triplanar"])  # it has three
def test_gradients_are_those_of_the_coordinates(name):
    projection, points = ALL[name](noise_image()), on_sphere(300) * 0.9
    points = points[np.abs(points[:, 1]) > 0.05]  # not across the seam
    step, expected = 1e-6, np.empty((len(points), 2, 3))
    for axis in range(3):
        offset = step * np.eye(3)[axis]
        ahead, behind = (projection._uv(points + way * offset) for way in (1, -1))
        expected[:, :, axis] = (ahead - behind) / (2 * step)
    given = np.broadcast_to(projection._gradients(points), expected.shape)
    # Central differences: step**2 * third derivatives / 6, and 2**-53 / step of rounding
    assert_allclose(given, expected, atol=1e-8 * (1 + np.abs(expected).max()))


def test_a_footprint_is_measured_along_the_surface_and_in_world_units():
    # A wave along x; averaged over one whole period nothing of it is left
    n = 512
    wave = (0.5 + 0.5 * np.sin(TURN * 16 * (np.arange(n) + 0.5) / n)).astype(np.float32)
    image = Image.from_linear(np.tile(wave[None, :, None], (n, 1, 1)))
    matrix = np.diag([10.0, 10, 10, 1])
    points = np.random.default_rng(0).uniform(-20, 20, (500, 3))
    period = 10 / 16
    for make in (Planar, Triplanar):
        flat = make(image, matrix=matrix)(points, np.tile([0.0, 0, 1], (500, 1)), 2 * period)
        assert np.abs(flat[:, 0] - 0.5).max() < 0.01
    steep = np.tile([1.0, 0, 0.002], (500, 1))  # x hardly changes along this surface
    sharp = Planar(image, matrix=matrix)(points, steep, 2 * period)
    assert_allclose(sharp[:, 0], Planar(image, matrix=matrix)(points)[:, 0], atol=0.05)
    blurred = Planar(image, matrix=matrix)(points, None, 2 * period)
    assert np.abs(blurred[:, 0] - 0.5).max() < 0.01


def test_planar_and_decal_have_their_corners_where_they_say():
    image = noise_image(2, 3)
    uv = np.random.default_rng(1).uniform(0.3, 0.7, (50, 2))
    z = np.full(50, 0.2)
    planar = Planar(image, width=3, height=2)(np.column_stack([uv * [3, 2], z]))
    assert_allclose(planar, image.sample(uv), rtol=4 * ULP, atol=1e-7)
    decal = Decal(image, width=3, height=2)(np.column_stack([(uv - 0.5) * [3, 2], z]))
    assert_allclose(decal, image.sample(uv), rtol=4 * ULP, atol=1e-7)


def test_cylinder_and_sphere_have_closed_coordinates():
    image, points = noise_image(), on_sphere(400) * 1.7
    angle = np.angle(points[:, 0] + 1j * points[:, 1]) / TURN
    expected = image.sample(np.column_stack([angle, points[:, 2] / 0.6]))
    assert_allclose(Cylindrical(image, height=0.6)(points), expected, atol=1e-6)
    latitude = np.arcsin(points[:, 2] / 1.7)
    expected = image.sample(
        np.column_stack([angle, latitude / np.pi + 0.5]), 0.0, ("repeat", "clamp")
    )
    assert_allclose(Spherical(image)(points), expected, atol=1e-6)


@pytest.mark.parametrize("make", [Cylindrical, Spherical])
@pytest.mark.parametrize("turn", [np.pi, 0.0])
@pytest.mark.parametrize("footprint", [0.0, 0.05])
def test_no_seam_shows_where_the_angle_jumps(make, turn, footprint):
    image = noise_image(16, 32)
    z = np.linspace(-0.6, 0.6, 200)
    side = [
        np.column_stack([np.full((200, 2), [np.cos(turn + way), np.sin(turn + way)]), z])
        for way in (-1e-9, 1e-9)
    ]
    left, right = (make(image)(points, None, footprint) for points in side)
    # 32 texels around: a step of 2e-9 changes what is interpolated by 32 / TURN times as much
    assert_allclose(left, right, atol=1e-6)
    # and what is averaged there is no wider than elsewhere: details remain
    assert np.ptp(left[:, 0]) > 0.3


@pytest.mark.parametrize("make", [Cylindrical, Spherical])
def test_poles_and_axes_are_finite(make):
    near = np.array([0.0, 1e-320, 1e-200, 1e-9, -1e-9])
    x, y, z = (grid.ravel() for grid in np.meshgrid(near, near, [-1.0, 0.0, 1e-250, 1.0]))
    points = np.column_stack([x, y, z])
    for footprint in (0.0, 1e-3, 1e3):
        colors = make(noise_image())(points, None, footprint)
        assert np.isfinite(colors).all()
        assert (colors[:, 3] > 0).all()


def test_at_a_pole_a_footprint_averages_around_and_not_upward():
    rows = np.linspace(0, 1, 64, dtype=np.float32)[:, None, None]
    image = Image.from_linear(np.tile(rows, (1, 128, 1)))  # black at the upper pole
    pole = Spherical(image)(np.array([[0.0, 0.0, 1.0]]), np.array([[0.0, 0.0, 1.0]]), 0.02)
    assert pole[0, 0] < 0.06  # the 8 texels of a 16th of the turn, not the mean 0.5
    spokes = np.zeros((64, 128, 1), np.float32)
    spokes[:, ::2] = 1
    pole = Spherical(Image.from_linear(spokes))(np.array([[0.0, 0.0, 1.0]]), None, 0.02)
    assert_allclose(pole[0, 0], 0.5, atol=1e-6)


def test_triplanar_weights_sum_to_one():
    normals, points = on_sphere(1000), np.random.default_rng(2).uniform(-3, 3, (1000, 3))
    color = np.array([0.3, 2.5, 0.1, 0.25], np.float32)
    image = Image.from_linear(np.tile(color, (4, 4, 1)))
    for sharpness in (0.5, 4, 1000):
        colors = Triplanar(image, sharpness=sharpness)(points, normals, 0.1)
        assert_allclose(colors, np.tile(color, (1000, 1)), rtol=1e-6)


def test_triplanar_blends_three_planes_by_powers_of_the_normal():
    image, normals = noise_image(), on_sphere(300)
    points = np.random.default_rng(2).uniform(-3, 3, (300, 3))
    sign = np.sign(normals)
    x, y, z = points.T
    planes = [(sign[:, 0] * y, z), (-sign[:, 1] * x, z), (sign[:, 2] * x, y)]
    weights = np.abs(normals) ** 3
    weights /= weights.sum(axis=1, keepdims=True)
    total, alpha = np.zeros((300, 3)), np.zeros(300)
    for k, plane in enumerate(planes):
        seen = image.sample(np.column_stack(plane)).astype(np.float64)
        total += (weights[:, k] * seen[:, 3])[:, None] * seen[:, :3]
        alpha += weights[:, k] * seen[:, 3]
    colors = Triplanar(image, sharpness=3)(points, 7 * normals)
    assert_allclose(colors, np.column_stack([total / alpha[:, None], alpha]), atol=1e-6)


def test_triplanar_writes_the_right_way_round_on_all_six_sides():
    # The image grows brighter to the right, and redder upward; up is z, on top and below y
    rows, columns = np.indices((64, 64))
    stored = np.stack([(63 - rows) / 64, columns / 64, 0 * rows], axis=2).astype(np.float32)
    paint = Triplanar(Image.from_linear(stored))
    for axis in range(3):
        up = np.array([0.0, 0, 1]) if axis < 2 else np.array([0.0, 1, 0])
        for way in (-1.0, 1.0):
            normal = way * np.eye(3)[axis]
            right = np.cross(up, normal)  # for someone who looks against the normal
            middle = 0.5 * (np.abs(right) * np.sign(right.sum()) + up)
            start, to_right, higher = (middle + 0.2 * d for d in (0 * up, right, up))
            seen = paint(np.stack([start, to_right, higher]), np.tile(normal, (3, 1)))
            assert_allclose(seen[1] - seen[0], [0, 0.2, 0, 0], atol=1e-6)
            assert_allclose(seen[2] - seen[0], [0.2, 0, 0, 0], atol=1e-6)


def test_a_decal_ends_at_its_box_and_leaves_the_back_alone():
    paint = Decal(gold(), width=2, height=1, depth=0.5)
    inside, beside, above, behind = [0.0, 0, 0.2], [1.01, 0, 0], [0, 0.51, 0], [0, 0, -0.26]
    points = np.array([inside, beside, above, behind])
    assert_array_equal(paint(points)[:, 3], [1, 0, 0, 0])
    there = np.tile(inside, (4, 1))
    normals = np.array([[0, 0, 1], [0, 0, -1], [1, 0, 0.1], [0, 0, 0]], float)
    assert_array_equal(paint(there, normals)[:, 3], [1, 0, 1, 0])
    strict = Decal(gold(), width=2, height=1, depth=0.5, steepest=75)
    assert_array_equal(strict(there, normals)[:, 3], [1, 0, 0, 0])


def test_normals_of_stretched_shapes_are_carried_as_normals():
    matrix = np.diag([1.0, 1.0, 0.1, 1.0])
    matrix[0, 2] = 0.1  # sheared: z of texture space leans towards x
    plane = np.array([1.0, 0, -0.9])  # faces away from +z in the world, and leans
    local = plane @ matrix[:3, :3]
    expected = local[2] > 0
    assert expected != (plane[2] > 0)
    decal = Decal(gold(), matrix=matrix)(np.zeros((1, 3)), plane[None])
    assert (decal[0, 3] > 0) == expected


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda i: Planar(i, width=0), "width is 0"),
        (lambda i: Cylindrical(i, height=np.nan), "height is nan"),
        (lambda i: Triplanar(i, sharpness=-1), "sharpness is -1"),
        (lambda i: Decal(i, depth=np.inf), "depth is inf"),
        (lambda i: Decal(i, steepest=200), "steepest is 200"),
        (lambda i: Planar(i, matrix=np.diag([1.0, 1, 0, 1])), "flattens space"),
        (lambda i: Planar(i, matrix=np.diag([1.0, 1, 1, 2])), "last row"),
        (lambda i: Planar(i, wrap="bend"), "unknown wrap 'bend'"),
        (lambda i: Planar(i, space="object"), "unknown space 'object'"),
        (lambda i: Triplanar(i)(np.zeros((1, 3))), "no normals"),
        (lambda i: Planar(i)(np.full((2, 3), np.nan)), "2 of 2 points"),
        (lambda i: Planar(i)(np.zeros((2, 3)), np.zeros((1, 3))), "2 points and 1 normals"),
        (lambda i: Planar(i)(np.zeros((2, 3)), None, -1.0), "1 of 1 footprints"),
        (lambda i: Planar(i, width=1e-300)(np.full((1, 3), 1e30)), "texture coordinates"),
    ],
)
def test_what_makes_no_projection_is_refused(call, said):
    with pytest.raises(TextureError, match=said), np.errstate(over="ignore"):
        call(noise_image(2, 2))
