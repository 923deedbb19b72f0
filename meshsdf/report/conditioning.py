"""How sure is the place of a level set: its least gradient, and what a change of samples does.

Close functions need not have close level sets: where F rises steeply its level set stays put, on
a flat beach it wanders. A change of the samples by delta moves it by about delta / |gradient F|
within a cell. Where cells meet, slopes may cancel that are steep in each, and the bound for a given
change (`level_shift`) may be larger.
"""

from dataclasses import dataclass
from math import inf

import numpy as np

from ..arrays import Number, Values, Vector3
from ..errors import ReportError
from ..grid import Grid, NarrowBand
from ..kernels.gradient_bounds import bound_gradients
from .crossing_cells import crossing_cells, node_blocks, place_of_nodes
from .enclosure import Enclosure, ceil_digits, floor_digits
from .level_shift import Displacement, level_shift
from .zero_set import in_tasks

RELATIVE_TOLERANCE = 1e-2  # of the least gradient: two digits of a warning are enough
ABSOLUTE_TOLERANCE = 1e-6  # of the largest gradient, for points where it vanishes
DEEPEST = 24  # times that a cell is cut in eight
MAX_BOXES = 2**20  # more open boxes are not cut; a gradient may vanish along whole lines
FLAT = 0.1  # of the steepest gradient at a corner of a crossed cell: fair to call flat

_OFFSETS = np.indices((2, 2, 2)).reshape(3, 8).T.astype(np.int64)


@dataclass(frozen=True, eq=False)
class Conditioning:
    """How far the level set of a volume's trilinear interpolant F may be trusted.

    Attributes
    ----------
    least_gradient : Enclosure
        Holds the least |gradient of F| on the level set, value per world unit: of distances it is
        1, or less where F rounds off what distances are not smooth at. Where cells meet, F has
        a gradient from each side, and all count.
    where : (3,) float64
        A point of the level set where the gradient is ``least_gradient.upper`` at most.
    steepest : float
        The largest gradient at the corners of the cells that the level set enters.
    n_cells : int
        Number of those cells.
    volume, level
        As given.
    """

    least_gradient: Enclosure
    where: Vector3
    steepest: float
    n_cells: int
    volume: NarrowBand | Grid
    level: float

    @property
    def is_flat(self) -> bool:
        """Whether somewhere on the level set F rises ten times slower than where it is steepest."""
        return self.least_gradient.upper < FLAT * self.steepest

    def displacement(self, delta: Number) -> float:
        """Bound how far the level set moves if every sample changes by ``delta`` at most.

        World units; infinite if nothing bounds it. `displacement_at` also says where and why.
        """
        found = self.displacement_at(delta).upper
        return inf if found is None else found

    def displacement_at(self, delta: Number) -> Displacement:
        """Bound how far the level set moves if every sample changes by ``delta`` at most.

        Whatever the change: each point of the old level set is within the bound of the new one,
        and the other way round. In the unit of the values; see `level_shift`.

        Raises
        ------
        ReportError
            The change is negative or not finite.
        """
        if not 0 <= delta < inf:
            what, fix = f"the change is {delta:g}", "pass a finite number, 0 or more"
            raise ReportError(what, "Conditioning.displacement(delta=...)", fix)
        return level_shift(self.volume, self.level, delta)

    def describe(self) -> str:
        """Return one or two sentences for people."""
        low, high = self.least_gradient.lower, self.least_gradient.upper
        place = ", ".join(f"{x:.6g}" for x in self.where)
        known = f"between {floor_digits(low, 3)} and {ceil_digits(high, 3)}"
        first = f"The least gradient on the level set is {known}, near ({place})"
        if low > 0:
            first += ": within a cell a small change of the samples moves it by up to "
            first += f"{ceil_digits(1 / low, 3)} times as much."
        else:
            first += ": no multiple of a change of the samples bounds how far it moves there."
        if self.is_flat:
            share = ceil_digits(high / self.steepest, 2)
            first += " It is badly conditioned: where it is steepest, the gradient is "
            first += f"{floor_digits(self.steepest, 3)}, and here at most {share} of that."
        return first

    def to_json(self) -> dict:
        """Return plain types; None for what is infinite."""
        ends = (self.least_gradient.lower, self.least_gradient.upper)
        lower, upper = (end if np.isfinite(end) else None for end in ends)
        return {
            "level": self.level,
            "least_gradient": {"lower": lower, "upper": upper},
            "where": self.where.tolist(),
            "steepest": self.steepest,
            "n_cells": self.n_cells,
            "is_flat": self.is_flat,
        }


