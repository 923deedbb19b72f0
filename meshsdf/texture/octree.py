"""Where a texture's texels are: bricks of 8^3 around a surface, at every level of detail.

Node (i, j, k) of level l lies at ``texel 2^l (i, j, k)`` in the texture's own space. A texel is a
node that is a corner of a cell which the surface cuts; the others do not exist. About three texels
are needed for every square of one texel's side. Each level is a `BrickIndex`, as distance bands
are, and the coarser levels are the finer ones' mipmap (Christensen and Batali 2004, "An irradiance
atlas for global illumination in complex production scenes", doi:10.2312/EGWR/EGSR04/133-141).
"""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float64, Int32, Int64

from ..arrays import BrickCoordinates, Number
from ..errors import MemoryLimitError, TextureError
from ..grid.brick_index import BRICK, PAGE, BrickIndex
from ..kernels.box_overlap import count_touching, list_touching
from ..kernels.octree_tables import FIRST_GROUP, NO_ENTRY, OctreeTables, find_entries, link_entries
from ..kernels.parallel import n_threads, run_pieces
from ..kernels.sheets import MAX_SHEETS, find_sheets, pack_normals
from ..mesh import Mesh
from ..progress import Progress, silent
from ..sdf.memory import available_memory, estimate_bricks

Triangles = Float64[np.ndarray, "m 3 3"]
Entries = Int32[np.ndarray, " _"]  # no name: what goes in and what comes out differ in number

MAX_LEVELS = 24
LARGEST_RESOLUTION = 24000  # so that one root page of 4096 bricks a side covers everything
BYTES_PER_BRICK = 1500  # tables, and the texels' normals while they are found
BRICKS_PER_PIECE = 256
SHARE_OF_FREE = 0.8


@dataclass(frozen=True, eq=False)
class Octree:
    """Which texels exist at every level; it never changes, whatever is painted.

    Attributes
    ----------
    texel : float
        Spacing of the finest level's nodes, in units of the texture's space.
    level_first : (L + 1,) int64
        Where the entries of every level begin. An entry is one sheet of one brick.
    tables : OctreeTables
        What kernels need.
    """

    texel: float
    level_first: Int64[np.ndarray, " l"]
    tables: OctreeTables

    @classmethod
    def around(
        cls,
        mesh: Mesh,
        *,
        texel: Number | None = None,
        resolution: Number | None = None,
        progress: Progress = silent,
    ) -> "Octree":
        """Find the texels that a mesh needs.

        Parameters
        ----------
        mesh : Mesh
            Any triangles; open, crossing and degenerate ones are as welcome as others.
        texel : float, optional
            Spacing of the finest texels, world units.
        resolution : int, optional
            Or: texels along the longest side of the mesh's box; 512 if neither is given.

        Raises
        ------
        TextureError
            The spacing is no positive number, or texels are so small beside the coordinates that
            rounding would move them by more than a hundredth.
        MemoryLimitError
            The tables would not fit in memory; said before they are made.
        """
        texel = _resolve_texel(mesh, texel, resolution)
        _check_memory(mesh, texel)
        triangles = mesh.welded.points[mesh.welded.faces] / texel
        normals = _face_normals(triangles)
        levels = []
        parents = _top_bricks(triangles, n_levels := _n_levels(mesh, texel))
        for level in range(n_levels - 1, -1, -1):
            levels.append(_build_level(triangles, normals, 0.5**level, parents))
            parents = levels[-1].reach
            progress("octree", 1 - level / n_levels)
        return _assembled(texel, levels[::-1])

    @property
    def n_levels(self) -> int:
        """Number of levels."""
        return len(self.level_first) - 1

    @property
    def n_entries(self) -> int:
        """Sheets of bricks at all levels."""
        return int(self.level_first[-1])

    def index(self, level: int) -> BrickIndex:
        """The bricks of a level, as an index made anew: lookups have pages of their own."""
        bricks = self.tables.bricks[slice(*self.level_first[level : level + 2])]
        is_first = np.ones(len(bricks), bool)  # of the sheets of a brick
        is_first[1:] = (bricks[1:] != bricks[:-1]).any(axis=1)
        return BrickIndex.from_coordinates(bricks[is_first])

    def spacing(self, level: int) -> float:
        """Distance between the nodes of a level, in units of the texture's space."""
        return self.texel * 2.0**level

    def n_texels(self, level: int) -> int:
        """Texels that exist at a level."""
        first = self.tables.texel_first[self.level_first[level : level + 2]]
        return int(first[1] - first[0])

    def find(self, level: int, bricks: BrickCoordinates, normals: np.ndarray | None = None):
        """(n,) int32 entries of bricks (n, 3), of the sheets that look along normals (n, 3)."""
        found = np.empty(len(bricks), np.int32)
        if normals is None:
            normals = np.zeros((len(bricks), 3))
        find_entries(self.tables, level, np.ascontiguousarray(bricks), normals, found)
        return found


