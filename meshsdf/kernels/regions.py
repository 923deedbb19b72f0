"""Smooth regions of a mesh: sets of faces that hang together by edges without a crease."""

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def unit_normals(points, faces, begin, end, normals):
    """Write the unit normals of faces begin <= f < end; 0 where a face has no area."""
    for f in range(begin, end):
        a, b, c = points[faces[f, 0]], points[faces[f, 1]], points[faces[f, 2]]
        ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
        x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        length = np.sqrt(x * x + y * y + z * z)
        scale = 1.0 / length if length > 0.0 else 0.0
        normals[f, 0], normals[f, 1], normals[f, 2] = scale * x, scale * y, scale * z


@njit(cache=True, nogil=True)
def _root(parent, i):
    """The smallest member known of the set that holds i; halves the path on the way."""
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i


@njit(cache=True, nogil=True)
def label_regions(half_edges, first, net_uses, normals, cosine, links, labels, is_crease):
    """Number the regions in order of their first faces; return how many there are.

    Two faces on an edge of their own are joined unless their normals, turned alike, have a
    smaller cosine; ``is_crease`` tells of which edges that is true. ``links`` (n, 2) int32 are
    further faces to join.
    """
    for f in range(len(labels)):
        labels[f] = f
    for e in range(len(first) - 1):
        is_crease[e] = False
        if first[e + 1] - first[e] != 2:
            continue
        f, g = half_edges[first[e]] // 3, half_edges[first[e] + 1] // 3
        dot = 0.0
        for x in range(3):
            dot += normals[f, x] * normals[g, x]
        if net_uses[e] != 0:
            dot = -dot
        if dot < cosine:
            is_crease[e] = True
            continue
        f, g = _root(labels, f), _root(labels, g)
        labels[max(f, g)] = min(f, g)
    for n in range(len(links)):
        f, g = _root(labels, links[n, 0]), _root(labels, links[n, 1])
        labels[max(f, g)] = min(f, g)
    # Roots come first in their sets, so one pass can number them and look them up
    n_regions = 0
    for f in range(len(labels)):
        if labels[f] == f:
            labels[f] = -1 - n_regions
            n_regions += 1
        else:
            root = labels[f]
            while root >= 0:
                root = labels[root]
            labels[f] = root
    for f in range(len(labels)):
        labels[f] = -1 - labels[f]
    return n_regions
