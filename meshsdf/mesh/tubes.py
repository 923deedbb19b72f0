"""Closed, oriented meshes of tubes around closed curves: the torus and a knotted tube.

Every vertex lies on the exact surface up to rounding. The sag, the largest distance from the mesh
to the surface, is bounded by Taylor's theorem: over a right triangle with legs h and k in the
parameter plane, linear interpolation of X(u, v) is off by at most
``(h² max|X_uu| + 2 h k max|X_uv| + k² max|X_vv|) / 8``.

References
----------
Filip, Magedson, Markot 1986, "Surface algorithms using bounds on derivatives",
doi:10.1016/0167-8396(86)90005-1.
Wang, Jüttler, Zheng, Liu 2008, "Computation of rotation minimizing frames",
doi:10.1145/1330511.1330513.
"""

from collections.abc import Sequence

import numpy as np

from ..arrays import Faces, Points
from ..errors import MeshError
from .mesh import Mesh
from .primitives import as_place, check_count, check_positive, ring

# Half the smallest distance between strands (0.60716), below the smallest radius of curvature
# (1.2873); both found on 6000 points of the curve and rounded down.
TREFOIL_REACH = 0.607

# Largest second derivatives over the trefoil of its curve and of its frame's unit vectors, and
# the largest first derivative of those within the cross-section; on 20000 points, rounded up.
_CURVE_BEND, _FRAME_BEND, _FRAME_TURN = 12.2, 9.4, 3.1


def torus(
    major: float = 1.0,
    minor: float = 0.35,
    *,
    n_major: int = 96,
    n_minor: int = 48,
    center: Sequence[float | int] | np.ndarray = (0.0, 0.0, 0.0),
) -> Mesh:
    """Approximate the torus ``(sqrt(x² + y²) - major)² + z² = minor²`` around ``center``.

    Parameters
    ----------
    major, minor : float
        Radius of the circle in the xy plane and of the tube around it, world units;
        ``0 < minor < major``.
    n_major, n_minor : int
        Steps around the z axis and around the tube, at least 3; there are
        ``2 * n_major * n_minor`` faces.
    center : (3,) floats
        World units.

    Raises
    ------
    MeshError
        The radii are out of order, or a count is below 3.

    Notes
    -----
    Accuracy: the sag is at most
    ``pi²/2 * ((major + minor) / n_major² + 2 * minor / (n_major * n_minor) + minor / n_minor²)``.
    The volume is exactly that of the torus times ``sin(a) sin(b) / (a b)`` with
    ``a = 2 pi / n_major`` and ``b = 2 pi / n_minor``.
    """
    where = "torus"
    check_positive(major, "major", where)
    check_positive(minor, "minor", where)
    check_count(n_major, "n_major", where, least=3)
    check_count(n_minor, "n_minor", where, least=3)
    if minor >= major:
        what = f"the tube of radius {minor:g} fills the hole of the ring of radius {major:g}"
        raise MeshError(what, where, "pass minor < major")
    outward = np.column_stack([ring(n_major), np.zeros(n_major)])
    up = np.broadcast_to([0.0, 0.0, 1.0], outward.shape)
    vertices = _rings(major * outward, outward, up, minor, n_minor)
    return Mesh(vertices + as_place(center, where), _ring_faces(n_major, n_minor))


def trefoil_tube(
    radius: float = 0.35,
    *,
    n_along: int = 240,
    n_around: int = 32,
    center: Sequence[float | int] | np.ndarray = (0.0, 0.0, 0.0),
) -> Mesh:
    """Approximate the points at distance ``radius`` from a trefoil knot: a knotted torus.

    The knot is ``(sin t + 2 sin 2t, cos t - 2 cos 2t, -sin 3t)`` around ``center``, 28.83 world
    units long and about 5 across.

    Parameters
    ----------
    radius : float
        World units. The solid tube touches itself at 0.607, so radius and sag together must stay
        below that.
    n_along, n_around : int
        Rings along the knot and vertices around each, at least 3; there are
        ``2 * n_along * n_around`` faces.
    center : (3,) floats
        World units.

    Raises
    ------
    MeshError
        The tube is not positive, or is so thick or so coarse that strands could meet.

    Notes
    -----
    Accuracy: the sag is at most
    ``pi²/2 * ((12.2 + 9.4 * radius) / n_along² + 6.2 * radius / (n_along * n_around)
    + radius / n_around²)``.
    """
    where = "trefoil_tube"
    check_positive(radius, "radius", where)
    check_count(n_along, "n_along", where, least=3)
    check_count(n_around, "n_around", where, least=3)
    bend = (_CURVE_BEND + _FRAME_BEND * radius) / n_along**2
    shear = 2 * _FRAME_TURN * radius / (n_along * n_around)
    sag = np.pi**2 / 2 * (bend + shear + radius / n_around**2)
    if radius + sag >= TREFOIL_REACH:
        raise MeshError(
            f"a tube of radius {radius:g} with sag up to {sag:.3g} could run into itself: "
            f"strands are {2 * TREFOIL_REACH:g} apart",
            where,
            f"keep radius below {TREFOIL_REACH:g}, with more steps along and around",
        )
    t = 2 * np.pi * np.arange(n_along) / n_along
    curve = [np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t), -np.sin(3 * t)]
    speed = [np.cos(t) + 4 * np.cos(2 * t), 4 * np.sin(2 * t) - np.sin(t), -3 * np.cos(3 * t)]
    points = np.column_stack(curve) + as_place(center, where)
    return closed_tube(points, np.column_stack(speed), radius=radius, n_around=n_around)


