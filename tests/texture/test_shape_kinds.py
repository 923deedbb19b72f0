"""Textures that see the shape they are on, by name and as operations."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from meshsdf.errors import TextureError
from meshsdf.mesh import box_mesh
from meshsdf.texture.journal import Project
from meshsdf.texture.operations import Operation, perform
from meshsdf.texture.procedural import lengths_for, parameters_of, procedural, sees_shape
from meshsdf.texture.sdf_patterns import ON_SHAPE, EdgeWear, Thickness
from meshsdf.texture.volume_texture import VolumeTexture


def slab(points):
    """A slab, 0.2 thick, without end."""
    return np.abs(points[:, 2]) - 0.1


def test_each_kind_tells_its_parameters_and_a_shape_is_none_of_them():
    assert {kind: [one.name for one in parameters_of(kind)] for kind in ON_SHAPE} == {
        "cavity_dirt": ["reach", "strength", "clean", "dirt"],
        "edge_wear": ["reach", "threshold", "paint", "bare"],
        "thickness": ["thin_length", "thick_length", "thin", "thick"],
    }
    assert parameters_of("edge-wear") == parameters_of("edge_wear")
    assert sees_shape("cavity-dirt")
    assert not sees_shape("wood")


def test_lengths_begin_as_shares_of_the_mesh_and_ratios_do_not():
    assert lengths_for("thickness", 10.0) == {"thin_length": 0.2, "thick_length": 3.0}
    assert lengths_for("edge_wear", 10.0) == {"reach": 0.2}
    assert lengths_for("marble", 10.0) == {"scale": 10.0}
    assert lengths_for("marble", 0.0) == {"scale": 1.0}


def test_by_name_they_are_what_their_classes_are():
    points = np.array([[0.0, 0.0, 0.1], [3.0, 1.0, -0.1]])
    made = procedural("thickness", signed_distance=slab, thin_length="0.1", thick_length="0.3")
    assert isinstance(made, Thickness)
    # Halfway between the two lengths the smooth step is a half
    assert_allclose(made.weight(points), 0.5, atol=1e-6)
    assert isinstance(procedural("edge-wear", signed_distance=slab), EdgeWear)


def test_what_makes_no_sense_is_said():
    with pytest.raises(TextureError, match="edge_wear looks at the shape that it is on"):
        procedural("edge_wear")
    with pytest.raises(TextureError, match="edge_wear has no parameter raech"):
        procedural("edge_wear", signed_distance=slab, raech="1")
    with pytest.raises(TextureError, match=r"threshold is .*-1") as caught:
        procedural("edge_wear", signed_distance=slab, threshold="-1")
    assert "a number above 0" in str(caught.value)
    texture = VolumeTexture.around(box_mesh(), resolution=8)
    texture.add_layer()
    texture.surface = None
    with pytest.raises(TextureError, match="does not know its surface"):
        perform(texture, Operation("bake", {"layer": 0, "texture_kind": "thickness"}))


def test_as_an_operation_the_surface_of_the_texture_is_the_shape():
    texture = VolumeTexture.around(box_mesh((1.0, 1.0, 0.2)), resolution=16)
    texture.add_layer()
    lengths = {"thin_length": 0.1, "thick_length": 0.3, "thin": "#000000", "thick": "#ffffff"}
    perform(texture, Operation("bake", {"layer": 0, "texture_kind": "thickness", **lengths}))
    on_side = texture.colors(np.array([[0.0, 0.0, 0.1]]), np.array([[0.0, 0.0, 1.0]]))[0]
    assert_allclose(on_side[:3], 0.5, atol=2 / 255)  # 0.2 thick: halfway
    on_rim = texture.colors(np.array([[0.5, 0.0, 0.0]]), np.array([[1.0, 0.0, 0.0]]))[0]
    assert_allclose(on_rim[:3], 0.5, atol=2 / 255)  # the ball that fits there has the same size


def test_filling_a_layer_tells_how_far_it_is_and_can_be_stopped(tmp_path):
    texture = VolumeTexture.around(box_mesh(), resolution=128)
    texture.add_layer()
    params = {"layer": 0, "texture_kind": "cavity-dirt", "reach": 0.2}
    told = []
    perform(texture, Operation("bake", params), progress=lambda *one: told.append(one))
    shares = [share for stage, share in told if stage == "bake"]
    assert len(shares) > 1
    assert shares == sorted(shares)
    assert shares[-1] == 1
    assert any(stage != "bake" for stage, _ in told)  # the distances' own stages
    with pytest.raises(TextureError, match="multiple values for keyword argument 'progress'"):
        perform(texture, Operation("bake", params | {"progress": 1}))

    def stop(stage: str, share: float) -> None:
        raise KeyboardInterrupt

    with Project.create(tmp_path / "a.mtex", box_mesh(), resolution=16) as project:
        project.apply(Operation("add-layer"))
        before = project.digest()
        with pytest.raises(KeyboardInterrupt):
            project.apply(Operation("bake", params), progress=stop)
        assert project.last_seq == 1
        assert project.digest() == before
