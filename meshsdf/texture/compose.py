"""Textures of textures: mixed, coloured by a ramp, scaled, moved and turned.

A texture here is any callable ``f(points)`` or ``f(points, footprint)`` that gives (n, 4) colours,
linear with straight alpha: one of this package's or a plain function. Only those with a footprint
are filtered.
"""

import inspect
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Float64

from ..arrays import Matrix4, Number, Points, Values
from ..errors import TextureError
from .colors import Color, StraightRgba, blend, premultiplied, straight
from .parameters import Triple

Texture = Callable[..., Any]
LEAST_SCALE = 1e-9  # ratio of singular values below which a matrix flattens space


@dataclass(frozen=True, eq=False)
class Mixed:
    """One texture over into another by a weight; built by `mix`."""

    first: Texture
    second: Texture
    weight: Number | Texture

    def __call__(self, points: Points, footprint: Number | Values = 0.0) -> StraightRgba:
        weight = np.full(len(points), 1.0)
        if callable(self.weight):
            weight = np.clip(values_of(self.weight, points, footprint), 0, 1)
        else:
            weight *= float(self.weight)
        first, second = (
            _premultiplied_rows(colors_of(texture, points, footprint))
            for texture in (self.first, self.second)
        )
        return straight(blend(first, second, weight))


@dataclass(frozen=True, eq=False)
class Ramp:
    """Colours along a line, linear between stops; built by `ramp`."""

    places: Float64[np.ndarray, " stops"]
    colors: Float64[np.ndarray, "stops 4"] = field(repr=False)
    values: Texture | None = None

    def __call__(self, points: Points, footprint: Number | Values = 0.0) -> StraightRgba:
        """Colours at points, by the values there."""
        if self.values is None:
            raise TextureError(
                "this ramp has no values", "ramp(stops)(points)", "pass ramp(stops, values=f)"
            )
        return self.at(values_of(self.values, points, footprint))

    def at(self, values: Values) -> StraightRgba:
        """Colours of values; those of the ends beyond them."""
        rgba = [np.interp(values, self.places, self.colors[:, c]) for c in range(4)]
        return straight(np.stack(rgba, axis=1))


@dataclass(frozen=True, eq=False)
class Placed:
    """A texture seen through an affine map; built by `scaled`, `moved` and `turned`."""

    texture: Texture
    inverse: Matrix4  # world to the texture's own space
    shrink: float  # mean of what the inverse does to lengths

    def __call__(self, points: Points, footprint: Number | Values = 0.0) -> StraightRgba:
        own = np.empty_like(points)
        for row in range(3):
            a, b, c, d = (float(number) for number in self.inverse[row])
            own[:, row] = a * points[:, 0] + b * points[:, 1] + c * points[:, 2] + d
        return colors_of(self.texture, own, np.asarray(footprint, np.float64) * self.shrink)


def mix(first: Texture, second: Texture, weight: Number | Texture) -> Mixed:
    """Return ``first`` where the weight is 0, ``second`` where it is 1, linear light between.

    The weight is a number or a function of points, or of points and a footprint, that gives (n,)
    values; those beyond 0 and 1 are clipped. Each part is filtered by itself.

    Examples
    --------
    >>> red, blue = (lambda p: np.tile([1.0, 0, 0, 1], (len(p), 1)),
    ...              lambda p: np.tile([0, 0, 1.0, 1], (len(p), 1)))
    >>> mix(red, blue, lambda p: p[:, 0])(np.array([[0.25, 0.0, 0.0]]))
    array([[0.75, 0.  , 0.25, 1.  ]], dtype=float32)
    """
    if not callable(weight) and not 0 <= weight <= 1:
        raise TextureError(f"weight is {weight}", "mix(weight=...)", "pass a number from 0 to 1")
    return Mixed(first, second, weight)


