"""How far a level set can move when samples change: certified, cell by cell."""

from dataclasses import dataclass
from math import inf

import numpy as np

from ..arrays import Number, Vector3
from ..grid import Grid, NarrowBand
from ..kernels.level_shift import EMPTY, OPEN, bound_shifts
from .crossing_cells import cells_near_level, node_blocks, place_of_nodes
from .zero_set import in_tasks

DEEPEST = 16  # times that a cell is cut in eight before its surroundings are asked
MAX_BOXES = 2**17  # more open boxes are not cut: where nothing rises, cutting does not help
CELLS_AT_ONCE = 2**15
RINGS = 3  # of cells around a cell that are searched for values on both sides
CELLS_OF_RINGS_AT_ONCE = 2**11

_OFFSETS = np.indices((2, 2, 2)).reshape(3, 8).T.astype(np.int64)


@dataclass(frozen=True, eq=False)
class Displacement:
    """How far a level set can move when samples change.

    Attributes
    ----------
    upper : float or None
        World units: whatever the change, each point of the old level set is within it of the new
        one, and the other way round. None if nothing of the kind is proved.
    where : (3,) float64 or None
        Centre of the cell that needs it, or of the first one for which nothing is proved; None if
        no value comes so near to the level.
    why : str
        The reason, in words.
    """

    upper: float | None
    where: Vector3 | None
    why: str


def level_shift(volume: NarrowBand | Grid, level: Number, delta: Number) -> Displacement:
    """Bound how far the level set moves when every sample changes by ``delta`` at most.

    Parameters
    ----------
    volume : NarrowBand or Grid
        Its trilinear interpolant is meant.
    level, delta : float
        In the unit of the values; delta is not negative.

    Notes
    -----
    Accuracy: where the interpolant rises by m per unit of length over a box, along one direction,
    the bound is delta / m (`kernels.level_shift`), with boxes from a cell down to 2**-16 of it, and
    paths that stay within the neighbouring cells. Elsewhere it is the distance from the cell to
    the nearest nodes that remain on either side of the level, up to three cells further, which is
    true but up to a cell's diagonal too large.
    """
    if delta == 0:
        return Displacement(0.0, None, "nothing changes")
    if isinstance(volume, NarrowBand) and abs(level) + delta >= volume.background:
        why = f"a change of {delta:g} spans the band, whose values end at {volume.background:g}"
        return Displacement(None, None, why)
    cells = cells_near_level(volume, level, delta)
    largest, at = 0.0, None
    for start in range(0, len(cells), CELLS_AT_ONCE):
        some = cells[start : start + CELLS_AT_ONCE]
        shifts = _shifts(volume, some, float(level), float(delta))
        if shifts.max() > largest:
            largest, at = float(shifts.max()), some[int(shifts.argmax())]
    if at is None:
        return Displacement(0.0, None, "no value comes so near to the level")
    place = place_of_nodes(volume)
    where = place[0] * (at + 0.5) + place[1:]
    if largest == inf:
        why = (
            f"values within {delta:g} of the level surround this place: "
            "a piece of the surface may vanish there, or appear"
        )
        return Displacement(None, where, why)
    why = "here the values change least with the place"
    return Displacement(largest * volume.voxel_size * (1.0 + 1e-12), where, why)


def _shifts(volume: NarrowBand | Grid, cells: np.ndarray, level: float, delta: float) -> np.ndarray:
    """(n,) bound of each cell, in voxels; infinite where nothing is proved."""
    blocks = node_blocks(volume, cells, 1, level)
    shifts = np.zeros(len(cells))
    cell, lows = np.arange(len(cells)), np.zeros((len(cells), 3), np.int64)
    for depth in range(DEEPEST + 1):
        state, shift = np.empty(len(cell), np.uint8), np.zeros(len(cell))
        boxes = blocks, cell, lows, 0.5**depth, delta

        def work(begin: int, end: int, boxes=boxes, state=state, shift=shift) -> None:
            bound_shifts(*boxes, begin, end, state, shift)

        in_tasks(work, len(cell))
        np.maximum.at(shifts, cell[state > EMPTY], shift[state > EMPTY])
        is_open = state == OPEN
        if depth == DEEPEST or not 0 < 8 * np.count_nonzero(is_open) <= MAX_BOXES:
            break
        cell = np.repeat(cell[is_open], 8)
        lows = (2 * lows[is_open][:, None, :] + _OFFSETS).reshape(-1, 3)
    failed = np.unique(cell[is_open])
    for start in range(0, len(failed), CELLS_OF_RINGS_AT_ONCE):
        some = failed[start : start + CELLS_OF_RINGS_AT_ONCE]
        found = _distance_to_both_sides(volume, cells[some], level, delta)
        shifts[some] = np.maximum(shifts[some], found)
    return shifts


def _distance_to_both_sides(
    volume: NarrowBand | Grid, cells: np.ndarray, level: float, delta: float
) -> np.ndarray:
    """Voxels from any point of a cell to nodes that stay below the level, and to such above it.

    On the way from one to the other both the old and the new values cross the level, and a ball
    around the point that holds both ends holds the way.
    """
    values = node_blocks(volume, cells, RINGS, level)
    known = np.isfinite(values)
    # A way from node to node needs a box without gaps: what a grid's border leaves is one
    layers = [known.any(axis=axes) for axes in ((2, 3), (1, 3), (1, 2))]
    filled = layers[0][:, :, None, None] & layers[1][:, None, :, None] & layers[2][:, None, None, :]
    has_gaps = (filled & ~known).any(axis=(1, 2, 3))
    along = np.arange(-RINGS, RINGS + 2)
    farther = np.maximum(np.abs(along), np.abs(along - 1)) ** 2
    way = np.sqrt(farther[:, None, None] + farther[:, None] + farther)
    with np.errstate(invalid="ignore"):
        below = np.where(values < -delta, way, inf).min(axis=(1, 2, 3))
        above = np.where(values >= delta, way, inf).min(axis=(1, 2, 3))
    return np.where(has_gaps, inf, np.maximum(below, above))
