"""Which faces of a mesh meet which, elsewhere than in the corners and edges they share."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Int32, Int64

from ..arrays import Number
from ..kernels.parallel import even_ranges, n_threads, run_pieces
from ..progress import Progress, silent
from .face_tree import FaceTree

PIECES_PER_THREAD = 16  # enough for progress and an even load
ROOM_PER_FACE = 2  # pairs; where more are found, the search of that piece is run again


@dataclass(frozen=True, eq=False)
class Meetings:
    """Lists by face.

    Attributes
    ----------
    start : (m + 1,) int64
        Face f meets the faces ``partners[start[f]:start[f + 1], 0]``, in ascending order.
    partners : (2 p, 2) int32
        The other face, and how the two meet: CROSSING or COPLANAR of `kernels.sheet_pairs`.
    """

    start: Int64[np.ndarray, " m1"]
    partners: Int32[np.ndarray, "p2 2"]

    @property
    def is_met(self) -> Bool[np.ndarray, " m"]:
        """Which faces meet another."""
        return np.diff(self.start) > 0

    def coplanar(self) -> tuple[Int64[np.ndarray, " m1"], Int32[np.ndarray, " c"]]:
        """Start (m + 1,) and ascending lists of the faces with which each is coplanar."""
        from ..kernels.sheet_pairs import COPLANAR

        is_flat = self.partners[:, 1] == COPLANAR
        before = np.concatenate([np.zeros(1, np.int64), np.cumsum(is_flat)])
        return before[self.start], self.partners[is_flat, 0].copy()


def find_meetings(tree: FaceTree, near: Number, progress: Progress = silent) -> Meetings:
    """List all pairs of faces that meet; see `kernels.sheet_pairs` for what counts.

    Parameters
    ----------
    tree : FaceTree
        The faces; they name welded vertices.
    near : float
        In its normalised coordinates: how far faces in one plane may be apart.

    Notes
    -----
    Accuracy: no pair that meets is missing.
    Cost: O(m log m) plus the pairs whose boxes overlap.
    """
    from ..kernels.sheet_pairs import list_meetings  # pictures, say, need not wait for it

    m = len(tree.faces)
    ranges = even_ranges(m, PIECES_PER_THREAD * n_threads())
    found = [np.empty((0, 3), np.int32)] * len(ranges)

    def search(piece: int) -> None:
        begin, end = ranges[piece]
        n = room = ROOM_PER_FACE * (end - begin)
        while n >= room:
            room = n + 1
            pairs = np.empty((room, 3), np.int32)
            n = list_meetings(
                *(tree.points, tree.faces, tree.order, tree.children, tree.child_boxes),
                *(near, begin, end, pairs),
            )
        found[piece] = pairs[:n]

    run_pieces(search, len(ranges), stage="union", progress=progress)
    pairs = np.concatenate(found)
    both = np.concatenate([pairs, pairs[:, [1, 0, 2]]])
    both = both[np.lexsort((both[:, 1], both[:, 0]))]
    start = np.zeros(m + 1, np.int64)
    np.cumsum(np.bincount(both[:, 0], minlength=m), out=start[1:])
    return Meetings(start, np.ascontiguousarray(both[:, 1:]))
