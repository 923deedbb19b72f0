"""Marching cubes on bricks: count, decide what signs leave open, fill."""

import numpy as np

from ..arrays import Faces, Number, Points
from ..kernels.marching_cubes import count_bricks, fill_faces, fill_vertices
from ..kernels.special_cells import collect_bricks
from ..progress import Progress, silent
from .brick_field import BrickField, in_ranges
from .fans import separate_fans
from .limits import require_nameable
from .special_cells import SpecialCells, decide_special_cells
from .trilinear_cases import CellCases


def brick_surface(
    field: BrickField, place: np.ndarray, cases: CellCases, progress: Progress = silent
) -> tuple[Points, Faces]:
    """Extract the surface, brick by brick; vertices within cells come behind all others.

    ``place`` holds level, toward_infinity, voxel_size and the three numbers of the translation.
    """
    n = len(field.corners)
    shared = field.inside, field.valid, field.near
    crossings, counts = _count(field, cases, progress)
    first_special = _starts(counts[:, 1])
    special = _collect(field, first_special, float(place[0]), cases, progress)
    per_word = np.bitwise_count(crossings)
    last = np.cumsum(per_word, dtype=np.int64).reshape(n, 24)
    n_crossings = int(last[-1, -1]) if n else 0
    require_nameable(n_crossings + int(special.n_centers.sum()))
    first = (last - per_word).astype(np.int32)
    first_face = _starts(counts[:, 0] + special.per_group(special.n_faces, first_special))
    centers = n_crossings + _starts(special.n_centers)[:-1]
    vertices = np.empty((n_crossings + int(special.n_centers.sum()), 3))
    vertices[n_crossings:] = special.centers(place, cases)
    faces = np.empty((int(first_face[-1]), 3), np.int32)
    tables = cases.crossed, cases.is_special, cases.triangles
    where = np.concatenate([[field.background], place])

    def fill(start: int, stop: int) -> None:
        fill_vertices(
            field.values, field.inside, field.near, crossings, first, field.corners, where,
            start, stop, vertices,
        )  # fmt: skip
        fill_faces(
            *shared, crossings, first, first_face, tables, first_special, special.decision.rows,
            centers, start, stop, faces,
        )  # fmt: skip

    in_ranges(fill, n, "surface", progress)
    return separate_fans(vertices, faces) if field.has_gaps else (vertices, faces)


def special_brick_cells(field: BrickField, level: Number, cases: CellCases) -> SpecialCells:
    """Decide the special cells alone."""
    _, counts = _count(field, cases, silent)
    return _collect(field, _starts(counts[:, 1]), float(level), cases, silent)


def _count(
    field: BrickField, cases: CellCases, progress: Progress
) -> tuple[np.ndarray, np.ndarray]:
    """Crossing words; faces and special cells of every brick."""
    n = len(field.corners)
    crossings = np.empty((n, 24), np.uint64)
    counts = np.empty((n, 2), np.int64)
    shared = field.inside, field.valid, field.near
    in_ranges(
        lambda start, stop: count_bricks(*shared, cases.sizes, start, stop, crossings, counts),
        n,
        "counting",
        progress,
    )
    return crossings, counts


def _collect(
    field: BrickField, first: np.ndarray, level: float, cases: CellCases, progress: Progress
) -> SpecialCells:
    n = int(first[-1])
    cells, values = np.empty((n, 3), np.int64), np.empty((n, 8))
    if n:
        in_ranges(
            lambda start, stop: collect_bricks(
                field.values, field.inside, field.valid, field.near, field.corners,
                field.background, cases.is_special, first, start, stop, cells, values,
            ),
            len(field.corners),
        )  # fmt: skip
    return decide_special_cells(cells, values, level, cases, progress)


def _starts(counts: np.ndarray) -> np.ndarray:
    """(n + 1,) where each begins and the last ends."""
    return np.concatenate([[0], np.cumsum(counts, dtype=np.int64)])
