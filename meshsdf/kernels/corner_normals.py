"""Normals at the corners of faces for smooth shading, with creases kept.

The normal of a corner is the sum, over the faces around its vertex that meet the corner's own face
at less than the crease angle, of their normals weighted by their angle there (Thürmer, Wüthrich
1998, doi:10.1080/10867651.1998.10487487). A face wound the other way counts with its normal turned.
"""

import numpy as np
from numba import njit

MOST = 256  # faces around a vertex that are compared pair by pair; beyond, all are summed


@njit(cache=True, nogil=True)
def corner_angles(points, faces, begin, end, angles):
    """``angles[f, k]`` = angle of face f at its corner k, radians; 0 beside an edge of length 0."""
    for f in range(begin, end):
        for k in range(3):
            p, q, r = faces[f, k], faces[f, (k + 1) % 3], faces[f, (k + 2) % 3]
            along = first = second = 0.0
            for axis in range(3):
                x, y = points[q, axis] - points[p, axis], points[r, axis] - points[p, axis]
                along += x * y
                first += x * x
                second += y * y
            length = np.sqrt(first) * np.sqrt(second)
            angles[f, k] = np.arccos(min(max(along / length, -1.0), 1.0)) if length > 0.0 else 0.0


@njit(cache=True, nogil=True)
def corners_by_vertex(faces, starts, corners):
    """``corners[starts[v]:starts[v + 1]]`` = 3 f + k of every corner at vertex v, rising."""
    starts[:] = 0
    for f in range(len(faces)):
        for k in range(3):
            starts[faces[f, k] + 1] += 1
    for v in range(len(starts) - 1):
        starts[v + 1] += starts[v]
    # Filling moves every start to where the next one was
    for f in range(len(faces)):
        for k in range(3):
            corners[starts[faces[f, k]]] = 3 * f + k
            starts[faces[f, k]] += 1
    for v in range(len(starts) - 1, 0, -1):
        starts[v] = starts[v - 1]
    starts[0] = 0


@njit(cache=True, nogil=True)
def corner_normals(faces, normals, angles, starts, corners, cosine, begin, end, result):
    """``result[f, k]`` = unit normal at corner k of face f, on the side of the face's normal."""
    for f in range(begin, end):
        nx, ny, nz = normals[f, 0], normals[f, 1], normals[f, 2]
        for k in range(3):
            v = faces[f, k]
            x = y = z = 0.0
            is_crowded = starts[v + 1] - starts[v] > MOST
            for c in range(starts[v], starts[v + 1]):
                g = corners[c] // 3
                dot = nx * normals[g, 0] + ny * normals[g, 1] + nz * normals[g, 2]
                if abs(dot) >= cosine or is_crowded:
                    weight = angles[g, corners[c] % 3] * (1.0 if dot >= 0.0 else -1.0)
                    x += weight * normals[g, 0]
                    y += weight * normals[g, 1]
                    z += weight * normals[g, 2]
            length = np.sqrt(x * x + y * y + z * z)
            # A crowd that looks elsewhere, or faces without area: the face's own normal
            if length == 0.0 or x * nx + y * ny + z * nz < cosine * length:
                x, y, z, length = nx, ny, nz, 1.0
            result[f, k, 0], result[f, k, 1], result[f, k, 2] = x / length, y / length, z / length