@dataclass(frozen=True, eq=False)
class _Reach:
    """Bricks (b, 3) in lexicographic order, and the faces[first[i] : first[i + 1]] that reach i."""

    bricks: BrickCoordinates
    first: Int64[np.ndarray, " b1"]
    faces: Int32[np.ndarray, " t"]


@dataclass(frozen=True, eq=False)
class _Level:
    reach: _Reach
    masks: np.ndarray  # (b, 2, 8) uint64
    n_sheets: np.ndarray  # (b,) int32
    means: np.ndarray  # (b, 2, 3) float32
    texel_normals: np.ndarray  # (t, 2) int8


def _build_level(triangles, normals, scale: float, parents: _Reach) -> _Level:
    """The bricks of one level, found among the children of those a level up."""
    reach = _children(triangles, scale, parents)
    n = len(reach.bricks)
    masks = np.empty((n, MAX_SHEETS, BRICK), np.uint64)
    n_sheets = np.empty(n, np.int32)
    means = np.empty((n, MAX_SHEETS, 3), np.float32)
    pieces = _even_work(reach.first, BRICKS_PER_PIECE)
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
    return _Level(
        reach, masks, n_sheets, means, np.concatenate([np.empty((0, 2), np.int8), *packed])
    )


def _children(triangles: Triangles, scale: float, parents: _Reach) -> _Reach:
    """The bricks of the next finer level that triangles reach, with the lists of those."""
    corner = np.indices((2, 2, 2)).reshape(3, 8).T
    bricks = (2 * parents.bricks[:, None] + corner).reshape(-1, 3)
    starts = np.repeat(parents.first[:-1], 8)
    stops = np.repeat(parents.first[1:], 8)
    counts = np.zeros(len(bricks), np.int64)
    pieces = _even_work(np.concatenate([[0], np.cumsum(stops - starts)]), 4096)

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
    pieces = _even_work(np.concatenate([[0], np.cumsum(stops - starts)]), 4096)

    def fill(piece: int) -> None:
        part = slice(*pieces[piece])
        list_touching(
            triangles, scale, bricks[part], starts[part], stops[part], parents.faces,
            first[:-1][part], faces,
        )  # fmt: skip

    run_pieces(fill, len(pieces))
    return _Reach(bricks, first, faces)


def _top_bricks(triangles: Triangles, n_levels: int) -> _Reach:
    """Bricks two levels of whose size hold everything, each with all the faces."""
    scale = 0.5**n_levels
    low = np.floor((triangles.min(axis=(0, 1)) * scale - 2) / BRICK).astype(np.int64)
    high = np.floor((triangles.max(axis=(0, 1)) * scale + 2) / BRICK).astype(np.int64)
    bricks = np.stack(
        np.meshgrid(*(np.arange(a, b + 1) for a, b in zip(low, high, strict=True)), indexing="ij"),
        axis=-1,
    ).reshape(-1, 3)
    n_faces = len(triangles)
    return _Reach(
        bricks,
        np.arange(len(bricks) + 1, dtype=np.int64) * n_faces,
        np.tile(np.arange(n_faces, dtype=np.int32), len(bricks)),
    )


