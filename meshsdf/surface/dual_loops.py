"""Where a field changes sign: crossed edges, the loops they form in cells, and how both hang
together. The polygons of marching cubes are the loops; those of dual contouring surround the
crossings."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float64, Int16, Int32, Int64, UInt8, UInt64

from ..errors import SurfaceError
from ..kernels.dual_arrays import Loops
from ..kernels.dual_loops import count_loops, fill_crossings, fill_loops
from ..progress import Progress, silent
from .brick_field import BrickField, in_ranges
from .dual_cases import QUADRANTS, dual_cases

MAX_VERTICES = 2**31 - 1  # faces are int32


@dataclass(frozen=True, eq=False)
class DualLoops:
    """c crossings and l loops of a field; both numbered as in `kernels.dual_loops`.

    Attributes
    ----------
    base : (3,) int64
        Lowest node of all bricks; what follows is relative to it.
    words : (w, 24) uint64
        Bit ``8 j + k`` of word ``8 a + i``: the edge from node (i, j, k) along axis a is crossed.
    first : (w, 24) int32
        Number of the first crossing of every word.
    nodes : (c, 3) int32
        Lower node of every crossed edge.
    ways : (c,) uint8
        Direction from inside to outside: -x, +x, -y, +y, -z, +z.
    fractions : (c,) float64
        Where linear interpolation puts the level, as a fraction of the edge.
    cells : (l, 3) int32
        Lower node of every loop's cell.
    kinds : (l,) int16
        Pattern of the cell, plus 256 times the loop's number there.
    start : (l + 1,) int32
        Loop i has the crossings ``crossings[start[i]:start[i + 1]]``, in order.
    crossings : (s,) int32
        See ``start``.
    around : (c, 4) int32
        Loops around every crossing, counter-clockwise from outside; -1 where a cell has none.
    folds : (c, 4) uint8
        Bit 0 (1): that loop's cell has a folded face towards the next (the last) loop.
    """

    base: Int64[np.ndarray, "3"]
    words: UInt64[np.ndarray, "w 24"]
    first: Int32[np.ndarray, "w 24"]
    nodes: Int32[np.ndarray, "c 3"]
    ways: UInt8[np.ndarray, " c"]
    fractions: Float64[np.ndarray, " c"]
    cells: Int32[np.ndarray, "l 3"]
    kinds: Int16[np.ndarray, " l"]
    start: Int32[np.ndarray, " l1"]
    crossings: Int32[np.ndarray, " s"]
    around: Int32[np.ndarray, "c 4"]
    folds: UInt8[np.ndarray, "c 4"]

    @property
    def n_crossings(self) -> int:
        """Number of crossed edges."""
        return len(self.ways)

    @property
    def n_loops(self) -> int:
        """Number of loops."""
        return len(self.kinds)

    @cached_property
    def arrays(self) -> Loops:
        """What most kernels need."""
        return Loops(self.start, self.crossings, self.cells, self.around)


def find_loops(
    field: BrickField,
    level: float,
    toward_infinity: float,
    progress: Progress = silent,
    *,
    joined: bool = False,
) -> DualLoops:
    """Count, add up, fill: every brick then writes at places of its own.

    ``joined`` as for `dual_cases`.

    Raises
    ------
    SurfaceError
        There are more than 2^31 - 1 loops or corners of loops.
    """
    cases = dual_cases(joined=joined)
    n = len(field.corners)
    shared = field.inside, field.valid, field.near
    words, totals = np.empty((n, 24), np.uint64), np.empty((n, 2), np.int64)
    in_ranges(
        lambda start, stop: count_loops(
            *shared, cases.n_loops, cases.n_sides, start, stop, words, totals
        ),
        n,
        "counting",
        progress,
    )
    per_word = np.bitwise_count(words)
    last = np.cumsum(per_word, dtype=np.int64).reshape(n, 24)
    sums = np.concatenate([np.zeros((1, 2), np.int64), np.cumsum(totals, axis=0)])
    n_loops, n_sides = sums[-1].tolist()
    if n_sides > MAX_VERTICES:
        raise SurfaceError(
            f"the loops of the surface have {n_sides} corners, {MAX_VERTICES} can be named",
            "dual_contouring(volume=...)",
            "cut the volume into parts, or use a larger voxel size",
        )
    c = int(last[-1, -1]) if n else 0
    first = (last - per_word).astype(np.int32)
    base = field.corners.min(axis=0) if n else np.zeros(3, np.int64)
    nodes, ways, fractions = np.empty((c, 3), np.int32), np.empty(c, np.uint8), np.empty(c)
    place = np.array([field.background, level, toward_infinity])

    def locate(start: int, stop: int) -> None:
        fill_crossings(
            field.values, field.inside, field.near, words, first, field.corners, base, place,
            start, stop, nodes, ways, fractions,
        )  # fmt: skip

    in_ranges(locate, n, "crossings", progress)
    cells, kinds = np.empty((n_loops, 3), np.int32), np.empty(n_loops, np.int16)
    start_of, crossings = np.empty(n_loops + 1, np.int32), np.empty(n_sides, np.int32)
    start_of[-1] = n_sides
    around, folds = np.full((c, 4), -1, np.int32), np.zeros((c, 4), np.uint8)
    firsts = sums[:, 0].copy(), sums[:, 1].copy()

    def fill(start: int, stop: int) -> None:
        fill_loops(
            *shared, words, first, field.corners, base, ways,
            cases.n_loops, cases.loop_size, cases.loop_edges, cases.folded, QUADRANTS, *firsts,
            start, stop, cells, kinds, start_of, crossings, around, folds,
        )  # fmt: skip

    in_ranges(fill, n, "loops", progress)
    return DualLoops(
        base, words, first, nodes, ways, fractions,
        cells, kinds, start_of, crossings, around, folds,
    )  # fmt: skip
