"""The rims of the holes: where the boundary of a mesh does not cancel, traced into loops.

The boundary of a sum of faces has no boundary itself, so at every vertex an even number of rim
segments end and the rims are closed loops. Where rims touch, they are cut apart at the touching
vertices.

How far a hole can matter
-------------------------
Let every hole be filled by any surface inside the convex hull of its own rim: a flat disc, a soap
film, any triangulation of the rim's vertices. Two such fillings of one rim differ by a closed
surface inside that hull; a hull is convex, so that closed surface bounds a solid inside it, and
inside or outside is the same for both fillings at every point outside the hulls. A point of the
hull is nowhere further than L / 2π from a rim of length L: were the rim beyond that distance, its
projection onto the unit sphere around the point would be a closed curve shorter than 2π, hence
inside an open hemisphere, hence the point would not be in the hull.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Int32

from ..arrays import Points, Vector3
from ..kernels.loops import trace_loops


@dataclass(frozen=True, eq=False)
class Hole:
    """One loop of surviving boundary.

    Attributes
    ----------
    points : (k, 3) float64
        The corners of the rim in order; the last is joined to the first.
    closed : bool
        True: boundaries of surfaces have no ends.
    length : float
        World units.
    n_edges : int
        Straight pieces of the rim between corners; a mesh edge split by collinear vertices that
        cancel is one piece.
    center : (3,) float64
        The mean position along the rim.
    """

    points: Points
    closed: bool
    length: float
    n_edges: int
    center: Vector3

    @property
    def reach(self) -> float:
        """No point of the convex hull of the rim is further from the rim than this."""
        return self.length / (2 * np.pi)


def trace_holes(points: Points, segments: Int32[np.ndarray, "s 2"]) -> tuple[Hole, ...]:
    """Join segments between welded vertices to loops, the longest first."""
    if len(segments) == 0:
        return ()
    vertices, local = np.unique(segments, return_inverse=True)
    local = local.reshape(-1, 2).astype(np.int32)
    ends = local.ravel()
    incident = (np.argsort(ends, kind="stable") // 2).astype(np.int32)
    start = np.r_[0, np.cumsum(np.bincount(ends))].astype(np.int32)
    s = len(segments)
    loop_vertices, loop_start, path = np.empty((3, s + 1), dtype=np.int32)
    place = np.full(len(vertices), -1, dtype=np.int32)
    is_used = np.zeros(s, dtype=np.bool_)
    n_loops = trace_loops(local, start, incident, is_used, place, path, loop_vertices, loop_start)
    corners = points[vertices[loop_vertices[:s]]]
    return _measured(corners, loop_start[: n_loops + 1].astype(np.intp))


def _measured(corners: np.ndarray, start: np.ndarray) -> tuple[Hole, ...]:
    """Holes from the corners of all loops, one after the other, and where each loop starts."""
    following = np.arange(1, len(corners) + 1)
    following[start[1:] - 1] = start[:-1]
    after = corners[following]
    x, y, z = (after - corners).T
    lengths = np.hypot(np.hypot(x, y), z)  # squares would underflow for the smallest of meshes
    loop_lengths = np.add.reduceat(lengths, start[:-1])
    weights = lengths / np.repeat(loop_lengths, np.diff(start))
    middles = 0.5 * corners + 0.5 * after
    centers = np.add.reduceat(weights[:, None] * middles, start[:-1])
    return tuple(
        Hole(corners[start[i] : start[i + 1]], True, length, int(start[i + 1] - start[i]), center)
        for i in np.argsort(-loop_lengths, kind="stable").tolist()
        for length, center in [(float(loop_lengths[i]), centers[i])]
    )
