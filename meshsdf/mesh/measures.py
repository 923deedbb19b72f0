"""Sizes and counts of a mesh: area, volume, Euler number, components, open loops.

Counts go by vertex index and never look at positions: two vertices at one place are two vertices.
Whether positions close what indices leave open is answered by the two-set check.
"""

import numpy as np
from jaxtyping import Float64

from ..arrays import FaceValues
from .components import component_labels
from .edge_table import EdgeTable, edge_table
from .mesh import Mesh
from .pieces import connected_labels


def face_areas(mesh: Mesh) -> FaceValues:
    """(m,) area of every face, square world units; exactly 0 only where rounding says so."""
    edges = _edges_from_first_corner(mesh)
    return 0.5 * np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)


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

    A closed surface of genus g that shares no edge or vertex with another has ``2 - 2 * g``. Sides
    that join a vertex to itself are no edges.
    """
    used = np.zeros(mesh.n_vertices, bool)
    used[mesh.faces] = True
    return int(used.sum()) - _edges(mesh).n_edges + mesh.n_faces


def genus(mesh: Mesh) -> int | None:
    """Return the number of handles of all components together, by index; None unless watertight.

    Fans of faces that touch at a vertex without sharing an edge are taken apart there first.
    """
    if not is_watertight(mesh):
        return None
    table = _edges(mesh)
    # Corners at one vertex hang together over the two faces of an edge
    one, two = table.half_edges.reshape(-1, 2).T
    face, turn = np.divmod(np.stack([one, two]), 3)
    after = 3 * face + (turn + 1) % 3
    links = np.concatenate([np.column_stack([one, after[1]]), np.column_stack([after[0], two])])
    n_fans = int(connected_labels(3 * mesh.n_faces, links).max()) + 1
    euler = n_fans - table.n_edges + mesh.n_faces
    return n_components(mesh) - euler // 2


def n_components(mesh: Mesh) -> int:
    """Return the number of pieces, where faces that share an edge by index hang together."""
    labels, n_pieces = component_labels(_edges(mesh))
    return n_pieces + int((labels < 0).sum())


def is_watertight(mesh: Mesh) -> bool:
    """Tell whether every edge lies in exactly two faces, once in each direction, by index.

    Notes
    -----
    Sufficient for an inside, not necessary: self-intersections pass, while T-junctions, unwelded
    vertices and four faces on one edge do not. A mesh without faces is not watertight.
    """
    table = _edges(mesh)
    has_edges = 0 < mesh.n_faces == len(table.half_edges) / 3
    return has_edges and table.n_nonmanifold == 0 and table.is_balanced


def n_boundary_loops(mesh: Mesh) -> int:
    """Return how many connected pieces the edges with exactly one face form, by index.

    Loops that touch at a vertex count as one.
    """
    table = _edges(mesh)
    used, ends = np.unique(table.edges[table.n_uses == 1], return_inverse=True)
    if len(used) == 0:
        return 0
    return int(connected_labels(len(used), ends.reshape(-1, 2)).max()) + 1


def welded(mesh: Mesh) -> Mesh:
    """Return the shape of the mesh with equal positions made one vertex, attributes left out.

    Faces that then repeat a corner are left out too: they are edges that shrank to a point, which
    changes neither the Euler number nor the number of components.
    """
    faces = mesh.welded.faces
    repeats = (faces == np.roll(faces, 1, axis=1)).any(axis=1)
    return Mesh(mesh.welded.points, faces[~repeats])


def _edges(mesh: Mesh) -> EdgeTable:
    return edge_table(mesh.faces, mesh.n_vertices)


def _edges_from_first_corner(mesh: Mesh) -> Float64[np.ndarray, "m 2 3"]:
    triangles = mesh.triangles
    return triangles[:, 1:] - triangles[:, :1]
