"""meshsdf.spatial.mesh_colors: what colours a mesh says it has."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf.errors import TextureError
from meshsdf.io import read_mesh
from meshsdf.mesh import Material, Mesh
from meshsdf.mesh.primitives import box_mesh
from meshsdf.spatial.mesh_colors import MeshColors, uv_density
from tests.models import model, needs_models

TINT = np.array([0.5, 1.0, 0.25, 1.0], np.float32)


def square(**more):
    """Two faces over [0, 4] x [0, 2] with uv over [0, 1]^2."""
    vertices = np.array([[0.0, 0, 0], [4, 0, 0], [4, 2, 0], [0, 2, 0]])
    faces = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    more.setdefault("uv", np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]]))
    return Mesh(vertices, faces, **more)


def textured(pixels, index=(0, 0), base=TINT, **more):
    return square(
        material_index=np.array(index, np.int32),
        materials=(Material("paint", base, pixels),),
        **more,
    )


def random_places(mesh, n, seed=0):
    rng = np.random.default_rng(seed)
    return rng.integers(0, mesh.n_faces, n, dtype=np.int32), rng.dirichlet(np.ones(3), n)


def plain_bilinear(pixels, uv):
    """sRGB bytes decoded by the standard's formula, four texels weighted; no alpha."""
    encoded = pixels[..., :3] / 255.0
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    height, width = pixels.shape[:2]
    x, y = uv[:, 0] * width - 0.5, (1 - uv[:, 1]) * height - 0.5
    left, top = np.floor(x).astype(int), np.floor(y).astype(int)
    total = np.zeros((len(uv), 3))
    for down in (0, 1):
        for right in (0, 1):
            weight = np.abs(1 - right - (x - left)) * np.abs(1 - down - (y - top))
            total += weight[:, None] * linear[(top + down) % height, (left + right) % width]
    return total


@needs_models
@pytest.mark.parametrize("name", ["spot.obj", "fuze.obj", "Duck.glb"])
def test_real_models_have_the_colours_of_their_images(name):
    mesh = read_mesh(model(name))
    face = np.arange(mesh.n_faces, dtype=np.int32)
    weights = np.full((mesh.n_faces, 3), 1 / 3)
    look = mesh.materials[mesh.material_index[0]]
    assert (mesh.material_index == mesh.material_index[0]).all()
    assert look.image is not None
    uv = mesh.uv[mesh.faces].mean(axis=1)
    expected = plain_bilinear(look.image, uv) * look.base_color[:3]
    colors = MeshColors(mesh)(face, weights)
    # float32 results; uv differ by 1e-16 in how three are averaged, times 4096 texels
    assert_allclose(colors[:, :3], expected, atol=1e-6)
    assert np.ptp(colors[:, 0]) > 0.1


@needs_models
def test_an_image_read_by_pillow_is_the_one_that_is_seen():
    from PIL import Image as Pillow

    mesh = read_mesh(model("fuze.obj"))
    with Pillow.open(model("fuze uv.jpg")) as picture:
        pixels = np.asarray(picture.convert("RGB"))
    face, weights = random_places(mesh, 3000)
    uv = np.einsum("nk,nkc->nc", weights, mesh.uv[mesh.faces[face]])
    base = mesh.materials[0].base_color[:3]
    colors = MeshColors(mesh)(face, weights)
    assert_allclose(colors[:, :3], plain_bilinear(pixels, uv) * base, atol=1e-6)


def test_the_image_is_tinted_and_repeats():
    pixels = np.random.default_rng(0).integers(0, 256, (5, 8, 3), dtype=np.uint8)
    uv = np.array([[-3.0, 2], [1.5, 0.1], [7, -4], [0.25, 1]])
    mesh = textured(pixels, uv=uv)
    face, weights = random_places(mesh, 500)
    at = np.einsum("nk,nkc->nc", weights, uv[mesh.faces[face]])
    colors = MeshColors(mesh)(face, weights)
    assert_allclose(colors[:, :3], plain_bilinear(pixels, at) * TINT[:3], atol=1e-6)
    assert_array_equal(colors[:, 3], 1)


def test_each_face_has_its_own_material_and_grey_where_there_is_none():
    pixels = np.full((1, 1, 3), 255, np.uint8)
    mesh = textured(pixels, index=(0, -1))
    face, weights = random_places(mesh, 40)
    colors = MeshColors(mesh)(face, weights)
    assert_allclose(colors[face == 0], np.tile(TINT, ((face == 0).sum(), 1)), atol=1e-7)
    grey = np.array([0.8, 0.8, 0.8, 1], np.float32)
    assert_array_equal(colors[face == 1], np.tile(grey, ((face == 1).sum(), 1)))
    assert_array_equal(MeshColors(square())(face, weights), np.tile(grey, (40, 1)))


