"""The cells of a lattice that a surface enters, and the values at their corners.

Cells are entered one by one or across faces whose corners differ; every node is evaluated once,
and all that a wave of new cells needs in one call.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..arrays import Ijk, Ijk1, Number, Points, Values
from ..box import Box
from ..errors import SurfaceError
from ..implicit import Implicit
from ..kernels.continuation import (
    INSIDE,
    NO_DATA,
    OUTSIDE,
    classify_cells,
    enter,
    enter_corners,
    enter_neighbours,
    find_numbers,
    list_links,
    rehash,
)
from ..progress import Progress, silent
from .cube_cases import FACES

KEY_BITS = 62  # keys of nodes are int64
CELLS_PER_WAVE = 2**16  # more are cut into parts, so that memory is not asked for in advance
POINTS_PER_CALL = 2**20

_PATTERNS = np.arange(256)[:, None] >> np.array(FACES)[:, None] & 1  # (6, 256, 4)
MIXED_FACES = ((_PATTERNS.any(-1) & ~_PATTERNS.all(-1)).T @ (1 << np.arange(6))).astype(np.uint8)
"""(256,) uint8: bit ``2 axis + side`` is set where the corners of that face differ."""


@dataclass(frozen=True, eq=False)
class Lattice:
    """Nodes at ``voxel_size * (first + (i, j, k))``, and their int64 keys.

    Attributes
    ----------
    first : (3,) int64
        Index of the first node.
    shape : (3,) int64
        Nodes along each axis, at least 2.
    voxel_size : float
        World units.
    """

    first: Ijk1
    shape: Ijk1
    voxel_size: float

    @classmethod
    def over(cls, box: Box, voxel_size: Number, *, padding: int = 0) -> "Lattice":
        """Return the lattice whose cells cover a box, and so many more on every side.

        Raises
        ------
        SurfaceError
            There are 2^62 nodes or more, or they are so far away that their indices are not exact.
        """
        with np.errstate(over="ignore", invalid="ignore"):
            first = np.floor(box.lower / voxel_size) - padding
            last = np.maximum(np.ceil(box.upper / voxel_size), first + 1) + padding
            bits = np.log2(last - first + 1).sum()
        if not (bits < KEY_BITS and np.abs([first, last]).max() < 2.0**52):
            raise SurfaceError(
                f"a box of {box.size.tolist()} at {box.lower.tolist()} has too many cells of "
                f"{voxel_size:g}",
                "continue_surface(box=..., voxel_size=...)",
                "pass a smaller box, or a larger voxel_size",
            )
        first, last = first.astype(np.int64), last.astype(np.int64)
        return cls(first, last - first + 1, float(voxel_size))

    def indices(self, keys: np.ndarray) -> Ijk:
        """Return the (n, 3) indices of nodes by their keys."""
        return np.stack(np.unravel_index(keys, tuple(self.shape)), axis=1) + self.first

    def keys(self, indices: Ijk) -> np.ndarray:
        """Return the (n,) int64 keys of nodes that lie in the lattice."""
        return np.ravel_multi_index(tuple((indices - self.first).T), tuple(self.shape))

    def cells_among(self, indices: Ijk) -> np.ndarray:
        """Return which of (n, 3) indices are the lowest node of a cell of the lattice."""
        local = indices - self.first
        return ((local >= 0) & (local <= self.shape - 2)).all(axis=1)


class KeyTable:
    """Keys numbered in the order of entry."""

    def __init__(self) -> None:
        self.n = 0
        self.keys = np.empty(64, np.int64)
        self.slots = np.full(128, -1, np.int32)

    def reserve(self, n_more: int) -> None:
        """Have room for so many more keys."""
        n = self.n + n_more
        self.keys = grown(self.keys, n)
        if 2 * n > len(self.slots):
            self.slots = np.full(1 << (2 * n - 1).bit_length(), -1, np.int32)
            rehash(self.keys, self.n, self.slots)


class LatticeCells:
    """Cells entered so far, with their sign patterns; nodes so far, with their values."""

    def __init__(self, function: Implicit, level: float, lattice: Lattice) -> None:
        self.function = function
        self.level = level
        self.lattice = lattice
        self.cells, self.nodes = KeyTable(), KeyTable()
        self.corners = np.empty((0, 8), np.int32)  # nodes of each cell
        self.patterns = np.empty(0, np.uint8)  # of each cell; 0 where the surface does not enter
        self.values = np.empty(0)  # of each node
        self.sides = np.empty(0, np.uint8)
        self.n_spread = 0  # cells whose neighbours are entered

    def enter(self, keys: np.ndarray, progress: Progress = silent) -> None:
        """Enter cells, whether or not the surface enters them."""
        for start in range(0, len(keys), CELLS_PER_WAVE):
            progress("searching", start / len(keys))
            part = keys[start : start + CELLS_PER_WAVE]
            self.cells.reserve(len(part))
            first = self.cells.n
            self.cells.n = enter(part, self.cells.slots, self.cells.keys, first)
            self._complete(first)

    def grow(self, progress: Progress = silent) -> None:
        """Enter all cells that hang together with those entered, across faces that differ."""
        while self.n_spread < self.cells.n:
            progress("growing", self.n_spread / self.cells.n)
            start, first = self.n_spread, self.cells.n
            stop = min(first, start + CELLS_PER_WAVE)
            self.cells.reserve(6 * (stop - start))
            self.cells.n = enter_neighbours(
                self.cells.keys, self.patterns, start, stop, self.lattice.shape, MIXED_FACES,
                self.cells.slots, first,
            )  # fmt: skip
            self.n_spread = stop
            self._complete(first)

    def is_mixed(self, keys: np.ndarray) -> np.ndarray:
        """Return which of these cells the surface enters; all must have been entered."""
        numbers = np.empty(len(keys), np.int32)
        find_numbers(keys, self.cells.slots, self.cells.keys, numbers)
        return self.patterns[numbers] > 0

    def links(self) -> np.ndarray:
        """Return the (l, 2) pairs of cells that hang together across a face that differs."""
        n = self.cells.n
        links = np.empty((3 * n, 2), np.int32)
        n_links = list_links(
            self.cells.keys, self.patterns, n, MIXED_FACES, self.lattice.shape, self.cells.slots,
            links,
        )  # fmt: skip
        return links[:n_links]

    def _complete(self, first: int) -> None:
        """Find the corners and patterns of the cells from number ``first`` on."""
        stop = self.cells.n
        self.corners, self.patterns = grown(self.corners, stop), grown(self.patterns, stop)
        for start in range(first, stop, CELLS_PER_WAVE):
            end = min(stop, start + CELLS_PER_WAVE)
            known = self.nodes.n
            self.nodes.reserve(8 * (end - start))
            self.nodes.n = enter_corners(
                self.cells.keys, start, end, self.lattice.shape, self.nodes.slots,
                self.nodes.keys, known, self.corners,
            )  # fmt: skip
            self._evaluate(known)
            classify_cells(self.corners, self.sides, start, end, self.patterns)

    def _evaluate(self, known: int) -> None:
        n = self.nodes.n
        self.values, self.sides = grown(self.values, n), grown(self.sides, n)
        nodes = self.lattice.indices(self.nodes.keys[known:n])
        values = evaluate(self.function, self.lattice.voxel_size * nodes)
        self.values[known:n] = values
        inside = np.where(values < self.level, np.uint8(INSIDE), np.uint8(OUTSIDE))
        self.sides[known:n] = np.where(np.isnan(values), np.uint8(NO_DATA), inside)


def evaluate(function: Callable[[Points], Values], points: Points) -> Values:
    """Return the values at points, in as few calls as memory allows.

    Raises
    ------
    SurfaceError
        The function gave another number of values.
    """
    out = np.empty(len(points))
    for start in range(0, len(points), POINTS_PER_CALL):
        part = points[start : start + POINTS_PER_CALL]
        values = function(part)
        if np.shape(values) != (len(part),):
            raise SurfaceError(
                f"the function gave the shape {np.shape(values)} for {len(part)} points",
                "continue_surface(shape=...)",
                "let it return one value for each point",
            )
        out[start : start + len(part)] = values
    return out


def grown(array: np.ndarray, n: int) -> np.ndarray:
    """Return the array, or a longer one that begins with it, with at least n rows."""
    if n <= len(array):
        return array
    longer = np.empty((max(n, 2 * len(array)), *array.shape[1:]), array.dtype)
    longer[: len(array)] = array
    return longer
