"""The edges that do not cancel by index, on the lines that carry them: do they cancel in space?

A set of intervals on a line, added modulo 2, is a function that jumps at x as often as intervals
end at x; it is zero far away, so it is zero everywhere if and only if every point ends an even
number of them. (With integer multiplicities the same holds for the sums of the signed jumps.)
As equal positions are welded, the test therefore only has to compare edges that share a vertex:
for every vertex, and every line through it, count the residual edges there that lie on that line.
No edge is cut and no two lines in space are ever compared.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Int32

from ..arrays import Faces, Points
from .collinear import are_collinear
from .edge_table import EdgeTable, edge_table
from .pieces import connected_labels

# Squared cosines to this axis tell lines through a vertex apart. Its components are not rational
# multiples of each other, so different directions of a lattice rarely share one.
AXIS = np.sqrt(np.array([1.0, 2.0, 5.0]) / 8.0)
# Differences and their quotients are off by 2 u each (u = 2**-53), the dot product by less than
# 12 u, its square over the squared length by less than 40 u; two of them by less than 80 u.
SAME_COSINE = 128 * 2.0**-53


@dataclass(frozen=True, eq=False)
class ResidualLines:
    """Edges with a net use, the places where they end, and the lines they form.

    A junction is a vertex together with one line through it. A line is a maximal set of residual
    edges connected through junctions; all of them lie on one line in space.

    Attributes
    ----------
    edge_index : (r,) int32
        Rows of the edge table with a net use. Edges used an odd number of times are among them.
    ends : (r, 2) int32
        Welded vertices of these edges, lower index first.
    net_uses : (r,) int32
        From lower to higher index.
    is_odd : (r,) bool
        Used by an odd number of faces.
    junction : (r, 2) int32
        The junction at either end.
    junction_vertex, junction_line : (j,) int32
        What each junction consists of.
    line : (r,) int32
        The line of each edge; lines are numbered from 0 without gaps.
    """

    edge_index: Int32[np.ndarray, " r"]
    ends: Int32[np.ndarray, "r 2"]
    net_uses: Int32[np.ndarray, " r"]
    is_odd: Bool[np.ndarray, " r"]
    junction: Int32[np.ndarray, "r 2"]
    junction_vertex: Int32[np.ndarray, " j"]
    junction_line: Int32[np.ndarray, " j"]
    line: Int32[np.ndarray, " r"]

    @property
    def n_lines(self) -> int:
        """Number of lines."""
        return int(self.line.max(initial=-1)) + 1

    def odd_junctions(self) -> Bool[np.ndarray, " j"]:
        """Mark the junctions where an odd number of odd edges end."""
        ended = self.junction[self.is_odd].ravel()
        return np.bincount(ended, minlength=len(self.junction_vertex)) % 2 == 1

    def is_balanced(self) -> bool:
        """Tell whether the edges cancel with their directions (integer multiplicities)."""
        jumps = np.stack([self.net_uses, -self.net_uses], axis=1).astype(np.float64)
        return not np.bincount(self.junction.ravel(), weights=jumps.ravel()).any()

    def is_closed_line(self) -> Bool[np.ndarray, " g"]:
        """Mark the lines on which odd edges cancel entirely."""
        closed = np.ones(self.n_lines, dtype=np.bool_)
        closed[self.junction_line[self.odd_junctions()]] = False
        return closed

    def open_edges(self) -> Int32[np.ndarray, "k 2"]:
        """List the ends of the odd edges on lines where something survives."""
        return self.ends[self.is_odd & ~self.is_closed_line()[self.line]]

    def survivors(self, points: Points) -> Int32[np.ndarray, "s 2"]:
        """Pair the odd junctions along each line: the intervals covered an odd number of times."""
        odd = np.flatnonzero(self.odd_junctions())
        vertices = self.junction_vertex[odd]
        x, y, z = points[vertices].T  # lexicographic order runs along any line
        order = np.lexsort((z, y, x, self.junction_line[odd]))
        return vertices[order].reshape(-1, 2)


def residual_lines(table: EdgeTable, points: Points) -> ResidualLines:
    """Group the edges with a net use by the lines they lie on. Exact for the given floats.

    Notes
    -----
    Cost: O(r log r) for r residual edges unless many edges at one vertex are parallel to within
    rounding without being parallel.
    """
    edge_index = np.flatnonzero(table.net_uses).astype(np.int32)
    ends = table.edges[edge_index]
    net_uses = table.net_uses[edge_index]
    vertex, other = ends.ravel(), ends[:, ::-1].ravel()
    label, leader = _same_lines(points, vertex, other)
    junction = label.reshape(-1, 2)
    n_junctions = len(leader)
    links = np.arange(len(ends)).repeat(2)
    line = connected_labels(len(ends) + n_junctions, np.column_stack([links, len(ends) + label]))
    _, line = np.unique(line, return_inverse=True)
    line = line.astype(np.int32)
    return ResidualLines(
        edge_index=edge_index,
        ends=ends,
        net_uses=net_uses,
        is_odd=net_uses % 2 != 0,
        junction=junction,
        junction_vertex=vertex[leader],
        junction_line=line[len(ends) :],
        line=line[: len(ends)],
    )


def _same_lines(points, vertex, other) -> tuple[np.ndarray, np.ndarray]:
    """Label edge ends so that equal labels mean: same vertex, other ends exactly in line with it.

    Ends that may be in line are neighbours when sorted by vertex and direction. In every cluster
    of such neighbours the first end not yet labelled leads, all that are in line with it follow;
    to be in line with a vertex is an equivalence, so rounds of this settle every cluster.
    Returns the labels and the leader of each.
    """
    cosine = _squared_cosine(points[other], points[vertex])
    todo = np.lexsort((cosine, vertex))
    apart = np.diff(vertex[todo], prepend=-1) != 0
    apart[1:] |= np.diff(cosine[todo]) > SAME_COSINE
    cluster = np.cumsum(apart)
    label = np.full(len(vertex), -1, dtype=np.int32)
    leaders: list[np.ndarray] = []
    n_labels = 0
    while len(todo):
        leads = np.diff(cluster, prepend=0) != 0
        group = np.cumsum(leads) - 1
        leader = todo[leads]
        same = leads.copy()
        ask = np.flatnonzero(~leads)
        led_by = leader[group[ask]]
        triples = np.stack([vertex[todo[ask]], other[led_by], other[todo[ask]]], axis=1)
        same[ask] = are_collinear(points, triples)
        label[todo[same]] = n_labels + group[same]
        n_labels += len(leader)
        leaders.append(leader)
        todo, cluster = todo[~same], cluster[~same]
    return label, np.concatenate(leaders) if leaders else np.empty(0, dtype=np.intp)


def _squared_cosine(heads: np.ndarray, tails: np.ndarray) -> np.ndarray:
    """Squared cosine of the angle to `AXIS`; one value for all where differences overflow."""
    with np.errstate(over="ignore", invalid="ignore"):
        direction = heads - tails
        direction /= np.abs(direction).max(axis=1, keepdims=True)
        cosine = (direction @ AXIS) ** 2 / np.einsum("ij,ij->i", direction, direction)
    return cosine if np.isfinite(cosine).all() else np.zeros(len(cosine))


def residual_edge_lines(
    faces: Faces, points: Points, *, table: EdgeTable | None = None
) -> tuple[Int32[np.ndarray, "l 3"], Int32[np.ndarray, "g 2"]]:
    """Name the supporting line of every edge that does not cancel by index.

    Parameters
    ----------
    faces : (m, 3) int32
        Welded vertex indices.
    points : (u, 3) float64
        Their positions, no two equal.

    Returns
    -------
    edge_line : (m, 3) int32, or (0, 3) when every edge cancels by index
        For the edge from corner e to corner (e + 1) % 3 of each face, the number of its line, or
        -1 if the faces on it use it equally often each way.
    line_ends : (g, 2) int32
        The vertices of each line that come first and last in lexicographic order of coordinates.

    Notes
    -----
    Edges of one line that meet at a vertex get one number, so arithmetic done with ``line_ends``
    rounds alike for the long edge and for the short ones of a T-junction.
    """
    if table is None:
        table = edge_table(faces, len(points))
    if table.is_balanced:
        return np.empty((0, 3), dtype=np.int32), np.empty((0, 2), dtype=np.int32)
    lines = residual_lines(table, points)
    line_of_edge = np.full(table.n_edges + 1, -1, dtype=np.int32)  # the last is for corner -1
    line_of_edge[lines.edge_index] = lines.line
    x, y, z = points[lines.junction_vertex].T
    order = np.lexsort((z, y, x, lines.junction_line))
    number = lines.junction_line[order]
    first = np.diff(number, prepend=-1) != 0
    last = np.diff(number, append=lines.n_lines) != 0
    ends = lines.junction_vertex[order]
    return line_of_edge[table.edge_of_corner], np.stack([ends[first], ends[last]], axis=1)
