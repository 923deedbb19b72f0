"""Give vertices at exactly the same position one number.

Equality is of the floats, bit by bit, with -0.0 equal to 0.0; there is no tolerance. Files such
as STL repeat a vertex for every face, and this is what ties their faces together again.
"""

import numpy as np
from jaxtyping import Float64

from ..arrays import Indices, Points, writable_alias
from ..kernels.parallel import n_threads, run_pieces
from ..kernels.weld import find_first_rows, number_firsts

ROWS_PER_PART = 2**16  # at least: every part reads all rows


def number_equal_rows(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Number the equal rows of an (n, 3) uint64 array in order of first appearance.

    Returns
    -------
    labels : (n,) int32
        The number of each row.
    first_row : (u,) int32
        The first row that bears each number.
    """
    first = np.empty(len(rows), dtype=np.int32)
    n_parts = min(n_threads(), 1 + len(rows) // ROWS_PER_PART)
    table_size = 1 << max(4, (2 * len(rows) // n_parts).bit_length())
    fits = [False] * n_parts

    def number(part: int) -> None:
        table = np.full(table_size, -1, dtype=np.int32)
        fits[part] = find_first_rows(rows, part, n_parts, table, first)

    run_pieces(number, n_parts)
    if not all(fits):  # the hashes crowd in one part
        table = np.full(1 << (2 * len(rows)).bit_length(), -1, dtype=np.int32)
        find_first_rows(rows, 0, 1, table, first)
    first_row = np.flatnonzero(first == np.arange(len(rows), dtype=np.int32)).astype(np.int32)
    number_firsts(first)
    return first, first_row


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
    points = writable_alias(np.ascontiguousarray(vertices))
    if np.signbit(points[points == 0]).any():
        points = points + 0.0  # -0.0 + 0.0 is 0.0
    labels, first_row = number_equal_rows(points.view(np.uint64))
    return labels, points if len(first_row) == len(points) else points[first_row]
