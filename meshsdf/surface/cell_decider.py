"""What the trilinear interpolant does in a cell whose signs leave that open, decided exactly.

f stands for value - level. Every decision is taken for f + e with a positive e smaller than all
numbers (simulation of simplicity): as for a node, "exactly at the level" means outside. The
level set of f + e has no singular point, so it is a manifold in every cell and across all faces.

*Faces.* Corners a, b, c, d go around a face, a and c of one sign, b and d of the other. The saddle
of the bilinear interpolant has the sign of a and c where ``a c > b d`` (Nielson and Hamann 1991,
doi:10.1109/VISUAL.1991.175782).

*Tunnels.* Along the third axis the four columns of corners run through linear functions a, b, c, d
of the height. With t = height / (1 - height), and up to a positive factor, ``a = a0 + a1 t``. The
plane at t joins a and c if they are positive, b and d negative and
``q(t) = a c - b d = q0 + q1 t + q2 t^2 >= 0``. Two outside regions that the cell's faces keep apart
meet in the interior if and only if such a plane joins two columns of theirs, a and c. There is an
interval of heights on which both are positive. On all of it b and d are negative: else a and c
would hang together around b or d on the faces. At both ends of it q is negative: an end is a cell
face, which keeps them apart, or a or c is 0 there. So q must have two roots in the interval. With
the interval mapped to t = 0 ... infinity, the first and last coefficients are negative, and two
roots mean: the middle coefficient is positive, and the discriminant, which up to a square is the
hyperdeterminant of the eight corners (Cayley 1845), is not negative. The same for -f tells
whether inside regions meet. Everything asked for is thus the sign of a polynomial.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64, Int16

from .cube_cases import FACES
from .rounded import (
    Numbers,
    Rounded,
    above_ties,
    choose,
    constant,
    rounded_differences,
    sign,
    whole_differences,
)
from .trilinear_cases import COLUMNS, TUNNELS, CellCases

_BITS = 1 << np.arange(8)


@dataclass(frozen=True, eq=False)
class Decision:
    """What some cells hold.

    Attributes
    ----------
    rows : (s,) int16
        Rows of `CellCases`.
    is_singular : (s,) bool
        A saddle point, within an alternating face or within the cell, lies exactly at the level
        where the answer hangs on it.
    """

    rows: Int16[np.ndarray, " s"]
    is_singular: Bool[np.ndarray, " s"]


def decide_cells(values: Float64[np.ndarray, "s 8"], level: float, cases: CellCases) -> Decision:
    """Decide cells given by the values at their corners, in the order of `CORNERS`.

    Infinite corners leave the interpolant without meaning: faces with one keep the inside apart,
    and the cell has no tunnel.
    """
    inside = values < level
    is_singular = np.zeros(len(values), bool)
    joined = np.zeros(len(values), np.int64)
    for n, face in enumerate(FACES):
        verdict, tie = _decide_face(values, level, inside, list(face))
        joined |= verdict << n
        is_singular |= tie
    pattern = (inside * _BITS).sum(axis=1)
    rows = cases.row[pattern, joined, 0]
    is_finite = np.isfinite(values).all(axis=1)
    for number, (m, from_inside) in enumerate(TUNNELS, start=1):
        asked = np.flatnonzero((cases.row[pattern, joined, number] >= 0) & is_finite)
        if len(asked) == 0:
            continue
        has_tunnel, tie = _decide_tunnel(values[asked], level, inside[asked], m, from_inside)
        is_singular[asked] |= tie
        found = asked[has_tunnel]
        rows[found] = cases.row[pattern[found], joined[found], number]
    return Decision(rows, is_singular)


def _decide_face(
    values: np.ndarray, level: float, inside: np.ndarray, face: list[int]
) -> tuple[np.ndarray, np.ndarray]:
    """Whether the inside corners of a face are joined; whether that is a tie."""
    a, b, c, d = inside[:, face].T
    asked = np.flatnonzero(
        (a == c) & (b == d) & (a != b) & np.isfinite(values[:, face]).all(axis=1)
    )
    joined, tie = np.zeros((2, len(values)), bool)
    corners = values[asked][:, face]
    signs = _sign_of_saddle(rounded_differences(corners, level))
    is_open = signs == 0
    signs[is_open] = _sign_of_saddle(whole_differences(corners[is_open], level))
    joined[asked] = signs == np.where(a[asked], 1, -1)
    tie[asked] = signs == 0
    return joined.astype(np.int64), tie


def _sign_of_saddle(corners: list[Numbers]) -> np.ndarray:
    a, b, c, d = corners
    return sign(a * c - b * d)


def _decide_tunnel(
    values: np.ndarray, level: float, inside: np.ndarray, m: int, from_inside: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Whether columns m and m + 2 meet within the cells; whether that is a tie."""
    order = [COLUMNS[(m + n) % 4] for n in (0, 2, 1, 3)]
    is_wanted = [~(inside[:, list(column)].T ^ from_inside) for column in order[:2]]
    meets = _meet(rounded_differences(values, level), order, is_wanted, from_inside)[0]
    is_open = np.flatnonzero(meets == 0)
    tie = np.zeros(len(values), bool)
    if len(is_open):
        whole = whole_differences(values[is_open], level)
        wanted = [ends[:, is_open] for ends in is_wanted]
        meets[is_open], may_meet = _meet(above_ties(whole), order, wanted, from_inside)
        tie[is_open] = may_meet & (sign(_discriminant(_columns(whole, order, from_inside))) == 0)
    return meets > 0, tie


