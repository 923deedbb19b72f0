"""The form of dual contouring whose vertices stay in their cells."""

import numpy as np

from ..kernels.cell_clamp import clamp_points, mark_bad_arcs
from .arc_vertices import find_ends
from .brick_field import in_ranges
from .dual_cases import parting_planes
from .dual_faces import crossing_places
from .located import Located

EDGE_MARGIN = 2.0**-14
"""Crossings are kept so far from the ends of their edges, as a fraction, that no two coincide."""


def clamped(located: Located) -> Located:
    """Return vertices so placed that triangles about all crossings do not cross each other."""
    loops, planes = located.loops, parting_planes()
    fractions = located.crossings.fractions.clip(EDGE_MARGIN, 1 - EDGE_MARGIN)
    crossings = located.crossings._replace(fractions=fractions)
    points = located.points.copy()
    is_bad = np.zeros(4 * loops.n_crossings, np.bool_)
    shared = loops.arrays, crossings, loops.kinds, planes

    def clamp(begin: int, end: int) -> None:
        clamp_points(*shared, begin, end, points)

    def mark(begin: int, end: int) -> None:
        mark_bad_arcs(*shared, points, begin, end, is_bad)

    in_ranges(clamp, loops.n_loops, nodes_per_item=32)
    in_ranges(mark, loops.n_crossings, nodes_per_item=32)
    arcs = np.flatnonzero(is_bad)
    ends, _ = find_ends(loops.arrays, arcs)
    places = crossing_places(crossings, ends.ravel()).reshape(-1, 2, 3).mean(axis=1)
    return Located(loops, crossings, points, arcs, places, -1.0)
