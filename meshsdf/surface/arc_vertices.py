"""Vertices on arcs: where the edge between two loops' points would leave the surface.

An arc joins two crossings on a cell face and belongs to one loop of each of the two cells. The
mesh has an edge between the loops' points, the chord. It gets a vertex of its own where two arcs
have the same loops, so that their chords differ; where the chord strays from the mesh; and where
it cuts across the outside of a flat region, at a corner of it that points inwards.
"""

import numpy as np
from jaxtyping import Bool, Int64

from ..arrays import Points, Values
from ..kernels.arcs import arc_ends, mark_keys
from ..kernels.dual_arrays import Loops
from ..kernels.feature_search import ANY
from .brick_field import in_ranges
from .dual_faces import crossing_places
from .dual_loops import DualLoops
from .features import ALLOWED, FAR, FLAT, NEAR, OFF, REACH, TIGHT, LoopKinds
from .near_features import NearFeatures, Pairs

Keys = Int64[np.ndarray, " t"]
SHORTEST = 1e-6  # of a chord's length: shorter parts of it are not looked at


def folded_arcs(loops: DualLoops) -> Keys:
    """Keys of the arcs that need a vertex, because another one joins the same two loops."""
    after = np.roll(loops.folds, -1, axis=1)
    names = np.flatnonzero(loops.folds & (after >> 1) & 1)
    return names[find_ends(loops.arrays, names)[1]]


def find_ends(loops: Loops, names: Keys) -> tuple[Pairs, Bool[np.ndarray, " t"]]:
    """The crossings that arcs join, and which of the arcs' names are keys."""
    ends, is_key = np.empty((len(names), 2), np.int32), np.empty(len(names), np.bool_)
    arc_ends(names, loops, ends, is_key)
    return ends, is_key


def place_arcs(
    near: NearFeatures, folded: Keys, points: Points, kinds: LoopKinds
) -> tuple[np.ndarray, np.ndarray]:
    """Keys of the arcs with a vertex, in rising order, and where these lie.

    Parameters
    ----------
    near : NearFeatures
        Of the mesh.
    folded : (f,) int64
        What `folded_arcs` found.
    points : (l, 3) float64
        Vertices of the loops, voxels.
    kinds : LoopKinds
        What became of them.
    """
    is_taken = np.zeros(4 * len(near.loops.around), np.bool_)
    is_taken[folded] = True
    ends, _ = find_ends(near.loops, folded)
    middles = crossing_places(near.crossings, ends.ravel()).reshape(-1, 2, 3).mean(axis=1)
    found = [(folded, _settle(near, ends, middles))]
    keys = np.flatnonzero(_are_keys(near.loops, kinds.is_curved) & ~is_taken)
    ends, _ = find_ends(near.loops, keys)
    middles = points[_pairs(near.loops, keys)].mean(axis=1)
    _, is_off = near.walk(*_as_loops(ends), middles, ALLOWED)
    found.append((keys[is_off], _settle(near, ends[is_off], middles[is_off])))
    is_taken[keys[is_off]] = True
    keys = np.flatnonzero(_are_keys(near.loops, kinds.is_near) & ~is_taken)
    found.append(_bends(near, keys, points, kinds.is_sharp))
    keys, places = (np.concatenate(part) for part in zip(*found, strict=True))
    order = np.argsort(keys)
    return keys[order], places[order]


def _are_keys(loops: Loops, is_wanted: Bool[np.ndarray, " l"]) -> Bool[np.ndarray, " a"]:
    """Which names are keys of arcs between two loops of which one is wanted."""
    c = len(loops.around)
    is_marked = np.empty(4 * c, np.bool_)
    in_ranges(
        lambda begin, end: mark_keys(loops, is_wanted, begin, end, is_marked),
        c,
        nodes_per_item=16,
    )
    return is_marked


def _pairs(loops: Loops, keys: Keys) -> Pairs:
    """The loops on both sides of arcs."""
    c, q = keys >> 2, keys & 3
    return np.stack([loops.around[c, q], loops.around[c, (q + 1) & 3]], axis=1)


def _as_loops(ends: Pairs) -> tuple[Loops, np.ndarray]:
    """Arcs as loops with two crossings each, so that these can be searched from; all of them."""
    n = len(ends)
    start = np.arange(0, 2 * n + 1, 2, dtype=np.int32)
    no_cells, nothing = np.zeros((n, 3), np.int32), np.empty((0, 4), np.int32)
    return Loops(start, np.ascontiguousarray(ends.ravel()), no_cells, nothing), np.arange(n)


