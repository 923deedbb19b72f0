"""Do all faces of a mesh lie in one plane? Then it has no thickness, and nothing is inside."""

import numpy as np
from jaxtyping import Integer

from ..arrays import Points, Values

FLOAT64 = 2.0**-53
FLOAT32 = 2.0**-24
N_TRIED = 4096  # vertices: those of nearly any solid show already that it is none


def is_flat(points: Points, faces: Integer[np.ndarray, "m 3"], *, closed: bool) -> bool:
    """Tell whether all corners of the faces lie in one plane, within rounding.

    Parameters
    ----------
    points : (n, 3) float64
        Vertices.
    faces : (m, 3) int
        At least one.
    closed : bool
        A closed mesh is flat only within the rounding of float64, for there may be an inside,
        however thin; an open one within that of float32, which files are often written in.

    Notes
    -----
    Accuracy: let a be any corner, b the farthest from it, c the farthest from the line ab. In a
    plane every corner is ``a + s (b - a) + t (c - a)`` with ``|s| <= 2``, ``|t| <= 1``; where each
    is moved by at most ``e``, it is at most ``8 e`` from the plane abc. With ``L = |b - a|`` and
    ``M`` the largest coordinate, rounding moves by ``e = sqrt(3) (u L + 2**-53 M)``; u = 2**-24
    for an open mesh, 2**-53 for a closed one.
    """
    step = max(1, 3 * len(faces) // N_TRIED)
    corners = faces.reshape(-1)
    return _is_plane(points[corners[::step]], closed) and _is_plane(points[corners], closed)


def _is_plane(points: Points, closed: bool) -> bool:
    offset = points - points[0]
    length = np.abs(offset).max()
    if length == 0:
        return True
    unit = FLOAT64 if closed else FLOAT32
    most = 8 * np.sqrt(3.0) * (unit + FLOAT64 * (np.abs(points).max() / length))
    offset /= length
    b = offset[np.argmax(_squares(offset))]
    across = np.cross(offset, b / np.linalg.norm(b))
    normal = across[np.argmax(_squares(across))]
    height = np.linalg.norm(normal)
    return bool(height <= most or np.abs(offset @ (normal / height)).max() <= most)


def _squares(vectors: Points) -> Values:
    return np.einsum("ij,ij->i", vectors, vectors)
