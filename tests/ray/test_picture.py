"""meshsdf.ray.picture: silhouettes, paint, light, edges, and the same bytes every time."""

from dataclasses import replace
from io import BytesIO

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from PIL import Image

from meshsdf.errors import RayError, SpatialError
from meshsdf.mesh import Material, Mesh
from meshsdf.mesh.primitives import box_mesh, icosphere
from meshsdf.mesh.tubes import trefoil_tube
from meshsdf.ray import Camera, Scene, frame, jpeg_bytes, picture, png_bytes, render_mesh
from meshsdf.srgb import srgb_from_linear

BALL = icosphere(subdivisions=5)
KNOT = trefoil_tube(n_along=90, n_around=16)
SMALL = {"width": 160, "height": 120}
GREEN = np.array([0.1, 0.6, 0.2])


def front(height=2.0, **options):
    """A view along -z without perspective, so many world units high."""
    return Camera(np.array([0.0, 0, 10]), np.zeros(3), orthographic_height=height, **options)


@pytest.mark.parametrize("distance", [1.5, 4.0, None])
def test_the_silhouette_of_a_sphere_has_the_area_of_its_formula(distance):
    if distance is None:
        camera, radius = front(2.5), 480 / 2.5
    else:
        camera = Camera(np.array([0.0, 0, distance]), np.zeros(3), field_of_view=100)
        # The cone that touches the sphere has the sine 1 / distance
        radius = np.tan(np.arcsin(1 / distance)) / camera.pixel_size(480)
        camera = replace(camera)
    picture = render_mesh(BALL, camera, width=640, height=480, occlusion=False)
    # Inscribed: the radius is short by at most the sag, 0.3 / 4**5, and its image's likewise. The
    # alpha of a pixel on the edge is off by 1/18 at random, of some 6 r pixels on the edge.
    area = np.pi * radius**2
    sag = 2 * 0.3 / 4**5 * (1 if distance is None else distance**2 / (distance**2 - 1))
    error = picture[..., 3].sum() / area - 1
    assert -sag - 0.2 * np.sqrt(radius) / area <= error <= 0.2 * np.sqrt(radius) / area
    rows, columns = np.nonzero(picture[..., 3])
    assert_allclose([rows.mean(), columns.mean()], [239.5, 319.5], atol=0.02)


def test_alpha_is_the_share_that_is_covered():
    # A box that ends 10.3 pixels right of the middle and 20.6 above, in pixels of 0.01
    box = box_mesh((1.0, 1.0, 1.0), center=(0.103 - 0.5, 0.206 - 0.5, 0.0))
    picture = render_mesh(box, front(1.0), width=100, height=100, samples=4, occlusion=False)
    alpha = picture[..., 3]
    assert_allclose(alpha[40:90, 60], 0.3, atol=1 / 16)
    assert_allclose(alpha[29, 10:50], 0.6, atol=1 / 16)
    assert_allclose(alpha[29, 60], 0.18, atol=2 / 16)
    assert (alpha[40:90, 59] == 1).all()
    assert (alpha[40:90, 61] == 0).all()
    # Without samples, a pixel is its middle
    plain = render_mesh(box, front(1.0), width=100, height=100, samples=1, occlusion=False)
    assert set(np.unique(plain[..., 3])) == {0.0, 1.0}
    assert (plain[40:90, 60, 3] == 0).all()
    assert (plain[29, 10:50, 3] == 1).all()


def test_paint_is_asked_at_places_of_the_mesh_that_pixels_show():
    asked = []

    def paint(points, faces):
        asked.append((points, faces))
        return np.tile(GREEN, (len(points), 1))

    camera = frame(KNOT)
    picture = render_mesh(KNOT, camera, paint=paint, **SMALL)
    points, faces = (np.concatenate(parts) for parts in zip(*asked, strict=True))
    corners = KNOT.triangles[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    assert np.abs(np.einsum("kx,kx->k", points - corners[:, 0], normals)).max() < 1e-14
    middles = asked[0][0]
    seen, _ = camera.project(middles, 160, 120)
    assert_allclose(seen % 1, 0.5, atol=1e-9)
    row, column = np.floor(seen[:, ::-1]).astype(int).T
    assert (picture[row, column, 3] > 0).all()
    # Light changes the strength of paint, not its hue
    shown = picture[picture[..., 3] == 1][:, :3]
    ratio = shown / GREEN
    assert (ratio.max(axis=1) / ratio.min(axis=1)).max() < 1 + 1e-5
    assert len(asked) == 2


def test_colours_of_vertices_are_interpolated_like_a_linear_paint():
    matrix = np.array([[0.2, 0.1, 0], [0, 0.2, 0.1], [0.1, 0, 0.2]])
    of_vertices = 0.5 + KNOT.vertices @ matrix / 3
    options = {"samples": 1, **SMALL}
    by_vertex = render_mesh(KNOT, paint=of_vertices, **options)
    by_point = render_mesh(KNOT, paint=lambda points, _: 0.5 + points @ matrix / 3, **options)
    assert_allclose(by_vertex, by_point, atol=1e-6)
    assert by_vertex[..., :3][by_vertex[..., 3] > 0].std() > 0.05


def square(**attributes):
    """The square from (-1, -1, 0) to (1, 1, 0), seen from +z."""
    corners = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    return Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], np.int32), **attributes)


