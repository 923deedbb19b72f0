"""Which edges and vertices can be the closest feature of a node, and the folds at every vertex.

The normal regions of faces, edges and vertices tile space. Between two faces in one plane the
region of their edge is nothing, and so is that of a vertex amid such faces, or on a straight line
of two edges: their neighbours' regions, widened by a slack, cover what rounding leaves of them.
Edges that do have a region are called folds. In meshes with flat parts most edges are none.
"""

import numpy as np
from numba import njit

SLIVER = 1e-5  # altitude / longest edge; thinner faces have no trustworthy plane
FACE_SLACK = 1e-8  # voxels by which a face's region is widened
STRAIGHT = 1e-12  # |u + v| of two unit directions, times the reach; their faces may be slivers


@njit(cache=True, nogil=True)
def mark_folds(points, faces, order, first, start, stop, reach, is_fold):
    """Fill ``is_fold`` (k,) bool for the edges [start, stop): False if the wedge is flat.

    Edge e has half-edges ``order[first[e]:first[e + 1]]``. A wedge is flat if two faces, no
    slivers, leave less than half of `FACE_SLACK` between their prisms, ``reach`` voxels away.
    """
    sine = 0.5 * FACE_SLACK / reach
    for e in range(start, stop):
        is_fold[e] = True
        if first[e + 1] - first[e] != 2:
            continue
        h, g = order[first[e]], order[first[e] + 1]
        f, i, j = h // 3, h % 3, g % 3
        a, b = points[faces[f, i]], points[faces[f, (i + 1) % 3]]
        c, d = points[faces[f, (i + 2) % 3]], points[faces[g // 3, (j + 2) % 3]]
        ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        cx, cy, cz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
        dx, dy, dz = d[0] - a[0], d[1] - a[1], d[2] - a[2]
        uu = ux * ux + uy * uy + uz * uz
        cu, du = cx * ux + cy * uy + cz * uz, dx * ux + dy * uy + dz * uz
        cc, dd = cx * cx + cy * cy + cz * cz, dx * dx + dy * dy + dz * dz
        # Into the faces, across the edge: squared lengths times uu, and their scalar product
        pp, qq = cc * uu - cu * cu, dd * uu - du * du
        if (cx * dx + cy * dy + cz * dz) * uu >= cu * du:
            continue
        longest = max(uu, cc, cc + uu - 2.0 * cu)
        if pp <= (SLIVER * longest) ** 2:
            continue
        longest = max(uu, dd, dd + uu - 2.0 * du)
        if qq <= (SLIVER * longest) ** 2:
            continue
        volume = (
            ux * (cy * dz - cz * dy) + uy * (cz * dx - cx * dz) + uz * (cx * dy - cy * dx)
        )  # the sine of the wedge is volume * |u| / (|p| |q|)
        is_fold[e] = volume * volume * uu > sine * sine * pp * qq


@njit(cache=True, nogil=True)
def ends_of_edges(faces, order, first, ids, ends):
    """Fill ``ends`` (n, 2) with the vertices of the edges ``ids``, the lower one first."""
    for n in range(len(ids)):
        h = order[first[ids[n]]]
        p, q = faces[h // 3, h % 3], faces[h // 3, (h % 3 + 1) % 3]
        ends[n, 0], ends[n, 1] = min(p, q), max(p, q)


@njit(cache=True, nogil=True)
def edges_of_vertices(ends, n_vertices, start, edges):
    """CSR lists: vertex v touches ``edges[start[v]:start[v + 1]]``."""
    start[:] = 0
    for e in range(len(ends)):
        start[ends[e, 0] + 1] += 1
        start[ends[e, 1] + 1] += 1
    for v in range(n_vertices):
        start[v + 1] += start[v]
    place = start.copy()
    for e in range(len(ends)):
        for side in range(2):
            v = ends[e, side]
            edges[place[v]] = e
            place[v] += 1


@njit(cache=True, nogil=True)
def mark_corners(points, ends, start, edges, reach, is_corner):
    """Fill ``is_corner`` (n,) bool: False for vertices without folds, or with two in line."""
    for v in range(len(points)):
        n = start[v + 1] - start[v]
        is_corner[v] = n > 0
        if n != 2:
            continue
        total = np.zeros(3)
        for i in range(start[v], start[v + 1]):
            e = edges[i]
            q = points[ends[e, 0] + ends[e, 1] - v]
            x, y, z = q[0] - points[v, 0], q[1] - points[v, 1], q[2] - points[v, 2]
            length = np.sqrt(x * x + y * y + z * z)
            if length > 0.0:
                total[0] += x / length
                total[1] += y / length
                total[2] += z / length
            else:
                total[0] = np.inf
        is_corner[v] = not (abs(total[0]) + abs(total[1]) + abs(total[2]) < STRAIGHT / reach * 3.0)
