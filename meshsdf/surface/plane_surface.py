"""Marching cubes on a whole dense grid: count, decide what signs leave open, fill."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int64

from ..arrays import Faces, Number, Points
from ..kernels.grid_planes import collect_planes, count_planes, fill_planes
from ..progress import Progress, silent
from .brick_field import in_ranges, least_not_below
from .limits import require_nameable
from .special_cells import SpecialCells, decide_special_cells
from .trilinear_cases import CellCases


@dataclass(frozen=True, eq=False)
class PlaneSurface:
    """Vertices and faces, plane by plane.

    Attributes
    ----------
    vertices, faces : (n, 3) float64, (m, 3) int32
        Vertices on the edges that leave the nodes of a plane, then those within the cells above it.
    keys : (n,) int64, or (0,)
        ``3 * (node, in C order) + axis`` of each vertex's edge; -1 within cells.
    """

    vertices: Points
    faces: Faces
    keys: Int64[np.ndarray, " k"]


def plane_surface(
    values: Float[np.ndarray, "i j k"],
    place: np.ndarray,
    cases: CellCases,
    *,
    shift: int,
    with_keys: bool = False,
    progress: Progress = silent,
) -> PlaneSurface:
    """Extract the surface; with ``shift`` 1 the grid is surrounded by infinitely large values.

    ``place`` holds level, toward_infinity, voxel_size and the three numbers of the origin.
    """
    values = np.ascontiguousarray(values)
    counts, special = _count(values, float(place[0]), shift, cases, progress)
    first_special = counts[:, 2].copy()
    n_edges = np.diff(counts[:, 0])
    n_centers = special.per_group(special.n_centers, first_special)
    counts[1:, 0] += np.cumsum(n_centers)
    counts[1:, 1] += np.cumsum(special.per_group(special.n_faces, first_special))
    n_vertices, n_faces = counts[-1, :2].tolist()
    require_nameable(n_vertices)
    # A cell's first vertex within: behind those on edges and those of earlier cells of its step
    step = np.repeat(np.arange(len(n_edges)), np.diff(first_special))
    before = np.cumsum(special.n_centers) - special.n_centers
    first_of_step = np.cumsum(n_centers) - n_centers
    centers = (counts[:-1, 0] + n_edges - first_of_step)[step] + before
    vertices, faces = np.empty((n_vertices, 3)), np.empty((n_faces, 3), np.int32)
    keys = np.full(n_vertices if with_keys else 0, -1, np.int64)
    within = np.repeat(centers, special.n_centers) + _rank(special.n_centers)
    vertices[within] = special.centers(place, cases)
    tables = cases.crossed, cases.is_special, cases.triangles
    threshold = least_not_below(place[0], values.dtype)
    _in_steps(
        lambda start, stop: fill_planes(
            values, threshold, shift, place, tables, counts, special.decision.rows, centers,
            start, stop, vertices, keys, faces,
        ),
        values, shift, "surface", progress,
    )  # fmt: skip
    return PlaneSurface(vertices, faces, keys)


def special_plane_cells(
    values: Float[np.ndarray, "i j k"], level: Number, cases: CellCases
) -> SpecialCells:
    """Decide the special cells alone."""
    return _count(np.ascontiguousarray(values), float(level), 0, cases, silent)[1]


def _count(
    values: np.ndarray, level: float, shift: int, cases: CellCases, progress: Progress
) -> tuple[np.ndarray, SpecialCells]:
    """(steps + 1, 3): first edge vertex, first face but for special cells', first special cell."""
    threshold = least_not_below(level, values.dtype)
    counts = np.zeros((len(values) + 2 * shift + 1, 3), np.int64)
    _in_steps(
        lambda start, stop: count_planes(
            values, threshold, shift, cases.sizes, start, stop, counts[1:]
        ),
        values, shift, "counting", progress,
    )  # fmt: skip
    counts = np.cumsum(counts, axis=0)
    n = int(counts[-1, 2])
    cells, corners = np.empty((n, 3), np.int64), np.empty((n, 8))
    if n:
        first = counts[:, 2].copy()
        _in_steps(
            lambda start, stop: collect_planes(
                values, threshold, shift, cases.is_special, first, start, stop, cells, corners
            ),
            values, shift, "", silent,
        )  # fmt: skip
    return counts, decide_special_cells(cells, corners, level, cases, progress)


def _in_steps(work, values: np.ndarray, shift: int, stage: str, progress: Progress) -> None:
    n_steps = len(values) + 2 * shift
    in_ranges(work, n_steps, stage, progress, nodes_per_item=values[0].size)


def _rank(counts: np.ndarray) -> np.ndarray:
    """0 ... n - 1 for every count n, one behind the other."""
    return np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