def conditioning(volume: NarrowBand | Grid, level: Number = 0.0) -> Conditioning:
    """Enclose the least gradient of a volume's trilinear interpolant on a level set.

    Parameters
    ----------
    volume : NarrowBand or Grid
        Samples of any function. NaN means no data.
    level : float
        In the unit of the values.

    Raises
    ------
    ReportError
        No value crosses the level, or the level makes no sense for the volume.

    Notes
    -----
    Accuracy: the interval holds the least gradient in exact arithmetic on the samples as stored;
    its width is a hundredth of that, or a millionth of the largest gradient, unless the gradient
    vanishes along lines: then the search may stop earlier, at ``MAX_BOXES`` boxes, and the
    interval is wider.
    Cost: time and memory grow with the cells that the level set enters.

    Examples
    --------
    >>> x = np.indices((9, 3, 3))[0] - 4.2
    >>> print(conditioning(Grid(x, 1.0, np.zeros(3))).least_gradient)
    [0.999999, 1.00001]
    >>> beach = conditioning(Grid(0.01 * x**3, 1.0, np.zeros(3)))
    >>> print(beach.least_gradient)  # between the nodes at -0.2 and 0.8
    [0.00519999, 0.00520001]
    >>> round(beach.displacement(0.001), 6)  # 0.001 / 0.0052
    0.192308
    """
    cells = crossing_cells(volume, level)
    if len(cells) == 0:
        what, fix = f"no value crosses the level {level:g}", "pass a level between the values"
        raise ReportError(what, "conditioning(volume, level=...)", fix)
    blocks = node_blocks(volume, cells, 0, level)
    steepest = float(_steepest(blocks).max())
    ends, cell, point = _least_gradient(blocks, steepest)
    place = place_of_nodes(volume)
    where = place[0] * (cells[cell] + point) + place[1:]
    least = ends.scaled(1.0 / volume.voxel_size)
    return Conditioning(
        least, where, steepest / volume.voxel_size, len(cells), volume, float(level)
    )


def _least_gradient(blocks: np.ndarray, steepest: float) -> tuple[Enclosure, int, Values]:
    """Per voxel; the cell and the place in it where the upper end is attained."""
    cell, lows = np.arange(len(blocks)), np.zeros((len(blocks), 3), np.int64)
    lowest, best, at, place = inf, inf, 0, np.full(3, 0.5)
    for depth in range(DEEPEST + 1):
        lower, upper = np.empty(len(cell)), np.empty(len(cell))
        points = np.empty((len(cell), 3))
        boxes, ends = (blocks, cell, lows, 0.5**depth), (lower, upper, points)

        def work(begin: int, end: int, boxes=boxes, ends=ends) -> None:
            bound_gradients(*boxes, begin, end, *ends)

        in_tasks(work, len(cell))
        least = int(upper.argmin())
        if upper[least] < best:
            best, at, place = float(upper[least]), int(cell[least]), points[least]
        enough = best - max(RELATIVE_TOLERANCE * best, ABSOLUTE_TOLERANCE * steepest)
        is_open = lower < (enough if best < inf else inf)
        is_last = depth == DEEPEST or 8 * np.count_nonzero(is_open) > MAX_BOXES
        closed = lower if is_last else lower[~is_open]
        lowest = min(lowest, float(closed.min(initial=inf)))
        if is_last or not is_open.any():
            break
        cell = np.repeat(cell[is_open], 8)
        lows = (2 * lows[is_open][:, None, :] + _OFFSETS).reshape(-1, 3)
    return Enclosure(min(lowest, best), best), at, place


def _steepest(blocks: np.ndarray) -> Values:
    """(n,) largest gradient at a corner of each cell, per voxel."""
    squares = np.zeros(blocks.shape)
    for axis in (1, 2, 3):
        squares += np.diff(blocks, axis=axis) ** 2  # the same on both ends of an edge
    return np.sqrt(squares.max(axis=(1, 2, 3)))
