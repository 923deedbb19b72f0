"""What it means for a surface to be sound, by index alone."""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components


def directed_edges(faces):
    """(3 m,) start and end of every side of every face."""
    faces = faces.astype(np.int64)
    return faces.ravel(), np.roll(faces, -1, axis=1).ravel()


def open_edges(mesh):
    """(n, 2) sides that no other face runs through in the opposite direction."""
    start, end = directed_edges(mesh.faces)
    alone = ~np.isin(start * mesh.n_vertices + end, end * mesh.n_vertices + start)
    return np.stack([start, end], axis=1)[alone]


def assert_manifold(mesh):
    """Oriented, edge- and vertex-manifold up to open edges; nothing unused, nothing twice."""
    n = mesh.n_vertices
    assert np.array_equal(np.unique(mesh.faces), np.arange(n)), "a vertex is unused"
    start, end = directed_edges(mesh.faces)
    assert (start != end).all(), "a face names a vertex twice"
    key = start * n + end
    assert len(np.unique(key)) == len(key), "an edge is used twice in one direction"
    assert len(np.unique(np.sort(mesh.faces, axis=1), axis=0)) == mesh.n_faces, "a duplicate face"
    # The link of vertex v has a node for every edge at v and a side for every face at v.
    ends = np.unique(np.concatenate([key, end * n + start]))
    corner = (
        np.roll(mesh.faces.astype(np.int64), -1, axis=1).ravel(),
        np.roll(mesh.faces.astype(np.int64), -2, axis=1).ravel(),
    )
    a, b = (np.searchsorted(ends, start * n + other) for other in corner)
    link = coo_array((np.ones(len(a), bool), (a, b)), shape=(len(ends), len(ends)))
    n_links, _ = connected_components(link, directed=False)
    assert n_links == n, "the faces around a vertex form more than one fan"


def assert_closed(mesh):
    """Every edge in exactly two faces, in opposite directions; every link one cycle."""
    assert_manifold(mesh)
    assert len(open_edges(mesh)) == 0


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
