"""The loops whose vertex crossings and normals alone would not put on the mesh.

A loop's labels are the smooth regions its crossings lie on. Where three regions meet in a corner
some loop sees them all, by Sperner's lemma (the crossings are the labelled vertices of a surface
cut into triangles), and along a crease a strip of loops sees both sides; their vertices belong
there. As every polygon lies around one crossing, whose label all its loops see, a polygon of a
flat region then has all its vertices in that region's plane.

Elsewhere the quadric's point is kept if it is near the mesh, and pulled there if not, as in a
fillet narrower than a cell. Beside an inner corner of a flat region it may lie in the plane but
off the region; then it moves to the rim.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from jaxtyping import Bool

from ..arrays import Number, Points, Values
from ..kernels.feature_search import ANY, mark_loops
from .brick_field import in_ranges
from .near_features import Chosen, NearFeatures

# All lengths are in voxels.
ALLOWED = 0.05
"""How far the quadric's points, and the middles of edges, may be from the mesh."""

NEAR = 1.0
"""Outside its cell a loop's feature is taken so far away; others only if they fit."""

FAR = 32.0
"""Nothing farther away is looked for. A wedge of 10 degrees has its edge 12 voxels from the last
cell with a node inside; thinner ones lose theirs."""

TIGHT = 1e-6
"""What fits all planes of a loop this well belongs to flat regions, so that it may be far."""

FLAT = 1e-4
"""Points no farther than this from the planes of all crossings: their region is called flat."""

OFF = 1e-7
"""Farther than this, and four times the distance from the planes, a point is off a flat region."""

REACH = 1.5
"""How far away the rim of a flat region is looked for, and its corners."""

Found = tuple[Points, Values]


@dataclass(frozen=True, eq=False)
class LoopKinds:
    """What became of each loop.

    Attributes
    ----------
    is_moved : (l,) bool
        Its vertex is not the quadric's point.
    is_sharp : (l,) bool
        Its vertex lies on a crease or corner.
    is_near : (l,) bool
        It is in a polygon with one on a crease or corner.
    is_curved : (l,) bool
        Its normals differ, or its vertex is sharp.
    """

    is_moved: Bool[np.ndarray, " l"]
    is_sharp: Bool[np.ndarray, " l"]
    is_near: Bool[np.ndarray, " l"]
    is_curved: Bool[np.ndarray, " l"]


def place_loops(
    near: NearFeatures, points: Points, is_curved: Bool[np.ndarray, " l"], feature_angle: Number
) -> LoopKinds:
    """Move ``points``, those of the quadrics, in place, to where the loops' vertices belong."""
    is_marked, is_sharp, is_moved = np.zeros((3, len(points)), np.bool_)
    cosine = float(np.cos(np.radians(feature_angle)))

    def mark(begin: int, end: int) -> None:
        mark_loops(
            near.loops, near.crossings.normals, near.labels, is_curved, cosine, begin, end,
            is_marked,
        )  # fmt: skip

    in_ranges(mark, len(points), nodes_per_item=16)
    chosen = np.flatnonzero(is_marked)
    feet, is_found = _snap(near, chosen, points[chosen])
    points[chosen], is_sharp[chosen] = feet, is_found
    chosen = np.flatnonzero(~is_sharp)
    points[chosen], is_moved[chosen] = near.walk(near.loops, chosen, points[chosen], ALLOWED)
    is_near = _neighbours(near.loops.around, is_sharp)
    chosen = np.flatnonzero(is_near & ~is_curved & ~is_marked)
    feet, is_found = _keep_on_regions(near, chosen, points[chosen])
    points[chosen], is_sharp[chosen] = feet, is_found
    return LoopKinds(is_moved | is_sharp, is_sharp, is_near, is_curved | is_sharp)


def _snap(
    near: NearFeatures, chosen: Chosen, places: Points
) -> tuple[Points, Bool[np.ndarray, " n"]]:
    """Move places to the features of their loops; which have one near, or in all their planes."""
    seen, n_seen = near.seen_labels(near.loops, chosen)
    feet, is_found = places.copy(), np.zeros(len(chosen), np.bool_)
    searches: list[Callable[..., Found]] = [_called_for, _instead]
    for search in searches:
        for limit in (9.0 * NEAR * NEAR, FAR * FAR):  # far away costs more, and is rarely needed
            rest = np.flatnonzero(~is_found)
            found, squares = search(near, places[rest], seen[rest], n_seen[rest], limit)
            outside, misfit = near.fit(near.loops, chosen[rest], found)
            fits = (outside <= NEAR) | (misfit <= TIGHT * (1.0 + outside))
            taken = np.isfinite(squares) & fits
            feet[rest[taken]], is_found[rest[taken]] = found[taken], True
    return feet, is_found


def _called_for(
    near: NearFeatures, places: Points, seen: np.ndarray, n_seen: np.ndarray, limit: float
) -> Found:
    """The crease of one or two regions, the corner of more."""
    feet, squares = places.copy(), np.full(len(places), np.inf)
    few = np.flatnonzero((n_seen > 0) & (n_seen < 3))
    pairs = seen[few, :2]
    alone = n_seen[few] == 1  # a crease that ends within the region, so it is but a guess
    pairs[alone, 1] = pairs[alone, 0]
    limits = np.where(alone, min(limit, NEAR * NEAR), limit)
    feet[few], squares[few] = near.creases(places[few], pairs, limits)
    many = np.flatnonzero(n_seen > 2)
    feet[many], squares[many] = near.corners(places[many], seen[many], n_seen[many], 3, limit)
    return feet, squares


def _instead(
    near: NearFeatures, places: Points, seen: np.ndarray, n_seen: np.ndarray, limit: float
) -> Found:
    """A corner of two regions that meet nowhere else; the crease of any two where more meet."""
    feet, squares = places.copy(), np.full(len(places), np.inf)
    two = np.flatnonzero(n_seen == 2)
    feet[two], squares[two] = near.corners(places[two], seen[two], n_seen[two], 2, limit)
    for i, j in combinations(range(int(n_seen.max(initial=0))), 2):
        many = np.flatnonzero((n_seen > 2) & (n_seen > j))
        found, found_squares = near.creases(places[many], seen[many][:, [i, j]], limit)
        nearer = found_squares < squares[many]
        feet[many[nearer]] = found[nearer]
        squares[many[nearer]] = found_squares[nearer]
    return feet, squares


def _neighbours(around: np.ndarray, is_sharp: np.ndarray) -> Bool[np.ndarray, " l"]:
    """Which loops are in a polygon with a sharp one."""
    sharp = np.append(is_sharp, False)[around].any(axis=1)
    is_near = np.zeros(len(is_sharp) + 1, np.bool_)
    is_near[around[sharp]] = True
    return is_near[:-1]


def _keep_on_regions(
    near: NearFeatures, chosen: Chosen, places: Points
) -> tuple[Points, Bool[np.ndarray, " n"]]:
    """Move places beside the flat regions of their loops to the rims; which were moved."""
    labels = near.labels[near.loops.sides[near.loops.start[chosen]]]
    _, misfit = near.fit(near.loops, chosen, places)
    _, is_off = near.walk(near.loops, chosen, places, OFF + 4.0 * misfit)
    is_off &= (misfit <= FLAT) & (labels >= 0)
    rest = np.flatnonzero(is_off)
    pairs = np.stack([labels[rest], np.full(len(rest), ANY, np.int32)], axis=1)
    feet = places.copy()
    feet[rest], squares = near.creases(places[rest], pairs, REACH * REACH)
    is_off[rest] = np.isfinite(squares)
    return feet, is_off
