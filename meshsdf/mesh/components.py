"""The connected parts of a mesh, and whether each is closed and which way it faces."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Int32

from ..arrays import FaceLabels, Faces, Points
from ..box import Box
from ..kernels.component_measures import measure_components
from ..kernels.edges import connect_faces
from .edge_chain import ResidualLines
from .edge_table import EdgeTable


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


def component_labels(table: EdgeTable, lines: ResidualLines | None) -> tuple[FaceLabels, int]:
    """Number the components in order of their first faces; -1 for faces that repeat a corner."""
    edge_of_corner = table.edge_of_corner
    if lines is not None and lines.is_odd.any():
        alias = np.arange(len(table.edges) + 1, dtype=np.int32)
        alias[-1] = -1
        tied = lines.is_odd & lines.is_closed_line()[lines.line]
        first_edge = np.zeros(lines.n_lines, dtype=np.int32)
        first_edge[lines.line[tied][::-1]] = lines.edge_index[tied][::-1]
        alias[lines.edge_index[tied]] = first_edge[lines.line[tied]]
        edge_of_corner = alias[edge_of_corner]
    labels = np.empty(len(edge_of_corner), dtype=np.int32)
    return labels, connect_faces(edge_of_corner, len(table.edges), labels)


def describe_components(
    points: Points, faces: Faces, table: EdgeTable, lines: ResidualLines | None
) -> tuple[Component, ...]:
    """Measure every component of faces that name welded vertices."""
    labels, c = component_labels(table, lines)
    if c == 0:
        return ()
    center = Box.around(points).center
    n_faces = np.zeros(c, dtype=np.int64)
    area, volume = np.zeros((2, c))
    lower, upper = np.full((c, 3), np.inf), np.full((c, 3), -np.inf)
    measure_components(points, faces, labels, center, n_faces, area, volume, lower, upper)
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
    component = np.empty(len(table.edges) + 1, dtype=np.int32)
    component[table.edge_of_corner] = labels[:, None]
    return component[:-1]
