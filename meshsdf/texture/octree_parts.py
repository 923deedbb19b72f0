"""Sheets of an octree divided where surfaces that look the same way need the same texels.

Faces get small numbers (`kernels.face_numbers`), so that parts of the surface that need the same
texel of a sheet, at any level, and are apart there (`kernels.sheet_parts`) have none in common. A
sheet in which that happens becomes one entry for every set of numbers that may share texels.

Limits: faces that edges connect within a brick share its texels, as on a ramp that winds tightly;
so do parts nearer than 1/64 of a level's texel, what more than 4 sets of numbers would be needed
for (more than 4 sheets within about 2 texels), and all parts of a brick with more than 32.
"""

from dataclasses import replace

import numpy as np

from ..kernels.face_numbers import MOST_NUMBERS, number_faces
from ..kernels.octree_tables import ANY_PART
from ..kernels.parallel import run_pieces
from ..kernels.part_sets import MOST_SETS, divide, find_sets
from ..kernels.sheet_parts import MOST_PARTS, NO_PART, find_parts
from ..mesh.edge_table import EdgeTable
from .octree_levels import BRICKS_PER_PIECE, Level, Triangles, even_work

NO_ROW = -1


def divided(
    triangles: Triangles, normals: np.ndarray, table: EdgeTable, levels: list[Level]
) -> tuple[list[Level], np.ndarray]:
    """The levels, finest first, with divided sheets, and the (m,) uint8 numbers of faces.

    Where nothing is in conflict, the levels as they are, and no numbers.
    """
    edges = table.edge_of_corner
    found = [_conflicts(triangles, edges, normals, level, n) for n, level in enumerate(levels)]
    if not any(conflicts.n_rows for conflicts in found):
        return levels, np.empty(0, np.uint8)
    numbers = _numbers(table, edges, levels, found)
    made = []
    for n, (level, conflicts) in enumerate(zip(levels, found, strict=True)):
        made.append(_divided(triangles, normals, numbers, level, conflicts, 0.5**n))
    if all((level.parts == ANY_PART).all() for level in made):
        return levels, np.empty(0, np.uint8)
    return made, numbers


class _Conflicts:
    """What `find_parts` says of a level; ``rows`` are the bricks in conflict."""

    def __init__(self, n_bricks: int, n_faces: int) -> None:
        self.labels = np.full(n_faces, NO_PART, np.int8)
        self.clash = np.zeros((n_bricks, MOST_PARTS), np.uint32)
        self.second = np.zeros(n_bricks, np.uint32)
        self.n_parts = np.zeros(n_bricks, np.uint8)

    @property
    def rows(self) -> np.ndarray:
        return np.flatnonzero(self.n_parts)

    @property
    def n_rows(self) -> int:
        return int(np.count_nonzero(self.n_parts))


def _conflicts(triangles, edges, normals, level: Level, number: int) -> _Conflicts:
    reach = level.reach
    found = _Conflicts(len(reach.bricks), len(reach.faces))
    pieces = even_work(reach.first, BRICKS_PER_PIECE)
    run_pieces(
        lambda piece: find_parts(
            triangles, edges, normals, 0.5**number, reach.bricks, reach.first, reach.faces,
            level.n_sheets, *pieces[piece], found.labels, found.clash, found.second, found.n_parts,
        ),
        len(pieces),
    )  # fmt: skip
    return found


def _numbers(table: EdgeTable, edges, levels: list[Level], found: list[_Conflicts]) -> np.ndarray:
    """(m,) uint8 numbers of the faces; the levels' parts in conflict are numbered through."""
    faces, parts, clashes, n_rows = [], [], [], 0
    for level, conflicts in zip(levels, found, strict=True):
        first, rows = level.reach.first, conflicts.rows
        row_of = np.full(len(first) - 1, NO_ROW)
        row_of[rows] = n_rows + np.arange(len(rows))
        brick = np.repeat(np.arange(len(first) - 1), np.diff(first))
        at = np.flatnonzero(row_of[brick] != NO_ROW)
        label = conflicts.labels[at].astype(np.int64)
        at, label = (a[conflicts.clash[brick[at], label] != 0] for a in (at, label))
        faces.append(level.reach.faces[at])
        parts.append(MOST_PARTS * row_of[brick[at]] + label)
        clashes.append(conflicts.clash[rows].ravel())
        n_rows += len(rows)
    faces, parts, n_faces = np.concatenate(faces), np.concatenate(parts), len(edges)
    order = np.argsort(faces, kind="stable")
    of_face = np.concatenate([[0], np.cumsum(np.bincount(faces, minlength=n_faces))])
    numbers, used = np.empty(n_faces, np.uint8), np.zeros(MOST_PARTS * n_rows, np.uint32)
    number_faces(
        edges, table.half_edges, table.first, of_face, parts[order], np.concatenate(clashes), used,
        numbers,
    )  # fmt: skip
    return numbers


