"""Which faces, edges and vertices reach into each slab, a run of brick columns along x."""

import numpy as np

from ..kernels.brick_marks import bin_by_slab, slab_ranges


def bin_features(
    points: np.ndarray, corners: np.ndarray, edges: np.ndarray, reach: float
) -> tuple[np.ndarray, np.ndarray]:
    """CSR lists (start, items) of the features that reach into each slab.

    Parameters
    ----------
    points, corners
        Local coordinates, and the vertices that span each feature, (n, k).
    edges : (s + 1,) float64
        Where slabs begin and end, in nodes.
    reach : float
        Voxels by which features are grown.
    """
    first, last = np.empty((2, len(corners)), np.int16)
    slab_ranges(points, corners, reach, edges, first, last)
    start = np.zeros(len(edges), np.int64)
    bin_by_slab(first, last, start, np.empty(0, np.int32))
    items = np.empty(start[-1], np.int32)
    bin_by_slab(first, last, start, items)
    return start, items


def items_of(lists: tuple[np.ndarray, np.ndarray], s: int) -> np.ndarray:
    """Return the features of slab s."""
    start, items = lists
    return items[start[s] : start[s + 1]]
