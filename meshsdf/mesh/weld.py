"""Give vertices at exactly the same position one number.

Equality is of the floats, bit by bit, with -0.0 equal to 0.0; there is no tolerance. Files such
as STL repeat a vertex for every face, and this is what ties their faces together again.
"""

import numpy as np
from jaxtyping import Float64

from ..arrays import Indices, Points
from ..kernels.weld import number_rows


def number_equal_rows(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Number the equal rows of an (n, 3) uint64 array in order of first appearance.

    Returns
    -------
    labels : (n,) int32
        The number of each row.
    first_row : (u,) int32
        The first row that bears each number.
    """
    table = np.full(1 << max(2, (2 * len(rows)).bit_length()), -1, dtype=np.int32)
    labels = np.empty(len(rows), dtype=np.int32)
    first_row = np.empty(len(rows), dtype=np.int32)
    n_different = number_rows(rows, table, labels, first_row)
    return labels, first_row[:n_different].copy()


def weld(vertices: Points) -> tuple[Indices, Float64[np.ndarray, "u 3"]]:
    """Merge vertices at exactly equal positions.

    Parameters
    ----------
    vertices : (n, 3) float64
        Finite positions.

    Returns
    -------
    labels : (n,) int32
        The welded vertex that each vertex becomes; numbered in order of first appearance.
    points : (u, 3) float64
        The positions of the welded vertices, no two equal.

    Notes
    -----
    Cost: O(n) time and memory, by hashing.

    Examples
    --------
    >>> labels, points = weld(np.array([[0.0, 0, 1], [2, 0, 0], [-0.0, 0, 1]]))
    >>> labels.tolist(), len(points)
    ([0, 1, 0], 2)
    """
    positions = np.ascontiguousarray(vertices) + 0.0  # -0.0 + 0.0 is 0.0
    labels, first_row = number_equal_rows(positions.view(np.uint64))
    return labels, positions[first_row]
