"""Does a triangle touch a cube? (Separating axes; Akenine-Moller 2001, doi:10.1145/1198555.1198747)

Cubes are taken a billionth larger than they are, so that a triangle in a face of the lattice is
met by the cubes on both its sides.
"""

import numpy as np
from numba import njit

SLACK = 1e-9  # of a node's spacing


@njit(cache=True, nogil=True)
def touches_cube(triangle, x, y, z, half):
    """Whether ``triangle`` (3, 3) meets the closed cube of half side ``half`` around (x, y, z)."""
    ax, ay, az = triangle[0, 0] - x, triangle[0, 1] - y, triangle[0, 2] - z
    bx, by, bz = triangle[1, 0] - x, triangle[1, 1] - y, triangle[1, 2] - z
    cx, cy, cz = triangle[2, 0] - x, triangle[2, 1] - y, triangle[2, 2] - z
    h = half + SLACK
    if min(ax, bx, cx) > h or max(ax, bx, cx) < -h:
        return False
    if min(ay, by, cy) > h or max(ay, by, cy) < -h:
        return False
    if min(az, bz, cz) > h or max(az, bz, cz) < -h:
        return False
    ux, uy, uz = bx - ax, by - ay, bz - az
    vx, vy, vz = cx - bx, cy - by, cz - bz
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    if abs(nx * ax + ny * ay + nz * az) > h * (abs(nx) + abs(ny) + abs(nz)):
        return False
    wx, wy, wz = ax - cx, ay - cy, az - cz
    return (
        _edge_meets(ux, uy, uz, ax, ay, az, cx, cy, cz, h)
        and _edge_meets(vx, vy, vz, bx, by, bz, ax, ay, az, h)
        and _edge_meets(wx, wy, wz, cx, cy, cz, bx, by, bz, h)
    )


@njit(cache=True, nogil=True, inline="always")
def _edge_meets(ux, uy, uz, px, py, pz, qx, qy, qz, h):
    """No axis edge x unit vector parts the cube from an edge's corner p and the corner q."""
    a, b = uz * py - uy * pz, uz * qy - uy * qz
    if min(a, b) > h * (abs(uy) + abs(uz)) or max(a, b) < -h * (abs(uy) + abs(uz)):
        return False
    a, b = ux * pz - uz * px, ux * qz - uz * qx
    if min(a, b) > h * (abs(ux) + abs(uz)) or max(a, b) < -h * (abs(ux) + abs(uz)):
        return False
    a, b = uy * px - ux * py, uy * qx - ux * qy
    return not (min(a, b) > h * (abs(ux) + abs(uy)) or max(a, b) < -h * (abs(ux) + abs(uy)))


@njit(cache=True, nogil=True)
def count_touching(triangles, scale, bricks, starts, stops, faces, counts):
    """``counts[i]`` = how many of ``faces[starts[i]:stops[i]]`` reach the cells of brick i.

    The cells that have a corner in brick b span the nodes 8 b - 1 ... 8 b + 8 of the level, whose
    lattice is ``scale`` times the coordinates of ``triangles`` (m, 3, 3).
    """
    local = np.empty((3, 3))
    for i in range(len(bricks)):
        counts[i] = 0
        for s in range(starts[i], stops[i]):
            _place(triangles, faces[s], scale, bricks, i, local)
            if touches_cube(local, 3.5, 3.5, 3.5, 4.5):
                counts[i] += 1


@njit(cache=True, nogil=True)
def list_touching(triangles, scale, bricks, starts, stops, faces, first, found):
    """``found[first[i]:]`` = those faces that `count_touching` counts for brick i, in order."""
    local = np.empty((3, 3))
    for i in range(len(bricks)):
        at = first[i]
        for s in range(starts[i], stops[i]):
            _place(triangles, faces[s], scale, bricks, i, local)
            if touches_cube(local, 3.5, 3.5, 3.5, 4.5):
                found[at] = faces[s]
                at += 1


@njit(cache=True, nogil=True, inline="always")
def _place(triangles, face, scale, bricks, i, local):
    """The triangle in the nodes of brick i."""
    for corner in range(3):
        for axis in range(3):
            local[corner, axis] = triangles[face, corner, axis] * scale - 8.0 * bricks[i, axis]
