"""Union, intersection, difference and complement of shapes, as minimum and maximum.

Minimum and maximum of 1-Lipschitz functions are 1-Lipschitz, so bounds stay bounds. Of exact
distances more remains only where it can be proved:

- ``min(f, g)`` is exact outside both shapes, but inside their overlap the surface of each is
  nearer than that of the union. Of shapes that do not touch it is exact everywhere.
- ``max(f, g)`` is exact inside the intersection, but beside an edge where the two surfaces meet the
  nearest point of one may not belong to the other.
- ``max(f, -g)`` is exact everywhere when the second shape lies within the first and does not
  touch its surface, or when the two are apart: the boundary is then that of both, or the first's.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ..arrays import Points, Values
from ..box import Box
from ..errors import ImplicitError
from .implicit import Exactness, Implicit


@dataclass(frozen=True, eq=False)
class Union(Implicit):
    """The least of several functions; built by `union`."""

    shapes: tuple[Implicit, ...]
    exactness: Exactness
    box: Box | None

    def __call__(self, points: Points) -> Values:
        least = self.shapes[0](points)
        for shape in self.shapes[1:]:
            least = np.minimum(least, shape(points))
        return least

    def gradient(self, points: Points) -> Points:
        number = np.argmin([shape(points) for shape in self.shapes], axis=0)
        return _gradient_of(self.shapes, number, points)


@dataclass(frozen=True, eq=False)
class Intersection(Implicit):
    """The greatest of several functions; built by `intersection` and `difference`."""

    shapes: tuple[Implicit, ...]
    exactness: Exactness
    box: Box | None

    def __call__(self, points: Points) -> Values:
        greatest = self.shapes[0](points)
        for shape in self.shapes[1:]:
            greatest = np.maximum(greatest, shape(points))
        return greatest

    def gradient(self, points: Points) -> Points:
        number = np.argmax([shape(points) for shape in self.shapes], axis=0)
        return _gradient_of(self.shapes, number, points)


@dataclass(frozen=True, eq=False)
class Complement(Implicit):
    """The negative of a function; built by `complement`."""

    shape: Implicit

    @property
    def exactness(self) -> Exactness:
        """That of the shape."""
        return self.shape.exactness

    def __call__(self, points: Points) -> Values:
        return -self.shape(points)

    def gradient(self, points: Points) -> Points:
        return -self.shape.gradient(points)


def union(*shapes: Implicit) -> Union:
    """Return what lies inside any of the shapes.

    EXACT if all are and their boxes do not touch; else a BOUND if all are at least that.

    Examples
    --------
    >>> from meshsdf.implicit import sphere
    >>> union(sphere(1.0), sphere(1.0, np.array([3.0, 0, 0]))).exactness.name
    'EXACT'
    >>> union(sphere(1.0), sphere(1.0, np.array([1.5, 0, 0]))).exactness.name
    'BOUND'
    """
    _check_number("union", shapes)
    boxes = [shape.box for shape in shapes]
    exactness = min(shape.exactness for shape in shapes)
    if not all(_are_apart(a, b) for a, b in combinations(boxes, 2)):
        exactness = min(exactness, Exactness.BOUND)
    around = None
    if None not in boxes:
        around = Box(
            np.min([known.lower for known in boxes], axis=0),
            np.max([known.upper for known in boxes], axis=0),
        )
    return Union(shapes, exactness, around)


def intersection(*shapes: Implicit) -> Intersection:
    """Return what lies inside all of the shapes; a BOUND if all are at least that."""
    _check_number("intersection", shapes)
    exactness = min(shape.exactness for shape in shapes)
    if len(shapes) > 1:
        exactness = min(exactness, Exactness.BOUND)
    known = [shape.box for shape in shapes if shape.box is not None]
    around = None
    if known:
        lower = np.max([one.lower for one in known], axis=0)
        upper = np.min([one.upper for one in known], axis=0)
        # Where the boxes have nothing in common there is no inside, and any box holds it
        around = Box(lower, upper) if (lower <= upper).all() else known[0]
    return Intersection(shapes, exactness, around)


def difference(shape: Implicit, *others: Implicit) -> Intersection:
    """Return what lies inside the first shape and inside none of the others.

    EXACT if all are, the others do not touch each other, and each of them lies within the first
    shape or apart from it, as their boxes tell; else a BOUND if all are at least that.
    """
    exactness = min(one.exactness for one in (shape, *others))
    boxes = [other.box for other in others]
    is_clear = all(_are_apart(a, b) for a, b in combinations(boxes, 2)) and all(
        _are_apart(shape.box, other.box) or _holds(shape, other) for other in others
    )
    if not is_clear:
        exactness = min(exactness, Exactness.BOUND)
    shapes = (shape, *(complement(other) for other in others))
    return Intersection(shapes, exactness, shape.box)


def complement(shape: Implicit) -> Complement:
    """Return what lies outside a shape; as exact as the shape."""
    return Complement(shape)


def _are_apart(a: Box | None, b: Box | None) -> bool:
    """Whether two boxes are known and do not touch."""
    if a is None or b is None:
        return False
    return bool(((a.lower > b.upper) | (b.lower > a.upper)).any())


def _holds(outer: Implicit, inner: Implicit) -> bool:
    """Whether the ball around the inner shape's box is proved to lie within the outer one."""
    if inner.box is None or outer.exactness < Exactness.BOUND:
        return False
    value = float(outer(inner.box.center[None])[0])
    return value < -0.5 * inner.box.diagonal


def _gradient_of(shapes: tuple[Implicit, ...], number: np.ndarray, points: Points) -> Points:
    """The gradient of shape ``number[n]`` at point n."""
    out = np.empty_like(points)
    for n, shape in enumerate(shapes):
        own = number == n
        if own.any():
            out[own] = shape.gradient(points[own])
    return out


def _check_number(name: str, shapes: tuple) -> None:
    if not shapes:
        raise ImplicitError("there are no shapes", f"{name}(*shapes)", "pass at least one shape")