def test_base_colours_need_no_image():
    mesh = textured(None)
    face, weights = random_places(mesh, 10)
    assert_array_equal(MeshColors(mesh)(face, weights), np.tile(TINT, (10, 1)))


def test_vertex_colours_are_blended_in_linear_light_and_tinted():
    corners = np.random.default_rng(0).random((4, 4)).astype(np.float32)
    mesh = textured(None, vertex_colors=corners)
    face, weights = random_places(mesh, 200)
    expected = np.einsum("nk,nkc->nc", weights, corners[mesh.faces[face]].astype(float))
    assert_allclose(MeshColors(mesh)(face, weights), expected * TINT, atol=1e-6)
    alone = square(vertex_colors=corners)
    assert_allclose(MeshColors(alone)(face, weights), expected, atol=1e-6)


def test_the_density_is_that_of_the_texture_map():
    assert_allclose(uv_density(square()), np.tile([1 / 4, 1 / 2], (2, 1)), rtol=1e-14)
    rng = np.random.default_rng(0)
    gradient = rng.normal(size=(2, 3))
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    flat = rng.normal(size=(30, 2)) @ turn[:, :2].T  # points of a plane through the origin
    mesh = Mesh(flat, np.arange(30, dtype=np.int32).reshape(-1, 3), uv=flat @ gradient.T)
    tangential = gradient - (gradient @ turn[:, 2])[:, None] * turn[:, 2]
    expected = np.tile(np.linalg.norm(tangential, axis=1), (10, 1))
    assert_allclose(uv_density(mesh), expected, rtol=1e-9)
    needle = Mesh(np.zeros((3, 3)), np.array([[0, 1, 2]], np.int32), uv=np.eye(3)[:, :2].copy())
    assert_array_equal(uv_density(needle), 0)


def test_a_footprint_on_the_surface_averages_that_much_of_the_image():
    columns = (np.arange(64) % 16 < 8)[None, :, None]
    pixels = np.tile(columns, (64, 1, 3)).astype(np.uint8) * 255  # four periods over u
    colors = MeshColors(textured(pixels, base=np.ones(4, np.float32)))
    face, weights = random_places(square(), 500)
    assert np.ptp(colors(face, weights)[:, 0]) == 1
    assert_allclose(colors(face, weights, 2.0)[:, 0], 0.5, atol=1e-3)  # 2 of 4 units: two periods
    tall = np.ascontiguousarray(pixels.transpose(1, 0, 2))
    rows = MeshColors(textured(tall, base=np.ones(4, np.float32)))
    assert_allclose(rows(face, weights, 1.0)[:, 0], 0.5, atol=1e-3)  # 1 of 2 units


def test_a_hundred_places_are_not_another_answer_than_each_alone():
    mesh = textured(np.random.default_rng(0).integers(0, 256, (9, 9, 3), dtype=np.uint8))
    face, weights = random_places(mesh, 100)
    footprint = np.linspace(0, 2, 100)
    colors, together = MeshColors(mesh), MeshColors(mesh)(face, weights, footprint)
    for k in (0, 13, 99):
        one = colors(face[k : k + 1], weights[k : k + 1], footprint[k : k + 1])
        assert_array_equal(one[0], together[k])
    assert colors(face[:0], weights[:0]).shape == (0, 4)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda c: c(np.array([12], np.int32), np.ones((1, 3))), "1 of 1 faces are not among 12"),
        (lambda c: c(np.array([-1], np.int32), np.ones((1, 3))), "1 of 1 faces are not among 12"),
        (lambda c: c(np.zeros(1, np.int32), np.full((1, 3), np.nan)), "1 of 1 barycentric"),
        (lambda c: c(np.zeros(2, np.int32), np.ones((1, 3))), "2 faces and 1 rows"),
        (lambda c: c(np.zeros(1, np.int32), np.ones((1, 3)), -1.0), "1 of 1 footprints"),
        (lambda c: MeshColors(textured(None, index=(0, 3))), "indices up to 3 for 2 faces"),
        (lambda c: MeshColors(square(uv=np.full((4, 2), np.nan))), "4 of 4 uv"),
    ],
)
def test_places_that_are_not_on_the_mesh_are_refused(call, said):
    with pytest.raises(TextureError, match=said):
        call(MeshColors(box_mesh()))
