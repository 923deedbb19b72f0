"""The part of a mesh that distances are measured to, placed on a lattice.

Equal positions are welded, faces without area dropped (they bound nothing and their edges lie on
their neighbours), and sheets that cancel are dropped too, since nothing changes sides there:
faces in even number for parity, faces that come with their reverse for winding numbers.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Int32

from ..arrays import FaceLabels, Faces, Points
from ..errors import SdfError
from ..kernels.half_edges import edges_of_vertices, group_edges, sort_half_edges
from ..mesh import Mesh
from ..mesh.edge_chain import residual_edge_lines
from ..mesh.faces import degenerate_faces, net_faces, odd_faces
from ..mesh.weld import weld
from .lattice import Lattice


@dataclass(frozen=True, eq=False)
class Features:
    """Edges with their half-edges, and vertices with their edges; see `kernels.half_edges`."""

    order: Int32[np.ndarray, " h"]
    ends: Int32[np.ndarray, "e 2"]
    first: Int32[np.ndarray, " f"]
    start: Int32[np.ndarray, " s"]
    edges: Int32[np.ndarray, " t"]


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
    edge_line : (m, 3) or (0, 3) int32
        Supporting line of edges that cancel only geometrically, else -1; empty when there are none.
    line_ends : (g, 2) int32
        The two outermost vertices on each supporting line.
    n_dropped : int
        Faces that were left out.
    """

    points: Points
    faces: Faces
    face_ids: FaceLabels
    edge_line: Int32[np.ndarray, "l 3"]
    line_ends: Int32[np.ndarray, "g 2"]
    n_dropped: int

    @cached_property
    def features(self) -> Features:
        """Edges and vertices of the faces."""
        n = 3 * len(self.faces)
        order = np.empty(n, np.int32)
        sort_half_edges(self.faces, len(self.points), order)
        ends, first = np.empty((n, 2), np.int32), np.empty(n + 1, np.int32)
        n_edges = group_edges(self.faces, order, ends, first)
        ends, first = ends[:n_edges].copy(), first[: n_edges + 1].copy()
        start = np.empty(len(self.points) + 1, np.int32)
        edges = np.empty(2 * n_edges, np.int32)
        edges_of_vertices(ends, len(self.points), start, edges)
        return Features(order, ends, first, start, edges)


def weld_faces(mesh: Mesh) -> tuple[Points, Faces]:
    """Return the distinct positions of the mesh, and its faces in terms of them."""
    labels, points = weld(mesh.vertices)
    return points, labels[mesh.faces]


def place(points: Points, faces: Faces, lattice: Lattice, *, cancel: str) -> PlacedMesh:
    """Keep what bounds something and express it in voxels of the lattice.

    Parameters
    ----------
    points, faces
        From `weld_faces`.
    lattice : Lattice
        Where to place it.
    cancel : "parity", "winding" or "unsigned"
        Which sheets to drop: those in even number, those that come with their reverse, or none.

    Raises
    ------
    SdfError
        Nothing is left.
    """
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
    edge_line, line_ends = residual_edge_lines(faces, points)
    if len(edge_line):
        edge_line = edge_line[keep]
    return PlacedMesh(
        lattice.to_local(points),
        np.ascontiguousarray(faces[keep]),
        np.flatnonzero(keep).astype(np.int32),
        np.ascontiguousarray(edge_line),
        line_ends,
        int(len(faces) - keep.sum()),
    )
