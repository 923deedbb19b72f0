"""How thick a shape is at a place of its surface: the largest ball that fits inside there."""

import numpy as np

from ..arrays import Number, Points, Values
from ..errors import TextureError
from .shape_distance import SignedDistance, values_of
from .waves import smoothstep

STEPS = 64  # along the normal, at least, to the middle of the largest ball
NORMAL_STEP = 1 / 24  # of the largest thickness: over which the normal is measured
FULL, NONE = 0.75, 0.35  # depth over way: a ball counts in full from one on, not at all below
DIVES = 4  # to a first ball; more change little
TINY = 1e-300  # nothing is divided by 0


def thickness(distance: SignedDistance, points: Points, *, largest: Number) -> Values:
    """Return the diameter of the largest ball inside that belongs to a place, up to ``largest``.

    Balls stand on the surface: the middle of one is ``t`` below the point along the normal, and
    its radius the depth ``d(t)`` there. With ``d = t`` it touches the surface at the point; one
    counts in full if ``d >= 0.75 t``, not at all if ``d < 0.35 t``, and its radius times a smooth
    step between. So a slab has its thickness, a ball, a cylinder or a slender cone its diameter
    there; the two sides of an edge that is bent by up to 41 degrees, as between facets of a curved
    surface, are as thick as if it was not there, and it is thin towards a sharp one.

    Parameters
    ----------
    distance : callable
        A signed distance, (n, 3) points to (n,) values.
    points : (n, 3) float64
        World units; on the surface or near it.
    largest : float
        World units; larger balls are not looked for.

    Notes
    -----
    Accuracy: not more than stated above, and by at most ``largest / 32`` less. Where distances are
    off by at most e, as sampled ones are, by 2 e more or less. Normals are measured over
    ``largest / 24``, which makes them continuous: so is the
    result. Nearer than that to a sharp edge they see both its sides.
    Method: from above, over what a function cannot reach that changes no faster than its argument;
    first a ball is found by dives to ``(t + d(t)) / 2``, as none with ``d = t`` lies between.

    Examples
    --------
    >>> ball = lambda p: np.linalg.norm(p, axis=1) - 2.0
    >>> thickness(ball, np.array([[2.0, 0.0, 0.0]]), largest=10.0).round(6)
    array([4.])
    """
    largest = float(largest)
    if not (np.isfinite(largest) and largest > 0):
        raise TextureError(
            f"largest is {largest}", "thickness(largest=...)", "pass a length above 0"
        )
    step = np.full(len(points), NORMAL_STEP * largest)
    balls = _Balls(distance, *project(distance, points, step))
    top = np.full(len(points), largest / 2)
    depth = balls.depth_at(np.arange(len(points)), top)
    left = np.flatnonzero(depth < top)
    way, depth = top[left], depth[left]
    dive, found = way, depth
    for _ in range(DIVES):
        dive = np.maximum((dive + found) / 2, 0)
        found = balls.depth_at(left, dive)
    # No depth above a way is more than the depth there and the rest of the way
    step = largest / (2 * STEPS)
    while len(left):
        way = way - np.maximum(balls.radius[left] - depth, step)
        going = way > balls.radius[left]
        left, way = left[going], way[going]
        depth = balls.depth_at(left, way)
    return 2 * balls.radius


class _Balls:
    """The largest ball found below every point, of those that were looked at.

    Attributes
    ----------
    radius : (n,) float64
        As they count, world units.
    """

    def __init__(self, distance: SignedDistance, on_surface: Points, normal: Points) -> None:
        self._distance, self._on_surface, self._normal = distance, on_surface, normal
        self.radius = np.zeros(len(on_surface))

    def depth_at(self, some: np.ndarray, way: Values) -> Values:
        """Look at the balls at these ways below some points; return the depths there."""
        places = self._on_surface[some] - way[:, None] * self._normal[some]
        depth = -values_of(self._distance, places)
        share = np.clip(depth / np.maximum(way, TINY), 0, 1)
        radius = share * way * smoothstep(NONE, FULL, share)
        self.radius[some] = np.maximum(self.radius[some], radius)
        return depth


def project(distance: SignedDistance, points: Points, step: Values) -> tuple[Points, Points]:
    """The points moved onto the surface along the normal, and the unit normals there.

    Normals are those of central differences over ``step``, (n,) world units.
    """
    offsets = np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])
    values = values_of(distance, (points + offsets[:, None] * step[:, None]).reshape(-1, 3))
    values = values.reshape(7, -1)
    gradient = ((values[1:4] - values[4:7]) / (2 * step)).T
    length = np.sqrt((gradient**2).sum(axis=1))
    normal = gradient / np.where(length == 0, 1.0, length)[:, None]
    return points - values[0][:, None] * normal, normal
