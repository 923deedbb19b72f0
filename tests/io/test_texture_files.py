"""A texture's colours through every file format that carries them, there and back."""

import numpy as np
import pytest

from meshsdf.io import read_mesh, write_mesh
from meshsdf.io.pictures import write_picture
from meshsdf.io.vdb import read_vdb_grids
from meshsdf.io.vdb_texture import write_vdb_texture
from meshsdf.mesh.primitives import box_mesh, icosphere
from meshsdf.spatial.image import Image
from meshsdf.srgb import linear_from_srgb, srgb_rgba
from meshsdf.texture.atlas import atlas_colors, atlas_for, textured, vertex_colored
from meshsdf.texture.mesh_source import MeshSource
from meshsdf.texture.mip import bake
from meshsdf.texture.volume_texture import VolumeTexture
from tests.io.vdb_examples import needs_openvdb, run_openvdb

SAND = np.array([213, 170, 59])
ROUNDS = 10


def filled(mesh, color) -> VolumeTexture:
    texture = VolumeTexture.around(mesh, resolution=24)
    texture.add_layer(color=np.array([*color, 1.0], np.float32))
    return texture


def bytes_of(linear) -> np.ndarray:
    return np.rint(255 * srgb_rgba(linear))[:, :3]


@pytest.mark.parametrize("suffix", [".glb", ".ply", ".obj"])
def test_a_colour_at_vertices_comes_back_after_ten_rounds(tmp_path, suffix):
    mesh = icosphere(subdivisions=2)
    texture = filled(mesh, linear_from_srgb(SAND / 255))
    for k in range(ROUNDS):
        path = tmp_path / f"{k}{suffix}"
        write_mesh(path, vertex_colored(texture, mesh))
        mesh = read_mesh(path)
        texture = VolumeTexture.around(mesh, resolution=24)
        bake(texture, texture.add_layer(), MeshSource(mesh))
    shown = texture.colors(np.array(mesh.vertices), np.array(mesh.vertices))
    assert np.abs(bytes_of(shown) - SAND).max() <= 1


@pytest.mark.parametrize("suffix", [".glb", ".obj"])
def test_a_colour_in_an_image_comes_back_after_ten_rounds(tmp_path, suffix):
    mesh = box_mesh()
    texture = filled(mesh, linear_from_srgb(SAND / 255))
    for k in range(ROUNDS):
        (tmp_path / str(k)).mkdir()
        path = tmp_path / str(k) / f"box{suffix}"
        atlas = atlas_for(mesh, 64, "squares" if mesh.uv is None else "own")
        write_mesh(path, textured(texture, atlas))
        mesh = read_mesh(path)
        texture = VolumeTexture.around(mesh, resolution=24)
        bake(texture, texture.add_layer(), MeshSource(mesh))
    triangles = mesh.triangles
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    assert np.abs(bytes_of(texture.colors(triangles.mean(axis=1), normals)) - SAND).max() <= 1


@pytest.mark.parametrize("suffix", [".png", ".exr"])
def test_a_colour_in_an_atlas_comes_back_after_ten_rounds(tmp_path, suffix):
    mesh = box_mesh()
    atlas = atlas_for(mesh, 64, "squares")
    texture = filled(mesh, linear_from_srgb(SAND / 255))
    for k in range(ROUNDS):
        path = tmp_path / f"{k}{suffix}"
        write_picture(path, atlas_colors(texture, atlas))
        shown = Image.from_linear(_read_exr(path)) if suffix == ".exr" else _read_png(path)
        color = shown.sample(np.array([[0.3, 0.6]]))[0, :3]
        texture = filled(mesh, color)
    assert np.abs(bytes_of(texture.colors(np.array([[0.5, 0.1, 0.2]]))) - SAND).max() <= 1


def _read_png(path) -> Image:
    from PIL import Image as Pillow

    return Image.from_srgb(np.asarray(Pillow.open(path)))


def _read_exr(path) -> np.ndarray:
    import OpenEXR

    with OpenEXR.File(str(path), separate_channels=True) as file:
        channels = file.channels()
        return np.dstack([channels[name].pixels.astype(np.float32) for name in "RGB"])


def test_a_colour_in_a_volume_comes_back_after_ten_rounds(tmp_path):
    mesh = icosphere(subdivisions=3)
    texture = filled(mesh, linear_from_srgb(SAND / 255))
    for k in range(ROUNDS):
        path = tmp_path / f"{k}.vdb"
        write_vdb_texture(path, texture, half=k % 2 == 1)
        (colors,) = read_vdb_grids(path)
        active = np.unpackbits(colors.active.view(np.uint8), bitorder="little").view(bool)
        values = np.asarray(colors.values[:]).reshape(-1, 3)[active]
        assert len(values) == texture.octree.n_texels(0)
        assert np.ptp(values, axis=0).max() == 0
        texture = filled(mesh, values[0])
    assert np.abs(bytes_of(texture.colors(np.array(mesh.vertices))) - SAND).max() <= 1


@needs_openvdb
def test_openvdb_reads_every_texel_where_it_is(tmp_path):
    mesh = icosphere(subdivisions=4)
    texture = VolumeTexture.around(mesh, resolution=40)
    bake(texture, texture.add_layer(), _place)
    path = tmp_path / "place.vdb"
    write_vdb_texture(path, texture)
    run_openvdb("dump", path)
    with np.load(f"{path}.npz") as data:
        rows = data["entries0"][data["entries0"][:, 4] == 1]
        corners = data["corners0"]
    assert len(rows) == texture.octree.n_texels(0)
    assert (rows[:, 3] == 1).all()
    points = rows[:, :3] @ (corners[1:] - corners[0]) + corners[0]
    colors = np.column_stack([rows[:, 5:], np.ones(len(rows))]).astype(np.float32)
    codes = np.rint(255 * srgb_rgba(colors))
    truth = np.rint(255 * srgb_rgba(_place(points)))
    assert np.abs(codes - truth)[:, :3].max() <= 1


def _place(points):
    return np.column_stack([0.5 + 0.4 * points, np.ones(len(points))]).astype(np.float32)
