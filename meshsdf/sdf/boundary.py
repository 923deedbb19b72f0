"""The boundary of a placed mesh as a chain of closed loops, with the tree that sums over it.

The boundary of a chain of faces has no ends: at every vertex as many boundary half-edges arrive as
leave. Pairing them, in any way, gives closed loops (Euler).
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Int32

from ..arrays import Points
from ..kernels.boundary_tree import N_COLUMNS, follow_loops, measure_nodes, split_chain
from .placed_mesh import PlacedMesh

MORTON_BITS = 10


@dataclass(frozen=True, eq=False)
class Boundary:
    """Half-edges that faces use more often one way than the other, as often as that.

    Attributes
    ----------
    chain : (h, 2) int32
        From and to vertex of each, in the direction of its faces; loops follow each other.
    arrays : tuple
        What the kernels of `kernels.boundary_winding` ask for.
    """

    chain: Int32[np.ndarray, "h 2"]
    arrays: tuple[np.ndarray, ...]

    @classmethod
    def of(cls, placed: PlacedMesh) -> "Boundary":
        """Collect the boundary. O(h log h)."""
        table = placed.table
        net = table.net_uses
        line_of_edge = np.full(len(net), -1, np.int32)
        if len(placed.edge_line):
            used = table.edge_of_corner >= 0
            line_of_edge[table.edge_of_corner[used]] = placed.edge_line[used]
        edge = np.repeat(np.arange(len(net)), np.abs(net))
        chain = np.where((net[edge] > 0)[:, None], table.edges[edge], table.edges[edge, ::-1])
        order, loop = _loops(chain, placed.points)
        chain = np.ascontiguousarray(chain[order], np.int32)
        nodes = np.empty((2 * len(chain), 5), np.int32)
        n = split_chain(loop, nodes) if len(chain) else 0
        nodes = nodes[:n].copy()
        data = np.empty((n, N_COLUMNS))
        measure_nodes(placed.points, chain, nodes, data)
        lines = line_of_edge[edge[order]]
        return cls(chain, (placed.points, chain, lines, placed.line_ends, nodes, data))


def _loops(chain: np.ndarray, points: Points) -> tuple[np.ndarray, np.ndarray]:
    """Order of the half-edges, and the loop of each in that order; near loops are neighbours."""
    n = len(chain)
    after = np.empty(n, np.int32)
    after[np.argsort(chain[:, 1], kind="stable")] = np.argsort(chain[:, 0], kind="stable")
    order, loop = np.empty(n, np.int32), np.empty(n, np.int32)
    if n == 0:
        return order, loop
    n_loops = follow_loops(after, order, loop)
    middles = np.empty((n_loops, 3))
    n_edges = np.bincount(loop)
    for axis in range(3):
        middles[:, axis] = np.bincount(loop, points[chain[order, 0], axis]) / n_edges
    rank = np.empty(n_loops, np.int32)
    rank[np.argsort(_morton(middles), kind="stable")] = np.arange(n_loops)
    by_place = np.argsort(rank[loop], kind="stable")
    return order[by_place], rank[loop[by_place]]


def _morton(points: Points) -> np.ndarray:
    """Codes whose order keeps near points together."""
    low = points.min(axis=0)
    side = max(float((points - low).max()), 1e-300)
    cell = ((points - low) / side * (2**MORTON_BITS - 1)).astype(np.int64)
    code = np.zeros(len(points), np.int64)
    for bit in range(MORTON_BITS):
        for axis in range(3):
            code |= ((cell[:, axis] >> bit) & 1) << (3 * bit + axis)
    return code
