"""Generalised winding numbers: how often the mesh winds around a point.

1 inside and 0 outside a closed mesh with outward faces; for open or overlapping soups a smooth
value between, for which "above 1/2" is the usual reading of "inside" (Jacobson, Kavan,
Sorkine-Hornung 2013, doi:10.1145/2461912.2461916). libigl does the sums; it is called here only,
and imported at the first call, because that takes half a second.
"""

import numpy as np

from ..arrays import Points, Values
from ..errors import SpatialError
from ..mesh import Mesh


def winding_number(mesh: Mesh, points: Points, *, exact: bool = False) -> Values:
    """Return the generalised winding number of the mesh around each of (n, 3) points.

    Parameters
    ----------
    mesh : Mesh
        Any soup. Without faces every winding number is 0.
    points : (n, 3) float64
        World units, finite.
    exact : bool
        Sum the solid angles of all faces in float64, in O(m) per point, instead of approximating
        far ones by a tree, in O(log m).

    Raises
    ------
    SpatialError
        A point is not finite.

    Notes
    -----
    Accuracy: exact, about 1e-16 per face, away from the surface. Otherwise a second-order
    expansion in float32 (Barill et al. 2018, doi:10.1145/3197517.3201337) without a proven bound;
    4e-3 was the largest error among random points around four closed and open scans. The value
    jumps by 1 across the surface, so within rounding of it (1e-6 of the mesh's size) either side
    may be answered. Use it to tell inside from outside (against 1/2), never as a measure; points
    whose value lies near 1/2 deserve ``exact=True``.
    On the surface itself the number is not defined, and any value may come back.
    Coordinates are centred on the mesh's box and divided by its longest side first, which changes
    no winding number and spares float32 the offset.
    """
    if not np.isfinite(points).all():
        n_bad = int((~np.isfinite(points).all(axis=1)).sum())
        what = f"{n_bad} of {len(points)} points are NaN or infinite"
        raise SpatialError(what, "winding_number(points=...)", "leave those points out")
    if mesh.n_faces == 0 or len(points) == 0:
        return np.zeros(len(points))
    import igl

    box = mesh.box
    scale = box.longest_side if box.longest_side > 0 else 1.0
    vertices = (mesh.vertices - box.center) / scale
    queries = (points - box.center) / scale
    faces = mesh.faces.astype(np.int64)
    compute = igl.winding_number if exact else igl.fast_winding_number
    return np.asarray(compute(vertices, faces, queries), dtype=np.float64).reshape(-1)
