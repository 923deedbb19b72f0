"""Wood: rings around an axis, plain or as they grow."""

from dataclasses import dataclass, field

import numpy as np

from ..arrays import Number, Points, Values
from .colors import Color, Rgba, blend, premultiplied
from .noise import fbm, gradient_noise
from .parameters import Triple, means
from .solid import Solid
from .waves import Periodic, smoothstep, square_wave_in_cube

# A cube is cut until its rings bend by less than this share of a ring's width
BEND = 0.05
PROFILE_STEPS = 1024


@dataclass(frozen=True, kw_only=True)
class Wood(Solid):
    """Light and dark rings around an axis.

    With c a point of the axis and a its direction,
    ``r = |(p - c) - ((p - c) . a) a|``, and the colour is dark on the last ``dark_fraction`` of
    every ``ring_width`` of r.

    References
    ----------
    Hughes et al., "Computer Graphics: Principles and Practice", 3rd edition, 2013, chapter 24;
    Peachey, "Solid texturing of complex surfaces", 1985, doi:10.1145/325165.325246.

    Examples
    --------
    >>> wood = Wood(ring_width=0.2, dark_fraction=0.25, light=(1, 1, 1), dark=(0, 0, 0))
    >>> wood(np.array([[0.1, 0.0, 5.0], [0.0, 0.18, 0.0]]))[:, 0]
    array([1., 0.], dtype=float32)
    """

    ring_width: Number = field(default=0.1, metadata=means("length", "from ring to ring"))
    dark_fraction: Number = field(
        default=0.3, metadata=means("share", "of a ring's width that is dark")
    )
    axis_point: Triple = field(
        default=(0.0, 0.0, 0.0), metadata=means("point", "a point of the axis")
    )
    axis: Triple = field(
        default=(0.0, 0.0, 1.0), metadata=means("direction", "direction of the axis")
    )
    light: Color = field(default="#d9a066", metadata=means("color", "of the wide, early wood"))
    dark: Color = field(default="#8a5a2b", metadata=means("color", "of the narrow, late wood"))

    def _colors(self, points: Points, width: Values) -> Rgba:
        radius, outward = around(points, self.axis_point, self.axis)
        across = np.abs(outward) * (width / self.ring_width)[:, None]
        weight = square_wave_in_cube(radius / self.ring_width, self.dark_fraction, across)
        return blend(premultiplied(self.light), premultiplied(self.dark), weight)

    def _cuts(self, points: Points, width: Values) -> Values:
        radius, _ = around(points, self.axis_point, self.axis)
        return width / np.sqrt(8 * BEND * self.ring_width * np.maximum(radius, 0.25 * width))


