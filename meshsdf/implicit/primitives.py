"""Simple shapes as functions: sphere, box, torus, plane, gyroid.

All but the gyroid are Euclidean distances with their exact gradients. Where a distance has no
gradient, because several points of the surface are nearest, one of the possible directions is
returned; at the center of a sphere, or on the axis and the center circle of a torus, whose
directions fill a sphere or a circle, the part of the gradient that is undetermined is zero.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..arrays import Number, Points, Values, Vector3
from ..box import Box
from ..errors import ImplicitError
from .implicit import Exactness, Implicit


@dataclass(frozen=True, eq=False)
class Sphere(Implicit):
    """|p - center| - radius; built by `sphere`."""

    radius: float
    center: Vector3

    exactness: ClassVar[Exactness] = Exactness.EXACT

    @property
    def box(self) -> Box:
        """The smallest box around the sphere."""
        return Box(self.center - self.radius, self.center + self.radius)

    def __call__(self, points: Points) -> Values:
        return np.linalg.norm(points - self.center, axis=1) - self.radius

    def gradient(self, points: Points) -> Points:
        return _unit(points - self.center)


@dataclass(frozen=True, eq=False)
class Cuboid(Implicit):
    """The distance to a box along the axes; built by `box`."""

    size: Vector3
    center: Vector3

    exactness: ClassVar[Exactness] = Exactness.EXACT

    @property
    def box(self) -> Box:
        """The box itself."""
        return Box(self.center - 0.5 * self.size, self.center + 0.5 * self.size)

    def __call__(self, points: Points) -> Values:
        beyond = np.abs(points - self.center) - 0.5 * self.size
        outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=1)
        return outside + np.minimum(beyond.max(axis=1), 0.0)

    def gradient(self, points: Points) -> Points:
        from_center = points - self.center
        beyond = np.abs(from_center) - 0.5 * self.size
        # Outside toward the nearest point, inside along the axis of the nearest face
        nearest = np.eye(3)[beyond.argmax(axis=1)]
        is_outside = beyond.max(axis=1, keepdims=True) > 0
        direction = np.where(is_outside, np.maximum(beyond, 0.0), nearest)
        return _unit(np.copysign(direction, from_center))


@dataclass(frozen=True, eq=False)
class Torus(Implicit):
    """The distance to a circle about the z axis, less a radius; built by `torus`."""

    major_radius: float
    minor_radius: float
    center: Vector3

    exactness: ClassVar[Exactness] = Exactness.EXACT

    @property
    def box(self) -> Box:
        """The smallest box around the torus."""
        outer = self.major_radius + self.minor_radius
        reach = np.array([outer, outer, self.minor_radius])
        return Box(self.center - reach, self.center + reach)

    def __call__(self, points: Points) -> Values:
        x, y, z = (points - self.center).T
        return np.hypot(np.hypot(x, y) - self.major_radius, z) - self.minor_radius

    def gradient(self, points: Points) -> Points:
        from_center = points - self.center
        from_axis = from_center * [1.0, 1.0, 0.0]
        return _unit(from_center - self.major_radius * _unit(from_axis))


@dataclass(frozen=True, eq=False)
class Plane(Implicit):
    """normal . p - offset; built by `plane`."""

    normal: Vector3
    offset: float

    exactness: ClassVar[Exactness] = Exactness.EXACT

    def __call__(self, points: Points) -> Values:
        return points @ self.normal - self.offset

    def gradient(self, points: Points) -> Points:
        return np.tile(self.normal, (len(points), 1))


@dataclass(frozen=True, eq=False)
class Gyroid(Implicit):
    """(sin x cos y + sin y cos z + sin z cos x) / (sqrt(3) k), x = k p; built by `gyroid`.

    The derivative by x is (cos x, sin x) . (cos y, -sin z), at most the length of the second
    vector; the squares of the three such lengths add up to 3. The slope is thus at most sqrt(3) k,
    and it is that at the origin.
    """

    wave_number: float  # k

    exactness: ClassVar[Exactness] = Exactness.BOUND

    def __call__(self, points: Points) -> Values:
        sine, cosine = np.sin(self.wave_number * points), np.cos(self.wave_number * points)
        waves = (sine * np.roll(cosine, -1, axis=1)).sum(axis=1)
        return waves / (np.sqrt(3) * self.wave_number)

    def gradient(self, points: Points) -> Points:
        sine, cosine = np.sin(self.wave_number * points), np.cos(self.wave_number * points)
        slope = cosine * np.roll(cosine, -1, axis=1) - sine * np.roll(sine, 1, axis=1)
        return slope / np.sqrt(3)


def sphere(radius: Number, center: Vector3 | None = None) -> Sphere:
    """Return the EXACT distance to a sphere; the center is zero unless given."""
    _check_lengths("sphere", radius=radius)
    return Sphere(float(radius), _center(center))


def box(size: Vector3, center: Vector3 | None = None) -> Cuboid:
    """Return the EXACT distance to a box of side lengths ``size``, its sides along the axes."""
    for length in size:
        _check_lengths("box", size=length)
    return Cuboid(size.copy(), _center(center))


def torus(major_radius: Number, minor_radius: Number, center: Vector3 | None = None) -> Torus:
    """Return the EXACT distance to a torus: a tube of minor_radius around a circle about z.

    Raises
    ------
    ImplicitError
        Not 0 < minor_radius < major_radius.
    """
    _check_lengths("torus", major_radius=major_radius, minor_radius=minor_radius)
    if minor_radius >= major_radius:
        raise ImplicitError(
            f"minor_radius is {minor_radius}, major_radius only {major_radius}",
            "torus(minor_radius=...)",
            "pass a smaller minor_radius: the tube must not meet itself",
        )
    return Torus(float(major_radius), float(minor_radius), _center(center))


def plane(normal: Vector3, offset: Number = 0.0) -> Plane:
    """Return the EXACT distance to the plane ``normal . p = offset``, inside where it is less.

    The normal may have any length but zero; the offset is in its unit.
    """
    length = float(np.linalg.norm(normal))
    _check_lengths("plane", normal=length)
    return Plane(normal / length, float(offset) / length)


def gyroid(period: Number) -> Gyroid:
    """Return a BOUND of the gyroid, which repeats along each axis and has no box."""
    _check_lengths("gyroid", period=period)
    return Gyroid(2 * np.pi / float(period))


def _unit(vectors: Points) -> Points:
    """Vectors of length one; zero where they are zero."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(length == 0, 1.0, length)


def _center(center: Vector3 | None) -> Vector3:
    return np.zeros(3) if center is None else center.copy()


def _check_lengths(shape: str, **lengths: Number) -> None:
    for name, length in lengths.items():
        if not (np.isfinite(length) and length > 0):
            raise ImplicitError(
                f"{name} is {length}", f"{shape}({name}=...)", "pass a length above 0"
            )
