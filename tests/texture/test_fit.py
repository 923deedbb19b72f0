"""meshsdf.texture.fit: how much of a mesh lies where a texture has texels."""

import re

import numpy as np
import pytest

from meshsdf.errors import TextureError
from meshsdf.mesh import Mesh
from meshsdf.mesh.primitives import icosphere
from meshsdf.texture.fit import N_POINTS, fit_of, require_fit
from meshsdf.texture.volume_texture import VolumeTexture

FAR = 40.0


@pytest.fixture(scope="module")
def texture() -> VolumeTexture:
    return VolumeTexture.around(icosphere(subdivisions=3), resolution=64)


def ball_and_another_far_away(radius: float) -> Mesh:
    """The textured ball, and one ``radius`` as large, which has radius**2 of its area."""
    ball = icosphere(subdivisions=3)
    other = radius * ball.vertices + [FAR, 0.0, 0.0]
    faces = np.concatenate([ball.faces, ball.faces + ball.n_vertices]).astype(np.int32)
    return Mesh(np.concatenate([ball.vertices, other]), faces)


def require(texture: VolumeTexture, mesh: Mesh) -> list[str]:
    told: list[str] = []
    require_fit(texture, mesh, where="mesh b, texture a", warn=told.append)
    return told


@pytest.mark.parametrize("radius", [0.1, 0.5, 1.0, 3.0])
def test_the_share_is_that_of_the_area_elsewhere(texture, radius):
    found = fit_of(texture, ball_and_another_far_away(radius))
    truth = radius**2 / (1 + radius**2)
    # Four standard deviations of the mean of as many draws
    assert found.off == pytest.approx(truth, abs=4 * np.sqrt(truth * (1 - truth) / N_POINTS))
    assert found.reach == pytest.approx(8 * 2 / 64, rel=0.01)
    assert FAR - 1 <= found.farthest <= FAR + radius - 1
    assert found == fit_of(texture, ball_and_another_far_away(radius))


def test_any_mesh_of_the_surface_passes_in_silence(texture):
    for n in (1, 2, 4):
        assert require(texture, icosphere(subdivisions=n)) == []


def test_a_mesh_partly_elsewhere_is_told_with_share_and_distance(texture):
    (words,) = require(texture, ball_and_another_far_away(0.5))
    assert words.startswith("20 % of the mesh's area lies farther than 0.25 (8 texels)")
    assert re.search(r"as far as 39\.[0-5]: it gets no colour there", words)


@pytest.mark.parametrize("change", ["moved", "scaled", "flattened"])
def test_a_mesh_mostly_elsewhere_is_refused(texture, change):
    ball = icosphere(subdivisions=2)
    vertices = {
        "moved": ball.vertices + np.array([0.0, FAR, 0.0]),
        "scaled": 1000 * ball.vertices,
        "flattened": ball.vertices * [1.0, 0.0, 0.0],  # faces without area: vertices count
    }[change]
    words = r"\d+ % of the mesh's area lies farther than 0.25 \(8 texels\) from the textured"
    with pytest.raises(TextureError, match=words) as error:
        require(texture, Mesh(vertices, ball.faces))
    assert "made around another mesh" in error.value.fix


def test_a_texture_without_a_surface_cannot_be_judged(texture):
    bare = VolumeTexture(texture.octree)
    assert require(bare, ball_and_another_far_away(1.0)) == []
    with pytest.raises(TextureError, match="does not know its surface"):
        fit_of(bare, icosphere())
