"""Strokes as data, and samples that no stroke can be made of."""

import inspect
import json

import numpy as np
import pytest

from meshsdf.errors import TextureError
from meshsdf.mesh import icosphere
from meshsdf.texture.brush import Brush
from meshsdf.texture.stroke import Stroke, paint, replay
from meshsdf.texture.stroke_path import StrokePath
from meshsdf.texture.stroke_record import StrokeRecord
from meshsdf.texture.symmetry import Symmetry
from meshsdf.texture.volume_texture import VolumeTexture

from .paint_twin import arc, everything

BALL = icosphere(subdivisions=4)
TEXEL = 1 / 32
RED = (1.0, 0.0, 0.0, 1.0)
GREY = (0.5, 0.5, 0.5, 1.0)


@pytest.fixture
def texture() -> VolumeTexture:
    return VolumeTexture.around(BALL, texel=TEXEL)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"points": np.nan}, "sample 1 at .* makes no sense"),
        ({"points": np.inf}, "makes no sense"),
        ({"points": 1e300}, "makes no sense"),
        ({"normals": 0.0}, "makes no sense"),
        ({"normals": np.nan}, "makes no sense"),
        ({"pressures": np.nan}, "pressure of nan"),
        ({"pressures": 1.5}, "pressure of 1.5"),
        ({"pressures": -0.5}, "pressure of -0.5"),
    ],
)
def test_absurd_samples_are_refused_and_paint_nothing(texture, change, message):
    layer = texture.add_layer()
    points, normals = arc(3)
    samples = {"points": points, "normals": normals, "pressures": np.ones(3)}
    name, value = next(iter(change.items()))
    samples[name][1] = value
    before = everything(texture, layer)
    with pytest.raises(TextureError, match=message):
        paint(texture, layer, Brush(0.2), **samples)
    assert everything(texture, layer) == before


def test_unequal_samples_and_endless_ways_are_refused(texture):
    layer = texture.add_layer()
    points, normals = arc(3)
    unchecked = inspect.unwrap(StrokePath._checked)  # the types of arguments say it, too, in tests
    with pytest.raises(TextureError, match="3 points, 2 normals, 3 pressures"):
        unchecked(StrokePath(Brush(0.2), TEXEL), points, normals[:2], np.ones(3))
    far = np.array([[0.0, 0, 1], [0, 0, 1e6]])
    with pytest.raises(TextureError, match="more than 100000 dabs"):
        paint(texture, layer, Brush(0.2, build_up=True), far, far)
    # A band is one capsule however long it is, and a vast dab reaches all there is
    assert len(paint(texture, layer, Brush(0.2), far, far))
    assert len(paint(texture, layer, Brush(1e12, color=RED), far[:1], far[:1]))


def test_a_record_paints_the_same_again(texture):
    layer, again = texture.add_layer(), texture.add_layer()
    points, normals = arc(5)
    stroke = Stroke(texture, layer, Brush(0.2, color=RED, build_up=True, flow=0.3))
    stroke.add(points[:2], normals[:2], np.array([0.5, 1.0]))
    stroke.add(points[2:], normals[2:])
    stroke.end()
    data = json.loads(json.dumps(stroke.record.to_dict()))
    data["layer"] = again.number
    replay(texture, StrokeRecord.from_dict(data))
    assert everything(texture, again) == everything(texture, layer)
    data["layer"] = 99
    with pytest.raises(TextureError, match="no layer 99; layers: 0, 1"):
        replay(texture, StrokeRecord.from_dict(data))
    params = stroke.record.to_params()
    params["layer"] = (third := texture.add_layer()).number
    replay(texture, StrokeRecord.from_params(params))
    assert everything(texture, third) == everything(texture, layer)
    with pytest.raises(TextureError, match="describes no stroke"):
        StrokeRecord.from_params({**params, "points": np.zeros(4)})
    for wrong in ({}, {**data, "samples": "AAAA"}, {**data, "samples": "?"}):
        with pytest.raises(TextureError, match="describes no stroke"):
            StrokeRecord.from_dict(wrong)


@pytest.mark.parametrize("other", ["finer", "remeshed"])
def test_a_record_looks_the_same_on_other_textures(texture, other):
    layer = texture.add_layer(color=GREY)
    brush = Brush(0.25, color=RED, build_up=True, flow=0.3, symmetry=Symmetry("y"))
    stroke = Stroke(texture, layer, brush)
    stroke.add(*arc(6, 0, 0.9, tilt=0.4))
    stroke.end()
    if other == "finer":
        theirs = VolumeTexture.around(BALL, texel=TEXEL / 2)
    else:
        theirs = VolumeTexture.around(icosphere(subdivisions=3), texel=TEXEL)
    copy = theirs.add_layer(color=GREY)
    replay(theirs, stroke.record)
    at = np.random.default_rng(0).normal(size=(5000, 3))
    at /= np.linalg.norm(at, axis=1, keepdims=True)
    at = at[at[:, 2] > 0]
    apart = np.abs(texture.colors(at, at, layer=layer) - theirs.colors(at, at, layer=copy))
    assert np.ptp(texture.colors(at, at, layer=layer), axis=0)[:3].min() > 0.4
    # The rim, a third of the radius wide, is drawn with texels of 1/8 of it at most
    assert apart.mean() < 0.004
    assert np.quantile(apart.max(axis=1), 0.99) < 0.1
