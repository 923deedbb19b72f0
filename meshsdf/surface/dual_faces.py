"""The triangles around all crossings, from points for loops, arcs and crossings."""

import numpy as np
from jaxtyping import Float64, Int64

from ..arrays import Faces, Number, Points
from ..kernels.dual_arrays import Crossings, Loops
from ..kernels.dual_faces import choose_pivots, count_triangles, fill_triangles, set_inserts
from ..progress import Progress, silent
from .brick_field import in_ranges

NODES_PER_CROSSING = 16  # work, in nodes of `in_ranges`


def join_loops(
    loops: Loops,
    crossings: Crossings,
    points: Points,
    arcs: Int64[np.ndarray, " t"],
    arc_points: Float64[np.ndarray, "t 3"],
    *,
    allowed: Number,
    progress: Progress = silent,
) -> tuple[np.ndarray, Faces]:
    """Surround every crossing with triangles.

    Parameters
    ----------
    loops, crossings
        Of the field.
    points, arcs, arc_points
        Vertices of the loops, and those on arcs by their keys in rising order; voxels.
    allowed : float
        In voxels. Crossings farther than this from the planes of their triangles become vertices:
        all of them if negative, only those whose polygon is not whole if infinite.
    progress : Progress
        Called between pieces of work.

    Returns
    -------
    vertices, faces
        Points of loops, arcs and crossings, some perhaps without faces; voxels.
    """
    c = len(crossings.ways)
    inserts = np.zeros(c, np.uint8)
    set_inserts(arcs, loops, inserts)
    vertices = np.concatenate([points, arc_points])
    pivots, counts = np.empty(c, np.int8), np.empty(c, np.int64)
    shared = loops, crossings, inserts, arcs, vertices, float(allowed)

    def count(begin: int, end: int) -> None:
        choose_pivots(*shared, begin, end, pivots)
        count_triangles(loops, inserts, pivots, begin, end, counts)

    in_ranges(count, c, "polygons", progress, nodes_per_item=NODES_PER_CROSSING)
    is_hub = pivots < 0
    hub_of = np.full(c, -1, np.int32)
    hub_of[is_hub] = np.arange(len(vertices), len(vertices) + np.count_nonzero(is_hub))
    first_face = np.concatenate([[0], np.cumsum(counts)])
    faces = np.empty((int(first_face[-1]), 3), np.int32)

    def fill(begin: int, end: int) -> None:
        fill_triangles(loops, inserts, arcs, hub_of, pivots, first_face, begin, end, faces)

    in_ranges(fill, c, "surface", progress, nodes_per_item=NODES_PER_CROSSING)
    return np.concatenate([vertices, crossing_places(crossings, np.flatnonzero(is_hub))]), faces


def crossing_places(crossings: Crossings, rows: np.ndarray) -> Points:
    """Return where some crossings lie, voxels."""
    places = crossings.nodes[rows].astype(np.float64)
    places[np.arange(len(rows)), crossings.ways[rows] >> 1] += crossings.fractions[rows]
    return places
