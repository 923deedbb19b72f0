"""The procedural textures by name, for command lines and files."""

import difflib
from dataclasses import Field, dataclass, fields
from typing import Any

from ..arrays import Number
from ..errors import TextureError
from .cellular import Cellular, Spots
from .clouds import Clouds
from .parameters import from_text
from .patterns import Brick, Checker, Stripes
from .sdf_patterns import ON_SHAPE, SignedDistance
from .solid import Solid
from .stone import Agate, Granite, Marble
from .wood import Wood, WoodGrain

PROCEDURALS: dict[str, type[Solid]] = {
    "agate": Agate,
    "brick": Brick,
    "cellular": Cellular,
    "checker": Checker,
    "clouds": Clouds,
    "granite": Granite,
    "marble": Marble,
    "spots": Spots,
    "stripes": Stripes,
    "wood": Wood,
    "wood_grain": WoodGrain,
}
"""Every kind that needs nothing but points; those that need a shape are `sdf_patterns.ON_SHAPE`."""


@dataclass(frozen=True)
class Parameter:
    """What help says of one parameter of a kind."""

    name: str
    default: Any
    meaning: str


def procedural(
    kind: str, *, signed_distance: SignedDistance | None = None, **parameters: Any
) -> Any:
    """Return the texture of a kind, its parameters checked.

    Parameters
    ----------
    kind : str
        One of `PROCEDURALS`, or of `sdf_patterns.ON_SHAPE`; ``-`` is as good as ``_``.
    signed_distance : callable, optional
        Of the shape; kinds that see the shape they are on need it.
    **parameters
        Values may be text, as a command line has them: ``"0.1"``, ``"0,0,1"``, ``"#aa7744"``.

    Raises
    ------
    TextureError
        There is no such kind or parameter, or the value is none of its kind; the error says which
        are valid. Or the distance is missing.

    Examples
    --------
    >>> procedural("wood", ring_width="0.25", axis="0,0,2").axis
    (0.0, 0.0, 1.0)
    """
    type_ = _type_of(kind)
    known = {one.name: one for one in _fields(type_)}
    for name in parameters:
        if name not in known:
            close = difflib.get_close_matches(name, known, 1)
            hint = f"did you mean {close[0]}? " if close else ""
            raise TextureError(
                f"{kind} has no parameter {name}",
                f'procedural("{kind}", {name}=...)',
                f"{hint}it has {', '.join(sorted(known))}",
            )
    values = {
        name: from_text(type_.__name__, known[name], value) if isinstance(value, str) else value
        for name, value in parameters.items()
    }
    if not sees_shape(kind):
        return type_(**values)
    if signed_distance is None:
        what = f"{kind} looks at the shape that it is on"
        raise TextureError(what, f'procedural("{kind}")', "pass signed_distance=...")
    return type_(distance=signed_distance, **values)


def sees_shape(kind: str) -> bool:
    """Whether a kind needs the signed distance of a shape."""
    return kind.replace("-", "_") in ON_SHAPE


def lengths_for(kind: str, longest: Number) -> dict[str, float]:
    """What lengths of a kind to begin with on a mesh whose longest side is given, world units.

    Defaults are for a mesh of size 1; a solid texture has one length, its scale.

    Examples
    --------
    >>> lengths_for("wood", 40.0), lengths_for("edge-wear", 40.0)
    ({'scale': 40.0}, {'reach': 0.8})
    """
    unit = float(longest) or 1.0
    if not sees_shape(kind):
        return {"scale": unit}
    lengths = [one for one in _fields(_type_of(kind)) if one.metadata["values"] == "length"]
    return {one.name: unit * one.default for one in lengths}


def parameters_of(kind: str) -> list[Parameter]:
    """Return the parameters of a kind in their order: name, default, meaning in one line.

    Examples
    --------
    >>> parameters_of("checker")[2]
    Parameter(name='side', default=0.25, meaning='of a cube')
    """
    return [
        Parameter(one.name, one.default, one.metadata["meaning"]) for one in _fields(_type_of(kind))
    ]


def _fields(type_: type) -> list[Field]:
    """The parameters of a class; a shape is none of them."""
    return [one for one in fields(type_) if one.metadata]


def _type_of(kind: str) -> type:
    known = PROCEDURALS | ON_SHAPE
    if kind.replace("-", "_") not in known:
        raise TextureError(
            f"there is no texture {kind!r}",
            "procedural(kind)",
            f"pass one of {', '.join(known)}",
        )
    return known[kind.replace("-", "_")]
