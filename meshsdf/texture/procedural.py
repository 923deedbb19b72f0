"""The procedural textures by name, for command lines and files."""

import difflib
from dataclasses import dataclass, fields
from typing import Any

from ..errors import TextureError
from .cellular import Cellular, Spots
from .clouds import Clouds
from .parameters import from_text
from .patterns import Brick, Checker, Stripes
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
"""Every kind that needs nothing but points; those that need a shape are in `sdf_patterns`."""


@dataclass(frozen=True)
class Parameter:
    """What help says of one parameter of a kind."""

    name: str
    default: Any
    meaning: str


def procedural(kind: str, **parameters: Any) -> Solid:
    """Return the texture of a kind, its parameters checked.

    Values may be text, as a command line has them: ``"0.1"``, ``"0,0,1"``, ``"#aa7744"``.

    Raises
    ------
    TextureError
        There is no such kind or parameter, or the value is none of its kind; the error says which
        are valid.

    Examples
    --------
    >>> procedural("wood", ring_width="0.25", axis="0,0,2").axis
    (0.0, 0.0, 1.0)
    """
    type_ = _type_of(kind)
    known = {one.name: one for one in fields(type_)}
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
    return type_(**values)


def parameters_of(kind: str) -> list[Parameter]:
    """Return the parameters of a kind in their order: name, default, meaning in one line.

    Examples
    --------
    >>> parameters_of("checker")[2]
    Parameter(name='side', default=0.25, meaning='of a cube')
    """
    return [
        Parameter(one.name, one.default, one.metadata["meaning"]) for one in fields(_type_of(kind))
    ]


def _type_of(kind: str) -> type[Solid]:
    if kind not in PROCEDURALS:
        raise TextureError(
            f"there is no texture {kind!r}",
            "procedural(kind)",
            f"pass one of {', '.join(PROCEDURALS)}",
        )
    return PROCEDURALS[kind]
