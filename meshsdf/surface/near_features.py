"""Batches of searches on one mesh: creases, corners, and the surface itself."""

import numpy as np
from jaxtyping import Bool, Float64, Int32, Int64

from ..arrays import Number, Points, Values
from ..kernels import feature_search
from ..kernels.bvh import EMPTY, PAD, build_tree
from ..kernels.chords import MOST_CORNERS, MOST_CUTS, corners_around, cut_chords
from ..kernels.dual_arrays import Crossings, Features, Loops, Surface, Tree
from ..kernels.surface_walk import find_neighbours, walk_points
from .brick_field import in_ranges
from .dual_loops import DualLoops
from .mesh_hits import MeshHits
from .regions import Regions

NODES_PER_SEARCH = 64  # work, in nodes of `in_ranges`

Pairs = Int32[np.ndarray, "n 2"]
Chosen = Int64[np.ndarray, " n"]


class NearFeatures:
    """Searches near the crossings of one field with one mesh; lengths in voxels.

    Attributes
    ----------
    loops, crossings
        Of the field.
    labels : (c,) int32
        The region that every crossing lies on, or -1.
    """

    def __init__(self, loops: DualLoops, regions: Regions, hits: MeshHits) -> None:
        beside = np.empty_like(regions.faces)
        find_neighbours(regions.half_edges, regions.first_half_edge, beside)
        self.loops = loops.arrays
        self.crossings = Crossings(loops.nodes, loops.ways, hits.fractions, hits.normals)
        self.labels = np.append(regions.labels, np.int32(-1))[hits.faces]
        self.surface = Surface(hits.points, regions.faces, beside, hits.faces)
        ends, corners = hits.points[regions.creases], hits.points[regions.corners]
        self.features = Features(
            hits.points,
            regions.creases,
            regions.sides,
            _tree(ends.min(axis=1, initial=np.inf), ends.max(axis=1, initial=-np.inf)),
            regions.corners,
            regions.corner_start,
            regions.corner_labels,
            _tree(corners, corners),
        )

    def seen_labels(self, loops: Loops, chosen: Chosen) -> tuple[np.ndarray, np.ndarray]:
        """(n, 12) labels that each of the loops chosen sees, and (n,) how many."""
        seen = np.full((len(chosen), feature_search.MOST_LABELS), -1, np.int32)
        n_seen = np.empty(len(chosen), np.int8)
        feature_search.list_labels(loops, self.labels, chosen, seen, n_seen)
        return seen, n_seen

    def fit(self, loops: Loops, chosen: Chosen, places: Points) -> tuple[Values, Values]:
        """How far places lie outside the cells of loops, and from the planes of their crossings."""
        outside, misfit = np.empty((2, len(chosen)))
        feature_search.measure_fit(loops, self.crossings, chosen, places, outside, misfit)
        return outside, misfit

    def creases(
        self, places: Points, pairs: Pairs, limit: Number | Values
    ) -> tuple[Points, Values]:
        """Nearest points of creases between regions, and squared distances; `nearest_creases`."""
        n = len(places)
        pairs, limits = np.sort(pairs, axis=1), np.full(n, limit, np.float64)
        pairs[pairs[:, 0] == feature_search.ANY] = pairs[pairs[:, 0] == feature_search.ANY, ::-1]
        feet, squares = places.copy(), np.empty(n)

        def search(begin: int, end: int) -> None:
            feature_search.nearest_creases(
                self.features, places, pairs, limits, begin, end, feet, squares
            )

        in_ranges(search, n, nodes_per_item=NODES_PER_SEARCH)
        return feet, squares

    def corners(
        self, places: Points, seen: np.ndarray, n_seen: np.ndarray, least: int, limit: Number
    ) -> tuple[Points, Values]:
        """Corners with the most of the labels seen, and squared distances; `nearest_corners`."""
        n = len(places)
        feet, squares = places.copy(), np.empty(n)

        def search(begin: int, end: int) -> None:
            feature_search.nearest_corners(
                self.features, places, seen, n_seen, least, float(limit), begin, end, feet, squares
            )

        in_ranges(search, n, nodes_per_item=NODES_PER_SEARCH)
        return feet, squares

    def walk(
        self, loops: Loops, chosen: Chosen, places: Points, enough: Number | Values
    ) -> tuple[Points, Bool[np.ndarray, " n"]]:
        """Nearest points of the surface to places off it; which places are off by more than enough.

        Where a place is near, and where no face is known, it is returned as it is.
        """
        n = len(places)
        feet, is_off = places.copy(), np.empty(n, np.bool_)
        limits = np.full(n, enough, np.float64) ** 2

        def work(begin: int, end: int) -> None:
            walk_points(
                self.surface, loops, self.crossings.normals, chosen, limits, begin, end,
                feet, is_off,
            )  # fmt: skip

        in_ranges(work, n, nodes_per_item=NODES_PER_SEARCH)
        return feet, is_off

    def cuts(
        self, ends: Pairs, start: Points, stop: Points
    ) -> tuple[Float64[np.ndarray, "n 32"], Int32[np.ndarray, " n"]]:
        """Where lines from start to stop meet the creases of their region; `cut_chords`."""
        n = len(ends)
        cuts, n_cuts = np.zeros((n, MOST_CUTS)), np.empty(n, np.int32)
        labels, normals = self.labels[ends[:, 0]], self.crossings.normals[ends[:, 0]]

        def cut(begin: int, end: int) -> None:
            cut_chords(self.features, labels, normals, start, stop, begin, end, cuts, n_cuts)

        in_ranges(cut, n, nodes_per_item=NODES_PER_SEARCH)
        return cuts, n_cuts

    def detours(
        self, ends: Pairs, start: Points, stop: Points, reach: Number
    ) -> Int32[np.ndarray, "n 6"]:
        """Vertices on creases of the region around a line, the least detour first, then -1."""
        found = np.empty((len(ends), MOST_CORNERS), np.int32)
        labels = self.labels[ends[:, 0]]
        if len(ends):
            corners_around(self.features, labels, start, stop, float(reach), found)
        return found


def _tree(lower: Points, upper: Points) -> Tree:
    """A tree over boxes; rounding to float32 only makes them larger."""
    m = len(lower)
    if m == 0:
        no_boxes = np.full((1, 12), np.inf, np.float32)
        return Tree(np.empty(0, np.int32), np.full((1, 2), EMPTY, np.int32), no_boxes)
    pad = PAD * float(np.abs([lower, upper]).max())
    boxes = np.concatenate([lower - pad, upper + pad], axis=1).astype(np.float32)
    order = np.empty(m, np.int32)
    children, child_boxes = np.empty((m + 1, 2), np.int32), np.empty((m + 1, 12), np.float32)
    n_nodes = build_tree(boxes, order, children, child_boxes)
    return Tree(order, children[:n_nodes].copy(), child_boxes[:n_nodes].copy())