def _columns(
    corners: list[Numbers], order: list[tuple[int, int]], negative: bool
) -> list[tuple[Numbers, Numbers]]:
    """(lower, upper) of the columns a, c, b, d, so that a and c are wanted positive."""
    return [tuple(-corners[n] if negative else corners[n] for n in column) for column in order]


def _discriminant(columns: list[tuple[Numbers, Numbers]]) -> Numbers:
    a, c, b, d = columns
    first, last = a[0] * c[0] - b[0] * d[0], a[1] * c[1] - b[1] * d[1]
    middle = a[0] * c[1] + a[1] * c[0] - (b[0] * d[1] + b[1] * d[0])
    return middle * middle - constant(4, middle) * first * last


def _meet(
    corners: list[Numbers],
    order: list[tuple[int, int]],
    is_wanted: list[np.ndarray],
    negative: bool,
) -> tuple[np.ndarray, np.ndarray]:
    """1 where two columns meet, -1 where not, 0 where open; and whether they would but for the
    discriminant.

    ``is_wanted[n][x]`` says whether the lower (upper) end of column a (c) is positive.
    """
    columns = _columns(corners, order, negative)
    a, c = columns[:2]
    (a_low, a_high), (c_low, c_high) = is_wanted
    # The root of a lies above that of c where this is negative and both rise to it, ...
    above = sign(a[0] * c[1] - a[1] * c[0])
    zero, one = constant(0, a[0]), constant(1, a[0])
    # Lower end of the interval: 0, or the higher of the roots where a or c becomes positive
    from_a = ~a_low & (c_low | (above < 0))
    from_c = ~c_low & ~from_a
    low = [choose(from_a, a[x], choose(from_c, c[x], (zero, one)[x])) for x in range(2)]
    # Upper end: infinity, or the lower of the roots where a or c stops being positive
    to_a = ~a_high & (c_high | (above > 0))
    to_c = ~c_high & ~to_a
    high = [choose(to_a, a[x], choose(to_c, c[x], (one, zero)[x])) for x in range(2)]
    exists = np.ones(len(above), np.int8)
    exists = np.where(~a_low & ~c_high, -above, exists)  # c must not stop before a begins
    exists = np.where(~c_low & ~a_high, above, exists)
    # Columns at both ends of the interval, up to positive factors
    at_low = [y[0] * low[1] - y[1] * low[0] for y in columns]
    at_high = [y[1] * high[0] - y[0] * high[1] for y in columns]
    middle = at_low[0] * at_high[1] + at_low[1] * at_high[0]
    middle = sign(middle - (at_low[2] * at_high[3] + at_low[3] * at_high[2]))
    discriminant = sign(_discriminant(columns))
    if isinstance(a[0], Rounded):  # then the order of the roots may be open, and the interval
        unknown = (a_low != a_high) & (c_low != c_high) & (above == 0)
        exists, middle = np.where(unknown, 0, exists), np.where(unknown, 0, middle)
    return np.minimum(np.minimum(exists, middle), discriminant), (exists > 0) & (middle > 0)
