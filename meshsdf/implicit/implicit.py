"""What an implicit function is: values, what they mean, where they are negative, a gradient."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, Protocol, runtime_checkable

import numpy as np

from ..arrays import Number, Points, Values
from ..box import Box
from ..errors import ImplicitError

# Balances what central differences leave out, step**2 / 6 of the third derivative, against the
# rounding of the values, 2**-53 of them / step, when both derivative and values are of order one.
RELATIVE_STEP = float(np.cbrt(2.0**-53))


class Exactness(IntEnum):
    """What a value means; each includes those before it, so that ``min`` keeps what is certain.

    SIGN: negative inside, positive outside, and no more. BOUND: also 1-Lipschitz, so that the value
    never exceeds the distance to the surface. EXACT: the Euclidean distance itself. All hold up
    to rounding of float64.
    """

    SIGN = 0
    BOUND = 1
    EXACT = 2


@runtime_checkable
class Implicit(Protocol):
    """A shape as a function: ``f(points) -> values``, negative inside; (n, 3) to (n,), float64.

    Derive from it to have the gradient by central differences and an unknown box; whatever has the
    four members is one, too. The value at a point must not depend on the other points.

    Attributes
    ----------
    exactness : Exactness
        What the values mean.
    box : Box or None
        Holds every point whose value is not positive; None when there is no such box, or none is
        known.
    """

    exactness: Exactness
    box: Box | None = None

    def __call__(self, points: Points) -> Values:
        """Return the values at points."""
        ...

    def gradient(self, points: Points) -> Points:
        """Return the gradients at points; here, by `central_differences`.

        The step is 4.8e-6 times the longest side of the box, or where that is not known the
        largest coordinate of the point, or 1 if that is zero.
        """
        size = np.abs(points).max(axis=1, initial=0.0)
        if self.box is not None:
            size = np.full(len(points), self.box.longest_side)
        size[size == 0] = 1.0
        return central_differences(self, points, RELATIVE_STEP * size)


def central_differences(
    function: Callable[[Points], Values], points: Points, step: Number | Values
) -> Points:
    """Estimate gradients from the values at a step to both sides along each axis.

    Parameters
    ----------
    function : callable
        (n, 3) points to (n,) values. Called once, with 6 n points.
    points : (n, 3) float64
        World units.
    step : float or (n,) float64
        World units, above 0; for all points or for each.

    Notes
    -----
    Accuracy: where the third derivatives along the axes are at most D, and values are right to e,
    each component is off by at most ``step**2 / 6 * D + e / step``. Where the function has a kink
    within the step, the result lies between the slopes of its two sides.

    Examples
    --------
    >>> central_differences(lambda p: p[:, 0] * p[:, 1], np.array([[2.0, 3.0, 4.0]]), 0.5)
    array([[3., 2., 0.]])
    """
    offset = np.broadcast_to(step, len(points))[:, None, None] * np.eye(3)
    after, before = points[:, None] + offset, points[:, None] - offset
    values = function(np.concatenate([after, before]).reshape(-1, 3)).reshape(2, -1, 3)
    # The steps as they were taken, after rounding
    return (values[0] - values[1]) / np.einsum("naa->na", after - before)


@dataclass(frozen=True, eq=False)
class Function(Implicit):
    """A plain function as an implicit one; built by `from_function`."""

    function: Callable[[Points], Any]
    exactness: Exactness
    derivative: Callable[[Points], Any] | None
    box: Box | None

    def __call__(self, points: Points) -> Values:
        return _checked(self.function(points), (len(points),), "function")

    def gradient(self, points: Points) -> Points:
        if self.derivative is None:
            return Implicit.gradient(self, points)
        return _checked(self.derivative(points), (len(points), 3), "gradient")


def from_function(
    function: Callable[[Points], Any],
    exactness: Exactness,
    *,
    gradient: Callable[[Points], Any] | None = None,
    box: Box | None = None,
) -> Function:
    """Take a plain function as an implicit one.

    Parameters
    ----------
    function : callable
        (n, 3) float64 points to (n,) numbers, negative inside.
    exactness : Exactness
        What the numbers mean. It is believed: a function said to be a BOUND that grows faster than
        one moves makes algorithms miss parts of its surface.
    gradient : callable or None
        (n, 3) points to (n, 3) gradients; None for central differences.
    box : Box or None
        Holds every point whose value is not positive, if there is one and it is known.

    Raises
    ------
    ImplicitError
        From the result, when it is called: the function gave another shape, or no real numbers.

    Examples
    --------
    >>> cylinder = from_function(lambda p: np.hypot(p[:, 0], p[:, 1]) - 1, Exactness.EXACT)
    >>> cylinder(np.array([[3.0, 4.0, 9.0]]))
    array([4.])
    >>> cylinder.gradient(np.array([[3.0, 4.0, 9.0]])).round(9)
    array([[0.6, 0.8, 0. ]])
    """
    return Function(function, exactness, gradient, box)


def _checked(given: Any, shape: tuple[int, ...], name: str) -> np.ndarray:
    """Return what a caller's function gave, as float64, if it has the right shape."""
    array = np.asarray(given)
    if array.shape != shape or array.dtype.kind not in "fiub":
        what = f"gave {array.dtype} of the shape {array.shape} for {shape[0]} points"
        raise ImplicitError(
            f"the {name} {what}",
            f"from_function({name}=...)",
            f"return real numbers of the shape {shape}",
        )
    return array.astype(np.float64, copy=False)
