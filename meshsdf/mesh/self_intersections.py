"""Pairs of faces that pass through each other: worth knowing, and harmless to the two-set property.

What is counted: pairs in which an edge of one face leads from certainly one side of the other's
plane to certainly the other side and passes the closed triangle on the way (its rim included, and
what rounding cannot tell from its rim). Faces that share an edge are never counted, faces that
share a corner only if they certainly meet elsewhere too. What is not counted: faces that only
touch, faces in one plane that overlap (duplicates among them), and whatever lies within the
rounding of the coordinates of such a position. "Certain" means that the sign of a determinant
exceeds a bound on its rounding error.
"""

from dataclasses import dataclass

import numpy as np

from ..arrays import Faces, Points, Vector3
from ..box import Box
from ..kernels.parallel import even_ranges, n_threads, run_pieces
from ..progress import Progress, silent

PIECES_PER_THREAD = 16  # enough for progress and an even load


@dataclass(frozen=True, eq=False)
class SelfIntersections:
    """How many pairs of faces cross, and the first of them.

    Attributes
    ----------
    n_pairs : int
        Number of crossing pairs.
    first_pair : (int, int) or None
        The pair first in lexicographic order of face indices.
    first_place : (3,) float64 or None
        Where an edge of one goes through the other.
    """

    n_pairs: int
    first_pair: tuple[int, int] | None
    first_place: Vector3 | None


def find_self_intersections(
    points: Points, faces: Faces, *, progress: Progress = silent
) -> SelfIntersections:
    """Count the pairs of faces that cross.

    Parameters
    ----------
    points : (u, 3) float64
        Welded positions: faces that touch at a corner must name the same vertex.
    faces : (m, 3) int32
        Welded vertex indices.
    progress : Progress
        Called between pieces of the work.

    Notes
    -----
    Cost: O(m log m) plus the pairs whose boxes overlap.
    """
    from ..kernels.triangle_pairs import LEAF, count_crossing_pairs, fill_boxes

    if len(faces) == 0:
        return SelfIntersections(0, None, None)
    order = np.argsort(_morton_codes(points, faces), kind="stable")
    ordered = np.ascontiguousarray(faces[order])
    n_leaves = -(-len(faces) // LEAF)
    first_leaf = 1 << (n_leaves - 1).bit_length()
    boxes = np.empty((len(faces), 6))
    nodes = np.tile(np.repeat([np.inf, -np.inf], 3), (2 * first_leaf, 1))
    fill_boxes(points, ordered, first_leaf, boxes, nodes)
    ranges = even_ranges(n_leaves, PIECES_PER_THREAD * n_threads())
    counts = np.zeros(len(ranges), dtype=np.int64)
    pairs = np.full((len(ranges), 2), np.iinfo(np.int64).max)
    places = np.zeros((len(ranges), 3))

    def count(i: int) -> None:
        counts[i] = count_crossing_pairs(
            points, ordered, order, first_leaf, boxes, nodes, *ranges[i], pairs[i], places[i]
        )

    run_pieces(count, len(ranges), stage="self-intersections", progress=progress)
    if not counts.any():
        return SelfIntersections(0, None, None)
    first = min(range(len(ranges)), key=lambda i: tuple(pairs[i]))
    low, high = pairs[first].tolist()
    return SelfIntersections(int(counts.sum()), (low, high), places[first].copy())


def _morton_codes(points: Points, faces: Faces) -> np.ndarray:
    """Interleave the bits of the centres of the faces, 21 bits per axis of their box."""
    centers = points[faces].mean(axis=1)
    box = Box.around(centers)
    side = box.longest_side or 1.0
    cells = ((centers - box.lower) / side * (2**21 - 1)).astype(np.uint64)
    # Spread 21 bits so that two zeros follow each (Warren, Hacker's Delight, 2nd ed., 2012)
    for shift, mask in (
        (32, 0x1F00000000FFFF),
        (16, 0x1F0000FF0000FF),
        (8, 0x100F00F00F00F00F),
        (4, 0x10C30C30C30C30C3),
        (2, 0x1249249249249249),
    ):
        cells = (cells | (cells << np.uint64(shift))) & np.uint64(mask)
    return cells[:, 0] | cells[:, 1] << np.uint64(1) | cells[:, 2] << np.uint64(2)