def closed_tube(curve: Points, tangents: Points, *, radius: float, n_around: int) -> Mesh:
    """Sweep a regular polygon of ``n_around`` corners along a closed curve.

    Parameters
    ----------
    curve : (n, 3) float64
        Points in order, at least 3, the first one not repeated; world units.
    tangents : (n, 3) float64
        Directions of the curve there, of any length but zero.
    radius : float
        Of the circle around the polygon, world units.
    n_around : int
        Corners of the polygon, at least 3.

    Raises
    ------
    MeshError
        Too few points or corners, or a radius that is not positive.

    Notes
    -----
    Method: a frame carried along without twisting (double reflection), and the angle by which it
    misses its start after one lap spread evenly over the rings. Whether the tube runs into itself
    is the caller's to know: it does not where ``radius`` is below the reach of the curve.
    """
    where = "closed_tube"
    check_positive(radius, "radius", where)
    check_count(len(curve), "the number of points", where, least=3)
    check_count(n_around, "n_around", where, least=3)
    tangents = tangents / np.linalg.norm(tangents, axis=1, keepdims=True)
    first, second = _closed_frame(curve, tangents)
    vertices = _rings(curve, first, second, radius, n_around)
    return Mesh(vertices, _ring_faces(len(curve), n_around))


def _closed_frame(curve: Points, tangents: Points) -> tuple[Points, Points]:
    """Two unit vectors across the curve at each point, turning as little as closing up allows."""
    n = len(curve)
    normals = np.empty((n + 1, 3))
    axis = np.eye(3)[np.argmin(np.abs(tangents[0]))]
    start = np.cross(tangents[0], axis)
    normals[0] = start / np.linalg.norm(start)
    for i in range(n):
        after = (i + 1) % n
        # Reflect the frame in the plane half way, then turn its tangent to where it must point.
        step = curve[after] - curve[i]
        moved = _reflect(np.vstack([normals[i], tangents[i]]), step)
        normals[i + 1] = _reflect(moved[:1], tangents[after] - moved[1])[0]
    side = np.cross(normals[0], tangents[0])
    missed = np.arctan2(normals[n] @ side, normals[n] @ normals[0])
    angle = (-missed / n * np.arange(n))[:, None]
    normals = normals[:n]
    sides = np.cross(normals, tangents)
    first = np.cos(angle) * normals + np.sin(angle) * sides
    return first, np.cross(first, tangents)


def _reflect(vectors: Points, normal: np.ndarray) -> Points:
    """Mirror vectors in the plane through 0 with that normal; none is moved if it is zero."""
    square = normal @ normal
    if square == 0:
        return vectors
    return vectors - np.outer(2 * (vectors @ normal) / square, normal)


def _rings(
    curve: Points, first: Points, second: Points, radius: float, n_around: int
) -> np.ndarray:
    """(n * n_around, 3) vertices: around each point of the curve, from ``first`` to ``second``."""
    across = np.einsum("ja,nax->njx", ring(n_around), np.stack([first, second], axis=1))
    return (curve[:, None] + radius * across).reshape(-1, 3)


def _ring_faces(n_along: int, n_around: int) -> Faces:
    """(2 * n_along * n_around, 3) faces between successive rings, closed in both directions."""
    here = np.arange(n_along * n_around).reshape(n_along, n_around)
    ahead = np.roll(here, -1, axis=0)
    quads = np.stack([here, ahead, np.roll(ahead, -1, axis=1), np.roll(here, -1, axis=1)], axis=-1)
    return quads[..., [0, 1, 2, 0, 2, 3]].reshape(-1, 3).astype(np.int32)
