"""meshsdf.surface.carried_voxels: what a mesh has at the closest points of a band's nodes."""

from dataclasses import replace

import igl
import numpy as np
import pytest

from meshsdf.errors import SurfaceError
from meshsdf.mesh import Material, Mesh, icosphere
from meshsdf.sdf import mesh_to_band
from meshsdf.surface.carried_voxels import carried_in_bricks, require_carried


def textured_ball() -> Mesh:
    """A ball with an image of two colours, split where u = 1/2."""
    ball = icosphere(subdivisions=2)
    image = np.zeros((4, 4, 3), np.uint8)
    image[:, :2, 0], image[:, 2:, 2] = 188, 255
    look = Material("", np.ones(4, np.float32), image)
    uv = 0.5 + 0.4 * ball.vertices[:, :2]
    index = np.zeros(ball.n_faces, np.int32)
    return replace(ball, uv=np.ascontiguousarray(uv), material_index=index, materials=(look,))


def test_places_and_coordinates_are_those_of_the_closest_points():
    mesh = textured_ball()
    band = mesh_to_band(mesh, voxel_size=0.2, half_width=2, closest=True)
    slots = np.arange(band.index.n_bricks)[::2]
    active = band.active_mask()[slots]
    offsets = np.stack(np.indices((8, 8, 8)), axis=-1)
    nodes = band.to_world(
        (band.index.coordinates[slots][:, None, None, None] * 8 + offsets)[active]
    )
    closest = carried_in_bricks(mesh, band, "closest", slots)
    squares, _, _ = igl.point_mesh_squared_distance(
        nodes, mesh.vertices, mesh.faces.astype(np.int64)
    )
    apart = np.linalg.norm(closest[active] - nodes, axis=1)
    np.testing.assert_allclose(apart, np.sqrt(squares), rtol=0, atol=1e-6)
    onto, _, _ = igl.point_mesh_squared_distance(
        closest[active].astype(float), mesh.vertices, mesh.faces.astype(np.int64)
    )
    assert np.sqrt(onto.max()) < 1e-6
    uv = carried_in_bricks(mesh, band, "uv", slots)
    # Linear in the place, so true within faces as well
    np.testing.assert_allclose(uv[active, :2], 0.5 + 0.4 * closest[active, :2], rtol=0, atol=1e-6)
    assert (uv[..., 2] == 0).all()
    for array in (closest, uv):
        assert (array[~active] == 0).all()
        assert (array.dtype, array.shape) == (np.float32, (len(slots), 8, 8, 8, 3))


def test_colours_of_images_are_linear():
    mesh = textured_ball()
    band = mesh_to_band(mesh, voxel_size=0.2, closest=True)
    slots = np.arange(band.index.n_bricks)
    active = band.active_mask()
    u = carried_in_bricks(mesh, band, "uv", slots)[active, 0]
    color = carried_in_bricks(mesh, band, "Cd", slots)[active]
    # Half a texel off the border between the colours nothing of the other is mixed in
    left, right = u < 0.375, u > 0.625
    assert left.sum() > 100
    # 188 of 255 in sRGB is 0.503 in linear light
    assert np.abs(color[left & (u > 0.125)] - [0.5029, 0, 0]).max() < 1e-4
    assert np.abs(color[right & (u < 0.875)] - [0, 0, 1]).max() < 1e-6


def test_what_is_not_there_is_refused():
    plain = icosphere(subdivisions=1)
    band = mesh_to_band(plain, voxel_size=0.3)
    with pytest.raises(SurfaceError, match="the mesh has no texture coordinates"):
        require_carried(plain, ["closest", "uv"])
    with pytest.raises(SurfaceError, match="the mesh has no colours"):
        require_carried(plain, ["Cd"])
    with pytest.raises(SurfaceError, match="there is no grid 'N'"):
        require_carried(plain, ["N"])
    with pytest.raises(SurfaceError, match="the band has no closest faces"):
        carried_in_bricks(plain, band, "closest", np.arange(2))
