"""Marching squares on rows as they come: the state between two of them.

Only the last row and the chains that are not finished are kept.
"""

from fractions import Fraction

import numpy as np

from ..kernels.marching_squares import (
    FINISHED,
    FREE,
    classify_nodes,
    collect,
    retire_row,
    trace_rows,
)
from ..kernels.square_decider import (
    ANTIDIAGONAL,
    APART,
    BILINEAR,
    DIAGONAL,
    JOINED,
    MEAN,
    UNDECIDED,
    classify_squares,
)
from .curves import Curves

RULES = {
    "bilinear": BILINEAR,
    "mean": MEAN,
    "diagonal": DIAGONAL,
    "antidiagonal": ANTIDIAGONAL,
}
ZEROS = ("outside", "nudge", "snap")


class SquareRows:
    """Takes rows of a grid in order and gives back the curves that they finish."""

    def __init__(
        self,
        n_columns: int,
        *,
        level: float,
        voxel_size: float,
        origin: np.ndarray,
        alternating: str,
        zeros: str,
    ) -> None:
        self.level = level
        self.rule = RULES[alternating]
        self.zeros = zeros
        self.place = np.array([level, voxel_size, *origin], float)
        self.n_rows = 0
        # The last row: values, side of the level, whether it is at the level
        self.values = np.empty((0, n_columns))
        self.sides = np.empty((0, n_columns), np.uint8)
        self.at_level = np.empty((0, n_columns), bool)
        # Vertices on the edges along the last row, and the pool they live in
        self.on_row = np.full(n_columns - 1, -1, np.int64)
        self.after = np.empty(0, np.int64)
        self.is_entered = np.empty(0, bool)
        self.end = np.empty(0, np.int64)
        self.edge = np.empty(0, np.int64)
        self.points = np.empty((0, 2))
        self.free = np.empty(0, np.int64)
        self.finished = np.empty((0, 2), np.int64)
        self.counts = np.zeros(2, np.int64)

    def feed(self, rows: np.ndarray) -> Curves:
        """Take (r, n) more values; return the curves that closed or ended in the new squares."""
        n_kept, n_columns = self.values.shape
        values = np.concatenate([self.values, rows], dtype=np.float64)
        sides = np.concatenate([self.sides, np.empty(rows.shape, np.uint8)])
        at_level = np.concatenate([self.at_level, np.empty(rows.shape, bool)])
        classify_nodes(values, self.level, self.zeros != "outside", n_kept, sides, at_level)
        cases = np.empty((len(values) - 1, n_columns - 1), np.uint8)
        if classify_squares(values, sides, self.level, self.rule, cases):
            self._decide_the_rest(values, cases)
        self._make_room((2 * n_columns - 1) * len(values))
        trace_rows(
            cases, values, at_level, self.zeros == "snap", self.n_rows - n_kept, self.place,
            self.on_row, np.empty_like(self.on_row), np.empty(n_columns, np.int64), self.after,
            self.is_entered, self.end, self.edge, self.points, self.free, self.finished,
            self.counts,
        )  # fmt: skip
        self.n_rows += len(rows)
        self.values, self.sides = values[-1:].copy(), sides[-1:].copy()
        self.at_level = at_level[-1:].copy()
        return self._collect()

    def finish(self) -> Curves:
        """Return the curves that end on the last row."""
        beyond = 2 * self.n_rows * self.values.shape[1]
        retire_row(
            self.on_row, beyond, self.after, self.is_entered, self.end, self.edge, self.finished,
            self.counts,
        )  # fmt: skip
        return self._collect()

    def _decide_the_rest(self, values: np.ndarray, cases: np.ndarray) -> None:
        for i, j in np.argwhere(cases >> 4 == UNDECIDED):
            square = values[i : i + 2, j : j + 2]
            corners = square[0, 0], square[1, 0], square[1, 1], square[0, 1]
            verdict = decide_exactly(corners, self.level, self.rule)
            cases[i, j] = (cases[i, j] & 15) | verdict << 4

    def _make_room(self, n_new: int) -> None:
        """Let the pool have at least ``n_new`` unused vertices."""
        n_old, n_free = len(self.after), int(self.counts[FREE])
        if n_free >= n_new:
            return
        n_more = max(n_new - n_free, n_old)
        for name in ("after", "is_entered", "end", "edge", "points", "free", "finished"):
            old = getattr(self, name)
            more = np.empty((n_more, *old.shape[1:]), old.dtype)
            setattr(self, name, np.concatenate([old, more]))
        self.free[n_free : n_free + n_more] = np.arange(n_old, n_old + n_more)
        self.counts[FREE] += n_more

    def _collect(self) -> Curves:
        n_chains = int(self.counts[FINISHED])
        n_used = len(self.after) - int(self.counts[FREE])  # no fewer than the chains' vertices
        points, names = np.empty((n_used, 2)), np.empty(n_used, np.int64)
        offsets, is_closed = np.empty(n_chains + 1, np.int64), np.empty(n_chains, bool)
        n_curves = collect(
            self.after, self.edge, self.points, self.free, self.finished, self.counts,
            points, names, offsets, is_closed,
        )  # fmt: skip
        n_points = offsets[n_curves]
        node, axis = np.divmod(names[:n_points], 2)
        edges = np.stack([*np.divmod(node, self.values.shape[1]), axis], axis=1)
        return Curves(
            points[:n_points].copy(), edges, offsets[: n_curves + 1], is_closed[:n_curves]
        )


def decide_exactly(corners: tuple[float, ...], level: float, rule: int) -> int:
    """Whether the inside corners of an alternating square are JOINED or APART, in fractions.

    An infinite corner stands for one number larger than all others: 2**5000 outweighs any product
    of float64 numbers with any other.
    """
    a, b, c, d = (_fraction(float(corner)) - Fraction(level) for corner in corners)
    if rule == MEAN:
        return JOINED if a + b + c + d < 0 else APART
    saddle = a * c - b * d if a < 0 else b * d - a * c
    return JOINED if saddle > 0 else APART


def _fraction(value: float) -> Fraction:
    if np.isinf(value):
        return Fraction(2**5000 if value > 0 else -(2**5000))
    return Fraction(value)