def test_a_mesh_shows_its_own_texture_the_right_way_up():
    image = np.zeros((2, 2, 3), np.uint8)
    image[0, 0], image[0, 1], image[1, 0], image[1, 1] = [255, 0, 0], [0, 255, 0], [0, 0, 255], 255
    painted = square(
        uv=np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]]),
        material_index=np.zeros(2, np.int32),
        materials=(Material("m", np.ones(4, np.float32), image),),
    )
    picture = render_mesh(painted, front(), width=80, height=80, samples=1)
    middles = picture[[20, 20, 60, 60], [20, 60, 20, 60], :3] > 0.3
    assert_array_equal(middles, [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]])


def test_a_mesh_shows_its_own_vertex_colours_unless_there_is_paint():
    colors = np.array([[1.0, 0, 0, 1], [0, 0, 1, 1], [0, 0, 1, 1], [1, 0, 0, 1]], np.float32)
    painted = square(vertex_colors=colors)
    picture = render_mesh(painted, front(), width=80, height=80, samples=1)
    red, blue = picture[40, :, 0], picture[40, :, 2]
    assert (np.diff(red) < 0).all()
    assert (np.diff(blue) > 0).all()
    green = render_mesh(painted, front(), width=8, height=8, paint=np.tile(GREEN, (4, 1)))
    assert (green[..., 1] > green[..., 0]).all()


def test_corners_are_darker_than_open_places_unless_occlusion_is_off():
    floor, wall = square(), square().vertices[:, [0, 2, 1]] + [0, 0, 0]
    both = Mesh(
        np.concatenate([floor.vertices, wall[:, [0, 1, 2]] @ np.diag([1.0, 1, 1]) + [0, 0, 1]]),
        np.concatenate([floor.faces, floor.faces + 4]),
    )
    camera = front(2.2)
    options = {"width": 110, "height": 110, "samples": 1, "smooth": False}
    picture = render_mesh(both, camera, **options)[..., 1]
    plain = render_mesh(both, camera, occlusion=False, **options)[..., 1]
    # The wall stands on the floor's middle line, and is seen edge-on
    profile = picture[58:104, 10:100].mean(axis=1) / plain[58:104, 10:100].mean(axis=1)
    assert profile[0] < 0.7
    assert profile[-1] > 0.8
    assert (np.diff(profile[::5]) > 0).all()
    assert plain[58:104, 10:100].std() < 1e-3


def test_nothing_speckles_on_a_ball_in_the_open():
    picture = render_mesh(BALL, front(2.5), width=200, height=200, samples=1, smooth=True)
    looks = np.sqrt(picture[60:140, 60:140, 1])
    bend = looks[1:-1, 2:] + looks[1:-1, :-2] + looks[2:, 1:-1] + looks[:-2, 1:-1]
    assert np.abs(bend / 4 - looks[1:-1, 1:-1]).max() < 1 / 255


def test_flat_faces_have_one_colour_each_and_smooth_ones_do_not():
    ball = icosphere(subdivisions=2)
    options = {"width": 100, "height": 100, "samples": 1, "occlusion": False}
    flat = render_mesh(ball, front(), smooth=False, **options)
    smooth = render_mesh(ball, front(), smooth=True, **options)
    n_flat, n_smooth = (len(np.unique(p[p[..., 3] > 0], axis=0)) for p in (flat, smooth))
    assert n_flat <= 160  # half of the faces
    assert n_smooth > 2000
    assert_array_equal(flat[..., 3], smooth[..., 3])
    assert_array_equal(render_mesh(ball, front(), **options), flat)  # 320 faces are large
    assert_array_equal(render_mesh(Scene(ball, smooth=True), front(), **options), smooth)


def test_both_sides_of_a_face_are_seen():
    away = Mesh(square().vertices, square().faces[:, ::-1].copy())
    options = {"width": 20, "height": 20}
    assert_array_equal(
        render_mesh(away, front(), **options), render_mesh(square(), front(), **options)
    )


def test_the_same_bytes_with_any_number_of_threads(monkeypatch):
    once = render_mesh(KNOT, **SMALL)
    monkeypatch.setattr("meshsdf.kernels.parallel.n_threads", lambda: 1)
    again = render_mesh(KNOT, **SMALL)
    assert once.tobytes() == again.tobytes()
    assert png_bytes(once) == png_bytes(again)


