"""Mean and rms of the distance of one surface from another, by quadrature: quick, without proof.

Faces of more than an average share of the area are cut into k² equal triangles, so that samples
lie as densely in a few large faces as in many small ones. Corners of a large face may not stand
for it: a round trip loses most at the corners of the mesh, and next to nothing between them.
"""

import numpy as np
from jaxtyping import Float64, Int32

from ..arrays import FaceValues, Number, Points, Values
from ..mesh import Mesh
from ..mesh.measures import face_areas
from ..progress import Progress, silent
from ..spatial.closest_point import ClosestPoint

LEAST_PIECES = 2**16
"""Triangles of equal area that a surface of few faces is cut into, about; see Notes."""

# Points and equal weights, exact for polynomials of degree 2; none lies on a side
_INNER = np.array([[1, 1], [4, 1], [1, 4]]) / 6.0


def estimated_means(
    source: Mesh,
    closest: ClosestPoint,
    corner_squares: Float64[np.ndarray, "m 3"],
    *,
    n_pieces: Number = LEAST_PIECES,
    progress: Progress = silent,
) -> tuple[float, float]:
    """Estimate mean and rms of the distance over the source's area, world units.

    Parameters
    ----------
    source : Mesh
        Without area, each face counts as much as any other.
    closest : ClosestPoint
        The target.
    corner_squares : (m, 3) float64
        Squared distances of the corners of all faces.
    n_pieces : float
        Into how many triangles a surface of few faces is cut, about.

    Notes
    -----
    Accuracy: without bound. Per triangle exact for polynomials of degree 2, so for the squared
    distance to one plane. Where distances change within a triangle, what is missed is spread
    evenly: rms / mean / sqrt(n) of the mean, so 2 % where the rms is six times the mean.
    Cost: one closest point for a face of at most about an average share of the area, three for
    each triangle of the others; at most about ``3 n_pieces`` of these.
    """
    areas = face_areas(source)
    if areas.sum() == 0:
        areas = np.ones(len(areas))
    shares = areas / areas.sum()
    cuts = np.maximum(np.rint(np.sqrt(shares * n_pieces)), 1).astype(np.int64)
    triangles = source.triangles - closest.center
    small = np.flatnonzero(cuts == 1)
    inner = _squares(closest, triangles[small].mean(axis=1), progress)
    # At the corners it is known already; 1/12 each and 3/4 in the middle is of degree 2 as well
    squares = [np.column_stack([corner_squares[small], inner]).ravel()]
    weights = [np.outer(shares[small], [1 / 12, 1 / 12, 1 / 12, 3 / 4]).ravel()]
    large = [np.flatnonzero(cuts == n) for n in np.unique(cuts[cuts > 1])]
    points = [_samples(triangles[which], int(cuts[which[0]])) for which in large]
    if points:
        squares.append(_squares(closest, np.concatenate(points), progress))
        weights += [
            np.repeat(shares[which], len(p) // len(which)) * (len(which) / len(p))
            for which, p in zip(large, points, strict=True)
        ]
    return _moments(np.concatenate(weights), np.concatenate(squares))


def _moments(weights: Values, squares: Values) -> tuple[float, float]:
    return float(weights @ np.sqrt(squares)), float(np.sqrt(weights @ squares))


def _squares(closest: ClosestPoint, points: Points, progress: Progress) -> FaceValues:
    return closest.search(points, np.empty(0, np.int32), progress)[0]


def _samples(triangles: Float64[np.ndarray, "k 3 3"], n: int) -> Points:
    """Three points within each of the n² equal parts of every triangle."""
    i, j = np.divmod(np.arange(n * n, dtype=np.int32), np.int32(n))
    upright = _places(i, j, 1.0)[i + j < n]
    turned = _places(i + 1, j + 1, -1.0)[i + j < n - 1]
    uv = np.concatenate([upright, turned]).reshape(-1, 2) / n
    weights = np.column_stack([1.0 - uv.sum(axis=1), uv])
    return np.einsum("sc,kcd->ksd", weights, triangles).reshape(-1, 3)


def _places(
    i: Int32[np.ndarray, " s"], j: Int32[np.ndarray, " s"], side: float
) -> Float64[np.ndarray, "s 3 2"]:
    return np.column_stack([i, j])[:, None, :] + side * _INNER
