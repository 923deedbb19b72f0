"""Texture coordinates for any mesh: two faces to a square, squares in rows.

Every face becomes a right triangle whose legs follow the size of the face. Between two faces there
are at least two texels, so that each has the texels that bilinear lookups on its edges touch.
"""

from dataclasses import replace

import numpy as np

from ..errors import TextureError
from ..mesh import Mesh

SIDES = np.array([8, 10, 12, 16, 20, 24, 32, 40, 48, 64, 80, 96, 128, 192, 256, 384, 512, 1024])
LOSS = 5  # texels of a square's side that no leg can use


def lay_out_faces(mesh: Mesh, size: int) -> Mesh:
    """The mesh with three vertices for every face and coordinates on ``size`` x ``size`` texels.

    Raises
    ------
    TextureError
        Even the smallest squares do not fit; says the size that would do.
    """
    triangles = mesh.triangles
    edges = np.linalg.norm(np.roll(triangles, -1, axis=1) - triangles, axis=2)
    turn = (np.argmax(edges, axis=1) + 2) % 3  # the corner opposite the longest edge comes first
    order = (turn[:, None] + np.arange(3)) % 3
    corners = np.take_along_axis(mesh.faces, order, axis=1)
    legs = edges.max(axis=1) / np.sqrt(2)
    sides = _fitting_sides(legs, size)
    uv = _placed(sides, size)
    vertices = np.array(mesh.vertices[corners.reshape(-1)])
    faces = np.arange(3 * mesh.n_faces, dtype=np.int32).reshape(-1, 3)
    colors = mesh.vertex_colors
    if colors is not None:
        colors = np.array(colors[corners.reshape(-1)])
    return replace(mesh, vertices=vertices, faces=faces, uv=uv, vertex_colors=colors)


def _fitting_sides(legs: np.ndarray, size: int) -> np.ndarray:
    """(m,) sides of the faces' squares: as many texels for a length as fit."""
    allowed = SIDES[size >= SIDES]
    smallest = np.full(len(legs), allowed[0])
    if _height(smallest, size) > size:
        needed = int(np.ceil(np.sqrt(len(legs) / 2)) + 1) * int(allowed[0])
        what = f"{len(legs)} faces do not fit in {size} x {size} texels"
        raise TextureError(what, "atlas_for(size=...)", f"ask for a size of {needed} or more")
    low, high = 0.0, size / max(float(legs.max()), 1e-300)
    for _ in range(40):
        middle = 0.5 * (low + high)
        if _height(_sides(legs, middle, allowed), size) <= size:
            low = middle
        else:
            high = middle
    return _sides(legs, low, allowed)


def _sides(legs: np.ndarray, scale: float, allowed: np.ndarray) -> np.ndarray:
    wanted = legs * scale + LOSS
    return allowed[np.minimum(np.searchsorted(allowed, wanted), len(allowed) - 1)]


def _height(sides: np.ndarray, size: int) -> int:
    """Texels that rows of squares take, each row of squares of one side."""
    values, counts = np.unique(sides, return_counts=True)
    squares = -(-counts // 2)
    return int((values * -(-squares // (size // values))).sum())


def _placed(sides: np.ndarray, size: int) -> np.ndarray:
    """(3 m, 2) coordinates of the faces' corners."""
    uv = np.empty((len(sides), 3, 2))
    top = 0
    for side in np.unique(sides):
        faces = np.flatnonzero(sides == side)
        square = np.arange(len(faces)) // 2
        per_row = size // side
        corner = np.stack([square % per_row, square // per_row], axis=1) * side + [0, top]
        leg = side - LOSS
        near = np.array([[1, 1], [1 + leg, 1], [1, 1 + leg]])
        second = (np.arange(len(faces)) % 2 == 1)[:, None, None]
        local = np.where(second, side - near, near)
        uv[faces] = (corner[:, None] + local) / size
        top += int(side) * -(-(int(square[-1]) + 1) // int(per_row))
    uv[..., 1] = 1 - uv[..., 1]
    return uv.reshape(-1, 2)
