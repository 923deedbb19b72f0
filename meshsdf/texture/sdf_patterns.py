"""Textures that see the shape they are on: worn edges, dirt in cavities, thin parts.

`procedural.procedural` makes them by name, too. They need no baked maps, as everything is asked of
a signed distance ``f(points) -> values``, negative inside: a `ShapeDistance`, an `Implicit`, or
``lambda points: MeshDistance(mesh)(points).distance`` with the object made once. Curvature is right
for any function with that zero set; occlusion and thickness want distances, or bounds of them.

A `ShapeDistance` is sampled once, in voxels that are a small share of the length that a texture
measures over, and asked itself for the few points of coarse footprints (`SAMPLED`). Weights differ
from those of exact distances by 0.008 on average, by 0.08 at one of a hundred places (suzanne, spot
and armadillo, lengths as `procedural.lengths_for` has them; most at creases).
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from itertools import combinations
from typing import NamedTuple

import numpy as np

from ..arrays import Number, Points, Values
from ..errors import TextureError
from .colors import Color, StraightRgba, blend, premultiplied, straight
from .parameters import check_parameters, means
from .shape_distance import ShapeDistance, SignedDistance, values_of
from .thickness import project, thickness
from .waves import smoothstep

TAPS = 5  # along the normal
NORMAL_STEP = 1 / 10  # of the reach: over which the normal is measured
OFF_SURFACE = 2.0  # footprints: no texel is further from the surface


class Sampling(NamedTuple):
    """How distances are sampled for a texture, in lengths that it measures over."""

    voxels: int  # along that length
    farthest: float  # from a point on the surface is asked
    widest: float  # footprint: points of wider ones are few, and far from the surface


SAMPLED = {
    "edge_wear": Sampling(8, np.sqrt(2), 1.0),
    "cavity_dirt": Sampling(20, 1.0, 0.25),
    "thickness": Sampling(64, 0.5, 0.0625),
}


@dataclass(frozen=True, kw_only=True, eq=False)
class _OnShape(ABC):
    """A texture of two colours, the second by a weight that the shape gives."""

    distance: SignedDistance

    def __post_init__(self) -> None:
        check_parameters(self)

    def __call__(self, points: Points, footprint: Number | Values = 0.0) -> StraightRgba:
        """Return colours, (n, 4) float32, linear; filters finer than the reach change nothing."""
        widths = np.broadcast_to(np.asarray(footprint, np.float64), len(points))
        first, second = self._color_pair()
        return straight(blend(first, second, self.weight(points, widths)))

    def _seen(self, kind: str, length: Number, footprint: Number | Values) -> SignedDistance:
        """The distance to ask: sampled, if it is that of a mesh and all footprints are small."""
        look = SAMPLED[kind]
        fits = np.max(footprint, initial=0.0) <= look.widest * length
        if not (fits and isinstance(self.distance, ShapeDistance)):
            return self.distance
        reach = (look.farthest + OFF_SURFACE * look.widest) * length
        return self.distance.sampled(voxel_size=length / look.voxels, reach=reach)

    @abstractmethod
    def weight(self, points: Points, footprint: Number | Values = 0.0) -> Values:
        """Return the share of the second colour, (n,) in [0, 1]; also a weight for `mix`."""

    @abstractmethod
    def _color_pair(self) -> tuple[np.ndarray, np.ndarray]:
        """The two colours, linear, multiplied by alpha."""


@dataclass(frozen=True, kw_only=True, eq=False)
class EdgeWear(_OnShape):
    """Bare where the shape bends outwards: by `mean_curvature`, the paint is gone from edges.

    ``smoothstep(0, 2 threshold, kappa * reach)``, kappa measured over ``reach``, or over half the
    footprint where that is more.
    """

    reach: Number = field(
        default=0.02, metadata=means("length", "distance over which the bend is measured")
    )
    threshold: Number = field(
        default=0.3, metadata=means("ratio", "bend (curvature times reach) that wears half")
    )
    paint: Color = field(default="#35566b", metadata=means("color", "of the paint"))
    bare: Color = field(default="#b9b4ab", metadata=means("color", "of what is under it"))

    def weight(self, points: Points, footprint: Number | Values = 0.0) -> Values:
        """Return how much is worn off, (n,) in [0, 1]."""
        step = np.maximum(self.reach, np.asarray(footprint, np.float64) / 2)
        distance = self._seen("edge_wear", self.reach, footprint)
        kappa = mean_curvature(distance, points, step)
        return smoothstep(0, 2 * self.threshold, kappa * step)

    def _color_pair(self) -> tuple[np.ndarray, np.ndarray]:
        return premultiplied(self.paint), premultiplied(self.bare)


@dataclass(frozen=True, kw_only=True, eq=False)
class CavityDirt(_OnShape):
    """Dirt where the surroundings stand close: by `occlusion`, times ``strength``."""

    reach: Number = field(
        default=0.1, metadata=means("length", "how far out the surroundings count")
    )
    strength: Number = field(default=1.5, metadata=means("ratio", "dirt per share of occlusion"))
    clean: Color = field(default="#c8b89a", metadata=means("color", "of the clean surface"))
    dirt: Color = field(default="#33281d", metadata=means("color", "of the dirt"))

    def weight(self, points: Points, footprint: Number | Values = 0.0) -> Values:
        """Return how dirty it is, (n,) in [0, 1]."""
        reach = np.maximum(self.reach, np.asarray(footprint, np.float64))
        distance = self._seen("cavity_dirt", self.reach, footprint)
        return np.minimum(self.strength * occlusion(distance, points, reach), 1.0)

    def _color_pair(self) -> tuple[np.ndarray, np.ndarray]:
        return premultiplied(self.clean), premultiplied(self.dirt)


@dataclass(frozen=True, kw_only=True, eq=False)
class Thickness(_OnShape):
    """One colour where the shape is thin, another where it is thick: by `thickness`."""

    thin_length: Number = field(
        default=0.02, metadata=means("length", "at which the colour is that of thin parts")
    )
    thick_length: Number = field(
        default=0.3, metadata=means("length", "at which it is that of thick parts")
    )
    thin: Color = field(default="#e8734a", metadata=means("color", "of thin parts"))
    thick: Color = field(default="#4a2a22", metadata=means("color", "of thick parts"))

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.thick_length <= self.thin_length:
            raise TextureError(
                f"thick_length is {self.thick_length:g}, thin_length {self.thin_length:g}",
                "Thickness(thick_length=...)",
                "pass a thick_length that is larger",
            )

    def weight(self, points: Points, footprint: Number | Values = 0.0) -> Values:
        """Return 0 in thin parts, 1 in thick ones, (n,)."""
        distance = self._seen("thickness", self.thick_length, footprint)
        length = thickness(distance, points, largest=self.thick_length)
        return smoothstep(self.thin_length, self.thick_length, length)

    def _color_pair(self) -> tuple[np.ndarray, np.ndarray]:
        return premultiplied(self.thin), premultiplied(self.thick)


ON_SHAPE: dict[str, type[_OnShape]] = {
    "cavity_dirt": CavityDirt,
    "edge_wear": EdgeWear,
    "thickness": Thickness,
}
"""Every kind that needs a signed distance."""


def mean_curvature(
    distance: SignedDistance, points: Points, step: Number | Values = 1e-3
) -> Values:
    """Return half the divergence of the unit gradient: 1/r on a sphere of radius r.

    Parameters
    ----------
    distance : callable
        Any function with the shape as its zero set; (n, 3) points to (n,) values.
    points : (n, 3) float64
        World units; off the surface it is that of the level set through the point.
    step : float or (n,) float64
        To the places around that are asked, world units; details smaller than it are not seen.

    Notes
    -----
    Method: ``(|g|^2 tr H - g . H g) / (2 |g|^3)``, g and H the gradient and the second derivatives
    by central differences, 19 values a point. 0 where the gradient vanishes.
    Accuracy: the error falls with the square of the step; rounding of the values is divided by it.

    References
    ----------
    Goldman, "Curvature formulas for implicit curves and surfaces", 2005,
    doi:10.1016/j.cagd.2005.06.005.

    Examples
    --------
    >>> ball = lambda p: np.linalg.norm(p, axis=1) - 2.0
    >>> mean_curvature(ball, np.array([[2.0, 0.0, 0.0]])).round(6)
    array([0.5])
    """
    step = np.broadcast_to(np.asarray(step, np.float64), len(points))
    eye = np.eye(3)
    pairs = list(combinations(range(3), 2))
    diagonals = [eye[i] + side * eye[j] for i, j in pairs for side in (1, -1)]
    offsets = np.concatenate([np.zeros((1, 3)), eye, -eye, diagonals, -np.array(diagonals)])
    values = values_of(distance, (points + offsets[:, None] * step[:, None]).reshape(-1, 3))
    values = values.reshape(len(offsets), -1)
    middle, after, before = values[0], values[1:4], values[4:7]
    gradient = (after - before) / (2 * step)
    second = (after - 2 * middle + before) / step**2
    square = (gradient**2).sum(axis=0)
    bent = (gradient**2 * second).sum(axis=0)
    ends = values[7:13] + values[13:19]
    for number, (i, j) in enumerate(pairs):
        cross = (ends[2 * number] - ends[2 * number + 1]) / (4 * step**2)
        bent += 2 * gradient[i] * gradient[j] * cross
    top = square * second.sum(axis=0) - bent
    flat = square < 1e-12
    return np.where(flat, 0.0, top / (2 * np.where(flat, 1.0, square) ** 1.5))


def occlusion(distance: SignedDistance, points: Points, reach: Number | Values) -> Values:
    """Return how much of the distance expected along the normal is missing, (n,) in [0, 1].

    At i/5 of the reach from the surface, i = 1 to 5, an open place is as far from the shape as from
    the point. The shortfalls, as shares, are averaged with weights that halve from tap to tap.

    References
    ----------
    Evans, "Fast approximations for global illumination on dynamic scenes", SIGGRAPH 2006 course,
    doi:10.1145/1185657.1185834.

    Examples
    --------
    >>> corner = lambda p: np.minimum(p[:, 0], p[:, 1])
    >>> occlusion(corner, np.array([[0.0, 9.0, 0.0]]), 1.0)
    array([0.])
    """
    reach = np.broadcast_to(np.asarray(reach, np.float64), len(points))
    on_surface, normal = project(distance, points, NORMAL_STEP * reach)
    total = np.zeros(len(points))
    weights = 0.5 ** np.arange(TAPS)
    for tap, weight in enumerate(weights / weights.sum(), start=1):
        height = reach * tap / TAPS
        found = values_of(distance, on_surface + height[:, None] * normal)
        total += weight * np.clip(1 - found / height, 0, 1)
    return total
