"""The undirected edges of a mesh and how often faces use them, each way."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Int32

from ..arrays import Faces
from ..kernels.edges import number_edges, sort_half_edges


@dataclass(frozen=True, eq=False)
class EdgeTable:
    """The edges of all faces but those that repeat a corner, whose own edges cancel.

    Attributes
    ----------
    edges : (k, 2) int32
        Vertices of each edge, the lower index first; sorted.
    n_uses : (k,) int32
        How many faces have the edge.
    net_uses : (k,) int32
        Uses from lower to higher index minus uses the other way.
    edge_of_corner : (m, 3) int32
        The edge from corner e to corner (e + 1) % 3 of each face; -1 where a corner is repeated.
    half_edges : (h,) int32
        Half-edges ``3 f + e``, edge by edge, in the order of faces within an edge.
    """

    edges: Int32[np.ndarray, "k 2"]
    n_uses: Int32[np.ndarray, " k"]
    net_uses: Int32[np.ndarray, " k"]
    edge_of_corner: Int32[np.ndarray, "m 3"]
    half_edges: Int32[np.ndarray, " h"]

    @property
    def is_even(self) -> bool:
        """Every edge has an even number of faces: the two-set property, by index."""
        return not (self.n_uses % 2).any()

    @property
    def is_balanced(self) -> bool:
        """Every edge is used equally often each way: two-set and oriented, by index."""
        return not self.net_uses.any()


def edge_table(faces: Faces, n_vertices: int) -> EdgeTable:
    """Count the edges of ``faces``, which name vertices below ``n_vertices``. O(n + m)."""
    faces = np.array(faces)  # a writable copy: a read-only array would be compiled for anew
    order = np.empty(3 * len(faces), dtype=np.int32)
    order = order[: sort_half_edges(faces, n_vertices, order)]
    edge_of_corner = np.full((len(faces), 3), -1, dtype=np.int32)
    edges = np.empty((len(order), 2), dtype=np.int32)
    n_uses, net_uses = np.empty((2, len(order)), dtype=np.int32)
    k = number_edges(faces, order, edge_of_corner, edges, n_uses, net_uses)
    return EdgeTable(
        edges[:k].copy(), n_uses[:k].copy(), net_uses[:k].copy(), edge_of_corner, order
    )
