"""Faces that bound nothing: those without area, and sheets that lie on each other and cancel.

Two sheets with the same corners cancel: crossing both leaves one on the side one started from. Only
sheets met an odd number of times bound a solid, and distances are measured to those alone.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Int32

from ..arrays import FaceMask, Faces, Points, writable_alias
from ..kernels.weld import sort_corners
from .collinear import are_collinear
from .weld import number_equal_rows


@dataclass(frozen=True, eq=False)
class FaceSheets:
    """Which faces have the same three corners; a sheet is one such set of corners.

    Attributes
    ----------
    sheet_of_face : (m,) int32
        Sheets are numbered in order of their first faces.
    n_copies : (s,) int32
        Number of faces on each sheet.
    net_copies : (s,) int32
        Faces turned one way minus faces turned the other way.
    is_even : (m,) bool
        Which way each face is turned: True where its corners are an even permutation of their
        ascending order.
    """

    sheet_of_face: Int32[np.ndarray, " m"]
    n_copies: Int32[np.ndarray, " s"]
    net_copies: Int32[np.ndarray, " s"]
    is_even: Bool[np.ndarray, " m"]


def face_sheets(faces: Faces) -> FaceSheets:
    """Find the faces with equal corners; ``faces`` name welded vertices."""
    rows = np.empty((len(faces), 3), dtype=np.uint64)
    is_even = np.empty(len(faces), dtype=np.bool_)
    sort_corners(writable_alias(faces), rows, is_even)
    sheet, first = number_equal_rows(rows)
    n_copies = np.bincount(sheet, minlength=len(first)).astype(np.int32)
    n_even = np.bincount(sheet[is_even], minlength=len(first)).astype(np.int32)
    return FaceSheets(sheet, n_copies, 2 * n_even - n_copies, is_even)


def degenerate_faces(points: Points, faces: Faces) -> FaceMask:
    """Mark the faces of exactly zero area: repeated corners, or corners on one line.

    They separate nothing and no distance is measured to them, yet they stay in the chain of edges
    that `check` examines: removing a sliver that fills a T-junction would open the index mesh.
    """
    return are_collinear(writable_alias(points), writable_alias(faces))


def odd_faces(faces: Faces) -> FaceMask:
    """Mark the first face of every sheet that occurs an odd number of times.

    What is left is the support of the mesh as a chain modulo 2, as far as equal corners tell;
    sheets that overlap without having the same corners are not seen.

    Examples
    --------
    >>> odd_faces(np.array([[0, 1, 2], [3, 4, 5], [2, 1, 0]], dtype=np.int32)).tolist()
    [False, True, False]
    """
    sheets = face_sheets(faces)
    return (sheets.n_copies[sheets.sheet_of_face] % 2 == 1) & (_rank(sheets.sheet_of_face) == 0)


def net_faces(faces: Faces) -> FaceMask:
    """Drop pairs of faces with equal corners and opposite orientation.

    What is left is the mesh as a chain with integer multiplicities: of every sheet, the surplus
    of the side that has more faces, first ones first.

    Examples
    --------
    >>> net_faces(np.array([[0, 1, 2], [1, 0, 2], [2, 0, 1]], dtype=np.int32)).tolist()
    [True, False, False]
    """
    sheets = face_sheets(faces)
    sheet = sheets.sheet_of_face
    net = sheets.net_copies[sheet]
    rank = _rank(2 * sheet + sheets.is_even)  # among the faces of the sheet turned the same way
    return (sheets.is_even == (net > 0)) & (rank < np.abs(net))


def _rank(labels: np.ndarray) -> np.ndarray:
    """How many earlier entries bear the same label, for every entry."""
    order = np.argsort(labels, kind="stable")
    ordered = labels[order]
    starts = np.flatnonzero(np.r_[True, ordered[1:] != ordered[:-1]]) if len(labels) else order
    lengths = np.diff(np.r_[starts, len(labels)])
    rank = np.empty(len(labels), dtype=np.int64)
    rank[order] = np.arange(len(labels)) - np.repeat(starts, lengths)
    return rank
