"""Does a thin neighbourhood of the open edges leave the rest of space in one piece?

If every open segment stays within w of a graph G (the rims after the weld), the question is about
the capsules of radius d = 2 w around the edges of G. They are convex, so their union has the shape
of their nerve. Where capsules of edges without a common vertex do not meet, the nerve is G itself
(the capsules at a vertex all meet there), with at most some triangles of G filled. A graph has no
closed surface in it, and fewer than four filled triangles make none; the union then has no second
homology, and by Alexander duality its complement is connected.
"""

import numpy as np

from ..arrays import Points

MOST_EDGES = 2000  # pairs of edges are compared one by one


def complement_is_connected(points: Points, edges: np.ndarray, radius: float) -> bool:
    """Prove that space without the capsules of ``radius`` around the edges is connected.

    Parameters
    ----------
    points : (u, 3) float64
        World units.
    edges : (e, 2) int
        Pairs of vertices; repeated ones and loops are left out.
    radius : float
        World units.

    Returns
    -------
    proved : bool
        False when the proof fails, which does not say that the complement falls apart.
    """
    edges = np.sort(edges[edges[:, 0] != edges[:, 1]], axis=1)
    edges = np.unique(edges, axis=0)
    if len(edges) > MOST_EDGES:
        return False
    for i in range(len(edges) - 1):
        others = edges[i + 1 :]
        apart = ~(others[:, :, None] == edges[i]).any(axis=(1, 2))
        p, q = points[edges[i, 0]], points[edges[i, 1]]
        r, s = points[others[apart, 0]], points[others[apart, 1]]
        if len(r) and segment_distances(p, q, r, s).min() <= 2 * radius:
            return False
    return _n_filled_triangles(points, edges, radius) < 4


def segment_distances(p: np.ndarray, q: np.ndarray, r: np.ndarray, s: np.ndarray) -> np.ndarray:
    """(n,) distances of segment pq to the segments rs (n, 3) each.

    The least of four end-to-segment distances, and of the distance of the lines where both feet
    lie inside.
    """
    ends = [_point_to_segments(p, r, s), _point_to_segments(q, r, s)]
    u = q - p
    length = u @ u
    for end in (r, s):
        t = np.clip((end - p) @ u / length, 0, 1)
        ends.append(np.linalg.norm(end - p - t[:, None] * u, axis=1))
    v = s - r
    normal = np.cross(u, v)
    size = np.einsum("ij,ij->i", normal, normal)
    crossing = size > 0
    size = np.where(crossing, size, 1.0)
    along = np.einsum("ij,ij->i", np.cross(r - p, v), normal) / size
    across = np.einsum("ij,ij->i", np.cross(r - p, u), normal) / size
    inner = crossing & (along > 0) & (along < 1) & (across > 0) & (across < 1)
    lines = np.abs(np.einsum("ij,ij->i", r - p, normal)) / np.sqrt(size)
    return np.minimum.reduce([*ends, np.where(inner, lines, np.inf)])


def _point_to_segments(p: np.ndarray, r: np.ndarray, s: np.ndarray) -> np.ndarray:
    v = s - r
    t = np.clip(np.einsum("ij,ij->i", p - r, v) / np.einsum("ij,ij->i", v, v), 0, 1)
    return np.linalg.norm(r + t[:, None] * v - p, axis=1)


def _n_filled_triangles(points: Points, edges: np.ndarray, radius: float) -> int:
    """Triangles of the graph whose three capsules could have a common point."""
    around: dict[int, set[int]] = {}
    for a, b in edges.tolist():
        around.setdefault(a, set()).add(b)
        around.setdefault(b, set()).add(a)
    n = 0
    for a, b in edges.tolist():
        for c in around[a] & around[b]:
            if c > b:
                n += _inradius(points[a], points[b], points[c]) <= radius
    return n


def _inradius(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> float:
    around = np.linalg.norm(b - a) + np.linalg.norm(c - b) + np.linalg.norm(a - c)
    return float(np.linalg.norm(np.cross(b - a, c - a)) / around)
