"""Marching squares: the curves where a plane grid takes one value.

The plane's version of Lorensen and Cline 1987 (doi:10.1145/37401.37422), with the alternating
square decided by a choice of rules and without any tolerance.
"""

from collections.abc import Iterable, Iterator
from typing import Literal

import numpy as np
from jaxtyping import Float

from ..arrays import Number, Vector2
from ..errors import SurfaceError
from .curves import Curve, Curves
from .square_rows import RULES, ZEROS, SquareRows

Alternating = Literal["bilinear", "mean", "diagonal", "antidiagonal"]
Zeros = Literal["outside", "nudge", "snap"]

NODES_PER_BLOCK = 2**16  # rows are taken together up to this many nodes, so that they stay in cache


def marching_squares(
    values: Float[np.ndarray, "i j"],
    *,
    level: Number = 0.0,
    voxel_size: Number = 1.0,
    origin: Vector2 | None = None,
    alternating: Alternating = "bilinear",
    zeros: Zeros = "outside",
) -> Curves:
    """Extract the curves ``value = level``, with the smaller values on their left.

    Parameters
    ----------
    values : (ni, nj) float32 or float64
        Values at the nodes ``origin + voxel_size * (i, j)``, at least 2 along each axis. NaN
        means no data: a square with such a corner holds nothing, and curves end there.
    level : float
        In the unit of the values.
    voxel_size : float
        World units.
    origin : (2,) float64 or None
        World position of node (0, 0); None for zero.
    alternating : {"bilinear", "mean", "diagonal", "antidiagonal"}
        What joins two opposite corners of a square whose signs alternate: the sign of the bilinear
        interpolant's saddle point; the sign of the mean of the four corners; or a diagonal,
        which always joins (i, j) to (i + 1, j + 1), or (i + 1, j) to (i, j + 1).
    zeros : {"outside", "nudge", "snap"}
        What a node exactly at the level counts as. "outside"; or, with "nudge", as a node whose
        value differs from the level by 1/1024 of its neighbour's (the neighbour before its run of
        such nodes in the row, else the one after, else the one in the row before; outside if
        there is none). With "snap" the vertices on its edges then move back to the node, or to
        the middle of the edge where both of its ends are at the level.

    Returns
    -------
    curves : Curves
        In the order in which a walk through the rows finishes them. Closed ones start at the
        point with the least name, open ones run from border (or missing data) to border.

    Raises
    ------
    SurfaceError
        Level or origin is not finite, voxel_size is not a positive number, an axis has fewer than 2
        nodes, or a choice is none of those listed.

    Notes
    -----
    Promise: whatever the values, every point inside the grid is on two pieces, one coming and
    one going; no piece has length zero, because points that follow each other at one place become
    one, with the least of their names or an open curve's end's (a curve of one place only is left
    out). Curves meet or
    overlap only at nodes at the level, or where rounding moves crossings to one place.
    A tie of the bilinear rule or the mean, decided without rounding error, leaves the inside
    corners apart, as a point at the level counts as outside. Infinite values count as equally
    large, and cross the level at mid-edge.
    Accuracy: a point lies on a grid edge where linear interpolation puts it, to rounding of
    float64. For exact distances to a curve of curvature up to kappa it is no farther from that
    curve than ``voxel_size**2 / 8 * kappa / (1 - voxel_size * kappa)``.
    Cost: O(nodes) time; memory for the values of some rows, and for the curves.

    References
    ----------
    W. E. Lorensen and H. E. Cline, "Marching cubes", 1987, doi:10.1145/37401.37422.
    G. M. Nielson and B. Hamann, "The asymptotic decider", 1991, doi:10.1109/VISUAL.1991.175782.

    Examples
    --------
    >>> i, j = np.indices((9, 9)) - 4.0
    >>> curves = marching_squares(np.hypot(i, j) - 3.0)
    >>> [(curve.is_closed, len(curve.points)) for curve in curves]
    [(True, 20)]
    >>> round(curves[0].signed_area, 1)  # a circle's is 28.3
    27.6
    """
    state = _start(values.shape[1], level, voxel_size, origin, alternating, zeros)
    if len(values) < 2:
        raise _too_small(values.shape)
    step = max(1, NODES_PER_BLOCK // values.shape[1])
    parts = [state.feed(values[i : i + step]) for i in range(0, len(values), step)]
    parts.append(state.finish())
    first = np.cumsum([0] + [len(part.points) for part in parts[:-1]])
    ends = [n + part.offsets[1:] for n, part in zip(first, parts, strict=True)]
    return Curves(
        np.concatenate([part.points for part in parts]),
        np.concatenate([part.edges for part in parts]),
        np.concatenate([np.zeros(1, np.int64), *ends]),
        np.concatenate([part.is_closed for part in parts]),
    )


def marching_squares_rows(
    rows: Iterable[np.ndarray],
    *,
    level: Number = 0.0,
    voxel_size: Number = 1.0,
    origin: Vector2 | None = None,
    alternating: Alternating = "bilinear",
    zeros: Zeros = "outside",
) -> Iterator[Curve]:
    """Extract the curves of a grid that comes row by row, each as soon as it closes or ends.

    Parameters
    ----------
    rows : iterable of (nj,) float32 or float64
        Row i holds the values at the nodes ``origin + voxel_size * (i, j)``. At most two rows are
        held at a time, beside the curves that are not finished.
    level, voxel_size, origin, alternating, zeros
        As for `marching_squares`.

    Yields
    ------
    curve : Curve
        The curves of `marching_squares`, bit for bit and in the same order.

    Raises
    ------
    SurfaceError
        As for `marching_squares`; or a row is not one-dimensional, has not as many values as the
        first, or is not of float32 or float64.

    Examples
    --------
    >>> rows = ((np.hypot(i, np.arange(-4.0, 5.0)) - 3.0) for i in range(-4, 5))
    >>> [round(curve.length, 1) for curve in marching_squares_rows(rows)]
    [18.7]
    """
    # Judged now rather than at the first curve
    _start(2, level, voxel_size, origin, alternating, zeros)
    return _walk(rows, (level, voxel_size, origin, alternating, zeros))


def _walk(rows: Iterable[np.ndarray], choices: tuple) -> Iterator[Curve]:
    state = None
    for i, row in enumerate(rows):
        if state is None:
            _check_row(i, row, None)
            state = _start(len(row), *choices)
        else:
            _check_row(i, row, state.values.shape[1])
        found = state.feed(row[None])
        del row  # the caller's: not held while curves are looked at
        yield from found
    if state is None or state.n_rows < 2:
        raise _too_small((0, 0) if state is None else (1, state.values.shape[1]))
    yield from state.finish()


def _start(
    n_columns: int,
    level: Number,
    voxel_size: Number,
    origin: Vector2 | None,
    alternating: str,
    zeros: str,
) -> SquareRows:
    """Check what was asked for, and begin."""
    for name, value, known in (
        ("alternating", alternating, tuple(RULES)),
        ("zeros", zeros, ZEROS),
    ):
        if value not in known:
            raise SurfaceError(
                f"{name} is {value!r}", f"marching_squares({name}=...)", f"pass one of {known}"
            )
    origin = np.zeros(2) if origin is None else origin
    for name, value in (("level", level), ("origin", origin)):
        if not np.isfinite(value).all():
            raise SurfaceError(
                f"{name} is {value}", f"marching_squares({name}=...)", "pass finite numbers"
            )
    if not (np.isfinite(voxel_size) and voxel_size > 0):
        raise SurfaceError(
            f"voxel_size is {voxel_size}",
            "marching_squares(voxel_size=...)",
            "pass a length above 0",
        )
    if n_columns < 2:
        raise _too_small(("any", n_columns))
    return SquareRows(
        n_columns,
        level=float(level),
        voxel_size=float(voxel_size),
        origin=origin,
        alternating=alternating,
        zeros=zeros,
    )


def _check_row(i: int, row: np.ndarray, n_columns: int | None) -> None:
    where = "marching_squares_rows(rows=...)"
    if not isinstance(row, np.ndarray) or row.dtype not in (np.float32, np.float64):
        kind = row.dtype if isinstance(row, np.ndarray) else type(row).__name__
        raise SurfaceError(f"row {i} holds {kind}", where, "pass arrays of float32 or float64")
    if row.ndim != 1 or (n_columns is not None and len(row) != n_columns):
        expected = "(n,)" if n_columns is None else f"({n_columns},)"
        raise SurfaceError(
            f"row {i} has the shape {row.shape}, expected {expected}",
            where,
            "pass one-dimensional rows of one length",
        )


def _too_small(shape: tuple) -> SurfaceError:
    return SurfaceError(
        f"the grid has {' x '.join(map(str, shape))} nodes, so it has no square",
        "marching_squares(values=...)",
        "pass at least 2 nodes along each axis",
    )
