"""The part of a mesh that distances are measured to, placed on a lattice.

Equal positions are welded, faces without area dropped (they bound nothing and their edges lie on
their neighbours), and sheets that cancel are dropped too, since nothing changes sides there:
faces in even number for parity, faces that come with their reverse for winding numbers.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Int32

from ..arrays import FaceLabels, FaceMask, Faces, Points
from ..errors import SdfError
from ..kernels.vertex_edges import edges_of_vertices
from ..mesh import (
    TwoSetReport,
    degenerate_faces,
    net_faces,
    odd_faces,
    residual_edge_lines,
)
from ..mesh.edge_table import EdgeTable, edge_table
from ..mesh.welded import Welded
from .lattice import Lattice


@dataclass(frozen=True, eq=False)
class Features:
    """Edges with their half-edges, and vertices with their edges.

    Attributes
    ----------
    ends : (e, 2) int32
        Vertices of each edge.
    order, first : (h,), (e + 1,) int32
        Edge e has the half-edges ``3 f + corner`` in ``order[first[e]:first[e + 1]]``.
    edges, start : (2 e,), (u + 1,) int32
        Vertex v touches the edges in ``edges[start[v]:start[v + 1]]``.
    """

    ends: Int32[np.ndarray, "e 2"]
    order: Int32[np.ndarray, " h"]
    first: Int32[np.ndarray, " f"]
    edges: Int32[np.ndarray, " t"]
    start: Int32[np.ndarray, " s"]


@dataclass(frozen=True, eq=False)
class PlacedMesh:
    """Welded triangles in local index coordinates.

    Attributes
    ----------
    points : (u, 3) float64
        Voxels from the lattice's local origin.
    faces : (m, 3) int32
        Faces that bound something.
    face_ids : (m,) int32
        Their numbers in the mesh.
    table : EdgeTable
        Their edges.
    edge_line : (m, 3) or (0, 3) int32
        Supporting line of edges that cancel only geometrically, else -1; empty when there are none.
    line_ends : (g, 2) int32
        The two outermost vertices on each supporting line.
    """

    points: Points
    faces: Faces
    face_ids: FaceLabels
    table: EdgeTable
    edge_line: Int32[np.ndarray, "l 3"]
    line_ends: Int32[np.ndarray, "g 2"]

    @cached_property
    def features(self) -> Features:
        """Edges and vertices of the faces."""
        table = self.table
        first = np.zeros(len(table.edges) + 1, np.int32)
        np.cumsum(table.n_uses, out=first[1:])
        start = np.empty(len(self.points) + 1, np.int32)
        edges = np.empty(2 * len(table.edges), np.int32)
        edges_of_vertices(table.edges, len(self.points), start, edges)
        return Features(table.edges, table.half_edges, first, edges, start)


def bounding_faces(welded: Welded, *, cancel: str, report: TwoSetReport | None = None) -> FaceMask:
    """Mark the faces that bound something.

    Parameters
    ----------
    welded : Welded
        Of the mesh.
    cancel : "parity", "winding" or "unsigned"
        Which sheets to leave out: those in even number, those that come with their reverse, none.
    report : TwoSetReport, optional
        What `check` said of the mesh; saves the search where it found nothing to leave out.

    Raises
    ------
    SdfError
        Nothing is left.
    """
    points, faces = welded.points, welded.faces
    if report is not None and report.n_degenerate_faces == report.n_duplicate_faces == 0:
        return np.ones(len(faces), bool)
    keep = ~degenerate_faces(points, faces)
    if not keep.any():
        raise SdfError(
            f"all {len(faces)} faces are degenerate: their corners lie on one line",
            "mesh_to_band(mesh)",
            "export the mesh again with faces that have area",
        )
    if cancel != "unsigned":
        keep &= odd_faces(faces) if cancel == "parity" else net_faces(faces)
    if not keep.any():
        raise SdfError(
            f"all {len(faces)} faces cancel: every sheet comes twice, so nothing has an inside",
            f'mesh_to_band(sign="{cancel}")',
            'pass sign="unsigned" to measure the distance to the sheets',
        )
    return keep


def place(
    welded: Welded, lattice: Lattice, *, cancel: str, report: TwoSetReport | None = None
) -> PlacedMesh:
    """Express the faces that bound something in voxels of the lattice; see `bounding_faces`."""
    points, faces, table = welded.points, welded.faces, welded.table
    keep = bounding_faces(welded, cancel=cancel, report=report)
    face_ids = np.flatnonzero(keep).astype(np.int32)
    if not keep.all():
        faces = np.ascontiguousarray(faces[keep])
        table = edge_table(faces, len(points))
    edge_line, line_ends = residual_edge_lines(faces, points, table=table)
    return PlacedMesh(lattice.to_local(points), faces, face_ids, table, edge_line, line_ends)
