"""Cells whose sign pattern leaves open what they hold: decide them, and number what they add."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, Int64

from ..arrays import Ijk
from ..kernels.special_cells import place_centers
from ..progress import Progress, silent
from .brick_field import in_ranges
from .cell_decider import Decision, decide_cells
from .trilinear_cases import CellCases

NODES_PER_CELL = 64  # deciding a cell takes about as long as counting so many nodes
CELLS_AT_ONCE = 2**15  # a few megabytes of intermediate numbers


@dataclass(frozen=True, eq=False)
class SpecialCells:
    """Cells in the order in which they are met, and what was decided.

    Attributes
    ----------
    cells : (s, 3) int64
        Lowest node of each.
    values : (s, 8) float64
        At its corners, in the order of `CORNERS`.
    decision : Decision
        Row of triangles of each, and whether it is singular.
    n_faces, n_centers : (s,) int64
        Faces of each, and vertices within.
    """

    cells: Ijk
    values: Float64[np.ndarray, "s 8"]
    decision: Decision
    n_faces: Int64[np.ndarray, " s"]
    n_centers: Int64[np.ndarray, " s"]

    def per_group(self, counts: np.ndarray, first: np.ndarray) -> np.ndarray:
        """Sum counts over the cells ``first[g]: first[g + 1]`` of each group."""
        total = np.concatenate([[0], np.cumsum(counts)])
        return np.diff(total[first])

    def centers(self, place: np.ndarray, cases: CellCases) -> Float64[np.ndarray, "n 3"]:
        """Positions of the vertices within; ``place`` as for `place_centers`."""
        start = np.concatenate([[0], np.cumsum(self.n_centers)])
        points = np.empty((int(start[-1]), 3))
        place_centers(
            self.values, self.decision.rows, cases.center_edges, self.cells, place, start, points
        )
        return points


def decide_special_cells(
    cells: np.ndarray,
    values: np.ndarray,
    level: float,
    cases: CellCases,
    progress: Progress = silent,
) -> SpecialCells:
    """Decide every cell."""
    rows = np.empty(len(cells), np.int16)
    is_singular = np.empty(len(cells), bool)

    def decide(start: int, stop: int) -> None:
        for low in range(start, stop, CELLS_AT_ONCE):
            part = slice(low, min(low + CELLS_AT_ONCE, stop))
            decision = decide_cells(values[part], level, cases)
            rows[part], is_singular[part] = decision.rows, decision.is_singular

    in_ranges(decide, len(cells), "deciding", progress, nodes_per_item=NODES_PER_CELL)
    n_faces, n_centers = (n[rows].astype(np.int64) for n in (cases.n_triangles, cases.n_centers))
    return SpecialCells(cells, values, Decision(rows, is_singular), n_faces, n_centers)
