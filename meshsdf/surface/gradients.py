"""Crossings and normals of a volume of which only node values are known."""

import numpy as np

from ..grid import Grid, NarrowBand
from ..kernels.dual_arrays import Crossings
from ..kernels.node_gradients import gradient_normals
from ..progress import Progress, silent
from .brick_field import BrickField, in_ranges
from .dual_loops import DualLoops
from .mesh_hits import brick_table


def gradient_crossings(
    volume: NarrowBand | Grid, field: BrickField, loops: DualLoops, progress: Progress = silent
) -> Crossings:
    """Return crossings by linear interpolation, and normals by central differences."""
    table = brick_table(volume, field)
    shift = loops.base - table.origin
    normals = np.empty((loops.n_crossings, 3))

    def estimate(begin: int, end: int) -> None:
        gradient_normals(
            field.values, table.index.root, table.index.pages, field.background, shift,
            loops.nodes, loops.ways, loops.fractions, begin, end, normals,
        )  # fmt: skip

    in_ranges(estimate, loops.n_crossings, "normals", progress, nodes_per_item=16)
    return Crossings(loops.nodes, loops.ways, loops.fractions, normals)
