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
def _join(parent, f, g):
    """Join the sets of f and g; the smaller root stays."""
    f, g = _root(parent, f), _root(parent, g)
    parent[max(f, g)] = min(f, g)


@njit(cache=True, nogil=True)
def _turn(half_edges, first, net_uses, normals, e):
    """Cosine and squared sine between the faces on edge e, turned alike; (-1, 1) if not two."""
    if first[e + 1] - first[e] != 2:
        return -1.0, 1.0
    n, m = normals[half_edges[first[e]] // 3], normals[half_edges[first[e] + 1] // 3]
    x, y, z = n[1] * m[2] - n[2] * m[1], n[2] * m[0] - n[0] * m[2], n[0] * m[1] - n[1] * m[0]
    dot = n[0] * m[0] + n[1] * m[1] + n[2] * m[2]
    return (-dot if net_uses[e] != 0 else dot), x * x + y * y + z * z


@njit(cache=True, nogil=True)
def mark_wide(points, faces, half_edges, first, width, flats, shares, is_wide):
    """Mark the faces of flats whose area is at least half of ``width`` times their outline.

    A strip as wide as ``width`` has that, and a polygon around a circle of twice its diameter.
    ``flats`` (m,) names the sets by a face of each; ``shares`` (m,) is room to work in.
    """
    for f in range(len(faces)):
        shares[f] = 0.0
    for e in range(len(first) - 1):
        f = half_edges[first[e]]
        is_inner = first[e + 1] - first[e] == 2
        is_inner = is_inner and flats[f // 3] == flats[half_edges[first[e] + 1] // 3]
        if is_inner:
            continue
        p, q = points[faces[f // 3, f % 3]], points[faces[f // 3, (f + 1) % 3]]
        length = np.sqrt((p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2 + (p[2] - q[2]) ** 2)
        for u in range(first[e], first[e + 1]):
            shares[flats[half_edges[u] // 3]] -= width * length
    for f in range(len(faces)):
        a, b, c = points[faces[f, 0]], points[faces[f, 1]], points[faces[f, 2]]
        ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
        x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        shares[flats[f]] += np.sqrt(x * x + y * y + z * z)  # twice the area
    for f in range(len(faces)):
        is_wide[f] = shares[flats[f]] >= 0.0


@njit(cache=True, nogil=True)
def label_flats(half_edges, first, net_uses, normals, sine, flats):
    """``flats[f]`` = the first face of the set that hangs together by turns below ``sine``."""
    for f in range(len(flats)):
        flats[f] = f
    for e in range(len(first) - 1):
        cosine, square = _turn(half_edges, first, net_uses, normals, e)
        if cosine > 0.0 and square <= sine * sine:
            _join(flats, half_edges[first[e]] // 3, half_edges[first[e] + 1] // 3)
    for f in range(len(flats)):
        flats[f] = _root(flats, f)


@njit(cache=True, nogil=True)
def label_regions(
    half_edges, first, net_uses, normals, cosine, links, flats, is_wide, labels, is_crease
):
    """Number the regions in order of their first faces; return how many there are.

    Two faces on an edge of their own are joined if they belong to one flat; and if both are narrow,
    unless their normals, turned alike, have a smaller cosine. ``is_crease`` tells which edges part
    two faces. ``links`` (n, 2) int32 are further faces to join.
    """
    for f in range(len(labels)):
        labels[f] = flats[f]
    for e in range(len(first) - 1):
        is_crease[e] = False
        if first[e + 1] - first[e] != 2:
            continue
        f, g = half_edges[first[e]] // 3, half_edges[first[e] + 1] // 3
        if flats[f] == flats[g]:
            continue
        if is_wide[f] or is_wide[g] or _turn(half_edges, first, net_uses, normals, e)[0] < cosine:
            is_crease[e] = True
        else:
            _join(labels, f, g)
    for n in range(len(links)):
        _join(labels, links[n, 0], links[n, 1])
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