@dataclass(frozen=True, kw_only=True)
class WoodGrain(Solid):
    """Wood as it grows: rings that waver, darken slowly and end at once, with fibres and rays.

    ``q = p + waviness V(p)`` with a vector noise V stretched along the axis; r is its distance
    from the axis, ``s = r / ring_width + unevenness N(r)``, and the share of late wood is
    ``smoothstep(0, 0.8, s) - smoothstep(0.83, 1, s)`` of the fraction of s. Fibres are noise
    drawn out along the axis; rays are sheets of noise along the radius.

    References
    ----------
    Upstill, "The RenderMan Companion", 1990, listing 16.15; Peachey, "Solid texturing of complex
    surfaces", 1985, doi:10.1145/325165.325246.
    """

    ring_width: Number = field(
        default=0.09, metadata=means("length", "from ring to ring, on average")
    )
    waviness: Number = field(
        default=0.16, metadata=means("number", "how far rings are displaced, pattern units")
    )
    unevenness: Number = field(
        default=0.5, metadata=means("number", "how far rings come early or late, in rings")
    )
    fibres: Number = field(
        default=0.35, metadata=means("share", "strength of the fibres along the axis")
    )
    rays: Number = field(
        default=0.0, metadata=means("share", "strength of the rays from the axis outwards")
    )
    axis_point: Triple = field(
        default=(0.0, 0.0, 0.0), metadata=means("point", "a point of the axis")
    )
    axis: Triple = field(
        default=(0.1, 0.06, 1.0), metadata=means("direction", "direction of the axis")
    )
    light: Color = field(default="#dba871", metadata=means("color", "of the early wood"))
    dark: Color = field(default="#7d4a22", metadata=means("color", "of the late wood"))

    def _colors(self, points: Points, width: Values) -> Rgba:
        along = np.array(self.axis)
        local = _in_frame(points - np.array(self.axis_point), along)
        stretched = local * np.array([0.9, 0.9, 0.25])
        wide = width[:, None] * np.array([0.9, 0.9, 0.25])
        moved = local[:, :2].copy()
        for axis in range(2):
            noise = fbm(stretched, wide, octaves=2, seed=self.seed + 101 * axis)
            moved[:, axis] += self.waviness * noise
        radius = np.hypot(moved[:, 0], moved[:, 1])
        # Good and bad years: the same at all places of one ring
        years = np.zeros((len(points), 3))
        years[:, 0] = 0.45 * radius / self.ring_width
        step = 0.45 * width / self.ring_width
        rings = radius / self.ring_width
        rings += self.unevenness * gradient_noise(years, np.minimum(step, 4.0), seed=self.seed + 7)
        late = _RINGS(rings, width / self.ring_width)
        out = blend(premultiplied(self.light), premultiplied(self.dark), late)
        shade = np.ones(len(points))
        if self.fibres:
            thread = np.array([1.0, 1.0, 0.03]) * (6.0 / self.ring_width)
            noise = fbm(local * thread, width[:, None] * thread, octaves=2, seed=self.seed + 11)
            shade += self.fibres * noise * (0.6 + 0.4 * late)
        out[:, :3] *= shade[:, None]
        if self.rays:
            out = blend(out, 1.15 * premultiplied(self.light), self._ray_share(local, width))
        return out

    def _ray_share(self, local: Points, width: Values) -> Values:
        """How much of a ray is at places: long along the radius, short around it."""
        radius = np.maximum(np.hypot(local[:, 0], local[:, 1]), 1e-9)
        place = np.stack(
            [40 * np.arctan2(local[:, 1], local[:, 0]), 3 * radius, 5 * local[:, 2]], axis=1
        )
        wide = np.stack([40 * width / radius, 3 * width, 5 * width], axis=1)
        noise = gradient_noise(place, np.minimum(wide, 4.0), seed=self.seed + 13)
        return self.rays * smoothstep(0.35, 0.6, noise)

    def _cuts(self, points: Points, width: Values) -> Values:
        return 1.0 + 1.5 * width / self.ring_width


def around(points: Points, axis_point: Triple, axis: Triple) -> tuple[Values, Points]:
    """Distances from an axis, and the unit vectors away from it (zero on it)."""
    ax, ay, az = (float(number) for number in axis)
    x, y, z = (points[:, i] - float(axis_point[i]) for i in range(3))
    t = x * ax + y * ay + z * az
    away = np.stack([x - t * ax, y - t * ay, z - t * az], axis=1)
    radius = np.sqrt(away[:, 0] ** 2 + away[:, 1] ** 2 + away[:, 2] ** 2)
    return radius, away / np.where(radius == 0, 1.0, radius)[:, None]


def _in_frame(points: Points, axis: np.ndarray) -> Points:
    """Coordinates along two axes across a unit vector, and along it (Duff et al. 2017)."""
    ax, ay, az = (float(number) for number in axis)
    side = 1.0 if az >= 0 else -1.0
    a = -1.0 / (side + az)
    b = ax * ay * a
    x, y, z = points[:, 0], points[:, 1], points[:, 2]
    return np.stack(
        [
            x * (1 + side * ax * ax * a) + y * (side * b) - z * (side * ax),
            x * b + y * (side + ay * ay * a) - z * ay,
            x * ax + y * ay + z * az,
        ],
        axis=1,
    )


def _ring_profile() -> Periodic:
    s = np.arange(PROFILE_STEPS) / PROFILE_STEPS
    return Periodic(smoothstep(0, 0.8, s) - smoothstep(0.83, 1, s))


_RINGS = _ring_profile()