def _divided(triangles, normals, numbers, level: Level, conflicts: _Conflicts, scale) -> Level:
    """The level with the sheets in conflict divided, and the number next to every texel."""
    reach, rows = level.reach, conflicts.rows
    sets = np.empty((len(rows), 2, MOST_NUMBERS), np.int8)
    bits = np.zeros((len(rows), 2, MOST_SETS), np.int32)
    find_sets(
        rows, reach.first, reach.faces, conflicts.labels, conflicts.clash, conflicts.second,
        conflicts.n_parts, numbers, sets, bits,
    )  # fmt: skip
    split = (bits != 0).sum(axis=2).max(axis=1, initial=0) > 1
    rows, sets, bits = rows[split], sets[split], bits[split]
    row_of = np.full(len(reach.bricks), NO_ROW, np.int64)
    row_of[rows] = np.arange(len(rows))
    made = _with_room(level, rows, bits)
    entry_first = np.concatenate([[0], np.cumsum(made.n_sheets)])
    texel_first = np.zeros(len(made.masks) + 1, np.int64)
    no_texels = np.empty((0, 2), np.int8), np.empty(0, np.uint8)

    def run(only_masks: bool, texel_normals, texel_parts) -> None:
        pieces = even_work(reach.first, BRICKS_PER_PIECE)
        run_pieces(
            lambda piece: divide(
                triangles, normals, numbers, scale, reach.bricks, reach.first, reach.faces,
                level.n_sheets, entry_first, row_of, sets, only_masks, *pieces[piece], made.masks,
                texel_first, texel_normals, texel_parts,
            ),
            len(pieces),
        )  # fmt: skip

    run(True, *no_texels)
    counts = np.bitwise_count(made.masks).sum(axis=1, dtype=np.int64)
    np.cumsum(counts, out=texel_first[1:])
    texel_normals = np.empty((texel_first[-1], 2), np.int8)
    texel_parts = np.empty(texel_first[-1], np.uint8)
    # Texels of bricks that are not divided are those that there were
    kept = np.repeat(row_of < 0, level.n_sheets)
    before = np.bitwise_count(level.masks).sum(axis=1, dtype=np.int64)
    after = np.repeat(np.repeat(row_of < 0, made.n_sheets), counts)
    texel_normals[after] = level.texel_normals[np.repeat(kept, before)]
    run(False, texel_normals, texel_parts)
    return replace(made, texel_normals=texel_normals, texel_parts=texel_parts)


def _with_room(level: Level, rows: np.ndarray, bits: np.ndarray) -> Level:
    """The level with as many entries for the bricks ``rows`` as sets of ``bits``; their masks are
    not known yet."""
    n_sheets = level.n_sheets.copy()
    n_sheets[rows] = (bits != 0).sum(axis=(1, 2))
    old = np.repeat(np.arange(len(n_sheets)), level.n_sheets)
    new = np.repeat(np.arange(len(n_sheets)), n_sheets)
    is_row = np.zeros(len(n_sheets), bool)
    is_row[rows] = True
    masks = np.zeros((len(new), 8), np.uint64)
    means = np.zeros((len(new), 3), np.float32)
    parts = np.full(len(new), ANY_PART, np.int32)
    masks[~is_row[new]] = level.masks[~is_row[old]]
    means[~is_row[new]] = level.means[~is_row[old]]
    if len(rows):
        first = np.cumsum(level.n_sheets) - level.n_sheets
        row, sheet, number = np.nonzero(bits)
        means[is_row[new]] = level.means[first[rows[row]] + sheet]
        of_set = bits[row, sheet, number]
        alone = (bits != 0).sum(axis=2)[row, sheet] == 1
        parts[is_row[new]] = np.where(alone, ANY_PART, of_set)
    return replace(level, n_sheets=n_sheets, masks=masks, means=means, parts=parts)
