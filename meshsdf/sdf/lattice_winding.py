"""Generalised winding numbers of the nodes around an open mesh: W = crossings + boundary.

Crossings are counted once, for the bricks of the band, and summed upwards; every brick keeps the
counts above it, which hold for all missing bricks up to the next one of its column, as no face
passes between the nodes of a missing brick. The boundary term is that of
`kernels.boundary_winding`.
"""

from functools import partial

import numpy as np

from ..arrays import Values
from ..grid import BrickIndex
from ..grid.brick_index import BRICK
from ..kernels.crossings import count_crossings
from ..kernels.open_signs import sum_upwards, wind_bricks, wind_points
from ..kernels.parallel import even_ranges, n_threads, run_pieces
from ..progress import Progress, silent
from .boundary import Boundary
from .memory import SLABS_PER_THREAD
from .placed_mesh import PlacedMesh
from .slabs import bin_features, items_of

MEMBRANE = 0.05  # of W: nearer to 1/2, a slightly different filling of the holes changes the side
BRICKS_PER_PIECE = 64


class LatticeWinding:
    """Winding numbers of bricks of nodes.

    Parameters
    ----------
    placed : PlacedMesh
        All faces with area, in coordinates local to the index.
    index : BrickIndex
        Bricks that hold every node within a voxel of a face.
    """

    def __init__(self, placed: PlacedMesh, index: BrickIndex) -> None:
        self.placed = placed
        self.index = index
        self.boundary = Boundary.of(placed)
        self.local = index.coordinates - index.origin
        self.top = np.zeros((index.n_bricks, BRICK * BRICK), np.int32)

    def first_sides(self, progress: Progress = silent) -> tuple[np.ndarray, int]:
        """Return `sides` of the index's own bricks; to be called before any other."""
        x = self.local[:, 0]
        ranges = even_ranges(int(x[-1] - x[0]) + 1, SLABS_PER_THREAD * n_threads())
        slabs = [(int(x[0]) + first, int(x[0]) + last) for first, last in ranges]
        edges = BRICK * np.array([slabs[0][0], *(last for _, last in slabs)], np.float64)
        lists = bin_features(self.placed.points, self.placed.faces, edges, 1.0)
        inside = np.empty((len(x), BRICK**3), np.bool_)
        uncertain = np.empty(len(x), np.int64)

        def wind_slab(s: int) -> None:
            a, b = (int(place) for place in np.searchsorted(x, slabs[s]))
            counts = self._crossings(items_of(lists, s), slabs[s], a, b)
            sum_upwards(self.local[a:b], counts, self.top[a:b])
            self._wind(self.local[a:b], counts, inside[a:b], uncertain[a:b])

        run_pieces(wind_slab, len(slabs), stage="sign", progress=progress)
        return inside.reshape(-1, BRICK, BRICK, BRICK), int(uncertain.sum())

    def sides(self, bricks: np.ndarray, progress: Progress = silent) -> tuple[np.ndarray, int]:
        """Tell which nodes of bricks missing in the index lie inside.

        Returns
        -------
        inside : (b, 8, 8, 8) bool
            The winding number exceeds 1/2 in magnitude.
        n_uncertain : int
            At how many nodes it does so, or does not, by less than `MEMBRANE`.
        """
        local = np.ascontiguousarray(bricks - self.index.origin)
        inside = np.empty((len(local), BRICK**3), np.bool_)
        uncertain = np.empty(len(local), np.int64)
        pieces = even_ranges(len(local), -(-len(local) // BRICKS_PER_PIECE))

        def wind_piece(piece: int) -> None:
            some = slice(*pieces[piece])
            counts = np.repeat(self._counts_below(local[some]), BRICK, axis=1)
            self._wind(local[some], counts, inside[some], uncertain[some])

        run_pieces(wind_piece, len(pieces), stage="sign", progress=progress)
        return inside.reshape(-1, BRICK, BRICK, BRICK), int(uncertain.sum())

    def at_centers(self, bricks: np.ndarray) -> Values:
        """Return the winding number of node (4, 4, 4) of bricks missing in the index."""
        local = np.ascontiguousarray(bricks - self.index.origin)
        middle = BRICK // 2
        counts = self._counts_below(local)[:, BRICK * middle + middle]
        wound = np.empty(len(local))
        nodes = (local * BRICK + middle).astype(np.float64)
        wind_points(self.boundary.arrays, nodes, np.ascontiguousarray(counts), wound)
        return wound

    def _crossings(self, ids: np.ndarray, slab: tuple[int, int], a: int, b: int) -> np.ndarray:
        crossings = np.zeros((b - a, BRICK**3), np.int32)
        placed, index = self.placed, self.index
        count = partial(count_crossings, placed.points, placed.faces, placed.edge_line)
        tables = (index.root, index.pages, a, True, crossings)
        count(placed.line_ends, ids, BRICK * slab[0], BRICK * slab[1], *tables)
        return crossings

    def _wind(self, local: np.ndarray, counts: np.ndarray, inside, uncertain) -> None:
        wind_bricks(self.boundary.arrays, local, counts, MEMBRANE, inside, uncertain)

    def _counts_below(self, local: np.ndarray) -> np.ndarray:
        """(b, 64) counts of the lines below each brick."""
        low = np.minimum(self.local.min(axis=0), local.min(axis=0))
        size = np.maximum(self.local.max(axis=0), local.max(axis=0)) - low + 1

        def key(bricks: np.ndarray) -> np.ndarray:
            x, y, z = (bricks - low).T
            return (x * size[1] + y) * size[2] + z

        below = np.searchsorted(key(self.local), key(local)) - 1
        same = (below >= 0) & (self.local[below, :2] == local[:, :2]).all(axis=1)
        return np.where(same[:, None], self.top[below], 0).astype(np.int32)
