"""Closed, oriented meshes of shapes with closed formulas: sphere, box, tetrahedron, cylinder.

Every vertex lies on the exact surface up to rounding. What a flat face loses against a curved
surface is the *sag*, the largest distance from the mesh to the surface; each docstring bounds it.
Tori and tubes are in `tubes`. Faces are counter-clockwise from outside, and the same arguments
give the same arrays.
"""

from collections.abc import Sequence
from math import isfinite

import numpy as np

from ..arrays import Faces, Points, Vector3
from ..errors import MeshError
from .mesh import Mesh

MAX_SUBDIVISIONS = 10  # 20 * 4**10 = 21 million faces; the next level would not fit a laptop

# The two caps and the belt of an icosahedron, in rings of 1, 5, 5 and 1 vertices.
_UPPER = [(0, i, i % 5 + 1) for i in range(1, 6)]
_BELT_DOWN = [(i, i + 5, i % 5 + 1) for i in range(1, 6)]
_BELT_UP = [(i % 5 + 1, i + 5, i % 5 + 6) for i in range(1, 6)]
_LOWER = [(11, i % 5 + 6, i + 5) for i in range(1, 6)]
_ICOSAHEDRON_FACES = np.array(_UPPER + _BELT_DOWN + _BELT_UP + _LOWER, dtype=np.int32)

# Two triangles per side; corner 4 i + 2 j + k is at (i, j, k) of the unit cube.
_BOX_FACES = np.array(
    [
        *[(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5)],
        *[(0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6)],
        *[(0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)],
    ],
    dtype=np.int32,
)


def icosphere(
    radius: float = 1.0,
    *,
    subdivisions: int = 4,
    center: Sequence[float | int] | np.ndarray = (0.0, 0.0, 0.0),
) -> Mesh:
    """Approximate the sphere ``|x - center| = radius`` by a subdivided icosahedron.

    Parameters
    ----------
    radius : float
        World units, positive.
    subdivisions : int
        0 to 10. Each one cuts every triangle in four and pushes the new vertices to the sphere,
        so there are ``20 * 4**subdivisions`` faces.
    center : (3,) floats
        World units.

    Raises
    ------
    MeshError
        ``radius`` is not positive and finite, or ``subdivisions`` is out of range.

    Notes
    -----
    Accuracy: the mesh is inscribed, and its sag is
    ``radius * (1 - 1 / sqrt(1 + (3 - sqrt(5))**2 / 4**subdivisions))``, which is below
    ``0.3 * radius / 4**subdivisions``. It is attained at the middle of the 20 central faces: the
    tangent of their angular radius starts at ``3 - sqrt(5)`` and halves with every subdivision.
    """
    where = "icosphere"
    check_positive(radius, "radius", where)
    check_count(subdivisions, "subdivisions", where, least=0, most=MAX_SUBDIVISIONS)
    vertices, faces = _icosahedron(), _ICOSAHEDRON_FACES
    for _ in range(subdivisions):
        vertices, faces = _quarter_on_sphere(vertices, faces)
    return Mesh(radius * vertices + as_place(center, where), faces)


def box_mesh(
    size: Sequence[float | int] | np.ndarray = (1.0, 1.0, 1.0),
    *,
    center: Sequence[float | int] | np.ndarray = (0.0, 0.0, 0.0),
) -> Mesh:
    """Return the axis-aligned box with the given side lengths: 8 vertices, 12 triangles, no sag.

    Parameters
    ----------
    size : (3,) floats
        Side lengths in world units, positive.
    center : (3,) floats
        World units.

    Raises
    ------
    MeshError
        A side is not positive and finite.
    """
    where = "box_mesh"
    sides = as_place(size, where)
    for axis, side in zip("xyz", sides, strict=True):
        check_positive(float(side), f"the size along {axis}", where)
    corners = np.indices((2, 2, 2)).reshape(3, 8).T - 0.5
    return Mesh(corners * sides + as_place(center, where), _BOX_FACES)


def tetrahedron(
    edge: float = 1.0, *, center: Sequence[float | int] | np.ndarray = (0.0, 0.0, 0.0)
) -> Mesh:
    """Return the regular tetrahedron with the given edge length: 4 faces, no sag.

    Its corners are alternate corners of an axis-aligned cube of side ``edge / sqrt(2)`` around
    ``center``, one of them along (1, 1, 1). MeshError if ``edge`` is not positive and finite.
    """
    check_positive(edge, "edge", "tetrahedron")
    corners = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    faces = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]], dtype=np.int32)
    return Mesh(edge / np.sqrt(8.0) * corners + as_place(center, "tetrahedron"), faces)