def ramp(stops: Sequence[tuple[Number, Color]], values: Texture | None = None) -> Ramp:
    """Return colours linear between ``(place, colour)`` stops, in linear light.

    ``ramp(stops).at(numbers)`` colours numbers; ``ramp(stops, values=f)`` is a texture, coloured by
    f(points) or f(points, footprint). Numbers are averaged before they become colours.

    Examples
    --------
    >>> ramp([(0, "#000000"), (2, "#ffffff")]).at(np.array([1.0, 3.0]))[:, 0]
    array([0.5, 1. ], dtype=float32)
    """
    places = np.array([place for place, _ in stops], np.float64)
    if len(places) == 0 or not np.isfinite(places).all() or (np.diff(places) < 0).any():
        raise TextureError(
            f"the places of {len(places)} stops are {places.tolist()}",
            "ramp(stops)",
            "pass at least one (place, colour), with places that do not fall",
        )
    try:
        colors = np.array([premultiplied(color) for _, color in stops])
    except ValueError as error:
        raise TextureError("a stop's colour is none", "ramp(stops)", f"pass {error}") from None
    return Ramp(places, colors, values)


def scaled(texture: Texture, factor: Number | Triple) -> Placed:
    """Return the texture enlarged by a factor, or one along each axis, about the origin."""
    return placed(texture, np.diag(np.append(np.ones(3) * np.asarray(factor, np.float64), 1.0)))


def moved(texture: Texture, offset: Triple) -> Placed:
    """Return the texture moved by an offset."""
    matrix = np.eye(4)
    matrix[:3, 3] = offset
    return placed(texture, matrix)


def turned(texture: Texture, axis: Triple, degrees: Number) -> Placed:
    """Return the texture turned about an axis through the origin.

    Counter-clockwise as seen from the end of the axis; filters turn with it.
    """
    x, y, z = np.asarray(axis, np.float64) / max(float(np.linalg.norm(axis)), 1e-300)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = np.radians(float(degrees))
    matrix = np.eye(4)
    matrix[:3, :3] += np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    return placed(texture, matrix)


def placed(texture: Texture, matrix: Matrix4) -> Placed:
    """Return the texture moved by an affine map, (4, 4), that does not flatten space.

    A footprint becomes the cube of the same volume in the texture's own space.
    """
    sizes = np.linalg.svd(matrix[:3, :3], compute_uv=False)
    if not (np.isfinite(matrix).all() and sizes[2] > LEAST_SCALE * sizes[0]):
        raise TextureError(
            f"the map flattens space: singular values run from {sizes[0]:g} to {sizes[2]:g}",
            "placed(matrix=...)",
            "pass an invertible matrix, factors that are not 0, an axis that is not 0",
        )
    return Placed(texture, np.linalg.inv(matrix), float(np.prod(sizes) ** (-1 / 3)))


def colors_of(texture: Texture, points: Points, footprint: Any = 0.0) -> StraightRgba:
    """The colours of a texture or a plain function, checked: (n, 4) float32."""
    colors = np.asarray(_called(texture, points, footprint))
    if colors.shape != (len(points), 4):
        raise TextureError(
            f"a texture gave an array of shape {colors.shape} for {len(points)} points",
            "texture(points)",
            "return (n, 4): linear red, green, blue and alpha",
        )
    return colors.astype(np.float32)


def values_of(function: Texture, points: Points, footprint: Any = 0.0) -> Values:
    """The values of a function of points, checked: (n,) float64."""
    values = np.asarray(_called(function, points, footprint), np.float64)
    if values.shape != (len(points),):
        raise TextureError(
            f"a function gave an array of shape {values.shape} for {len(points)} points",
            "weight(points)",
            "return (n,) values",
        )
    return values


def _called(function: Texture, points: Points, footprint: Any) -> Any:
    return function(points, footprint) if _takes_footprint(function) else function(points)


def _takes_footprint(function: Texture) -> bool:
    """Whether a second argument may be given by position and is named footprint."""
    try:
        names = list(inspect.signature(function).parameters)
    except ValueError:
        return False
    return len(names) > 1 and names[1] == "footprint"


def _premultiplied_rows(colors: StraightRgba) -> Float64[np.ndarray, "n 4"]:
    out = colors.astype(np.float64)
    out[:, :3] *= out[:, 3:]
    return out
