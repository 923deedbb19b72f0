"""The missing bricks between those of a band, as runs along z: few, where bricks would be n^3.

A gap is a run of missing bricks between two of one column; what lies below, above or beside all
columns is outer. Gaps of neighbouring columns that face each other belong to one region.
"""

from dataclasses import dataclass

import numpy as np

from ..arrays import BrickCoordinates, BrickRuns, Indices
from ..mesh.pieces import connected_labels

BESIDE = ((-1, 0), (1, 0), (0, -1), (0, 1))


@dataclass(frozen=True, eq=False)
class BrickGaps:
    """Gaps between bricks, and which of them hang together.

    Attributes
    ----------
    runs : (g, 4) int64
        x, y, z0, z1: the missing bricks (x, y, z0) ... (x, y, z1 - 1).
    region : (g,) int32
        Number of the region; -1 for gaps that are connected with the outside.
    """

    runs: BrickRuns
    region: Indices

    @classmethod
    def between(cls, bricks: BrickCoordinates) -> "BrickGaps":
        """Find the gaps between bricks in lexicographic order. O(b log b)."""
        same_column = (bricks[1:, :2] == bricks[:-1, :2]).all(axis=1)
        last = np.flatnonzero(same_column & (np.diff(bricks[:, 2]) > 1))
        runs = np.column_stack([bricks[last], bricks[last + 1, 2]])
        runs[:, 2] += 1
        if len(runs) == 0:
            return cls(runs, np.empty(0, np.int32))
        links = [_links(bricks, runs, step) for step in BESIDE]
        label = connected_labels(len(runs) + 1, np.concatenate(links))
        region = np.where(label[:-1] == label[-1], -1, label[:-1])
        _, inverse = np.unique(region, return_inverse=True)
        return cls(runs, (inverse - (region.min() < 0)).astype(np.int32))

    def first_bricks(self) -> BrickCoordinates:
        """Return one brick of every region."""
        regions, first = np.unique(self.region, return_index=True)
        return self.runs[first[regions >= 0], :3].copy()


def _links(bricks: BrickCoordinates, runs: BrickRuns, step: tuple[int, int]) -> np.ndarray:
    """Pairs of gaps that face each other one column on; the gap after the last stands for outside.

    Columns and heights make one number, column * height + z, that rises along bricks and gaps.
    """
    low, high = bricks.min(axis=0), bricks.max(axis=0)
    height, width = high[2] - low[2] + 2, high[1] - low[1] + 3

    def column(xy: np.ndarray) -> np.ndarray:
        return (xy[:, 0] - low[0] + 1) * width + (xy[:, 1] - low[1] + 1)

    def key(columns: np.ndarray, z: np.ndarray) -> np.ndarray:
        return columns * height + (z - low[2])

    own, there = column(runs), column(runs[:, :2] + np.array(step))
    columns, first = np.unique(column(bricks), return_index=True)
    last = np.append(first[1:], len(bricks)) - 1
    at = np.searchsorted(columns, there).clip(max=len(columns) - 1)
    is_outer = columns[at] != there  # no brick beside it
    is_outer |= (runs[:, 2] < bricks[first[at], 2]) | (runs[:, 3] > bricks[last[at], 2] + 1)
    begin = np.searchsorted(key(own, runs[:, 3]), key(there, runs[:, 2]), side="right")
    end = np.searchsorted(key(own, runs[:, 2]), key(there, runs[:, 3]), side="left")
    n_facing = np.maximum(end - begin, 0)
    gap = np.repeat(np.arange(len(runs)), n_facing)
    offset = np.arange(len(gap)) - np.repeat(np.cumsum(n_facing) - n_facing, n_facing)
    facing = np.column_stack([gap, begin[gap] + offset])
    outer = np.flatnonzero(is_outer)
    return np.concatenate([facing, np.column_stack([outer, np.full(len(outer), len(runs))])])
