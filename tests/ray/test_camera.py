"""meshsdf.ray.camera and framing: rays, pixels, and views that hold everything."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf.box import Box
from meshsdf.errors import RayError
from meshsdf.mesh import Mesh
from meshsdf.mesh.primitives import box_mesh, icosphere
from meshsdf.mesh.tubes import trefoil_tube
from meshsdf.ray import VIEWS, Camera, frame

CAMERAS = {
    "perspective": Camera(np.array([3.0, 2.0, 5.0]), np.array([0.5, 0.0, -1.0])),
    "wide": Camera(np.array([0.0, 9.0, 0.1]), np.zeros(3), np.array([1.0, 0, 0]), 120),
    "parallel": Camera(np.array([-3.0, 1.0, 2.0]), np.ones(3), orthographic_height=2.5),
}


@pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)
def test_points_on_a_ray_are_seen_in_its_pixel(camera):
    rng = np.random.default_rng(0)
    pixels = rng.uniform(0, 1, (500, 2)) * [640, 480]
    origins, directions = camera.rays(640, 480, pixels)
    assert_allclose(np.linalg.norm(directions, axis=1), 1, atol=1e-15)
    far = rng.uniform(0.1, 100, (500, 1))
    seen, depth = camera.project(origins + far * directions, 640, 480)
    # 2000 ulps of a picture's width: points 100 away, seen in pixels of a hundredth
    assert_allclose(seen, pixels, atol=2000 * 640 * 2.0**-53)
    ahead = (camera.target - camera.position) / np.linalg.norm(camera.target - camera.position)
    assert_allclose(depth, far[:, 0] * (directions @ ahead), rtol=1e-12)


@pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)
def test_without_places_the_rays_go_through_the_middles_row_by_row(camera):
    origins, directions = camera.rays(5, 3)
    seen, _ = camera.project(origins + directions, 5, 3)
    y, x = np.indices((3, 5)).reshape(2, 15)
    assert_allclose(seen, np.column_stack([x, y]) + 0.5, atol=1e-12)


def test_the_field_of_view_reaches_from_border_to_border():
    camera = Camera(np.zeros(3), np.array([0.0, 0, -1]), field_of_view=90)
    edges = np.array([[0.0, 1, -1], [0, -1, -1], [2, 0, -1]])
    seen, depth = camera.project(edges, 400, 200)
    assert_allclose(seen, [[200, 0], [200, 200], [400, 100]], atol=1e-12)
    assert_allclose(depth, 1)
    parallel = Camera(np.zeros(3), np.array([0.0, 0, -1]), orthographic_height=2)
    assert_allclose(parallel.project(edges * [1, 1, 7], 400, 200)[0], seen, atol=1e-12)


def test_what_lies_behind_has_no_pixel():
    camera = Camera(np.zeros(3), np.array([0.0, 0, -1]))
    seen, depth = camera.project(np.array([[0.0, 0, 1], [0, 0, 0]]), 10, 10)
    assert np.isnan(seen).all()
    assert_array_equal(depth, [-1, 0])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"target": np.zeros(3)}, "same point"),
        ({"up": np.array([0.0, 0, -3])}, "along the line of sight"),
        ({"up": np.zeros(3)}, "or is zero"),
        ({"field_of_view": 180}, "180 degrees"),
        ({"field_of_view": float("nan")}, "nan degrees"),
        ({"orthographic_height": 0}, "height is 0"),
        ({"position": np.array([np.nan, 0, 0])}, r"position is \[nan"),
    ],
)
def test_what_makes_no_camera_is_refused(options, message):
    place = {"position": np.zeros(3), "target": np.array([0.0, 0, -1])}
    with pytest.raises(RayError, match=message):
        Camera(**place | options)


SUBJECTS = {
    "knot": trefoil_tube(n_along=60, n_around=8),
    "long box": box_mesh((9.0, 1.0, 0.1), center=(1e4, -2e4, 5.0)),
    "tiny": icosphere(1e-9, subdivisions=1),
    "plane": Mesh(np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]], np.int32)),
    "point": Mesh(np.ones((3, 3)), np.array([[0, 1, 2]], np.int32)),
}


@pytest.mark.parametrize("orthographic", [False, True])
@pytest.mark.parametrize("up", ["y", "z"])
@pytest.mark.parametrize("view", [*VIEWS, (123.0, -45), (30, 89.9)])
@pytest.mark.parametrize("subject", SUBJECTS.values(), ids=SUBJECTS)
def test_all_of_it_is_in_the_picture_and_two_opposite_borders_are_touched(
    subject, view, up, orthographic
):
    for aspect in (0.4, 1.0, 2.5):
        size = 1000 * aspect, 1000.0
        for target in (subject, subject.box):
            camera = frame(target, view, aspect, up=up, margin=0.1, orthographic=orthographic)
            box = subject.box
            points = subject.vertices
            if target is box:
                points = np.where(np.indices((2, 2, 2)).reshape(3, 8).T, box.upper, box.lower)
            seen, depth = camera.project(points, round(1000 * aspect), 1000)
            share = seen / size
            assert (depth > 0).all()
            slack = 1e-9 + 1e-15 * np.abs(points).max() / (box.diagonal or 1)
            assert share.min() >= 0.1 - slack
            assert share.max() <= 0.9 + slack
            free = np.array([share.min(axis=0), 1 - share.max(axis=0)])
            assert_allclose(free[0], free[1], atol=10 * slack)
            if subject.n_faces > 1:
                assert np.abs(free - 0.1).min() < 10 * slack


@pytest.mark.parametrize(
    ("up", "view", "right", "upward"),
    [
        ("y", "front", [1, 0, 0], [0, 1, 0]),
        ("y", "back", [-1, 0, 0], [0, 1, 0]),
        ("y", "right", [0, 0, -1], [0, 1, 0]),
        ("y", "left", [0, 0, 1], [0, 1, 0]),
        ("y", "top", [1, 0, 0], [0, 0, -1]),
        ("y", "bottom", [1, 0, 0], [0, 0, 1]),
        ("z", "front", [1, 0, 0], [0, 0, 1]),
        ("z", "right", [0, 1, 0], [0, 0, 1]),
        ("z", "top", [1, 0, 0], [0, 1, 0]),
    ],
)
def test_named_views_show_what_their_names_say(up, view, right, upward):
    camera = frame(Box(-np.ones(3), np.ones(3)), view, up=up)
    axes = np.array([right, upward, np.cross(right, upward)], float)
    assert_array_equal(np.abs(camera.axes - axes) < 1e-15, True)
    assert_allclose(camera.position, np.linalg.norm(camera.position) * axes[2], atol=1e-12)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"view": "above"}, "no view 'above'"),
        ({"view": (0, 91)}, "elevation 91"),
        ({"view": (float("nan"), 0)}, "azimuth is nan"),
        ({"aspect": 0}, "aspect is 0"),
        ({"margin": 0.5}, "margin is 0.5"),
        ({"field_of_view": 0}, "0 degrees"),
    ],
)
def test_what_makes_no_view_is_refused(options, message):
    with pytest.raises(RayError, match=message):
        frame(Box(-np.ones(3), np.ones(3)), **options)
