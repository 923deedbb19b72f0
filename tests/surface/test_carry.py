"""Colours and texture coordinates that a surface takes from the mesh it was made from."""

import os
from pathlib import Path

import igl
import numpy as np
import pytest

from meshsdf import Mesh, check, marching_cubes, mesh_to_band, read_mesh
from meshsdf.errors import SurfaceError
from meshsdf.mesh import Material
from meshsdf.mesh.primitives import box_mesh, icosphere
from meshsdf.surface.carry import carry

WHITE = np.ones(4, np.float32)


def back(mesh, resolution=24):
    return marching_cubes(mesh_to_band(mesh, resolution=resolution))


def striped_cylinder(n=48):
    """A tube of radius 1 around z, u once around it with a seam at angle 0, v along it."""
    angle = np.linspace(0, 2 * np.pi, n + 1)
    angle[-1] = 0.0
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    vertices = np.concatenate([np.column_stack([ring, np.full(n + 1, z)]) for z in (-1.0, 1.0)])
    u = np.linspace(0, 1, n + 1)
    uv = np.concatenate([np.column_stack([u, np.full(n + 1, v)]) for v in (0.0, 1.0)])
    low = np.arange(n)
    faces = np.concatenate(
        [
            np.stack([low, low + 1, low + n + 2], 1),
            np.stack([low, low + n + 2, low + n + 1], 1),
        ]
    ).astype(np.int32)
    image = np.zeros((4, 64, 3), np.uint8)
    image[:, :, 0] = np.arange(64) * 4
    material = Material("stripes", WHITE, image, "stripes.png")
    return Mesh(vertices, faces, uv=uv, material_index=np.zeros(len(faces), np.int32),
                materials=(material,))  # fmt: skip


def test_vertex_colours_that_vary_linearly_come_back_exactly():
    source = icosphere(2.0)
    colours = np.concatenate([source.vertices * 0.25 + 0.5, np.ones((source.n_vertices, 1))], 1)
    source = Mesh(source.vertices, source.faces, vertex_colors=colours.astype(np.float32))
    surface = back(source)
    found = carry(surface, source, ["colours"])
    *_, nearest = igl.point_mesh_squared_distance(
        surface.vertices.copy(), source.vertices.copy(), source.faces.copy()
    )
    off = np.abs(found.vertex_colors[:, :3] - (nearest * 0.25 + 0.5)).max(axis=1)
    assert np.quantile(off, 0.99) < 1e-7
    assert off.max() < 1e-4  # where two faces are equally near, rounding chooses
    assert (found.faces == surface.faces).all()


def test_texture_coordinates_keep_their_seam():
    source = striped_cylinder()
    angle = np.linspace(0.05, 2 * np.pi - 0.05, 41)  # a ring whose own seam is a face across it
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    vertices = np.concatenate([np.column_stack([ring, np.full(41, z)]) for z in (-0.5, 0.5)])
    low, after = np.arange(41), np.roll(np.arange(41), -1)
    faces = np.concatenate(
        [np.stack([low, after, after + 41], 1), np.stack([low, after + 41, low + 41], 1)]
    )
    surface = Mesh(vertices, faces.astype(np.int32))
    found = carry(surface, source, ["uv"])
    spread = np.ptp(found.uv[found.faces][:, :, 0], axis=1)
    assert spread.max() < 0.03  # without the seam one face would span all of the image
    assert found.n_vertices == surface.n_vertices + 2  # two corners beyond the seam
    assert np.allclose(found.triangles, surface.triangles, atol=0)
    around = np.arctan2(found.vertices[:, 1], found.vertices[:, 0]) / (2 * np.pi)
    off = (found.uv[:, 0] - around + 0.5) % 1 - 0.5
    assert np.abs(off).max() < 2e-3
    assert np.abs(found.uv[:, 1] - (found.vertices[:, 2] + 1) / 2).max() < 1e-9


def test_both_at_once_and_materials_follow_the_faces():
    mesh = box_mesh()
    red, blue = (Material(n, np.array(c, np.float32)) for n, c in (
        ("red", [1, 0, 0, 1]), ("blue", [0, 0, 1, 1])))  # fmt: skip
    top = (mesh.triangles[:, :, 2] > 0).all(axis=1)
    source = Mesh(mesh.vertices, mesh.faces, uv=mesh.vertices[:, :2] + 0.5,
                  material_index=top.astype(np.int32), materials=(red, blue))  # fmt: skip
    found = carry(back(source), source)
    high = found.vertices[:, 2] > 0.49
    assert (
        found.vertex_colors[high & (np.abs(found.vertices[:, :2]).max(axis=1) < 0.4), 2] == 1
    ).all()
    assert (found.vertex_colors[found.vertices[:, 2] < 0.3, 0] == 1).all()
    middles = found.triangles.mean(axis=1)
    inner = np.abs(middles[:, :2]).max(axis=1) < 0.45
    assert (found.material_index[inner & (middles[:, 2] > 0.49)] == 1).all()


def test_what_the_source_lacks_is_said():
    source = box_mesh()
    surface = back(source)
    with pytest.raises(SurfaceError, match="no colours"):
        carry(surface, source, ["colours"])
    with pytest.raises(SurfaceError, match="no texture coordinates"):
        carry(surface, source, ["uv"])
    with pytest.raises(SurfaceError, match="cannot carry normals"):
        carry(surface, source, ["normals"])


@pytest.mark.skipif("MESHSDF_MODELS" not in os.environ, reason="MESHSDF_MODELS names no folder")
def test_a_real_textured_mesh_has_the_same_colours_back():
    source = read_mesh(Path(os.environ["MESHSDF_MODELS"]) / "spot.obj")
    if source.uv is None:
        pytest.skip("spot.obj has no texture coordinates here")
    found = carry(back(source, 64), source, ["uv"])
    spread = np.ptp(found.uv[found.faces], axis=1).max(axis=1)
    assert np.quantile(spread, 0.999) < 0.1
    assert check(found, self_intersections=False).two_set
