"""The undirected edges of a mesh and how often faces use them, each way."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Int32

from ..arrays import Faces, writable_alias
from ..kernels.edges import (
    CONFLICTS,
    N_COUNTS,
    NONMANIFOLD,
    ODD,
    TWINS,
    UNBALANCED,
    count_corners,
    edges_of_stars,
    place_corners,
    read_edges,
)
from ..kernels.parallel import even_ranges, n_threads, run_pieces

FACES_PER_PIECE = 2**15  # at least: less work than that is not worth a thread
MOST_PIECES = 8  # every piece reads all faces

_NO_EDGES = np.empty((0, 2), np.int32)
_NOTHING = np.empty(0, np.int32)


@dataclass(frozen=True, eq=False)
class EdgeTable:
    """The edges of all faces but those that repeat a corner, whose own edges cancel.

    Edges are numbered by lower end, then upper end.

    Attributes
    ----------
    faces : (m, 3) int32
        The faces.
    half_edges : (h,) int32
        Half-edges ``3 f + e``, edge by edge, in the order of faces within an edge.
    first : (k + 1,) int32
        Edge i has ``half_edges[first[i]:first[i + 1]]``.
    is_branching : (n,) bool
        Vertices whose link is neither one cycle nor one path: they lie on an edge with more than
        two faces, or their corners fall into fans that no edge connects.
    n_odd, n_unbalanced, n_conflicts, n_nonmanifold : int
        Edges in an odd number of faces; used more often one way than the other; the same but in an
        even number of faces; in more than two.
    may_have_twins : bool
        False only if no two of the faces have the same three corners.
    """

    faces: Faces
    half_edges: Int32[np.ndarray, " h"]
    first: Int32[np.ndarray, " f"]
    is_branching: Bool[np.ndarray, " n"]
    n_odd: int
    n_unbalanced: int
    n_conflicts: int
    n_nonmanifold: int
    may_have_twins: bool

    @property
    def n_edges(self) -> int:
        """How many edges there are."""
        return len(self.first) - 1

    @property
    def is_even(self) -> bool:
        """Every edge has an even number of faces: the two-set property, by index."""
        return self.n_odd == 0

    @property
    def is_balanced(self) -> bool:
        """Every edge is used equally often each way: two-set and oriented, by index."""
        return self.n_unbalanced == 0

    @property
    def n_uses(self) -> Int32[np.ndarray, " k"]:
        """How many faces have each edge."""
        return np.diff(self.first)

    @cached_property
    def edges(self) -> Int32[np.ndarray, "k 2"]:
        """Vertices of each edge, the lower index first; sorted."""
        edges = np.empty((self.n_edges, 2), np.int32)
        read_edges(self.faces, self.half_edges, self.first, edges, _NOTHING, _NOTHING)
        return edges

    @cached_property
    def net_uses(self) -> Int32[np.ndarray, " k"]:
        """Uses from lower to higher index minus uses the other way."""
        net_uses = np.zeros(self.n_edges, np.int32)
        read_edges(self.faces, self.half_edges, self.first, _NO_EDGES, net_uses, _NOTHING)
        return net_uses

    @cached_property
    def edge_of_corner(self) -> Int32[np.ndarray, "m 3"]:
        """The edge from corner e to corner (e + 1) % 3 of each face; -1 where one is repeated."""
        corners = np.full(3 * len(self.faces), -1, np.int32)
        read_edges(self.faces, self.half_edges, self.first, _NO_EDGES, _NOTHING, corners)
        return corners.reshape(-1, 3)


def edge_table(faces: Faces, n_vertices: int) -> EdgeTable:
    """List the edges of ``faces``, which name vertices below ``n_vertices``. O(n + m)."""
    faces = writable_alias(faces)
    n_pieces = min(n_threads(), MOST_PIECES, 1 + len(faces) // FACES_PER_PIECE)
    ranges = even_ranges(n_vertices, n_pieces)
    start, low_start = np.zeros((2, n_vertices + 1), np.int32)
    run_pieces(lambda p: count_corners(faces, *ranges[p], start, low_start), len(ranges))
    np.cumsum(start, out=start)
    np.cumsum(low_start, out=low_start)
    star = np.empty(start[-1], np.int32)
    place = start.copy()
    run_pieces(lambda p: place_corners(faces, *ranges[p], place, star), len(ranges))
    half_edges = np.empty(low_start[-1], np.int32)
    first = np.empty(low_start[-1] + 1, np.int32)
    is_branching = np.zeros(n_vertices, np.bool_)
    counts = np.zeros((len(ranges), N_COUNTS), np.int64)
    n_edges = [0] * len(ranges)

    def list_edges(p: int) -> None:
        n_edges[p] = edges_of_stars(
            faces, start, star, low_start, *ranges[p], half_edges, first, is_branching, counts[p]
        )

    run_pieces(list_edges, len(ranges))
    found = [first[low_start[v] :][:n] for (v, _), n in zip(ranges, n_edges, strict=True)]
    first = np.concatenate([*found, low_start[-1:]])
    total = counts.sum(axis=0).tolist()
    return EdgeTable(
        faces=faces,
        half_edges=half_edges,
        first=first,
        is_branching=is_branching,
        n_odd=total[ODD],
        n_unbalanced=total[UNBALANCED],
        n_conflicts=total[CONFLICTS],
        n_nonmanifold=total[NONMANIFOLD],
        may_have_twins=total[TWINS] > 0,
    )