def cylinder(
    radius: float = 1.0,
    height: float = 2.0,
    *,
    n_around: int = 64,
    center: Sequence[float | int] | np.ndarray = (0.0, 0.0, 0.0),
) -> Mesh:
    """Approximate the solid ``x² + y² <= radius²``, ``|z| <= height / 2`` by a prism.

    Parameters
    ----------
    radius, height : float
        World units, positive. The axis is z.
    n_around : int
        Sides of the prism, at least 3; there are ``4 * n_around`` faces.
    center : (3,) floats
        World units.

    Raises
    ------
    MeshError
        A length is not positive and finite, or ``n_around`` is below 3.

    Notes
    -----
    Accuracy: caps and axis are exact; the side is inscribed with sag
    ``radius * (1 - cos(pi / n_around))``.
    """
    where = "cylinder"
    check_positive(radius, "radius", where)
    check_positive(height, "height", where)
    check_count(n_around, "n_around", where, least=3)
    circle = ring(n_around)
    level = np.full(n_around, 0.5 * height)
    bottom = np.column_stack([radius * circle, -level])
    top = np.column_stack([radius * circle, level])
    poles = np.array([[0.0, 0.0, -0.5 * height], [0.0, 0.0, 0.5 * height]])
    here = np.arange(n_around)
    after = (here + 1) % n_around
    south, north = np.full(n_around, 2 * n_around), np.full(n_around, 2 * n_around + 1)
    faces = [
        np.column_stack([here, after, after + n_around]),
        np.column_stack([here, after + n_around, here + n_around]),
        np.column_stack([south, after, here]),
        np.column_stack([north, here + n_around, after + n_around]),
    ]
    vertices = np.vstack([bottom, top, poles]) + as_place(center, where)
    return Mesh(vertices, np.vstack(faces).astype(np.int32))


def ring(n: int) -> np.ndarray:
    """(n, 2) points on the unit circle, counter-clockwise from (1, 0)."""
    angle = 2 * np.pi * np.arange(n) / n
    return np.column_stack([np.cos(angle), np.sin(angle)])


def check_positive(value: float | int, name: str, where: str) -> None:
    """MeshError unless the length is positive and finite."""
    if not (isfinite(value) and value > 0):
        raise MeshError(f"{name} is {value:g}", where, "pass a positive, finite length")


def check_count(value: int, name: str, where: str, *, least: int, most: int | None = None) -> None:
    """MeshError unless ``least <= value <= most``."""
    if value < least or (most is not None and value > most):
        limits = f"at least {least}" if most is None else f"from {least} to {most}"
        raise MeshError(f"{name} is {value}", where, f"pass a whole number {limits}")


def as_place(place: Sequence[float | int] | np.ndarray, where: str) -> Vector3:
    """The three coordinates as a float64 vector; MeshError if they are not three finite numbers."""
    vector = np.asarray(place, dtype=np.float64)
    if vector.shape != (3,) or not np.isfinite(vector).all():
        what = f"{vector.tolist()} is not a place or a size in space"
        raise MeshError(what, where, "pass three finite numbers")
    return vector


def _icosahedron() -> Points:
    """(12, 3) vertices on the unit sphere: a pole, two rings at heights ±1/sqrt(5), a pole."""
    height = 1 / np.sqrt(5.0)
    angle = 2 * np.pi * np.arange(5) / 5
    upper = np.column_stack([np.cos(angle), np.sin(angle), np.full(5, 0.5)])
    lower = np.column_stack(
        [np.cos(angle + np.pi / 5), np.sin(angle + np.pi / 5), np.full(5, -0.5)]
    )
    rings = 2 * height * np.vstack([upper, lower])
    return np.vstack([[[0.0, 0.0, 1.0]], rings, [[0.0, 0.0, -1.0]]])


def _quarter_on_sphere(vertices: Points, faces: Faces) -> tuple[np.ndarray, np.ndarray]:
    """Cut every triangle in four at its edges' midpoints, which move out to the unit sphere."""
    n = len(faces)
    edges = np.sort(np.vstack([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    unique, which = np.unique(edges, axis=0, return_inverse=True)
    middles = vertices[unique[:, 0]] + vertices[unique[:, 1]]
    middles /= np.linalg.norm(middles, axis=1, keepdims=True)
    ab, bc, ca = (len(vertices) + which.reshape(3, n)).astype(np.int32)
    a, b, c = faces.T
    quarters = [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
    finer = np.array(quarters, dtype=np.int32).transpose(2, 0, 1).reshape(-1, 3)
    return np.vstack([vertices, middles]), finer
