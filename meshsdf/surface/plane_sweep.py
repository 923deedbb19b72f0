"""Marching cubes on planes as they come: the state between two of them.

Step p holds the edges that leave the nodes of plane p and the cells between planes p and p + 1.
The values of two planes are held, the bits of four, and the vertices' numbers of two steps.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Int64

from ..arrays import FaceLabels, Points
from ..kernels.marching_planes import (
    classify_plane,
    collect_cells,
    count_cells,
    empty_plane,
    join_planes,
    number_edges,
    write_faces,
    write_vertices,
)
from .brick_field import least_not_below
from .cap import Naming, name_vertices
from .special_cells import SpecialCells, decide_special_cells
from .trilinear_cases import CellCases

UNKNOWN = 2**40  # planes: more than there can be


@dataclass(frozen=True, eq=False)
class MeshPart:
    """More vertices and faces of a mesh that comes in parts.

    Attributes
    ----------
    vertices : (n, 3) float64
        World units; numbered on from those of the parts before.
    faces : (m, 3) int64
        Vertices of this part and earlier ones, by their numbers.
    material_index : (m,) int32 or None
        As of the mesh that `marching_cubes` gives.
    """

    vertices: Points
    faces: Int64[np.ndarray, "m 3"]
    material_index: FaceLabels | None = None


@dataclass(frozen=True, eq=False)
class _Step:
    """What the faces of a step need, and those of the step before."""

    naming: Naming
    n_faces: int
    special: SpecialCells
    centers: np.ndarray


class PlaneSweep:
    """Takes planes in order and gives back the parts that they finish."""

    def __init__(
        self,
        shape: tuple[int, ...],
        dtype: np.dtype,
        place: np.ndarray,
        cases: CellCases,
        *,
        border: str,
    ) -> None:
        self.shape, self.place, self.cases = shape, place, cases
        self.is_capped = border == "cap"
        self.shift = 0 if border == "open" else 1
        self.threshold = least_not_below(float(place[0]), dtype)
        rows, self.width = (n + 2 * self.shift for n in shape)
        words = (self.width + 63) // 64
        self.nodes = tuple(np.zeros((4, rows, words), np.uint64) for _ in range(3))
        self.edges = tuple(np.zeros((4, 3, rows, words), np.uint64) for _ in range(2))
        self.first = np.zeros((4, 3, rows, words), np.int32)
        self.scratch = np.empty(8, np.uint64), np.empty(words, np.uint64)
        self.n_planes = 0  # taken so far, those around the grid included
        self.n_vertices = 0
        self.step: _Step | None = None
        # The plane before, and whether it is of the grid
        self.lower, self.lower_is_real = np.empty(shape, dtype), False
        if self.shift:
            self._take(None, exists=True)

    def feed(self, plane: np.ndarray) -> MeshPart:
        """Take the next (nj, nk) values, which must stay as they are until the next call."""
        return self._take(plane, exists=True)

    def finish(self) -> list[MeshPart]:
        """Return what ends on the last plane or around it."""
        around = [self._take(None, exists=True)] if self.shift else []
        return [*around, self._take(None, exists=False)]

    def _take(self, plane: np.ndarray | None, *, exists: bool) -> MeshPart:
        p, is_real = self.n_planes, plane is not None
        upper = plane if is_real else self.lower
        if is_real:
            classify_plane(upper, self.threshold, self.shift, p, self.nodes)
        else:
            empty_plane(p, self.width if exists else 0, self.nodes)
        before, vertices = self.step, np.empty((0, 3))
        if p > 0:
            vertices = self._next_step(upper, is_real)
        faces, material = np.empty((0, 3), np.int64), np.empty(0, np.int32)
        if before is not None:
            faces, material = self._faces_between(before, self.step, p - 2)
        self.n_planes = p + 1
        self.lower, self.lower_is_real = upper, is_real
        return MeshPart(vertices, faces, material if self.is_capped else None)

    def _next_step(self, upper: np.ndarray, upper_is_real: bool) -> np.ndarray:
        """Number the vertices of the step below the plane just taken; return the new ones."""
        p = self.n_planes - 1
        join_planes(p, self.nodes)
        n_edges = number_edges(p, self.nodes, self.edges, self.first)
        n_faces, n_special = count_cells(p, self.nodes, self.cases.sizes, *self.scratch)
        planes = self.lower, upper, (self.lower_is_real, upper_is_real), self.shift, p
        cells, values = np.empty((n_special, 3), np.int64), np.empty((n_special, 8))
        if n_special:
            collect_cells(
                *planes, self.nodes, self.cases.is_special, 0, cells, values, *self.scratch
            )
        special = decide_special_cells(cells, values, float(self.place[0]), self.cases)
        vertices = np.empty((n_edges + int(special.n_centers.sum()), 3))
        vertices[n_edges:] = special.centers(self.place, self.cases)
        keys = np.full(len(vertices) if self.is_capped else 0, -1, np.int64)
        write_vertices(*planes, self.edges, self.place, 0, vertices, keys)
        is_last = self.lower_is_real and not upper_is_real
        naming = self._name(len(vertices), keys, p if is_last else UNKNOWN)
        self.n_vertices += int(np.count_nonzero(naming.is_new))
        centers = n_edges + np.cumsum(special.n_centers) - special.n_centers
        self.step = _Step(naming, n_faces + int(special.n_faces.sum()), special, centers)
        return vertices[naming.is_new]

    def _name(self, n: int, keys: np.ndarray, n_planes: int) -> Naming:
        if not self.is_capped:
            none = np.empty(0, np.int64)
            number = np.arange(self.n_vertices, self.n_vertices + n)
            return Naming(number, np.ones(n, bool), np.zeros(n, bool), none, none)
        before = None if self.step is None else self.step.naming
        return name_vertices(keys, (n_planes, *self.shape), start=self.n_vertices, before=before)

    def _faces_between(self, step: _Step, above: _Step, p: int) -> tuple[np.ndarray, np.ndarray]:
        """Faces of step p, which name vertices of both steps, and their material index."""
        n = len(step.naming.number)
        corners = np.empty((step.n_faces, 3), np.int32)
        tables = self.cases.crossed, self.cases.is_special, self.cases.triangles
        write_faces(
            p, self.nodes, self.edges, self.first, 0, n, tables, step.special.decision.rows,
            step.centers, 0, 0, corners, *self.scratch,
        )  # fmt: skip
        return step.naming.followed_by(above.naming).faces(corners)
