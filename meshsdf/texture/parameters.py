"""The parameters of a texture: what each means, which values it takes, and how text becomes one."""

from collections.abc import Callable, Sequence
from dataclasses import Field, fields
from typing import Any

import numpy as np

from ..arrays import Number
from ..errors import TextureError
from .colors import linear_color

RANGES: dict[str, tuple[Number, Number]] = {
    "share": (0.0, 1.0),
    "count": (1, 32),
    "seed": (0, 2**31 - 1),
}
"""Least and most of the kinds of values that have them."""

Triple = Sequence[Number] | np.ndarray


def means(values: str, meaning: str) -> dict[str, str]:
    """Metadata of a texture's field: the name of its kind of values, one line of meaning."""
    return {"values": values, "meaning": meaning}


def check_parameters(texture: Any) -> None:
    """Check every parameter of a frozen dataclass and put it into its one form."""
    for one in fields(texture):
        if "values" in one.metadata:
            value = checked(type(texture).__name__, one, getattr(texture, one.name))
            object.__setattr__(texture, one.name, value)


def checked(name: str, one: Field, value: Any) -> Any:
    """The value in its one form; TextureError, saying which are valid, if it is not one."""
    values = one.metadata["values"]
    try:
        return CHECKS[values.split(":")[0]](value, values)
    except (TypeError, ValueError) as error:
        raise TextureError(
            f"{one.name} is {value!r}", f"{name}({one.name}=...)", f"pass {error}"
        ) from None


def from_text(name: str, one: Field, text: str) -> Any:
    """The value that a text such as "0.1", "0,0,1" or "true" stands for, checked."""
    values = one.metadata["values"].split(":")[0]
    value: Any = text
    try:
        if values in ("point", "direction") or (values == "color" and "," in text):
            value = [float(part) for part in text.split(",")]
        elif values in ("length", "ratio", "number", "share", "count", "seed"):
            value = float(text)
        elif values == "switch":
            value = {"true": True, "yes": True, "false": False, "no": False}.get(text, text)
    except ValueError:
        value = text  # refused below, as it was written
    return checked(name, one, value)


def _number(value: Any, least: Number, most: Number, words: str) -> float:
    if isinstance(value, str | bool) or not np.ndim(value) == 0:
        raise ValueError(words)
    if not (np.isfinite(value) and least <= value <= most):
        raise ValueError(words)
    return float(value)


def _length(value: Any, _: str) -> float:
    words = "a length above 0"
    return _number(value, np.nextafter(0.0, 1.0), np.inf, words)


def _ratio(value: Any, _: str) -> float:
    return _number(value, np.nextafter(0.0, 1.0), np.inf, "a number above 0")


def _any_number(value: Any, _: str) -> float:
    return _number(value, -np.inf, np.inf, "a number")


def _share(value: Any, _: str) -> float:
    return _number(value, *RANGES["share"], "a number from 0 to 1")


def _whole(value: Any, least: Number, most: Number, words: str) -> int:
    number = _number(value, least, most, words)
    if number != int(number):
        raise ValueError(words)
    return int(number)


def _count(value: Any, _: str) -> int:
    return _whole(value, *RANGES["count"], "a whole number from 1 to 32")


def _seed(value: Any, _: str) -> int:
    return _whole(value, *RANGES["seed"], "a whole number from 0 to 2147483647")


def _point(value: Any, _: str) -> tuple[float, float, float]:
    words = "three numbers"
    if isinstance(value, str) or len(value) != 3:
        raise ValueError(words)
    x, y, z = (_number(number, -np.inf, np.inf, words) for number in value)
    return x, y, z


def _direction(value: Any, _: str) -> tuple[float, float, float]:
    x, y, z = _point(value, "")
    length = float(np.sqrt(x * x + y * y + z * z))
    if length == 0:
        raise ValueError("three numbers that are not all 0")
    return x / length, y / length, z / length


def _color(value: Any, _: str) -> Any:
    try:
        linear_color(value)
    except (TypeError, ValueError) as error:
        words = 'an sRGB colour such as "#aa7744", or 3 or 4 linear numbers'
        raise ValueError(f"{words}: {error}") from None
    return value if isinstance(value, str) else tuple(float(number) for number in value)


def _switch(value: Any, _: str) -> bool:
    if not isinstance(value, bool):
        raise ValueError("True or False")
    return value


def _choice(value: Any, values: str) -> str:
    names = values.split(":")[1].split("|")
    if value not in names:
        raise ValueError(" or ".join(names))
    return value


CHECKS: dict[str, Callable[[Any, str], Any]] = {
    "length": _length,
    "ratio": _ratio,
    "number": _any_number,
    "share": _share,
    "count": _count,
    "seed": _seed,
    "point": _point,
    "direction": _direction,
    "color": _color,
    "switch": _switch,
    "choice": _choice,
}
