"""Sums over the faces of a mesh: area, shadows, signed volume, boxes, in one pass."""

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def measure_components(
    points, faces, f0, f1, component, center, n_faces, area, volume, lower, upper
):
    """Add every face in [f0, f1) to its component; faces of component -1 are left out.

    n_faces, area, volume : (c,) of zeros; lower, upper : (c, 3) of +inf, -inf. Volumes are sums
    of tetrahedra with apex ``center``.
    """
    corner = np.empty((3, 3))
    for f in range(f0, f1):
        c = component[f]
        if c < 0:
            continue
        for i in range(3):
            for axis in range(3):
                x = points[faces[f, i], axis]
                corner[i, axis] = x - center[axis]
                lower[c, axis] = min(lower[c, axis], x)
                upper[c, axis] = max(upper[c, axis], x)
        ax, ay, az = corner[0, 0], corner[0, 1], corner[0, 2]
        ux, uy, uz = corner[1, 0] - ax, corner[1, 1] - ay, corner[1, 2] - az
        vx, vy, vz = corner[2, 0] - ax, corner[2, 1] - ay, corner[2, 2] - az
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        n_faces[c] += 1
        area[c] += 0.5 * np.sqrt(nx * nx + ny * ny + nz * nz)
        volume[c] += (ax * nx + ay * ny + az * nz) / 6


@njit(cache=True, nogil=True)
def sum_areas(points, faces):
    """Total area, and the sum of the areas of the shadows on the three coordinate planes."""
    area = shadow = 0.0
    for f in range(len(faces)):
        a, b, c = points[faces[f, 0]], points[faces[f, 1]], points[faces[f, 2]]
        ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        area += 0.5 * np.sqrt(nx * nx + ny * ny + nz * nz)
        shadow += 0.5 * (abs(nx) + abs(ny) + abs(nz))
    return area, shadow
