"""Atlases against plain drawing, seams against the eye's tolerance, gaps, thin plates."""

import itertools

import numpy as np
import pytest

from meshsdf.errors import TextureError
from meshsdf.io import read_mesh
from meshsdf.kernels.uv_raster import NO_FACE, draw_faces
from meshsdf.mesh import Mesh
from meshsdf.mesh.primitives import box_mesh, icosphere
from meshsdf.spatial.image import Image
from meshsdf.srgb import srgb_rgba
from meshsdf.texture.atlas import atlas_for, pull_push, textured, vertex_colored
from meshsdf.texture.mesh_source import MeshSource
from meshsdf.texture.mip import bake
from meshsdf.texture.procedural import procedural
from meshsdf.texture.volume_texture import VolumeTexture
from tests.models import model, needs_models


def baked(mesh: Mesh, function, resolution: int = 64) -> VolumeTexture:
    texture = VolumeTexture.around(mesh, resolution=resolution)
    bake(texture, texture.add_layer(), function)
    return texture


def plain_faces(uv, faces, size):
    """Of a picture that repeats, the first face with a texel's centre inside all its edges."""
    face_of = np.full((size, size), NO_FACE)
    for f in range(len(faces) - 1, -1, -1):
        a, b, c = uv[faces[f]]
        for row in range(size):
            for column, dx, dy in itertools.product(range(size), (-1, 0, 1), (-1, 0, 1)):
                p = np.array([column + 0.5 + dx * size, row + 0.5 + dy * size])
                sides = [
                    (q[0] - r[0]) * (p[1] - r[1]) - (q[1] - r[1]) * (p[0] - r[0])
                    for r, q in ((a, b), (b, c), (c, a))
                ]
                if min(sides) >= 0 or max(sides) <= 0:
                    face_of[row, column] = f
    return face_of


def test_faces_are_drawn_where_a_plain_test_finds_them():
    rng = np.random.default_rng(3)
    middle = rng.uniform(-4, 28, (8, 1, 2))
    uv = (middle + rng.uniform(-9, 9, (8, 3, 2))).reshape(24, 2)
    faces = np.arange(24, dtype=np.int32).reshape(8, 3)
    face_of = np.full((24, 24), NO_FACE, np.int32)
    places = np.zeros((24, 24, 2), np.float32)
    draw_faces(uv, faces, 24, 24, 0.0, face_of, places)
    assert np.array_equal(face_of, plain_faces(uv, faces, 24))
    rows, columns = np.nonzero(face_of != NO_FACE)
    corners = uv[faces[face_of[rows, columns]]]
    s, t = places[rows, columns].T.astype(float)[..., None]
    back = (1 - s - t) * corners[:, 0] + s * corners[:, 1] + t * corners[:, 2]
    off = back - np.column_stack([columns + 0.5, rows + 0.5])
    assert np.abs(off - 24 * np.rint(off / 24)).max() < 1e-4


def edges_between_charts(mesh: Mesh):
    """Places on every edge of the surface, on both its faces: (k, 2 faces), (k, 2, 3) weights."""
    welded = mesh.welded.faces
    seen = {}
    for face, corners in enumerate(welded):
        for k in range(3):
            a, b = int(corners[k]), int(corners[(k + 1) % 3])
            seen.setdefault((min(a, b), max(a, b)), []).append((face, k, a < b))
    faces, weights = [], []
    for sides in seen.values():
        if len(sides) != 2:
            continue
        for share in (0.2, 0.5, 0.8):
            pair = np.zeros((2, 3))
            for side, (_, k, forward) in enumerate(sides):
                along = share if forward else 1 - share
                pair[side, k], pair[side, (k + 1) % 3] = 1 - along, along
            faces.append([sides[0][0], sides[1][0]])
            weights.append(pair)
    return np.array(faces), np.array(weights)


def bytes_shown(image: Image, mesh: Mesh, faces, weights):
    uv = np.einsum("nk,nkc->nc", weights, mesh.uv[mesh.faces[faces]])
    return 255 * srgb_rgba(image.sample(uv))[:, :3]


@pytest.mark.parametrize("method", ["squares", "xatlas"])
def test_no_seam_shows_where_noise_crosses_the_edges_of_charts(method):
    if method == "xatlas":
        pytest.importorskip("xatlas", reason="the extra unwrap is not installed")
    mesh = icosphere(subdivisions=3)
    noise = procedural("clouds", scale=0.5, seed=4)
    texture = baked(mesh, noise, 128)
    laid = textured(texture, atlas_for(mesh, 2048, method))
    image = Image.from_srgb(laid.materials[0].image)
    faces, weights = edges_between_charts(laid)
    assert len(faces) == 3 * 3 * mesh.n_faces // 2
    one = bytes_shown(image, laid, faces[:, 0], weights[:, 0])
    other = bytes_shown(image, laid, faces[:, 1], weights[:, 1])
    assert np.ptp(one, axis=0).min() > 20, "the noise is to be seen"
    assert np.abs(one - other).max() <= 2


