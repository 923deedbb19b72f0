"""Polygons of any number of corners to triangles, as a fan around the first corner.

A fan covers a convex polygon exactly. On a concave one the triangles overlap and cancel, which
keeps the boundary edges but not the area; store such faces as triangles.
"""

import numpy as np
from jaxtyping import Int64


def fan_corners(
    counts: Int64[np.ndarray, " r"],
) -> tuple[Int64[np.ndarray, "m 3"], Int64[np.ndarray, " m"]]:
    """Corner numbers of the triangles of polygons stored one after the other.

    Parameters
    ----------
    counts : (r,) int64
        Corners of each polygon; those with fewer than 3 give no triangle.

    Returns
    -------
    corners : (m, 3) int64
        Places in the flat list of all corners.
    polygon : (m,) int64
        Which polygon each triangle came from.
    """
    starts = np.cumsum(counts) - counts
    n_triangles = np.maximum(counts - 2, 0)
    polygon = np.repeat(np.arange(len(counts)), n_triangles)
    step = np.arange(len(polygon)) - np.repeat(np.cumsum(n_triangles) - n_triangles, n_triangles)
    first = starts[polygon]
    return np.stack([first, first + step + 1, first + step + 2], axis=1), polygon


def checked_faces(indices: Int64[np.ndarray, "m 3"], n_vertices: int) -> np.ndarray:
    """Return the (m, 3) indices as int32; ValueError if one names no vertex.

    The check runs before the cast, which would wrap large indices to small ones.
    """
    wrong = ((indices < 0) | (indices >= n_vertices)).any(axis=1)
    if wrong.any():
        at = int(np.flatnonzero(wrong)[0])
        raise ValueError(
            f"{np.count_nonzero(wrong)} of {len(indices)} triangles name vertices that are not "
            f"among the {n_vertices} (first: triangle {at} = {indices[at].tolist()}, from 0)"
        )
    if n_vertices > np.iinfo(np.int32).max:
        raise ValueError(f"{n_vertices} vertices are more than 32-bit indices can name")
    return indices.astype(np.int32)