def test_tiles_that_no_face_touches_are_left_out_and_change_nothing(monkeypatch):
    close = Camera(np.array([0.0, 0.3, 6.0]), np.array([1.5, 0.0, 0.0]), field_of_view=12)
    cameras = [frame(KNOT, "top"), frame(KNOT, (20.0, 30.0)), front(1.0), close]
    for camera in cameras:
        for width, height in ((161, 67), (16, 16), (5, 90)):
            size = {"width": width, "height": height}
            some = picture._pixels_before(KNOT, camera, width, height)
            drawn = render_mesh(KNOT, camera, **size)
            with monkeypatch.context() as patch:
                patch.setattr(picture, "NEAR", np.inf)  # then no face's place is trusted
                every = picture._pixels_before(KNOT, camera, width, height)
                assert_array_equal(drawn, render_mesh(KNOT, camera, **size))
            assert len(np.unique(every, axis=0)) == width * height
            assert len(np.unique(some, axis=0)) == len(some) <= len(every)
    wide = picture._pixels_before(KNOT, cameras[0], 640, 160)
    assert len(wide) < 0.5 * 640 * 160


def test_what_the_camera_does_not_see_leaves_the_picture_empty():
    away = Camera(np.array([0.0, 0, 5]), np.array([0.0, 0, 9]))
    aside = Camera(np.array([0.0, 0, 5]), np.array([9.0, 0, 5]))
    for camera in (away, aside):
        assert not render_mesh(BALL, camera, width=40, height=30).any()
    inside = Camera(np.zeros(3), np.array([0.0, 0, 1]))
    assert (render_mesh(BALL, inside, width=40, height=30)[..., 3] == 1).all()


def test_a_background_shows_through_where_nothing_covers_it():
    clear = render_mesh(BALL, **SMALL)
    blue = np.array([0.1, 0.2, 0.9])
    full = render_mesh(BALL, background=blue, **SMALL)
    alpha = clear[..., 3:]
    assert ((alpha > 0) & (alpha < 1)).any()
    assert_allclose(full[..., :3], alpha * clear[..., :3] + (1 - alpha) * blue, atol=1e-6)
    assert (full[..., 3] == 1).all()
    assert not clear[clear[..., 3] == 0].any()


def test_png_files_hold_the_picture_in_srgb_and_nothing_else():
    picture = render_mesh(BALL, **SMALL)
    data = png_bytes(picture)
    pixels = np.asarray(Image.open(BytesIO(data)))
    assert pixels.shape == (120, 160, 4)
    expected = 255 * srgb_from_linear(np.clip(picture[..., :3], 0, 1))
    # Linear light is rounded to 1/65535 first: at most 255 * 12.92 / 131070 = 0.026 steps
    assert np.abs(pixels[..., :3] - expected).max() <= 0.527
    assert np.abs(pixels[..., 3] - 255 * picture[..., 3]).max() <= 0.51
    kinds, place = [], 8
    while place < len(data):
        kinds.append(data[place + 4 : place + 8])
        place += 12 + int.from_bytes(data[place : place + 4], "big")
    assert set(kinds) == {b"IHDR", b"IDAT", b"IEND"}
    opaque = render_mesh(BALL, background=(1, 1, 1), **SMALL)
    assert Image.open(BytesIO(png_bytes(opaque))).mode == "RGB"


def test_jpeg_files_have_white_behind():
    picture = render_mesh(BALL, **SMALL)
    pixels = np.asarray(Image.open(BytesIO(jpeg_bytes(picture)))).astype(int)
    white = np.asarray(
        Image.open(BytesIO(png_bytes(render_mesh(BALL, background=(1, 1, 1), **SMALL))))
    ).astype(int)
    assert np.abs(pixels - white).mean() < 2


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"width": 0}, "0 x 120 pixels"),
        ({"width": 2**20, "height": 2**20}, "1048576 x 1048576 pixels"),
        ({"samples": 0}, "samples is 0"),
        ({"samples": 17}, "samples is 17"),
        ({"background": (1, 2)}, r"background is \[1.0, 2.0\]"),
        ({"background": (0, 0, -1)}, "background is"),
        ({"paint": np.zeros((3, 3))}, r"shape \(3, 3\), but vertex colours"),
        ({"paint": lambda points, _: points[:, :2]}, "but point colours"),
        ({"paint": lambda points, _: points * np.nan}, "colours are NaN"),
    ],
)
def test_what_makes_no_picture_is_refused(options, message):
    with pytest.raises(RayError, match=message):
        render_mesh(KNOT, **SMALL | options)


def test_a_mesh_without_faces_is_refused():
    with pytest.raises(SpatialError, match="no faces"):
        render_mesh(Mesh(np.zeros((2, 3)), np.empty((0, 3), np.int32)))
