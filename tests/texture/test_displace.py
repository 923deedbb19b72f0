"""Painted heights move the surface along its normals: closed formulas on balls and boxes."""

import numpy as np
import pytest

from meshsdf.errors import TextureError
from meshsdf.mesh.primitives import box_mesh, icosphere
from meshsdf.surface import marching_cubes
from meshsdf.texture.displace import displaced_band
from meshsdf.texture.mip import bake
from meshsdf.texture.volume_texture import VolumeTexture


def heights(mesh, function, resolution: int = 64) -> VolumeTexture:
    """A texture whose height channel is ``function(points)``, in texels."""
    texture = VolumeTexture.around(mesh, resolution=resolution)

    def values(points):
        return np.column_stack([function(points), np.zeros((len(points), 3))]).astype(np.float32)

    bake(texture, texture.add_layer(), values, channel="height")
    return texture


@pytest.mark.parametrize("texels", [-3.0, 0.0, 4.0])
def test_a_ball_grows_by_what_is_painted(texels):
    mesh = icosphere(subdivisions=5)
    texture = heights(mesh, lambda points: np.full(len(points), texels))
    moved = marching_cubes(displaced_band(texture, mesh, resolution=64))
    radius = np.linalg.norm(moved.vertices, axis=1)
    sag = 0.3 / 4**5
    voxel = 2 / 64
    # Linear interpolation on edges of the lattice: second order in the voxel
    assert np.abs(radius - (1 + texels * texture.octree.texel)).max() < sag + voxel**2 / 4


def test_heights_vary_along_the_surface():
    mesh = icosphere(subdivisions=5)
    texture = heights(mesh, lambda points: 2.0 * points[:, 2], 128)
    moved = marching_cubes(displaced_band(texture, mesh, resolution=96)).vertices
    radius = np.linalg.norm(moved, axis=1)
    truth = 1 + 2.0 * texture.octree.texel * moved[:, 2] / radius
    assert np.abs(radius - truth).max() < 2e-3


def test_what_would_need_a_very_wide_band_is_refused():
    mesh = box_mesh()
    texture = heights(mesh, lambda points: np.full(len(points), 300.0), 64)
    with pytest.raises(TextureError, match="which is 300 voxels"):
        displaced_band(texture, mesh, resolution=64)
    inside = displaced_band(texture, mesh, resolution=64, scale=0.02)
    assert inside.value_at(np.array([[0, 0, 0]]))[0] < 0


def test_a_sheet_has_no_outside_to_move_to():
    square = box_mesh()
    flat = square.faces[np.ptp(square.triangles[:, :, 2], axis=1) == 0][:2]
    from meshsdf.mesh import Mesh

    sheet = Mesh(square.vertices, flat)
    texture = heights(sheet, lambda points: np.ones(len(points)), 32)
    with pytest.raises(TextureError, match="no inside"):
        displaced_band(texture, sheet, resolution=32)
