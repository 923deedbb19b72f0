"""What it means for a surface to be sound, by index alone."""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from meshsdf.mesh import Mesh


def joined(meshes):
    """All meshes as one, so that many small ones are judged at once."""
    first = np.cumsum([0] + [mesh.n_vertices for mesh in meshes])
    faces = [mesh.faces + np.int32(n) for mesh, n in zip(meshes, first[:-1], strict=True)]
    return Mesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(faces))


def directed_edges(faces):
    """(3 m,) start and end of every side of every face."""
    faces = faces.astype(np.int64)
    return faces.ravel(), np.roll(faces, -1, axis=1).ravel()


def open_edges(mesh):
    """(n, 2) sides that no other face runs through in the opposite direction."""
    start, end = directed_edges(mesh.faces)
    key, reverse = start * mesh.n_vertices + end, np.sort(end * mesh.n_vertices + start)
    at = np.searchsorted(reverse, key).clip(max=max(len(key) - 1, 0))
    return np.stack([start, end], axis=1)[reverse[at] != key]


def assert_manifold(mesh):
    """Oriented, edge- and vertex-manifold up to open edges; nothing unused, nothing twice."""
    n = mesh.n_vertices
    if n == 0:
        assert mesh.n_faces == 0
        return
    is_used = np.zeros(n, bool)
    is_used[mesh.faces] = True
    assert is_used.all(), "a vertex is unused"
    start, end = directed_edges(mesh.faces)
    assert (start != end).all(), "a face names a vertex twice"
    key = np.sort(start * n + end)
    assert (key[1:] != key[:-1]).all(), "an edge is used twice in one direction"
    corners = np.sort(mesh.faces, axis=1)
    corners = corners[np.lexsort(corners.T)]
    assert (corners[1:] != corners[:-1]).any(axis=1).all(), "a duplicate face"
    # The link of vertex v has a node for every edge at v and a side for every face at v.
    ends = np.sort(np.concatenate([key, end * n + start]))
    ends = ends[np.r_[True, ends[1:] != ends[:-1]]]
    faces = mesh.faces.astype(np.int64)
    others = (np.roll(faces, -turn, axis=1).ravel() for turn in (1, 2))
    a, b = (np.searchsorted(ends, start * n + other) for other in others)
    link = coo_array((np.ones(len(a), bool), (a, b)), shape=(len(ends), len(ends)))
    n_links, _ = connected_components(link, directed=False)
    assert n_links == n, "the faces around a vertex form more than one fan"


def assert_closed(mesh):
    """Every edge in exactly two faces, in opposite directions; every link one cycle; no face twice.

    For millions of faces: `assert_manifold` says the same, but takes several times as long.
    """
    n = mesh.n_vertices
    if n == 0:
        assert mesh.n_faces == 0
        return
    start, end = directed_edges(mesh.faces)
    assert (start != end).all(), "a face names a vertex twice"
    assert len(start) % 2 == 0, "an edge is open"
    key = np.minimum(start, end) * n + np.maximum(start, end)
    order = np.argsort(key)
    one, other = order[0::2], order[1::2]
    assert (key[one] == key[other]).all(), "an edge is open, or used more than twice"
    assert (key[one[1:]] != key[one[:-1]]).all(), "an edge is used more than twice"
    assert (start[one] == end[other]).all(), "an edge is used twice in one direction"
    # Around a vertex: from a side that starts there to its twin, and on to that one's successor
    turn = np.empty_like(order)
    turn[one], turn[other] = other, one
    turn = turn // 3 * 3 + (turn + 1) % 3
    assert (turn[turn] != np.arange(len(turn))).all(), "a face has a duplicate"
    first = np.arange(len(turn))  # of all sides reached by that: of 2, then 4, then 8, ...
    for _ in range(int(np.bincount(start).max()).bit_length()):
        first, turn = np.minimum(first, first[turn]), turn[turn]
    n_fans = np.count_nonzero(first == np.arange(len(first)))
    is_used = np.zeros(n, bool)
    is_used[mesh.faces] = True
    assert is_used.all(), "a vertex is unused"
    assert n_fans == n, "the faces around a vertex form more than one fan"


def euler_characteristic(mesh):
    return mesh.n_vertices - 3 * mesh.n_faces // 2 + mesh.n_faces  # closed meshes


def volume(mesh):
    """Signed volume; positive when faces are counter-clockwise from outside."""
    a, b, c = mesh.triangles.transpose(1, 0, 2)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def triangle_set(mesh):
    """(m, 9) triangles as positions, each from its least corner on, sorted: free of numbering."""
    _, rank = np.unique(mesh.vertices, axis=0, return_inverse=True)
    turn = (rank[mesh.faces].argmin(axis=1)[:, None] + np.arange(3)) % 3
    corners = np.take_along_axis(mesh.triangles, turn[:, :, None], axis=1).reshape(-1, 9)
    return corners[np.lexsort(corners.T[::-1])]


def vertex_set(mesh):
    """(n, 3) positions, sorted."""
    return mesh.vertices[np.lexsort(mesh.vertices.T[::-1])]
