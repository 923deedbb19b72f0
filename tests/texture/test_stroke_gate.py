"""Paint stays on the side and on the part of the surface that it is put on."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from meshsdf.mesh import Mesh, box_mesh, icosphere
from meshsdf.texture.brush import Brush, Stencil
from meshsdf.texture.refine import refine_to
from meshsdf.texture.stroke import paint
from meshsdf.texture.volume_texture import VolumeTexture

RED = (1.0, 0.0, 0.0, 1.0)
TEXEL = 1 / 32
BYTE = 1 / 255
UP = np.array([[0.0, 0, 1]])


def both(*meshes: Mesh) -> Mesh:
    """Several meshes as one."""
    faces, n = [], 0
    for mesh in meshes:
        faces.append(mesh.faces + n)
        n += mesh.n_vertices
    vertices = np.concatenate([mesh.vertices for mesh in meshes])
    return Mesh(vertices, np.concatenate(faces).astype(np.int32))


def alpha(texture, layer, points, normal) -> np.ndarray:
    """What is painted at points that look one way."""
    return texture.colors(points, np.tile(normal, (len(points), 1)), layer=layer)[:, 3]


def plane_points(x, y, z) -> np.ndarray:
    """A grid of points at a height."""
    return np.stack(np.meshgrid(x, y, [z], indexing="ij"), axis=-1).reshape(-1, 3)


@pytest.mark.parametrize("gap", [3.0, 3.4, 4.0])
def test_paint_does_not_jump_to_the_next_finger(gap):
    wide, far = 10.3 * TEXEL, (10.3 + gap) * TEXEL
    fingers = both(
        box_mesh((1.0, wide, wide), center=(0, 0.2 * TEXEL, 0)),
        box_mesh((1.0, wide, wide), center=(0, 0.2 * TEXEL + far, 0)),
    )
    texture = VolumeTexture.around(fingers, texel=TEXEL)
    top = 0.5 * wide
    dab = np.array([[0.0, 0.2 * TEXEL, top]])
    here = plane_points(np.linspace(-0.2, 0.2, 9), np.linspace(-0.1, 0.1, 5), top)
    there = here + np.array([0, far, 0])
    for geodesic in (False, True):
        layer = texture.add_layer()
        brush = Brush(24 * TEXEL, color=RED, hardness=0.9, detail=TEXEL, geodesic=geodesic)
        changed = paint(texture, layer, brush, dab, UP)
        assert len(changed)
        assert_allclose(alpha(texture, layer, here, UP[0]), 1, atol=BYTE)
        assert (alpha(texture, layer, there, UP[0]) == (0 if geodesic else 1)).all()


def test_a_dab_between_fingers_paints_the_one_it_is_on():
    plates = both(
        box_mesh((1.0, 1.0, 0.2), center=(0, 0, 0)), box_mesh((1.0, 1.0, 0.2), center=(0, 0, 0.3))
    )
    texture = VolumeTexture.around(plates, texel=TEXEL)
    grid = plane_points(np.linspace(-0.1, 0.1, 5), np.linspace(-0.1, 0.1, 5), 0.0)
    layer = texture.add_layer()
    brush = Brush(0.25, color=RED, hardness=0.9, detail=TEXEL, geodesic=True, angle=(-1.0, -1.0))
    # The upper side of the lower plate, 0.1 = 3.2 texels under the upper one; no gate by angle
    paint(texture, layer, brush, np.array([[0.0, 0, 0.1]]), UP)
    assert_allclose(alpha(texture, layer, grid + np.array([0, 0, 0.1]), UP[0]), 1, atol=BYTE)
    assert alpha(texture, layer, grid + np.array([0, 0, 0.2]), -UP[0]).max() == 0
    assert alpha(texture, layer, grid + np.array([0, 0, 0.4]), UP[0]).max() == 0


@pytest.mark.parametrize("thickness", [0.05, 0.5, 2.0])
@pytest.mark.parametrize("geodesic", [False, True])
def test_the_other_side_of_a_thin_plate_stays_clean(thickness, geodesic):
    plate = box_mesh((1.0, 1.0, thickness * TEXEL), center=(0, 0, 0.3 * TEXEL))
    texture = VolumeTexture.around(plate, texel=TEXEL)
    z = np.array([0.3 + 0.5 * thickness, 0.3 - 0.5 * thickness]) * TEXEL
    layer = texture.add_layer(color=(0.0, 0.0, 1.0, 1.0))
    brush = Brush(0.3, color=RED, hardness=0.8, detail=TEXEL, geodesic=geodesic)
    paint(texture, layer, brush, np.array([[0.0, 0, z[0]]]), UP)
    grid = plane_points(np.linspace(-0.1, 0.1, 5), np.linspace(-0.1, 0.1, 5), 0.0)
    for side, color in ((0, RED), (1, (0.0, 0.0, 1.0, 1.0))):
        points = grid + np.array([0, 0, z[side]])
        normals = np.tile(UP * (1 - 2 * side), (len(points), 1))
        seen = texture.colors(points, normals, layer=layer)
        assert_allclose(seen, np.tile(color, (len(points), 1)), atol=BYTE)


def test_the_gate_changes_nothing_where_all_is_connected():
    ball = icosphere(subdivisions=4)
    texture = VolumeTexture.around(ball, texel=TEXEL)
    at = np.random.default_rng(0).normal(size=(2000, 3))
    at /= np.linalg.norm(at, axis=1, keepdims=True)
    seen = []
    points = np.array([[0.0, 0, 1], [0.6, 0, 0.8]])
    for geodesic in (False, True):
        layer = texture.add_layer()
        paint(texture, layer, Brush(0.3, color=RED, geodesic=geodesic), points, points)
        seen.append(texture.colors(at, at, layer=layer))
    assert seen[0].max() == 1
    assert (seen[0] == seen[1]).all()


def test_paint_goes_around_an_edge_as_far_as_the_angle_lets_it():
    texture = VolumeTexture.around(box_mesh((1.0, 1.0, 1.0)), texel=TEXEL)
    for angle, painted in (((0.0, 0.25), 0.0), ((-0.5, -0.25), 1.0)):
        layer = texture.add_layer()
        refine_to(texture, layer, 0)
        brush = Brush(0.3, color=RED, hardness=0.9, angle=angle, geodesic=True, detail=TEXEL)
        paint(texture, layer, brush, np.array([[0.0, 0.4, 0.5]]), UP)
        side = plane_points(np.linspace(-0.1, 0.1, 5), [0.5], 0.4)
        assert_allclose(alpha(texture, layer, side, [0.0, 1.0, 0.0]), painted, atol=BYTE)


def test_a_stamp_is_printed_upright_and_to_size():
    stamp = np.zeros((4, 4), np.float32)
    stamp[0, 3] = 1.0  # the upper right
    stamp[3] = 0.5  # and the lowest row
    brush = Brush(0.4, color=RED, stamp=stamp, detail=TEXEL / 2)
    # On the side that looks along -y, up is +z and right is +x
    tall = VolumeTexture.around(box_mesh((1.0, 0.5, 1.0)), texel=TEXEL / 2)
    layer = tall.add_layer()
    look = np.array([[0.0, -1.0, 0.0]])
    paint(tall, layer, brush, np.array([[0.0, -0.25, 0.0]]), look)
    centers = (np.arange(4) - 1.5) * 0.2
    points = np.array([[x, -0.25, z] for z in -centers for x in centers])
    seen = alpha(tall, layer, points, look[0]).reshape(4, 4)
    # Linear between texels: at a pixel's peak half a texel of a slope of 1 in 0.2 may be cut off
    assert_allclose(seen, stamp, atol=TEXEL / 4 / 0.2 + BYTE)


def test_paint_passes_a_stencil_where_it_is_open():
    texture = VolumeTexture.around(box_mesh((1.0, 1.0, 0.5)), texel=TEXEL)
    picture = np.array([[1.0, 0.0], [0.5, 1.0]], np.float32).repeat(8, 0).repeat(8, 1)
    # u = x + 1/2, v = 1/2 - y: the picture lies on the box's top
    matrix = np.array([[1.0, 0, 0, 0.5], [0, -1.0, 0, 0.5], [0, 0, 0, 1.0]])
    layer = texture.add_layer()
    brush = Brush(2.0, color=RED, hardness=1.0, stencil=Stencil(picture, matrix), detail=TEXEL)
    paint(texture, layer, brush, np.array([[0.0, 0, 0.25]]), UP)
    x, y = np.array([[-1, 1], [1, 1], [-1, -1], [1, -1]]).T / 4
    points = np.stack([x, y, 0 * x + 0.25], axis=1)
    assert_allclose(alpha(texture, layer, points, UP[0]), [1, 0, 0.5, 1], atol=2 * BYTE)
