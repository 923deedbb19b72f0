"""meshsdf.texture.brush and symmetry: what a brush may be, and that it can be kept."""

import json
from dataclasses import fields

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf.errors import TextureError
from meshsdf.texture.brush import Brush, Stencil
from meshsdf.texture.symmetry import Symmetry


def full_brush() -> Brush:
    """A brush none of whose attributes is the default."""
    rng = np.random.default_rng(0)
    return Brush(
        0.25, kind="clone", hardness=0.75, falloff="round", flow=0.5, opacity=0.25, build_up=True,
        spacing=0.2, pressure_radius=((0.0, 0.1), (1.0, 1.0)),
        pressure_flow=((0.0, 0.2), (0.5, 0.9), (1.0, 1.0)), color=(0.1, 0.2, 0.3, 0.4), value=-2.5,
        channel="orm", blend="soft-light", symmetry=Symmetry("xz", 3, "x", (1.0, 2.0, 3.0)),
        angle=(-0.5, 0.5), geodesic=True, stamp=rng.random((3, 5)).astype(np.float32),
        stencil=Stencil(rng.random((4, 2)).astype(np.float32), rng.random((3, 4))), detail=0.01,
        offset=(0.1, 0.0, -0.1), tolerance=0.125, end_color=(0.5, 0.6, 0.7, 0.8), shape="radial",
        through=True,
    )  # fmt: skip


def test_a_brush_survives_json_to_the_last_bit():
    brush = full_brush()
    text = json.dumps(brush.to_dict())
    back = Brush.from_dict(json.loads(text))
    assert json.dumps(back.to_dict()) == text
    assert_array_equal(back.stamp, brush.stamp)
    assert_array_equal(back.stencil.picture, brush.stencil.picture)
    assert_array_equal(back.stencil.matrix, brush.stencil.matrix)
    simple = ("stamp", "stencil")
    for one in fields(Brush):
        if one.name not in simple:
            assert getattr(back, one.name) == getattr(brush, one.name), one.name
            assert getattr(brush, one.name) != getattr(Brush(1.0), one.name), one.name


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"radius": 0.0}, "radius cannot be 0"),
        ({"radius": float("nan")}, "radius cannot be nan"),
        ({"radius": float("inf")}, "radius cannot be inf"),
        ({"hardness": 1.5}, "hardness cannot be 1.5"),
        ({"flow": -0.1}, "flow cannot be -0.1"),
        ({"opacity": 2}, "opacity cannot be 2"),
        ({"spacing": 0}, "spacing cannot be 0"),
        ({"detail": -1.0}, "detail cannot be -1"),
        ({"channel": "shine"}, "no channel 'shine'"),
        ({"blend": "mix"}, "no blend 'mix'"),
        ({"shape": "spiral"}, "no shape 'spiral'"),
        ({"color": (0.0, 0.0, float("nan"), 1.0)}, "is no color"),
        ({"offset": (0.0, float("inf"), 0.0)}, "is no offset"),
        ({"angle": (0.5, 0.2)}, "not in order"),
        ({"pressure_flow": ((0.5, 1.0), (0.2, 1.0))}, "no curve of pressure"),
        ({"pressure_radius": ()}, "no curve of pressure"),
        ({"stamp": np.full((2, 2), 1.5, np.float32)}, r"shape \(2, 2\)"),
        ({"stamp": np.zeros((0, 2), np.float32)}, r"shape \(0, 2\)"),
    ],
)
def test_what_is_no_brush_is_refused(wrong, message):
    with pytest.raises(TextureError, match=message):
        Brush(**{"radius": 1.0, **wrong})


@pytest.mark.parametrize("data", [{}, {"radius": "wide"}, {"radius": 1.0, "stamp": {"shape": [1]}}])
def test_what_describes_no_brush_is_refused(data):
    with pytest.raises(Exception, match=r"describes no brush|radius") as caught:
        Brush.from_dict(data)
    assert isinstance(caught.value, TextureError) or "jaxtyping" in type(caught.value).__module__


def test_a_stencil_needs_a_finite_matrix():
    with pytest.raises(TextureError, match="not finite"):
        Stencil(np.ones((1, 1), np.float32), np.full((3, 4), np.nan))


def test_texels_are_fine_enough_for_the_disc_and_for_its_edge():
    assert Brush(1.0, hardness=0.0).spacing_wanted == 1 / 8
    assert_allclose(Brush(1.0, hardness=0.9).spacing_wanted, 0.1 / 3)
    assert Brush(1.0, detail=0.02).spacing_wanted == 0.02
    assert Brush(1.0, pressure_radius=((0.0, 0.5), (1.0, 1.0))).spacing_wanted == 0.5 / 8
    assert Brush(1.0, stamp=np.ones((50, 100), np.float32)).spacing_wanted == 0.02


def test_the_copies_are_the_stroke_itself_first_and_none_twice():
    assert_array_equal(Symmetry().matrices(), np.eye(3)[None])
    assert_array_equal(Symmetry("x").matrices(), [np.eye(3), np.diag([-1.0, 1, 1])])
    assert len(Symmetry("xyz").matrices()) == 8
    assert len(Symmetry("xy", 2, "z").matrices()) == 4  # half a turn is both mirrors
    turns = Symmetry(radial=5, axis="z").matrices()
    assert len(turns) == 5
    for matrix in turns:
        assert_allclose(np.linalg.matrix_power(matrix, 5), np.eye(3), atol=1e-14)
        assert_array_equal(matrix[2], [0, 0, 1])
    assert_allclose(turns[1] @ [1, 0, 0], [np.cos(0.4 * np.pi), np.sin(0.4 * np.pi), 0], atol=1e-15)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"mirror": "xx"}, "'xx' names no mirror"),
        ({"mirror": "w"}, "'w' names no mirror"),
        ({"axis": "xy"}, "'xy' is no axis"),
        ({"radial": 0}, "0 turns"),
        ({"radial": 65}, "65 turns"),
        ({"center": (0.0, float("nan"), 0.0)}, "is no point"),
    ],
)
def test_what_is_no_symmetry_is_refused(wrong, message):
    with pytest.raises(TextureError, match=message):
        Symmetry(**wrong)