def _assembled(texel: float, levels: list[_Level]) -> Octree:
    """One table of all levels."""
    heads, pages, groups = np.empty((len(levels), 4), np.int64), [], []
    n_pages = n_entries = n_groups = 0
    level_first = [0]
    for number, level in enumerate(levels):
        index = BrickIndex.from_coordinates(level.reach.bricks)
        code = n_entries + np.cumsum(level.n_sheets) - level.n_sheets
        split = np.flatnonzero(level.n_sheets > 1)
        groups.append(np.stack([code[split], level.n_sheets[split]], axis=1))
        code[split] = FIRST_GROUP - n_groups - np.arange(len(split))
        n_groups += len(split)
        heads[number] = *index.origin, n_pages
        pages.append(_page_table(index, code, n_pages))
        n_pages += len(pages[-1])
        n_entries += int(level.n_sheets.sum())
        level_first.append(n_entries)
    kept = [np.arange(MAX_SHEETS) < level.n_sheets[:, None] for level in levels]
    masks = np.concatenate([level.masks[k] for level, k in zip(levels, kept, strict=True)])
    tables = OctreeTables(
        heads=heads,
        pages=np.concatenate(pages),
        groups=np.concatenate(groups).astype(np.int32),
        bricks=np.concatenate([np.repeat(v.reach.bricks, v.n_sheets, axis=0) for v in levels]),
        levels=np.repeat(np.arange(len(levels), dtype=np.int32), np.diff(level_first)),
        masks=masks,
        sheets=np.concatenate([v.means[k] for v, k in zip(levels, kept, strict=True)]),
        neighbors=np.empty((n_entries, 27), np.int32),
        parents=np.full(n_entries, NO_ENTRY, np.int32),
        texel_first=_starts(np.bitwise_count(masks).sum(axis=1)),
        texel_normals=np.concatenate([level.texel_normals for level in levels]),
        texel=texel,
    )
    run_pieces(
        lambda piece: link_entries(tables, 4096 * piece, min(4096 * (piece + 1), n_entries)),
        -(-n_entries // 4096),
    )
    return Octree(texel, np.array(level_first, np.int64), tables)


def _page_table(index: BrickIndex, code: np.ndarray, first: int) -> np.ndarray:
    """The pages of a level, which are numbered from ``first`` on, its root page before the others;
    bricks are named by ``code``."""
    root = np.full((PAGE, PAGE, PAGE), NO_ENTRY, np.int32)
    root[tuple(slice(n) for n in index.root.shape)] = index.root
    root[root >= 0] += first + 1
    n_upper = int(np.count_nonzero(root >= 0))
    pages = index.pages.copy()
    upper, lower = pages[:n_upper], pages[n_upper:]
    upper[upper >= 0] += first + 1
    lower[lower >= 0] = code[lower[lower >= 0]]
    return np.concatenate([root[None], pages]).reshape(-1, PAGE**3)


def _starts(counts) -> np.ndarray:
    return np.concatenate([[0], np.cumsum(counts, dtype=np.int64)]).astype(np.int64)


def _even_work(first: np.ndarray, per_piece: int) -> list[tuple[int, int]]:
    """Ranges of items of about equal work, where item i costs ``first[i + 1] - first[i]`` + 1."""
    n = len(first) - 1
    n_pieces = max(1, min(n, max(-(-n // per_piece), 4 * n_threads())))
    cost = first[1:] + np.arange(1, n + 1)
    goals = cost[-1] * np.arange(1, n_pieces) // n_pieces if n else []
    cuts = np.unique(np.concatenate([[0], np.searchsorted(cost, goals) + 1, [n]]))
    return [(int(a), int(b)) for a, b in pairwise(cuts)]


def _face_normals(triangles: Triangles) -> np.ndarray:
    """(m, 3) float64 unit normals; zero for faces without area."""
    cross = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    length = np.linalg.norm(cross, axis=1, keepdims=True)
    return np.divide(cross, length, out=np.zeros_like(cross), where=length > 0)


def _n_levels(mesh: Mesh, texel: float) -> int:
    """As many levels as let the coarsest bricks hold about all of the mesh."""
    size = float(mesh.box.size.max()) / texel
    return min(MAX_LEVELS, max(1, math.ceil(math.log2(max(size, 1.0) / BRICK)) + 1))


def _resolve_texel(mesh: Mesh, texel: Number | None, resolution: Number | None) -> float:
    where = "Octree.around(texel=..., resolution=...)"
    if texel is not None and resolution is not None:
        raise TextureError("both a texel's size and a resolution are given", where, "give one")
    longest = float(mesh.box.size.max())
    if texel is None:
        resolution = 512 if resolution is None else resolution
        if not (np.isfinite(resolution) and resolution >= 1):
            what = f"a resolution of {resolution} texels makes no sense"
            raise TextureError(what, where, "give a number of 1 or more")
        if longest == 0:
            what = "the mesh is a single point, so it has no longest side to divide"
            raise TextureError(what, where, "give the texel's size")
        texel = longest / float(resolution)
    texel = float(texel)
    if not (np.isfinite(texel) and texel > 0):
        raise TextureError(f"texels of {texel} make no sense", where, "give a positive size")
    reach = float(np.abs([mesh.box.lower, mesh.box.upper]).max())
    if longest / texel > LARGEST_RESOLUTION:
        what = f"{longest / texel:.0f} texels along the longest side are too many"
        raise TextureError(what, where, f"ask for at most {LARGEST_RESOLUTION}")
    if reach * 2.0**-52 > 0.01 * texel or reach / texel > 2.0**50:
        what = f"coordinates up to {reach:g} are stored too coarsely for texels of {texel:g}"
        raise TextureError(what, where, "move the mesh nearer to the origin, or use larger texels")
    return texel


def _check_memory(mesh: Mesh, texel: float) -> None:
    wanted = estimate_bricks(mesh, texel, 1.0) * BYTES_PER_BRICK * 4 / 3 + 60 * mesh.n_faces
    free = available_memory()
    if free is not None and wanted > SHARE_OF_FREE * free:
        raise MemoryLimitError(
            f"texels of {texel:g} need about {wanted / 1e9:.1f} GB of tables; "
            f"{free / 1e9:.1f} GB are free",
            "Octree.around(texel=..., resolution=...)",
            "use larger texels",
        )
