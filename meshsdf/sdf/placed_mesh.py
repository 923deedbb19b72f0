"""The part of a mesh that distances are measured to, placed on a lattice.

Equal positions are welded, faces without area dropped (they bound nothing and their edges lie on
their neighbours), and sheets that cancel are dropped too, since nothing changes sides there:
faces in even number for parity, faces that come with their reverse for winding numbers.
"""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float64, Int32

from ..arrays import FaceLabels, FaceMask, Faces, Points
from ..errors import SdfError
from ..kernels.folds import edges_of_vertices, ends_of_edges, mark_corners, mark_folds
from ..kernels.parallel import even_ranges, n_threads, run_pieces
from ..mesh import (
    Mesh,
    TwoSetReport,
    degenerate_faces,
    net_faces,
    odd_faces,
    residual_edge_lines,
)
from ..mesh.edge_table import EdgeTable, edge_table
from ..mesh.welded import Welded
from .lattice import Lattice
from .union import MeshParts

EDGES_PER_PIECE = 2**15  # at least: less work than that is not worth a thread


@dataclass(frozen=True, eq=False)
class Features:
    """The edges and vertices that may be closest to a node: folds and corners.

    Attributes
    ----------
    ends : (e, 2) int32
        Vertices of each fold.
    order, first : (h,), (e + 1,) int32
        Fold e has the half-edges ``3 f + corner`` in ``order[first[e]:first[e + 1]]``.
    edges, start : (2 e,), (u + 1,) int32
        Vertex v touches the folds in ``edges[start[v]:start[v + 1]]``.
    corners : (c,) int32
        Vertices with folds that do not just run straight through.
    """

    ends: Int32[np.ndarray, "e 2"]
    order: Int32[np.ndarray, " h"]
    first: Int32[np.ndarray, " f"]
    edges: Int32[np.ndarray, " t"]
    start: Int32[np.ndarray, " s"]
    corners: Int32[np.ndarray, " c"]


def _no_weights() -> np.ndarray:
    return np.empty((0, 3, 3))


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
    weights : (m, 3, 3) or (0, 3, 3) float64
        Barycentrics of the corners on the face of the mesh that each is a part of; empty when all
        are whole.
    n_inner : int
        Faces of the mesh left out, wholly or in part, as they lie inside a union.
    """

    points: Points
    faces: Faces
    face_ids: FaceLabels
    table: EdgeTable
    edge_line: Int32[np.ndarray, "l 3"]
    line_ends: Int32[np.ndarray, "g 2"]
    weights: Float64[np.ndarray, "w 3 3"] = field(default_factory=_no_weights)
    n_inner: int = 0

    @classmethod
    def of_parts(cls, parts: MeshParts) -> "PlacedMesh":
        """Parts of faces, in local coordinates; crossings cannot be counted with them."""
        no_lines = np.empty((0, 3), np.int32), np.empty((0, 2), np.int32)
        table = edge_table(parts.faces, len(parts.points))
        return cls(
            *(parts.points, parts.faces, parts.face_ids, table),
            *(*no_lines, parts.weights, parts.n_inner),
        )

    def features(self, reach: float) -> Features:
        """Find the edges and vertices that may be closest to a node within ``reach`` voxels."""
        points, faces, table = self.points, self.faces, self.table
        order, first = table.half_edges, table.first
        is_fold = np.empty(table.n_edges, np.bool_)
        ranges = even_ranges(table.n_edges, min(n_threads(), 1 + table.n_edges // EDGES_PER_PIECE))
        run_pieces(
            lambda p: mark_folds(points, faces, order, first, *ranges[p], reach, is_fold),
            len(ranges),
        )
        folds = np.flatnonzero(is_fold).astype(np.int32)
        ends = np.empty((len(folds), 2), np.int32)
        ends_of_edges(faces, order, first, folds, ends)
        if len(folds) < table.n_edges:
            n_uses = np.diff(first)
            order = order[np.repeat(is_fold, n_uses)]
            first = np.concatenate([[0], np.cumsum(n_uses[folds])]).astype(np.int32)
        start = np.empty(len(points) + 1, np.int32)
        edges = np.empty(2 * len(folds), np.int32)
        edges_of_vertices(ends, len(points), start, edges)
        is_corner = np.empty(len(points), np.bool_)
        mark_corners(points, ends, start, edges, reach, is_corner)
        corners = np.flatnonzero(is_corner).astype(np.int32)
        return Features(ends, order, first, edges, start, corners)


def mesh_of_parts(welded: Welded, face_ids: FaceLabels, weights: np.ndarray) -> Mesh:
    """Return parts of faces as a mesh in world units; see ``weights`` of `PlacedMesh`."""
    if len(weights) == 0:
        return Mesh(welded.points, welded.faces[face_ids])
    corners = np.einsum("fij,fjk->fik", weights, welded.points[welded.faces[face_ids]])
    return Mesh(corners.reshape(-1, 3), np.arange(corners.size // 3, dtype=np.int32).reshape(-1, 3))


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
