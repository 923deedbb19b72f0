"""Sizes and counts of a mesh: area, volume, Euler number, components, open loops.

Counts go by vertex index and never look at positions: two vertices at one place are two vertices.
Whether positions close what indices leave open is answered by the two-set check.
"""

import numpy as np
from jaxtyping import Float64, Int64
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ..arrays import FaceValues
from .mesh import Mesh


def face_areas(mesh: Mesh) -> FaceValues:
    """(m,) area of every face, square world units; exactly 0 only where rounding says so."""
    return 0.5 * np.linalg.norm(_doubled_area_vectors(mesh), axis=1)


def face_normals(mesh: Mesh) -> Float64[np.ndarray, "m 3"]:
    """(m, 3) unit normals, outward for counter-clockwise faces; zero for faces without area.

    Notes
    -----
    Accuracy: edges are scaled to length 1 first, so neither tiny nor huge units lose the normal.
    The angle is off by about ``eps * (coordinate / height)``, where height is the smallest one of
    the triangle: needles far from the origin have poor normals.
    """
    edges = _edges_from_first_corner(mesh)
    scale = np.abs(edges).max(axis=(1, 2), initial=0.0)
    edges = edges / np.where(scale > 0, scale, 1.0)[:, None, None]
    normals = np.cross(edges[:, 0], edges[:, 1])
    length = np.linalg.norm(normals, axis=1)
    return normals / np.where(length > 0, length, 1.0)[:, None]


def area(mesh: Mesh) -> float:
    """Return the total area of the faces, square world units; overlapping faces count each."""
    return float(face_areas(mesh).sum())


def volume(mesh: Mesh) -> float:
    """Return the signed volume enclosed, cubic world units; negative when faces point inward.

    Notes
    -----
    Method: the divergence theorem, a sum of signed tetrahedra from every face to the centre of
    the box; of a solid wound w times around, the part counts w times. The surface has to be
    closed and oriented in space (indices may leave it open); otherwise the number depends on
    the centre and means nothing.
    Accuracy: as the reference is the box's centre, a solid far from the origin loses only what
    the rounding of its coordinates lost.
    """
    if mesh.n_faces == 0:
        return 0.0
    a, b, c = np.moveaxis(mesh.triangles - mesh.box.center, 1, 0)
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def euler_number(mesh: Mesh) -> int:
    """Return vertices - edges + faces, of the vertices that faces use and the edges by index.

    A closed surface of genus g that shares no edge or vertex with another has ``2 - 2 * g``.
    """
    edges = np.unique(np.sort(directed_edges(mesh), axis=1), axis=0)
    return len(np.unique(mesh.faces)) - len(edges) + mesh.n_faces


def n_components(mesh: Mesh) -> int:
    """Return the number of pieces, where faces that share an edge by index hang together."""
    edges, which = np.unique(np.sort(directed_edges(mesh), axis=1), axis=0, return_inverse=True)
    # A graph of faces and edges; the sides of face f are rows f, f + m and f + 2 m.
    face = np.tile(np.arange(mesh.n_faces), 3)
    links = np.column_stack([face, mesh.n_faces + which.ravel()])
    return _n_pieces(mesh.n_faces + len(edges), links)


def is_watertight(mesh: Mesh) -> bool:
    """Tell whether every edge lies in exactly two faces, once in each direction, by index.

    Notes
    -----
    Sufficient for an inside, not necessary: self-intersections pass, while T-junctions, unwelded
    vertices and four faces on one edge do not. A mesh without faces is not watertight.
    """
    edges = directed_edges(mesh)
    _, which, count = np.unique(
        np.sort(edges, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    direction = np.bincount(which.ravel(), weights=np.sign(edges[:, 1] - edges[:, 0]))
    return mesh.n_faces > 0 and bool((count == 2).all() and (direction == 0).all())


def n_boundary_loops(mesh: Mesh) -> int:
    """Return how many connected pieces the edges with exactly one face form, by index.

    Loops that touch at a vertex count as one.
    """
    edges, count = np.unique(np.sort(directed_edges(mesh), axis=1), axis=0, return_counts=True)
    used, ends = np.unique(edges[count == 1], return_inverse=True)
    return _n_pieces(len(used), ends.reshape(-1, 2))


def directed_edges(mesh: Mesh) -> Int64[np.ndarray, "e 2"]:
    """(3 m, 2) start and end of every face's sides: all first sides, then second, then third."""
    a, b, c = mesh.faces.astype(np.int64).T
    start, end = np.concatenate([a, b, c]), np.concatenate([b, c, a])
    return np.column_stack([start, end])


def _n_pieces(n_nodes: int, links: np.ndarray) -> int:
    """Number of connected components of a graph with (l, 2) links between its nodes."""
    if n_nodes == 0:
        return 0
    weights = np.ones(len(links), dtype=np.int8)
    graph = coo_array((weights, (links[:, 0], links[:, 1])), shape=(n_nodes, n_nodes))
    return int(connected_components(graph, directed=False, return_labels=False))


def _edges_from_first_corner(mesh: Mesh) -> Float64[np.ndarray, "m 2 3"]:
    triangles = mesh.triangles
    return triangles[:, 1:] - triangles[:, :1]


def _doubled_area_vectors(mesh: Mesh) -> Float64[np.ndarray, "m 3"]:
    edges = _edges_from_first_corner(mesh)
    return np.cross(edges[:, 0], edges[:, 1])
