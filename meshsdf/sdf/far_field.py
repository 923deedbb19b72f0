"""The nodes of a grid beyond the band: blocks of them, shared among all cores."""

import numpy as np

from ..arrays import Ijk1
from ..grid import NarrowBand
from ..kernels.far_field import BLOCK, edge_inverses, fill_blocks
from ..kernels.parallel import even_ranges, run_pieces
from ..progress import Progress
from ..spatial.closest_point import ClosestPoint

MAX_PIECES = 128  # enough for progress, Ctrl-C and an even load
BYTES_PER_FACE = 700  # the tree, corners in its order, and the lists of two threads
# Squares and witnesses err by at most 1600 u S^2, u = 2**-53 and S the largest coordinate:
# 160 for the sums of `far_lists`, 4 sqrt(3) S * 200 u S for a witness (`point_triangle`)
MARGIN = 2.0**-41


def fill_grid(
    band: NarrowBand, query: ClosestPoint, first: Ijk1, shape: Ijk1, progress: Progress
) -> np.ndarray:
    """Return float32 signed distances at the nodes ``first ... first + shape - 1``.

    Parameters
    ----------
    band : NarrowBand
        Signs everywhere, and the values of active nodes, which are kept.
    query : ClosestPoint
        Of the faces that the band's distances are measured to.
    first, shape : (3,) int64
        Index coordinates of the first node, and number of nodes along each axis.
    """
    out = np.empty(shape, np.float32)
    axes = [
        band.voxel_size * (first[axis] + np.arange(shape[axis]))
        + (band.translation[axis] - query.center[axis])
        for axis in range(3)
    ]
    start = first // 8 * 8 - first
    n_blocks = -(-(shape - start) // BLOCK)
    block = np.stack(np.unravel_index(np.arange(np.prod(n_blocks)), n_blocks), axis=1)
    firsts = block * BLOCK + start
    # The bricks of local node 0 and of local node -1 are different where start is negative
    brick0 = first // 8 - band.index.origin + (start < 0)
    low, last = np.maximum(firsts, 0), np.minimum(firsts + BLOCK, shape) - 1
    centers = np.stack([0.5 * (x[a] + x[b]) for x, a, b in zip(axes, low.T, last.T, strict=True)])
    _, seeds = query.search(np.ascontiguousarray(centers.T), np.empty(0, np.int32))
    inverses = np.empty((len(query.frames), 2))
    edge_inverses(query.frames, inverses)
    corners = query.corners[query.face_of_slot]
    largest = max(query.radius, *(float(np.abs(x[[0, -1]]).max()) for x in axes))
    index = band.index
    pieces = even_ranges(len(firsts), MAX_PIECES)

    def work(piece: int) -> None:
        fill_blocks(
            *(firsts, seeds, *pieces[piece], *axes, 1.0 / band.voxel_size),
            *(MARGIN * largest**2, query.frames, inverses, corners, *query.tree),
            *(index.root, index.pages, band.values, np.float32(band.background), brick0, out),
        )

    run_pieces(work, len(pieces), stage="far field", progress=progress)
    return out
