"""Where a function crosses a level on many edges at once, to rounding.

The ITP method (Oliveira and Takahashi 2020, doi:10.1145/3423597): the point proposed by the secant,
moved a little toward the middle, and held so near to the middle that no edge ever takes more than
six steps more than bisection would. Smooth functions take eight to ten steps.
"""

from collections.abc import Callable

import numpy as np

from ..arrays import Values

HALVINGS = 40  # the root is known to this power of a half, in parts of the edge
SLACK = (
    6  # steps that may be spent beyond those of bisection (n0 of the paper); one is often too few
)
TRUNCATION = 0.2  # kappa_1 of the paper, for brackets of length one; kappa_2 is 2


def edge_roots(
    value_at: Callable[[np.ndarray, Values], Values], low: Values, high: Values, level: float
) -> Values:
    """Return where edges cross the level, as fractions of them.

    Parameters
    ----------
    value_at : callable
        (m,) edge numbers and (m,) fractions to (m,) values.
    low, high : (n,) float64
        Values at fractions 0 and 1: of each edge, one is below the level and one not.
    level : float
        In the unit of the values.

    Notes
    -----
    Accuracy: within ``2**-41`` of the edge there are a point below the level and one that is not.
    Values that are not finite count as not below (+inf, NaN) or below (-inf), and nothing more.
    """
    out = np.where(low == level, 0.0, 1.0)  # right where an end is at the level
    edge = np.flatnonzero((low != level) & (high != level))
    sign = np.where(low[edge] < level, 1.0, -1.0)  # of the rise from one end to the other
    bracket = np.zeros(len(edge)), np.ones(len(edge))
    height = sign * (low[edge] - level), sign * (high[edge] - level)
    for step in range(HALVINGS + SLACK):
        at = _propose(*bracket, *height, 0.5 ** (step + 1 - SLACK))
        value = value_at(edge, at)
        out[edge] = at
        is_low = (value < level) == (sign > 0)
        g = sign * (value - level)
        a, b = np.where(is_low, at, bracket[0]), np.where(is_low, bracket[1], at)
        ga, gb = np.where(is_low, g, height[0]), np.where(is_low, height[1], g)
        is_missed = value != level
        out[edge[is_missed]] = 0.5 * (a + b)[is_missed]
        is_open = is_missed & (b - a > 0.5**HALVINGS)
        edge, sign = edge[is_open], sign[is_open]
        bracket, height = (a[is_open], b[is_open]), (ga[is_open], gb[is_open])
        if len(edge) == 0:
            break
    return out


def _propose(a: Values, b: Values, ga: Values, gb: Values, left: float) -> Values:
    """The next point of each bracket, so that no more than the length ``left`` remains."""
    middle = 0.5 * (a + b)
    # Interpolate
    with np.errstate(invalid="ignore", over="ignore"):
        secant = (gb * a - ga * b) / (gb - ga)
    secant = np.where(np.isfinite(secant), secant, middle)
    # Truncate: move toward the middle, and by enough to have the root behind when it is that near
    shift = np.maximum(TRUNCATION * (b - a) ** 2, 0.5 ** (HALVINGS + 1))
    to_middle = middle - secant
    moved = np.where(shift <= np.abs(to_middle), secant + np.copysign(shift, to_middle), middle)
    # Project onto the points that leave short enough brackets
    reach = np.maximum(left - 0.5 * (b - a), 0.0)
    return np.clip(moved, middle - reach, middle + reach)
