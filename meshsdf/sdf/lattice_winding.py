"""Generalised winding numbers of the nodes around an open mesh: W = crossings + boundary.

Crossings are counted once, for the bricks of the band, and summed upwards; every brick keeps the
counts above it, which hold for all missing bricks up to the next one of its column, as no face
passes between the nodes of a missing brick. The boundary term is that of
`kernels.boundary_winding`.

In a soup every node is near a boundary. With thousands of edges the approximation of
`spatial.winding_number` is cheaper there; nodes it puts near 1/2 get their exact number.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np

from ..arrays import Values
from ..grid import BrickIndex
from ..grid.brick_grid import node_words
from ..grid.brick_index import BRICK
from ..kernels.crossings import count_crossings
from ..kernels.open_signs import HALF, sum_upwards, wind_bricks, wind_points
from ..kernels.parallel import even_ranges, n_threads, run_pieces
from ..mesh import Mesh
from ..progress import Progress, silent
from ..spatial.winding_number import winding_number
from .boundary import Boundary
from .memory import SLABS_PER_THREAD
from .placed_mesh import PlacedMesh
from .slabs import bin_features, items_of

MEMBRANE = 0.05  # of W: nearer to 1/2, a slightly different filling of the holes changes the side
BRICKS_PER_PIECE = 64
BRICKS_AT_ONCE = 4096  # 2 M points, 50 MB
MANY_EDGES = 1000  # one exact evaluation costs 20 ns per edge, an approximate one about 5 us
APPROXIMATE = 0.01  # of W; the largest error seen of the approximation is 4e-3


OFFSETS = np.indices((BRICK, BRICK, BRICK)).reshape(3, -1).T


@dataclass(frozen=True, eq=False)
class _States:
    """Which nodes are inside, which uncertain (bits), and which bricks are left to do."""

    inside: np.ndarray
    uncertain: np.ndarray
    hard: list[tuple[np.ndarray, np.ndarray]]

    @classmethod
    def empty(cls, n: int) -> "_States":
        return cls(np.empty((n, BRICK**3), np.bool_), np.zeros((n, BRICK), np.uint64), [])


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

    def first_sides(self, progress: Progress = silent) -> tuple[np.ndarray, np.ndarray]:
        """Return `sides` of the index's own bricks; to be called before any other."""
        x = self.local[:, 0]
        ranges = even_ranges(int(x[-1] - x[0]) + 1, SLABS_PER_THREAD * n_threads())
        slabs = [(int(x[0]) + first, int(x[0]) + last) for first, last in ranges]
        edges = BRICK * np.array([slabs[0][0], *(last for _, last in slabs)], np.float64)
        lists = bin_features(self.placed.points, self.placed.faces, edges, 1.0)
        states = _States.empty(len(x))

        def wind_slab(s: int) -> None:
            a, b = (int(place) for place in np.searchsorted(x, slabs[s]))
            counts = self._crossings(items_of(lists, s), slabs[s], a, b)
            sum_upwards(self.local[a:b], counts, self.top[a:b])
            self._wind(self.local, counts, states, a, b)

        run_pieces(wind_slab, len(slabs), stage="sign", progress=progress)
        return self._settle_rest(self.local, states, progress)

    def sides(
        self, bricks: np.ndarray, progress: Progress = silent
    ) -> tuple[np.ndarray, np.ndarray]:
        """Tell which nodes of bricks missing in the index lie inside.

        Returns
        -------
        inside : (b, 8, 8, 8) bool
            The winding number exceeds 1/2 in magnitude.
        uncertain : (b, 8) uint64
            Bits of the nodes at which it does so, or does not, by less than `MEMBRANE`.
        """
        local = np.ascontiguousarray(bricks - self.index.origin)
        states = _States.empty(len(local))
        pieces = even_ranges(len(local), -(-len(local) // BRICKS_PER_PIECE))

        def wind_piece(piece: int) -> None:
            a, b = pieces[piece]
            counts = np.repeat(self._counts_below(local[a:b]), BRICK, axis=1)
            self._wind(local, counts, states, a, b)

        run_pieces(wind_piece, len(pieces), stage="sign", progress=progress)
        return self._settle_rest(local, states, progress)

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

    def _wind(
        self, local: np.ndarray, counts: np.ndarray, states: "_States", a: int, b: int
    ) -> None:
        """Decide bricks a ... b - 1, all or, in a soup, those that are easy."""
        many = len(self.boundary.chain) > MANY_EDGES
        found = states.inside[a:b], states.uncertain[a:b], np.empty(b - a, np.bool_)
        wind_bricks(self.boundary.arrays, local[a:b], counts, MEMBRANE, many, *found)
        hard = np.flatnonzero(found[2])
        states.hard.append((a + hard, counts[hard]))

    def _settle_rest(
        self, local: np.ndarray, states: "_States", progress: Progress
    ) -> tuple[np.ndarray, np.ndarray]:
        """Decide what `_wind` has left, and put the states into shape."""
        hard = np.concatenate([bricks for bricks, _ in states.hard])
        counts = np.concatenate([counts for _, counts in states.hard])
        order = np.argsort(hard)  # pieces end in any order
        hard, counts = hard[order], counts[order]
        for first in range(0, len(hard), BRICKS_AT_ONCE):
            some = slice(first, first + BRICKS_AT_ONCE)
            bricks = hard[some]
            wound = self._approximate(local[bricks], counts[some])
            states.inside[bricks] = wound > HALF
            states.uncertain[bricks] = node_words(np.abs(wound - HALF) < MEMBRANE)
            progress("sign", min(1.0, (first + BRICKS_AT_ONCE) / len(hard)))
        shaped = states.inside.reshape(-1, BRICK, BRICK, BRICK)
        return shaped, states.uncertain

    def _approximate(self, local: np.ndarray, counts: np.ndarray) -> np.ndarray:
        """|W| of (b, 512) nodes: by a tree over faces, exactly where that comes near 1/2."""
        nodes = (BRICK * local[:, None] + OFFSETS).reshape(-1, 3).astype(np.float64)
        wound = winding_number(Mesh(self.placed.points, self.placed.faces), nodes)
        near = np.flatnonzero(np.abs(np.abs(wound) - HALF) < APPROXIMATE)
        pieces = even_ranges(len(near), -(-len(near) // BRICKS_PER_PIECE))

        def wind_piece(piece: int) -> None:
            some = near[slice(*pieces[piece])]
            exact = np.empty(len(some))
            wind_points(self.boundary.arrays, nodes[some], counts.ravel()[some], exact)
            wound[some] = exact

        run_pieces(wind_piece, len(pieces) if len(near) else 0)
        return np.abs(wound).reshape(len(local), -1)

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
