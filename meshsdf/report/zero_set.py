"""The zero set of a band's trilinear interpolant, as flat pieces proved to lie near it.

The zero set Z is where F = value - level, trilinear in every cell, changes its sign: the points
that are not below the level themselves, but have such that are as near as one likes. It lies in
the cells with a corner below the level and one not below. A box around part of it is cut in eight
until F is so nearly linear in it that zeros and a plane are proved to be near each other
(`kernels.zero_planes`), or until the box itself is so small that any of its points will do.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import ceil, log2

import numpy as np
from jaxtyping import Bool, Float64, Int32, Int64

from ..arrays import Number, Points
from ..errors import ReportError
from ..grid import NarrowBand
from ..kernels.parallel import even_ranges, run_pieces
from ..kernels.zero_bounds import bound_triangles
from ..kernels.zero_planes import (
    EMPTY,
    FITTED,
    OPEN,
    count_pieces,
    fill_pieces,
    fit_planes,
)
from ..mesh import Mesh
from ..spatial.closest_point import UNIT_ROUNDOFF
from .crossing_cells import crossing_cells, node_blocks, place_of_nodes

LARGEST_LIMIT = 0.25  # voxels: as far as blocks with one ring of cells reach
HALF_DIAGONAL = 0.5 * 3**0.5 * (1 + 1e-9)  # of a cell
CELLS_AT_ONCE = 2**15  # bounds the memory of blocks, 512 bytes per cell
BOXES_PER_TASK = 4096
PLACE_ERROR = 1e-11  # voxels: of a piece's corner in its cell, and of its plane; see `zero_planes`

_OFFSETS = np.indices((2, 2, 2)).reshape(3, 8).T.astype(np.int64)


@dataclass(frozen=True, eq=False)
class Boxes:
    """Parts of cells: number of the cell, lowest corner as multiple of the size, size, plane."""

    cell: Int64[np.ndarray, " b"]
    lows: Int64[np.ndarray, "b 3"]
    sizes: Float64[np.ndarray, " b"]
    planes: Float64[np.ndarray, "b 4"]
    thickness: Float64[np.ndarray, " b"]
    is_sure: Bool[np.ndarray, " b"]

    def __len__(self) -> int:
        return len(self.cell)

    def take(self, which: np.ndarray) -> "Boxes":
        """The boxes at an index or mask."""
        return Boxes(*(getattr(self, name)[which] for name in self.__dataclass_fields__))

    @staticmethod
    def join(parts: list["Boxes"]) -> "Boxes":
        """All boxes of one or more lists."""
        names = Boxes.__dataclass_fields__
        return Boxes(*(np.concatenate([getattr(p, name) for p in parts]) for name in names))


@dataclass(frozen=True, eq=False)
class Patches:
    """Triangles and points that stand for a zero set, or a part of one.

    Attributes
    ----------
    mesh : Mesh
        A soup, world units; a face whose corners are one vertex is a point.
    cell : (f,) int64
        Of each face: place in `ZeroSet.cells`.
    is_sure : (f,) bool
        Whether each point of the face is proved to be within ``slack`` of the zero set. False
        only at places where signs are a matter of rounding and F is nearly flat.
    slack : float
        World units. Every point of the zero set is within it of a face.
    """

    mesh: Mesh
    cell: Int64[np.ndarray, " f"]
    is_sure: Bool[np.ndarray, " f"]
    slack: float

    def sure_part(self) -> Mesh:
        """The faces that are proved to be near the zero set."""
        if self.is_sure.all():
            return self.mesh
        return Mesh(self.mesh.vertices, self.mesh.faces[self.is_sure])


class ZeroSet:
    """Where a band's trilinear interpolant takes a level.

    Attributes
    ----------
    cells : (n, 3) int64
        Lowest nodes of the cells with corners on both sides.
    max_boxes : int
        Boxes are not cut further where there would be more; pieces are then farther off.

    Raises
    ------
    ReportError
        No value crosses the level.
    """

    def __init__(self, band: NarrowBand, level: Number, max_boxes: int) -> None:
        self.band, self.level, self.max_boxes = band, float(level), max_boxes
        self.cells = crossing_cells(band, level)
        self.n_boxes = 0
        if len(self.cells) == 0:
            raise ReportError(
                f"no value of the band crosses the level {level:g}",
                "error_budget(band=..., level=...)",
                "pass the band that the surface was extracted from",
            )

    @property
    def centers(self) -> Points:
        """(n, 3) centres of the cells, world units."""
        place = place_of_nodes(self.band)
        return place[0] * (self.cells + 0.5) + place[1:]

    @property
    def rounding(self) -> float:
        """Bound on how far pieces are misplaced by rounding, world units."""
        place = place_of_nodes(self.band)
        largest = place[0] * (np.abs(self.cells).max() + 2.0) + np.abs(place[1:]).max()
        return PLACE_ERROR * place[0] + 16 * UNIT_ROUNDOFF * float(largest)

    def patches(self, which: Int64[np.ndarray, " k"], limit: float) -> Patches:
        """Return pieces for some of the cells, within ``limit`` voxels where the budget allows."""
        chunks = [which[i : i + CELLS_AT_ONCE] for i in range(0, len(which), CELLS_AT_ONCE)]
        limit = min(limit, LARGEST_LIMIT)
        room = self.max_boxes - self.n_boxes
        parts = []
        for chunk in chunks:
            share = room * len(chunk) // len(which)
            blocks = node_blocks(self.band, self.cells[chunk], 1, self.level)
            boxes = self._cut(blocks, limit, share)
            parts.append(self._pieces(boxes, chunk))
        vertices, faces, cell, is_sure, thickness = zip(*parts, strict=True)
        first = np.cumsum([0, *(len(v) for v in vertices[:-1])])
        faces = [f + np.int32(start) for f, start in zip(faces, first, strict=True)]
        slack = float(max(thickness)) * self.band.voxel_size + self.rounding
        mesh = Mesh(np.concatenate(vertices), np.concatenate(faces))
        return Patches(mesh, np.concatenate(cell), np.concatenate(is_sure), slack)

    def _cut(self, blocks: np.ndarray, limit: float, room: int) -> Boxes:
        """Boxes with planes, and with none (thickness: half their diagonal) where that is enough.

        ``cell`` counts blocks.
        """
        n = len(blocks)
        cell, lows = np.arange(n), np.zeros((n, 3), np.int64)
        done, n_done = [], 0
        deepest = max(ceil(log2(HALF_DIAGONAL / limit)), 0)
        for depth in range(deepest + 1):
            size = 0.5**depth
            state, planes, thickness = _fit(blocks, cell, lows, size, limit)
            self.n_boxes += len(cell)
            is_fitted, is_left = state == FITTED, state > FITTED
            n_done += int(np.count_nonzero(is_fitted))
            is_last = depth == deepest or n_done + 8 * np.count_nonzero(is_left) > room
            thickness[is_left] = HALF_DIAGONAL * size
            planes[is_left] = 0.0
            kept = state != EMPTY if is_last else is_fitted
            boxes = Boxes(
                cell, lows, np.full(len(cell), size), planes, thickness, (state == OPEN) | is_fitted
            )
            done.append(boxes.take(kept))
            if is_last or not is_left.any():
                break
            cell = np.repeat(cell[is_left], 8)
            lows = (2 * lows[is_left][:, None, :] + _OFFSETS).reshape(-1, 3)
        return Boxes.join(done)

    def _pieces(self, boxes: Boxes, chunk: np.ndarray) -> tuple:
        """Vertices, faces, their cells and whether they are sure, and the largest thickness."""
        place = place_of_nodes(self.band)
        is_flat = (boxes.planes[:, 1:] != 0).any(axis=1)
        flat, small = boxes.take(is_flat), boxes.take(~is_flat)
        counts = np.empty(len(flat), np.int64)
        shape = flat.lows, flat.sizes, flat.planes, flat.thickness
        in_tasks(lambda begin, end: count_pieces(*shape, begin, end, counts), len(flat))
        flat, counts = flat.take(counts >= 3), counts[counts >= 3]
        first = np.concatenate([[0], np.cumsum(counts)])
        n_vertices, n_faces = int(first[-1]), int(first[-1]) - 2 * len(flat)
        vertices, faces = np.empty((n_vertices, 3)), np.empty((n_faces, 3), np.int32)
        box = np.empty(n_faces, np.int64)
        corners = self.cells[chunk[flat.cell]]
        shape = flat.lows, flat.sizes, flat.planes, flat.thickness, corners, place, first
        in_tasks(
            lambda begin, end: fill_pieces(*shape, begin, end, vertices, faces, box), len(flat)
        )
        # Boxes without a plane are their centres
        middle = self.cells[chunk[small.cell]] + (small.lows + 0.5) * small.sizes[:, None]
        points = np.arange(n_vertices, n_vertices + len(small), dtype=np.int32)
        cell = chunk[np.concatenate([flat.cell[box], small.cell])]
        is_sure = np.concatenate([flat.is_sure[box], small.is_sure])
        thickness = np.concatenate([flat.thickness, small.thickness]).max(initial=0.0)
        vertices = np.concatenate([vertices, place[0] * middle + place[1:]])
        faces = np.concatenate([faces, np.repeat(points[:, None], 3, axis=1)])
        return vertices, faces, cell, is_sure, thickness

    def bound(
        self,
        points: Points,
        pieces: Int32[np.ndarray, "k 3"],
        center: Float64[np.ndarray, "3"],
        enough: float,
    ) -> Float64[np.ndarray, " k"]:
        """(k,) upper bounds on the distance of triangles from the zero set, world units.

        Corners are ``points[pieces] + center``. Infinite where the bound would be above
        ``enough``, or is not found.
        """
        band, upper = self.band, np.empty(len(pieces))
        origin = (center - band.translation) / band.voxel_size - 8.0 * band.index.origin
        numbers = np.array([band.background, self.level, band.voxel_size, *origin])
        nodes = band.index.root, band.index.pages, band.values, numbers
        enough = float(enough)
        in_tasks(
            lambda begin, end: bound_triangles(points, pieces, *nodes, enough, begin, end, upper),
            len(pieces),
        )
        return upper


def _fit(
    blocks: np.ndarray, cell: np.ndarray, lows: np.ndarray, size: float, limit: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """States, planes and thickness of boxes of one size."""
    n = len(cell)
    state, planes, thickness = np.empty(n, np.uint8), np.zeros((n, 4)), np.zeros(n)

    def work(begin: int, end: int) -> None:
        fit_planes(blocks, cell, lows, size, limit, begin, end, state, planes, thickness)

    in_tasks(work, n)
    return state, planes, thickness


def in_tasks(work: Callable[[int, int], None], n_items: int) -> None:
    """Call ``work(begin, end)`` on pieces of ``range(n_items)``, on all cores."""
    if n_items:
        tasks = even_ranges(n_items, n_items // BOXES_PER_TASK + 1)
        run_pieces(lambda task: work(*tasks[task]), len(tasks))
