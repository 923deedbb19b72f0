"""The corners of OBJ faces: ``v``, ``v/vt``, ``v//vn`` or ``v/vt/vn``, counted from 1 or back."""

import re
from dataclasses import dataclass

import numpy as np
from jaxtyping import Int64

from .text_rows import numbers

_KINDS = re.compile(rb"^[ \t]*(vt?|f)[ \t]", re.MULTILINE)
_EMPTY_PLACE = re.compile(rb"/(?![^\s/])")
_LARGEST = 2.0**53  # up to here a float64 holds every integer


@dataclass(frozen=True, eq=False)
class Defined:
    """What the corners may name.

    Attributes
    ----------
    text : bytes
        The whole file; where a line stands in it gives relative indices their meaning.
    counts : (r,) int64
        Corners of each face.
    n_vertices, n_coordinates : int
        How many ``v`` and ``vt`` lines the file holds.
    """

    text: bytes
    counts: Int64[np.ndarray, " r"]
    n_vertices: int
    n_coordinates: int


def corner_indices(
    face_lines: bytes, defined: Defined
) -> tuple[Int64[np.ndarray, " k"], Int64[np.ndarray, " k"]]:
    """Return position and texture coordinate of all corners, from 0; -1 for no coordinate.

    Positions may still be out of range; coordinates are checked here.
    """
    vertex, texture = _raw_indices(face_lines, int(defined.counts.sum()))
    if (vertex == 0).any():
        raise ValueError("a face names vertex 0, but OBJ counts from 1")
    n_before, n_texture_before = 0, 0
    if (vertex < 0).any() or (texture < 0).any():
        n_before, n_texture_before = _defined_before(defined)
    has_texture = texture != 0
    vertex = np.where(vertex > 0, vertex - 1, vertex + n_before)
    texture = np.where(texture > 0, texture - 1, texture + n_texture_before)
    wrong = has_texture & ((texture < 0) | (texture >= defined.n_coordinates))
    if wrong.any():
        raise ValueError(
            f"{np.count_nonzero(wrong)} face corners name texture coordinates that are not "
            f"among the {defined.n_coordinates}"
        )
    texture[~has_texture] = -1
    return vertex, texture


def _raw_indices(face_lines: bytes, n_corners: int) -> tuple[np.ndarray, np.ndarray]:
    """(k,) v and (k,) vt as written; 0 where there is no vt."""
    n_slashes = np.zeros(n_corners, np.int64)
    if b"/" in face_lines:
        n_slashes = np.array([word.count(b"/") for word in face_lines.split()], np.int64)
        # An empty place ("1//3", "1/") becomes a 0, which no index may be.
        face_lines = _EMPTY_PLACE.sub(b"/0", face_lines).replace(b"/", b" ")
    total = int(n_slashes.sum()) + n_corners
    values = numbers(face_lines, total, "face")
    if n_slashes.max() > 2 or not (np.abs(values) < _LARGEST).all():
        raise ValueError("a face corner is not of the form v, v/vt, v//vn or v/vt/vn")
    if (values != np.floor(values)).any():
        raise ValueError("a face names a vertex by a number that is not whole")
    start = np.cumsum(n_slashes + 1) - n_slashes - 1
    has_texture = n_slashes > 0
    texture = np.where(has_texture, values[start + has_texture], 0)
    return values[start].astype(np.int64), texture.astype(np.int64)


def _defined_before(defined: Defined) -> tuple[np.ndarray, np.ndarray]:
    """For every corner, how many v and vt lines stand above its face."""
    kinds = np.array(_KINDS.findall(defined.text))
    is_face = kinds == b"f"
    n_vertices = np.cumsum(kinds == b"v")[is_face]
    n_coordinates = np.cumsum(kinds == b"vt")[is_face]
    return np.repeat(n_vertices, defined.counts), np.repeat(n_coordinates, defined.counts)
