"""Convex parts of faces, between the lines in which other faces meet them."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64, Int32, Int64

from ..arrays import Faces, Number
from ..kernels.parallel import even_ranges, n_threads, run_pieces
from ..progress import Progress, silent
from .face_tree import FaceTree
from .meetings import PIECES_PER_THREAD, Meetings

PIECES_PER_LINE = 4  # room for pieces; where there are more, their faces are cut once more
CORNERS_PER_PIECE = 5
DEPTH = 1024  # room for the pieces of one face; multiplied where it does not suffice


@dataclass(frozen=True, eq=False)
class FacePieces:
    """Convex polygons, each a part of a face, in the order of their faces.

    Attributes
    ----------
    face : (n,) int32
        The face that each is a part of.
    n_corners : (n,) int64
        How many corners each has.
    center : (n, 3) float64
        Centroids, as barycentrics on the face.
    corners : (c, 3) float64
        Corners, piece after piece, counter-clockwise, as barycentrics on the face.
    """

    face: Int32[np.ndarray, " n"]
    n_corners: Int64[np.ndarray, " n"]
    center: Float64[np.ndarray, "n 3"]
    corners: Float64[np.ndarray, "c 3"]

    def among(self, keep: Bool[np.ndarray, " n"]) -> "FacePieces":
        """Return those marked."""
        corners = self.corners[np.repeat(keep, self.n_corners)]
        return FacePieces(self.face[keep], self.n_corners[keep], self.center[keep], corners)

    def fans(self) -> tuple[Int64[np.ndarray, "t 3"], Int64[np.ndarray, " t"]]:
        """Cut every piece into triangles around its first corner.

        Returns
        -------
        corners : (t, 3) int64
            Rows of ``corners``.
        piece : (t,) int64
            The piece that each is a part of.
        """
        piece = np.repeat(np.arange(len(self.face)), self.n_corners - 2)
        first = np.cumsum(self.n_corners) - self.n_corners
        before = np.cumsum(self.n_corners - 2) - (self.n_corners - 2)
        step = np.arange(len(piece)) - before[piece]
        apex = first[piece]
        return np.stack([apex, apex + step + 1, apex + step + 2], axis=1), piece


def cut_met_faces(
    tree: FaceTree, faces: Faces, meetings: Meetings, near: Number, progress: Progress = silent
) -> FacePieces:
    """Cut every face that meets another; see `kernels.sheet_cuts`.

    Parameters
    ----------
    tree : FaceTree
        Of the faces.
    faces : (m, 3) int32
        In their own order.
    meetings : Meetings
        Of the faces.
    near : float
        In normalised coordinates: lengths that count as nothing.
    """
    from ..kernels.sheet_cuts import cut_faces  # most meshes never come here

    ids = np.flatnonzero(meetings.is_met).astype(np.int32)
    start = np.append(meetings.start[ids], meetings.start[-1])
    ranges = even_ranges(len(ids), PIECES_PER_THREAD * n_threads())
    nothing = (np.empty(0, np.int32), np.empty(0, np.int64), np.empty((0, 3)), np.empty((0, 3)))
    found = [nothing] * len(ranges)

    def cut(piece: int) -> None:
        begin, end = ranges[piece]
        room, more = PIECES_PER_LINE * int(start[end] - start[begin]), 0
        stack = DEPTH
        while True:
            more = max(more, CORNERS_PER_PIECE * room)
            face, stop = np.empty(room, np.int32), np.empty(room, np.int64)
            center, corners = np.empty((room, 3)), np.empty((more, 3))
            n, c = cut_faces(
                *(tree.points, faces, ids, begin, end, start, meetings.partners, near),
                *(np.empty((stack, 2)), np.empty((stack, 7)), np.empty((stack, 2), np.int64)),
                *(face, stop, center, corners),
            )
            if n < 0:
                stack *= 4
            elif n > room or c > more:
                room, more = n, c
            else:
                break
        found[piece] = (face[:n], np.diff(stop[:n], prepend=0), center[:n], corners[:c])

    run_pieces(cut, len(ranges) if len(ids) else 0, stage="union", progress=progress)
    return FacePieces(*(np.concatenate(column) for column in zip(*found, strict=True)))