def test_squares_refuse_what_does_not_fit_and_say_what_would():
    mesh = icosphere(subdivisions=3)
    with pytest.raises(TextureError, match="1280 faces do not fit in 64 x 64") as caught:
        atlas_for(mesh, 64, "squares")
    size = int(caught.value.fix.split()[5])
    assert atlas_for(mesh, size, "squares").coverage > 0.2


def test_own_coordinates_are_used_unless_faces_cover_each_other():
    mesh = box_mesh()
    with pytest.raises(TextureError, match="no texture coordinates"):
        atlas_for(mesh, 128, "own")
    laid = atlas_for(mesh, 128, "squares").mesh
    assert atlas_for(laid, 128).method == "own"
    stacked = Mesh(laid.vertices, laid.faces, uv=np.tile(laid.uv[:3], (laid.n_faces, 1)))
    assert atlas_for(stacked, 128, time_limit=1e-3).method == "squares"


def test_xatlas_that_takes_too_long_is_stopped():
    pytest.importorskip("xatlas", reason="the extra unwrap is not installed")
    with pytest.raises(TextureError, match=r"not done in 0\.001 seconds"):
        atlas_for(icosphere(subdivisions=2), 128, "xatlas", time_limit=1e-3)


def test_squares_instead_of_xatlas_say_why():
    pytest.importorskip("xatlas", reason="the extra unwrap is not installed")
    laid = atlas_for(icosphere(subdivisions=2), 256, time_limit=1e-3)
    assert laid.method == "squares"
    assert laid.without_xatlas == "xatlas was not done in 0.001 seconds: allow more time"
    assert atlas_for(icosphere(subdivisions=2), 256, "squares").without_xatlas == ""


def test_what_is_not_known_is_filled_from_its_surroundings():
    rng = np.random.default_rng(0)
    known = rng.random((37, 61)) < 0.02
    picture = np.full((37, 61, 4), np.nan, np.float32)
    picture[known] = [0.25, 0.5, 0.75, 1.0]
    filled = pull_push(np.nan_to_num(picture), known)
    assert np.abs(filled - [0.25, 0.5, 0.75, 1.0]).max() < 1e-6
    halves = np.zeros((32, 32, 4), np.float32)
    halves[:, 31] = 1
    edges = np.zeros((32, 32), bool)
    edges[:, [0, 31]] = True
    across = pull_push(halves, edges)[16, :, 0]
    assert (np.diff(across) >= -1e-6).all()
    assert across[8] < 0.5 < across[24]


def test_vertex_colours_are_what_the_texture_shows_there():
    mesh = icosphere(subdivisions=4)
    marble = procedural("marble", scale=2.0)
    texture = baked(mesh, marble, 128)
    colored = vertex_colored(texture, mesh)
    spacing = np.sqrt(4 * np.pi / mesh.n_vertices)
    truth = marble(np.array(mesh.vertices), spacing)
    assert np.abs(srgb_rgba(colored.vertex_colors) - srgb_rgba(truth)).mean() < 0.02


def test_thin_plates_take_each_side_from_its_own_face():
    plate = box_mesh((1.0, 1.0, 0.004), center=(0.5, 0.5, 0.002))
    top = plate.triangles[:, :, 2].min(axis=1) > 0.003
    index = np.where(top, 0, 1).astype(np.int32)
    from meshsdf.mesh import Material

    red, blue = (
        Material("", np.array([*color, 1.0], np.float32)) for color in ([1, 0, 0], [0, 0, 1])
    )
    painted = Mesh(plate.vertices, plate.faces, material_index=index, materials=(red, blue))
    texture = baked(painted, MeshSource(painted), 100)
    places = np.array([[0.3, 0.4, 0.004], [0.3, 0.4, 0.0]])
    normals = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
    assert texture.colors(places, normals).tolist() == [[1, 0, 0, 1], [0, 0, 1, 1]]


@needs_models
@pytest.mark.parametrize("name", ["spot.obj", "fuze.obj"])
def test_an_image_comes_back_through_space(name):
    mesh = read_mesh(model(name))
    image = mesh.materials[0].image[..., :3]
    texture = baked(mesh, MeshSource(mesh), 1024)
    size = len(image)
    again = textured(texture, atlas_for(mesh, size, "own")).materials[0].image[..., :3]
    shown = np.full((size, size), NO_FACE, np.int32)
    corners = np.stack([size * mesh.uv[:, 0], size * (1 - mesh.uv[:, 1])], axis=1)
    draw_faces(corners, mesh.faces, size, size, 0.0, shown, np.empty((size, size, 2), np.float32))
    error = (image.astype(float) - again)[shown != NO_FACE]
    assert 10 * np.log10(255**2 / (error**2).mean()) > 38
