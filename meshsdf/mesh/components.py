"""The connected parts of a mesh, and whether each is closed and which way it faces."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Int32

from ..arrays import FaceLabels, Faces, Indices, Points
from ..box import Box
from ..kernels.edges import join_corners, join_faces, join_forests, number_components
from ..kernels.parallel import even_ranges, n_threads, run_pieces
from .edge_chain import ResidualLines
from .edge_table import EdgeTable

FACES_PER_SUM = 2**15
MOST_SUMS = 16
FACES_PER_FOREST = 2**16  # at least: joining forests costs as much as joining so many faces


@dataclass(frozen=True, eq=False)
class Component:
    """Faces that hang together by shared edges, or by edges that cancel on a common line.

    Attributes
    ----------
    n_faces : int
        Faces that repeat a corner belong to no component and are not counted.
    area : float
        Of all its faces, overlaps counted as often as they occur.
    volume : float
        Signed: positive when faces look outward. Means little unless closed and oriented.
    closed : bool
        Its own boundary vanishes modulo 2: it bounds a solid by itself.
    oriented : bool
        Its boundary vanishes with directions: neighbouring faces agree.
    inside_out : bool
        Closed, oriented, of negative volume, and no closed component of positive volume has a box
        around its box, so it cannot be the wall of a cavity.
    box : Box
        Around its vertices.
    """

    n_faces: int
    area: float
    volume: float
    closed: bool
    oriented: bool
    inside_out: bool
    box: Box


def component_labels(
    table: EdgeTable, lines: ResidualLines | None = None
) -> tuple[FaceLabels, int]:
    """Number the components in order of their first faces; -1 for faces that repeat a corner."""
    faces, ties = table.faces, np.empty((0, 2), np.int32)
    if lines is not None and lines.is_odd.any():
        tied = lines.is_odd & lines.is_closed_line()[lines.line]
        first_edge = np.zeros(lines.n_lines, dtype=np.int32)
        first_edge[lines.line[tied][::-1]] = lines.edge_index[tied][::-1]
        ties = np.stack([lines.edge_index[tied], first_edge[lines.line[tied]]], axis=1)
    # Where no vertex branches and nothing is tied, what a vertex joins is joined by edges too
    by_vertex = len(ties) == 0 and not table.is_branching.any()
    if by_vertex:
        parent = _connected_vertices(faces, len(table.is_branching))
    else:
        parent = np.arange(len(faces), dtype=np.int32)
        join_faces(table.half_edges, table.first, ties, parent)
    labels = np.empty(len(faces), dtype=np.int32)
    name = np.full(len(parent), -1, dtype=np.int32)
    return labels, number_components(faces, parent, by_vertex, name, labels)


def _connected_vertices(faces: Faces, n_vertices: int) -> Indices:
    """A forest whose trees are the sets of vertices that faces connect."""
    ranges = even_ranges(len(faces), min(n_threads(), 1 + len(faces) // FACES_PER_FOREST))
    forests = np.tile(np.arange(n_vertices, dtype=np.int32), (len(ranges), 1))
    run_pieces(lambda p: join_corners(faces, *ranges[p], forests[p]), len(ranges))
    for other in forests[1:]:
        join_forests(forests[0], other)
    return forests[0]


def describe_components(
    points: Points, faces: Faces, table: EdgeTable, lines: ResidualLines | None
) -> tuple[Component, ...]:
    """Measure every component of faces that name welded vertices."""
    from ..kernels.component_measures import measure_components  # only `check` waits for it

    labels, c = component_labels(table, lines)
    if c == 0:
        return ()
    center = Box.around(points).center
    # As many sums as the number of faces asks for, whatever the number of threads: same bits
    ranges = even_ranges(len(faces), min(MOST_SUMS, 1 + len(faces) // FACES_PER_SUM // c))
    n_faces = np.zeros((len(ranges), c), dtype=np.int64)
    area, volume = np.zeros((2, len(ranges), c))
    lower, upper = (np.full((len(ranges), c, 3), far) for far in (np.inf, -np.inf))

    def measure(p: int) -> None:
        sums = n_faces[p], area[p], volume[p], lower[p], upper[p]
        measure_components(points, faces, *ranges[p], labels, center, *sums)

    run_pieces(measure, len(ranges))
    n_faces, area, volume = n_faces.sum(axis=0), area.sum(axis=0), volume.sum(axis=0)
    lower, upper = lower.min(axis=0), upper.max(axis=0)
    closed, oriented = _closed_and_oriented(labels, c, table, lines)
    negative = closed & oriented & (volume < 0)
    around = np.flatnonzero(closed & (volume > 0))
    inside_out = np.zeros(c, dtype=np.bool_)
    for i in np.flatnonzero(negative):
        holds = (lower[around] <= lower[i]).all(axis=1) & (upper[around] >= upper[i]).all(axis=1)
        inside_out[i] = not holds.any()
    columns = (n_faces, area, volume, closed, oriented, inside_out)
    rows = zip(*(column.tolist() for column in columns), strict=True)
    return tuple(Component(*row, Box(lower[i], upper[i])) for i, row in enumerate(rows))


def _closed_and_oriented(
    labels: FaceLabels, c: int, table: EdgeTable, lines: ResidualLines | None
) -> tuple[Bool[np.ndarray, " c"], Bool[np.ndarray, " c"]]:
    """Add up the jumps of each component at each junction, modulo 2 and with directions."""
    closed, oriented = np.ones((2, c), dtype=np.bool_)
    if lines is None:
        return closed, oriented
    component = _component_of_edge(labels, table)[lines.edge_index]
    keys = lines.junction.astype(np.int64) * c + component[:, None]
    keys, place = np.unique(keys, return_inverse=True)
    owner = keys % c
    net = np.stack([lines.net_uses, -lines.net_uses], axis=1).ravel()
    jumps = np.bincount(place.ravel(), weights=net.astype(np.float64))
    oriented[owner[jumps != 0]] = False
    closed[owner[jumps % 2 != 0]] = False
    return closed, oriented


def _component_of_edge(labels: FaceLabels, table: EdgeTable) -> Int32[np.ndarray, " k"]:
    component = np.empty(table.n_edges + 1, dtype=np.int32)
    component[table.edge_of_corner] = labels[:, None]
    return component[:-1]
