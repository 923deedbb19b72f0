"""Are the brushes and parameters that a page sends of the right kinds?

What they mean is for brushes and operations to judge; here it is seen to that they get what they
can judge: numbers where numbers belong, and so on.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from ..errors import ServerError
from ..kernels.blending import MODES
from ..texture.brush import Brush, Stencil

LONGEST_NAME = 200  # letters of a layer's name
BRIGHTEST = 65504.0  # of a colour in half precision
MOST_LEVELS = 64
LARGEST = 1e30  # of a length; float32 holds it


def _is_whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= 0


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _is_color(value: Any) -> bool:
    if not isinstance(value, list) or len(value) not in (3, 4):
        return False
    return all(_is_number(one) and 0 <= one <= BRIGHTEST for one in value) and value[3:] <= [1]


def _is_matrix(value: Any) -> bool:
    """Rows of the same number of numbers."""
    if not isinstance(value, list) or not 1 <= len(value) <= 4:
        return False
    rows = [row if isinstance(row, list) else [None] for row in value]
    same = len({len(row) for row in rows}) == 1
    return same and all(_is_number(one) for row in rows for one in row)


Kind = tuple[Callable[[Any], bool], str]
LAYER: Kind = _is_whole, "a layer's number"
NAME: Kind = (lambda v: isinstance(v, str) and len(v) <= LONGEST_NAME), "a text of 200 letters"
TEXT: Kind = (lambda v: isinstance(v, str)), "a text"
COLOR: Kind = _is_color, "3 or 4 linear numbers from 0 on, alpha up to 1"
SHARE: Kind = (lambda v: _is_number(v) and 0 <= v <= 1), "a number from 0 to 1"
LENGTH: Kind = (lambda v: _is_number(v) and 0 <= v <= LARGEST), "a number from 0 on"
LEVEL: Kind = (lambda v: _is_whole(v) and v < MOST_LEVELS), "a level, 0 for the finest"
MODE: Kind = (lambda v: v in MODES), f"one of {', '.join(MODES)}"
YES: Kind = (lambda v: isinstance(v, bool)), "true or false"
PLACE: Kind = _is_whole, "a place, counted from 0"
MATRIX: Kind = (lambda v: v is None or _is_matrix(v)), "rows of numbers"

OPEN = None  # as the last key: other parameters are the pattern's or the projection's
KINDS: dict[str, dict[str | None, Kind]] = {
    "add-layer": {"name": NAME, "color": COLOR},
    "drop-layer": {"layer": LAYER},
    "layer": {
        "layer": LAYER, "name": NAME, "opacity": SHARE, "mode": MODE, "visible": YES,
        "place": PLACE,
    },
    "fill-color": {"layer": LAYER, "color": COLOR},
    "bake": {"layer": LAYER, "texture_kind": TEXT, "level": LEVEL, OPEN: TEXT},
    "coarsen": {"layer": LAYER, "tolerance": LENGTH},
    "project": {
        "layer": LAYER, "image": TEXT, "projection": TEXT, "level": LEVEL, "matrix": MATRIX,
        OPEN: TEXT,
    },
}  # fmt: skip
"""What pages may ask for, and the kinds of its parameters."""


PICTURE = np.ones((1, 1), np.float32)
EXAMPLE = Brush(1.0, detail=1.0, stamp=PICTURE, stencil=Stencil(PICTURE, np.eye(3, 4))).to_dict()
"""A brush in which everything is given, to compare others with."""
MAY_BE_NONE = tuple(name for name, value in Brush(1.0).to_dict().items() if value is None)


def check_brush_kinds(brush: dict[str, Any]) -> None:
    """Refuse what cannot be a brush's `to_dict`.

    Raises
    ------
    ServerError
        The radius is missing, something is unknown, or it is of another kind than in any brush.
    """
    if "radius" not in brush:
        raise ServerError("a brush without a radius", "STROKE_BEGIN", "give one")
    for name, value in brush.items():
        if name not in EXAMPLE:
            what = f"there is no {name[:40]!r} in a brush"
            raise ServerError(what, "STROKE_BEGIN", f"use {', '.join(EXAMPLE)}")
        if value is None and name in MAY_BE_NONE:
            continue
        if not _is_like(value, EXAMPLE[name]):
            what = f"a brush's {name} cannot be {str(value)[:60]!r}"
            fix = f"give something like {str(EXAMPLE[name])[:60]}"
            raise ServerError(what, "STROKE_BEGIN", fix)


def _is_like(value: Any, example: Any) -> bool:
    """Whether a value is made as an example is; lists may be of any length."""
    if isinstance(example, dict):
        known = isinstance(value, dict) and set(value) <= set(example)
        return known and all(_is_like(value[name], example[name]) for name in value)
    if isinstance(example, list):
        return isinstance(value, list) and all(_is_like(one, example[0]) for one in value)
    if isinstance(example, float):
        return _is_number(value)
    return type(value) is type(example)


def check_asked(kind: str, params: dict[str, Any]) -> None:
    """Refuse an operation whose parameters are not of their kinds.

    Raises
    ------
    ServerError
        Pages may not ask for it, a parameter is unknown, or it is of another kind.
    """
    where = f"operation {kind[:40]!r}"
    if kind not in KINDS:
        raise ServerError("pages may not do that", where, f"use one of {', '.join(KINDS)}")
    known = KINDS[kind]
    for name, value in params.items():
        if name not in known:
            if OPEN in known:
                continue
            raise ServerError(f"there is no parameter {name[:40]!r}", where, f"use {_names(known)}")
        fits, words = known[name]
        if not fits(value):
            what = f"{name} cannot be {str(value)[:60]!r}"
            raise ServerError(what, where, f"give {words}")


def _names(known: dict[str | None, Kind]) -> str:
    return ", ".join(name for name in known if name is not None)