def _settle(near: NearFeatures, ends: Pairs, places: Points) -> Points:
    """Move places near arcs to the crease between the regions of their ends, or onto the mesh."""
    arcs, chosen = _as_loops(ends)
    settled, _ = near.walk(arcs, chosen, places, ALLOWED)
    labels = near.labels[ends]
    rest = np.flatnonzero((labels[:, 0] != labels[:, 1]) & (labels.min(axis=1) >= 0))
    found, squares = near.creases(places[rest], labels[rest], FAR * FAR)
    _, misfit = near.fit(arcs, rest, found)
    fits = (squares <= NEAR * NEAR) | (misfit <= TIGHT * (1.0 + np.sqrt(squares)))
    taken = np.isfinite(squares) & fits
    settled[rest[taken]] = found[taken]
    return settled


def _bends(
    near: NearFeatures, keys: Keys, points: Points, is_sharp: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Keys of chords that leave their flat region, and the corner each goes around."""
    ends, _ = find_ends(near.loops, keys)
    labels, pairs = near.labels[ends], _pairs(near.loops, keys)
    same = np.flatnonzero((labels[:, 0] == labels[:, 1]) & (labels[:, 0] >= 0))
    keys, ends, pairs = keys[same], ends[same], pairs[same]
    misfit = _misfit(near, ends, points[pairs[:, 0]], points[pairs[:, 1]])
    is_inner = ~is_sharp[pairs]
    strays = misfit <= FLAT
    strays[strays] = _strays(
        near, ends[strays], points[pairs[strays]], OFF + 4.0 * misfit[strays],
        is_inner[strays].any(axis=1),
    )  # fmt: skip
    keys, ends, chord = keys[strays], ends[strays], points[pairs[strays]]
    enough, is_inner = OFF + 4.0 * misfit[strays], is_inner[strays]
    found = np.full(len(keys), -1)
    for vertices in near.detours(ends, chord[:, 0].copy(), chord[:, 1].copy(), REACH).T:
        corner = near.features.points[vertices]
        one = np.stack([chord[:, 0], corner], axis=1)
        two = np.stack([corner, chord[:, 1]], axis=1)
        misses = _strays(near, ends, one, enough, is_inner[:, 0])
        misses |= _strays(near, ends, two, enough, is_inner[:, 1])
        is_right = (found < 0) & (vertices >= 0) & ~misses
        found[is_right] = vertices[is_right]
    return keys[found >= 0], near.features.points[found[found >= 0]]


def _misfit(near: NearFeatures, ends: Pairs, start: Points, stop: Points) -> Values:
    """How far the ends of chords are from the planes of both crossings of their arcs."""
    arcs, chosen = _as_loops(ends)
    return np.maximum(near.fit(arcs, chosen, start)[1], near.fit(arcs, chosen, stop)[1])


def _strays(
    near: NearFeatures,
    ends: Pairs,
    lines: np.ndarray,
    enough: Values,
    is_inner: Bool[np.ndarray, " t"],
) -> Bool[np.ndarray, " t"]:
    """Tell which lines, (t, 2, 3) points, leave their flat region.

    A line is cut wherever it meets a crease of the region; between two cuts it is on the region as
    a whole or not at all, and the middle tells which. With an end within the region
    (``is_inner``) and no cut it is.
    """
    start, stop = np.ascontiguousarray(lines[:, 0]), np.ascontiguousarray(lines[:, 1])
    cuts, n_cuts = near.cuts(ends, start, stop)
    rows = np.arange(len(ends))
    strays = np.zeros(len(ends), np.bool_)
    for k in range(int(n_cuts.max(initial=-1)) + 1):
        low = cuts[:, k - 1] if k else np.zeros(len(ends))
        high = np.where(k < n_cuts, cuts[:, min(k, cuts.shape[1] - 1)], 1.0)
        looked_at = (k <= n_cuts) & ~((n_cuts == 0) & is_inner) & ~strays
        looked = rows[looked_at]  # beyond the last cut there are no numbers
        some = looked[high[looked] - low[looked] > SHORTEST]
        middle = 0.5 * (low[some] + high[some])[:, None]
        places = (1.0 - middle) * start[some] + middle * stop[some]
        arcs, chosen = _as_loops(ends[some])
        _, is_off = near.walk(arcs, chosen, places, enough[some])
        some, places = some[is_off], places[is_off]
        # What is out of sight of the crossings may still be on a crease
        region = np.stack([near.labels[ends[some, 0]], np.full(len(some), ANY, np.int32)], axis=1)
        _, squares = near.creases(places, region, enough[some] ** 2)
        strays[some] = np.isinf(squares)
    return strays
