"""A picture thrown back onto what it shows, from where it was taken; never onto what was hidden.

A point is hidden if the way to the eye is blocked. By a mesh: exactly, by a ray. By a distance
field: by sphere tracing (Hart 1996, doi:10.1007/s003710050084) from the point to the eye.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from math import radians, tan
from typing import Any

import numpy as np
from jaxtyping import Bool, Float64

from ..arrays import Number, Points, Points2, Values, Vector3
from ..errors import TextureError
from ..mesh import Mesh
from ..spatial.ray_hits import RayHits
from .projection import Gradients, Mapped, Reached, check_positive, toward

OWN = 2.0  # texels from a point within which what the ray meets is the point's own surface
SHORTEST = 0.25  # texels: the shortest step, and the thinnest wall that is sure to be met
FINEST = 1e-3  # of the distance from eye to target: a texel, unless given
PARALLEL = 1e-9  # sine of the angle between up and the line of sight that is too small


def _upward() -> Vector3:
    return np.array([0.0, 1.0, 0.0])


@dataclass(frozen=True, eq=False)
class CameraProjection(Mapped):
    """From an eye: every point in view gets what the picture shows there.

    Attributes
    ----------
    eye, target, up : (3,) float64
        Where the picture was taken from, a point in its middle, and what is up in it; texture
        space, as is all else here.
    field_of_view : float
        Angle from the picture's lower to its upper border, degrees, below 180.
    aspect : float or None
        Width of the picture over its height; None for square pixels.
    hides : Mesh, callable or None
        What hides points from the eye: a mesh, or signed distances (n, 3) to (n,), negative
        inside, never more than the true distance. With None everything in view is reached.
    texel : float or None
        What is met within two texels of a point is its own surface. None: a thousandth of the
        distance from eye to target.
    steepest : float
        Degrees; where normals are given, those turned this far from the eye or farther get nothing.

    Raises
    ------
    TextureError
        Numbers that make no camera.

    Notes
    -----
    Accuracy: with a mesh, hidden is exact for points farther than two texels from what hides them.
    Distances may miss walls thinner than a quarter of a texel; and a point that lies deeper within
    their zero set than the way to the eye rises in two texels counts as hidden.
    Limits: half a texel of the image within its border, alpha begins to fade.
    """

    eye: Vector3
    target: Vector3
    up: Vector3 = field(default_factory=_upward)
    field_of_view: Number = 30.0
    aspect: Number | None = None
    hides: Mesh | Callable[[Points], Any] | None = None
    texel: Number | None = None
    steepest: Number = 90.0

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("eye", "target", "up"):
            if not np.isfinite(getattr(self, name)).all():
                what = f"{name} is {getattr(self, name).tolist()}"
                raise TextureError(what, "CameraProjection", "pass three finite numbers")
        check_positive(self.field_of_view, "field_of_view", "CameraProjection(field_of_view=...)")
        if self.field_of_view >= 180:
            what = f"the field of view is {self.field_of_view:g} degrees"
            raise TextureError(what, "CameraProjection", "pass an angle between 0 and 180")
        check_positive(self.steepest, "steepest", "CameraProjection(steepest=...)", 180)
        for name in ("aspect", "texel"):
            if getattr(self, name) is not None:
                check_positive(getattr(self, name), name, f"CameraProjection({name}=...)")
        sight = self.target - self.eye
        across = np.linalg.norm(np.cross(sight, self.up))
        if across <= PARALLEL * np.linalg.norm(sight) * np.linalg.norm(self.up):
            what = "eye and target are one point, or up lies along the line of sight"
            raise TextureError(what, "CameraProjection", "move one of them")

    @cached_property
    def axes(self) -> Float64[np.ndarray, "3 3"]:
        """Rows: the unit vectors to the right, upward, and forward."""
        forward = _unit(self.target - self.eye)
        right = _unit(np.cross(forward, self.up))
        return np.stack([right, np.cross(right, forward), forward])

    @cached_property
    def extent(self) -> tuple[float, float]:
        """Width and height of what the picture shows at distance 1."""
        height = 2.0 * tan(radians(self.field_of_view) / 2.0)
        aspect = self.image.width / self.image.height if self.aspect is None else self.aspect
        return height * float(aspect), height

    @cached_property
    def own(self) -> float:
        """How far from a point the ray is not looked at, units of texture space."""
        distance = np.linalg.norm(self.target - self.eye)
        return OWN * float(FINEST * distance if self.texel is None else self.texel)

    @cached_property
    def rays(self) -> RayHits:
        """Hits of rays on the mesh that hides."""
        return RayHits(self.hides)

    def _uv(self, local: Points) -> Points2:
        x, y, depth = self.axes @ (local - self.eye).T
        depth = np.where(depth > 0, depth, np.inf)  # behind: the middle, for `_reached` to drop
        uv = np.column_stack([x / depth / self.extent[0], y / depth / self.extent[1]]) + 0.5
        return np.clip(uv, -2.0, 3.0)  # all beyond is as far outside

    def _gradients(self, local: Points) -> Gradients:
        x, y, depth = self.axes @ (local - self.eye).T
        depth = np.where(depth > 0, depth, np.inf)
        right, up, forward = self.axes
        gradients = np.empty((len(local), 2, 3))
        for k, (along, axis) in enumerate(((x, right), (y, up))):
            slope = (along / depth)[:, None]
            gradients[:, k] = (axis - slope * forward) / (depth * self.extent[k])[:, None]
        return gradients

    def _wraps(self) -> tuple[str, str]:
        return ("transparent", "transparent")

    def _widest(self) -> tuple[float, float]:
        return (2.0, 2.0)

    def _reached(self, local: Points, facing: Points | None) -> Reached:
        x, y, depth = self.axes @ (local - self.eye).T
        wide, high = self.extent
        # Half a picture beyond the borders, for what a footprint takes in
        reached = (depth > 0) & (np.abs(x) <= wide * depth) & (np.abs(y) <= high * depth)
        if facing is not None:
            reached &= toward(facing, self.eye - local, self.steepest)
        if self.hides is not None:
            asked = np.flatnonzero(reached)
            reached[asked] = ~self._is_hidden(local[asked])
        return reached

    def _is_hidden(self, points: Points) -> Bool[np.ndarray, " n"]:
        """Whether anything but their own surface stands between points and the eye."""
        way = self.eye - points
        length = np.linalg.norm(way, axis=1)
        toward_eye = way / length[:, None]
        if isinstance(self.hides, Mesh):
            eyes = np.tile(self.eye, (len(points), 1))
            return self.rays.is_blocked(eyes, -toward_eye, np.maximum(length - self.own, 0.0))
        hidden, t = np.zeros(len(points), bool), np.full(len(points), self.own)
        shortest = SHORTEST * self.own / OWN
        walking = np.flatnonzero(t < length)
        while len(walking):
            places = points[walking] + t[walking, None] * toward_eye[walking]
            distance = _distances(self.hides, places)
            hidden[walking] = distance < 0
            t[walking] += np.maximum(distance, shortest)
            walking = walking[(distance >= 0) & (t[walking] < length[walking])]
        return hidden


def _distances(function: Callable[[Points], Any], points: Points) -> Values:
    """What the caller's distance says; TextureError unless it is a number per point."""
    given = np.asarray(function(points))
    if given.shape != (len(points),) or given.dtype.kind not in "fiu" or np.isnan(given).any():
        what = f"gave {given.dtype} of the shape {given.shape}, or NaN, for {len(points)} points"
        where = "CameraProjection(hides=...)"
        raise TextureError(f"the distance {what}", where, "return one signed distance per point")
    return given.astype(np.float64)


def _unit(vector: Vector3) -> Vector3:
    scaled = vector / np.abs(vector).max()  # so that no square is lost
    return scaled / np.linalg.norm(scaled)
