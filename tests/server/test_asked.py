"""meshsdf.server.asked: whatever a page sends, brushes and operations get what they can judge."""

import copy

import numpy as np
import pytest

from meshsdf.errors import ServerError
from meshsdf.server.asked import KINDS, check_asked, check_brush_kinds
from meshsdf.texture import Brush, Stencil, Symmetry
from meshsdf.texture.operations import KINDS as OPERATIONS

PICTURE = np.full((2, 3), 0.5, np.float32)
FULL = Brush(
    0.25,
    detail=0.5,
    stamp=PICTURE,
    stencil=Stencil(PICTURE, np.ones((3, 4))),
    symmetry=Symmetry(mirror="x", radial=3),
    pressure_radius=((0.0, 0.2), (0.5, 0.7), (1.0, 1.0)),
).to_dict()

GOOD = [
    ("add-layer", {}),
    ("add-layer", {"name": "", "color": [0, 0.5, 9.0]}),
    ("layer", {"layer": 3, "opacity": 1, "visible": False, "place": 0, "mode": "multiply"}),
    ("fill-color", {"layer": 0, "color": [1, 1, 1, 0]}),
    ("bake", {"layer": 0, "texture_kind": "wood", "level": 2, "anything": [1, {"a": None}]}),
    ("coarsen", {"layer": 0, "tolerance": 0}),
    ("project", {"layer": 0, "image": "id", "projection": "planar", "matrix": [[1, 0.5], [0, 1]]}),
]
WRONG = [
    ("undo", {}, "pages may not do that"),
    ("stroke", {}, "pages may not do that"),
    ("paint-ball", {}, "pages may not do that"),
    ("add-layer", {"name": 5}, "name cannot be '5'"),
    ("add-layer", {"name": "x" * 201}, "name cannot be"),
    ("add-layer", {"color": [1, 1]}, "color cannot be"),
    ("add-layer", {"color": [1, 1, 1, 2]}, "color cannot be"),
    ("add-layer", {"color": [1, 1, -1]}, "color cannot be"),
    ("add-layer", {"color": [True, 1, 1]}, "color cannot be"),
    ("add-layer", {"more": 1}, "there is no parameter 'more'"),
    ("drop-layer", {"layer": -1}, "layer cannot be"),
    ("drop-layer", {"layer": True}, "layer cannot be"),
    ("layer", {"opacity": 1.5}, "opacity cannot be"),
    ("layer", {"mode": "none"}, "mode cannot be 'none'"),
    ("layer", {"mode": ["normal"]}, "mode cannot be"),
    ("layer", {"visible": 1}, "visible cannot be"),
    ("layer", {"place": 0.5}, "place cannot be"),
    ("bake", {"level": 64}, "level cannot be"),
    ("bake", {"texture_kind": None}, "texture_kind cannot be"),
    ("coarsen", {"tolerance": 1e300}, "tolerance cannot be"),
    ("coarsen", {"tolerance": "0"}, "tolerance cannot be"),
    ("project", {"matrix": [[1, 0], [1]]}, "matrix cannot be"),
    ("project", {"matrix": [[1, "0"]]}, "matrix cannot be"),
    ("project", {"matrix": [1, 0]}, "matrix cannot be"),
]


def test_pages_may_do_what_the_list_says_and_every_operation_is_known():
    assert set(KINDS) <= set(OPERATIONS)
    for kind, params in GOOD:
        check_asked(kind, params)
    assert {kind for kind, _ in GOOD} | {"drop-layer"} == set(KINDS)


@pytest.mark.parametrize(("kind", "params", "words"), WRONG)
def test_parameters_of_other_kinds_are_refused(kind, params, words):
    with pytest.raises(ServerError, match=words):
        check_asked(kind, params)


def test_every_brush_is_one():
    for brush in (Brush(0.1).to_dict(), FULL, {"radius": 1}):
        check_brush_kinds(brush)
        Brush.from_dict(brush)


OTHERS = [{"no": 1}, [[["x"]]], "555", 5, True]
MISFITS = [
    (name, other)
    for name, value in FULL.items()
    for other in OTHERS
    if not (type(other) is type(value) and type(other) in (str, bool))
    and not (other == 5 and isinstance(value, float))
]


@pytest.mark.parametrize(("name", "other"), MISFITS, ids=str)
def test_a_brush_with_something_else_in_a_place_is_refused(name, other):
    with pytest.raises(ServerError, match=rf"a brush's {name} cannot be"):
        check_brush_kinds(copy.deepcopy(FULL) | {name: other})


def test_a_brush_needs_its_radius_and_has_nothing_unknown():
    with pytest.raises(ServerError, match="a brush without a radius"):
        check_brush_kinds({"kind": "paint"})
    with pytest.raises(ServerError, match="there is no 'size' in a brush"):
        check_brush_kinds({"radius": 1.0, "size": 2})
    with pytest.raises(ServerError, match="a brush's symmetry cannot be"):
        check_brush_kinds({"radius": 1.0, "symmetry": {"radial": 2.5}})
    with pytest.raises(ServerError, match="a brush's radius cannot be 'None'"):
        check_brush_kinds({"radius": None})
