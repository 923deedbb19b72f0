"""The bricks of each level of an octree, found from the coarsest level down."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float32, Float64, Int8, Int32, Int64, UInt8, UInt64

from ..arrays import BrickCoordinates
from ..grid.brick_index import BRICK
from ..kernels.box_overlap import count_touching, list_touching
from ..kernels.octree_tables import ANY_PART
from ..kernels.parallel import n_threads, run_pieces
from ..kernels.sheets import MAX_SHEETS, find_sheets, pack_normals

Triangles = Float64[np.ndarray, "m 3 3"]

BRICKS_PER_PIECE = 256


@dataclass(frozen=True, eq=False)
class Reach:
    """Bricks (b, 3) in lexicographic order, and the faces[first[i] : first[i + 1]] that reach i."""

    bricks: BrickCoordinates
    first: Int64[np.ndarray, " b1"]
    faces: Int32[np.ndarray, " t"]


@dataclass(frozen=True, eq=False)
class Level:
    """The bricks (b) of one level, their sheets (e) and the texels of these (t).

    Attributes
    ----------
    reach : Reach
    n_sheets : (b,) int32
    masks : (e, 8) uint64
    means : (e, 3) float32
    texel_normals : (t, 2) int8
        All as in `OctreeTables`.
    parts : (e,) int32
        Bits of the numbers of faces that a sheet is of; -1 for all.
    texel_parts : (t,) uint8
        Number of the face next to each texel; empty if all have the number 0.
    """

    reach: Reach
    n_sheets: Int32[np.ndarray, " b"]
    masks: UInt64[np.ndarray, "e 8"]
    means: Float32[np.ndarray, "e 3"]
    texel_normals: Int8[np.ndarray, "t 2"]
    parts: Int32[np.ndarray, " e"]
    texel_parts: UInt8[np.ndarray, " _"]


def build_level(triangles, normals, scale: float, parents: Reach) -> Level:
    """The bricks of one level, found among the children of those a level up."""
    reach = _children(triangles, scale, parents)
    n = len(reach.bricks)
    masks = np.empty((n, MAX_SHEETS, BRICK), np.uint64)
    n_sheets = np.empty(n, np.int32)
    means = np.empty((n, MAX_SHEETS, 3), np.float32)
    pieces = even_work(reach.first, BRICKS_PER_PIECE)
    packed = [np.empty((0, 2), np.int8)] * len(pieces)

    def work(piece: int) -> None:
        begin, end = pieces[piece]
        texels = np.empty((end - begin, MAX_SHEETS, BRICK**3, 2), np.int8)
        find_sheets(
            triangles, normals, scale, reach.bricks, reach.first, reach.faces, begin, end,
            masks, n_sheets, means, texels,
        )  # fmt: skip
        kept = np.arange(MAX_SHEETS) < n_sheets[begin:end, None]
        n_texels = int(np.bitwise_count(masks[begin:end][kept]).sum())
        packed[piece] = np.empty((n_texels, 2), np.int8)
        pack_normals(begin, end, masks, n_sheets, texels, packed[piece])

    run_pieces(work, len(pieces))
    kept = np.arange(MAX_SHEETS) < n_sheets[:, None]
    return Level(
        reach, n_sheets, masks[kept], means[kept],
        np.concatenate([np.empty((0, 2), np.int8), *packed]),
        np.full(int(n_sheets.sum()), ANY_PART, np.int32), np.empty(0, np.uint8),
    )  # fmt: skip


def _children(triangles: Triangles, scale: float, parents: Reach) -> Reach:
    """The bricks of the next finer level that triangles reach, with the lists of those."""
    corner = np.indices((2, 2, 2)).reshape(3, 8).T
    bricks = (2 * parents.bricks[:, None] + corner).reshape(-1, 3)
    starts = np.repeat(parents.first[:-1], 8)
    stops = np.repeat(parents.first[1:], 8)
    counts = np.zeros(len(bricks), np.int64)
    pieces = even_work(np.concatenate([[0], np.cumsum(stops - starts)]), 4096)

    def count(piece: int) -> None:
        part = slice(*pieces[piece])
        count_touching(
            triangles, scale, bricks[part], starts[part], stops[part], parents.faces, counts[part]
        )

    run_pieces(count, len(pieces))
    hit = counts > 0
    bricks, starts, stops, counts = bricks[hit], starts[hit], stops[hit], counts[hit]
    order = np.lexsort(bricks.T[::-1])
    bricks, starts, stops = bricks[order], starts[order], stops[order]
    first = np.concatenate([[0], np.cumsum(counts[order])])
    faces = np.empty(first[-1], np.int32)
    pieces = even_work(np.concatenate([[0], np.cumsum(stops - starts)]), 4096)

    def fill(piece: int) -> None:
        part = slice(*pieces[piece])
        list_touching(
            triangles, scale, bricks[part], starts[part], stops[part], parents.faces,
            first[:-1][part], faces,
        )  # fmt: skip

    run_pieces(fill, len(pieces))
    return Reach(bricks, first, faces)


def top_bricks(triangles: Triangles, n_levels: int) -> Reach:
    """Bricks two levels of whose size hold everything, each with all the faces."""
    scale = 0.5**n_levels
    low = np.floor((triangles.min(axis=(0, 1)) * scale - 2) / BRICK).astype(np.int64)
    high = np.floor((triangles.max(axis=(0, 1)) * scale + 2) / BRICK).astype(np.int64)
    bricks = np.stack(
        np.meshgrid(*(np.arange(a, b + 1) for a, b in zip(low, high, strict=True)), indexing="ij"),
        axis=-1,
    ).reshape(-1, 3)
    n_faces = len(triangles)
    return Reach(
        bricks,
        np.arange(len(bricks) + 1, dtype=np.int64) * n_faces,
        np.tile(np.arange(n_faces, dtype=np.int32), len(bricks)),
    )


def even_work(first: np.ndarray, per_piece: int) -> list[tuple[int, int]]:
    """Ranges of items of about equal work, where item i costs ``first[i + 1] - first[i]`` + 1."""
    n = len(first) - 1
    n_pieces = max(1, min(n, max(-(-n // per_piece), 4 * n_threads())))
    cost = first[1:] + np.arange(1, n + 1)
    goals = cost[-1] * np.arange(1, n_pieces) // n_pieces if n else []
    cuts = np.unique(np.concatenate([[0], np.searchsorted(cost, goals) + 1, [n]]))
    return [(int(a), int(b)) for a, b in pairwise(cuts)]


def face_normals(triangles: Triangles) -> np.ndarray:
    """(m, 3) float64 unit normals; zero for faces without area."""
    cross = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    length = np.linalg.norm(cross, axis=1, keepdims=True)
    return np.divide(cross, length, out=np.zeros_like(cross), where=length > 0)
