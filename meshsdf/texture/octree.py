"""Where a texture's texels are: bricks of 8^3 around a surface, at every level of detail.

Node (i, j, k) of level l lies at ``texel 2^l (i, j, k)`` in the texture's own space. A texel is a
node that is a corner of a cell which the surface cuts; the others do not exist. About three texels
are needed for every square of one texel's side. Each level is a `BrickIndex`, as distance bands
are, and the coarser levels are the finer ones' mipmap (Christensen and Batali 2004, "An irradiance
atlas for global illumination in complex production scenes", doi:10.2312/EGWR/EGSR04/133-141).
"""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Int32, Int64, UInt8

from ..arrays import BrickCoordinates, Number
from ..errors import MemoryLimitError, TextureError
from ..grid.brick_index import BRICK, PAGE, BrickIndex
from ..kernels.octree_tables import (
    ANY_PART,
    FIRST_BITS,
    FIRST_GROUP,
    NO_ENTRY,
    OctreeTables,
    find_entries,
    link_entries,
)
from ..kernels.parallel import run_pieces
from ..kernels.part_sets import MOST_SETS
from ..mesh import Mesh
from ..progress import Progress, silent
from ..sdf.memory import available_memory, estimate_bricks
from .octree_levels import Level, build_level, face_normals, top_bricks
from .octree_parts import divided

Parts = Int64[np.ndarray, " n"]
Entries = Int32[np.ndarray, " _"]  # no name: what goes in and what comes out differ in number

MAX_LEVELS = 24
LARGEST_RESOLUTION = 24000  # so that one root page of 4096 bricks a side covers everything
BYTES_PER_BRICK = 1500  # tables, and the texels' normals while they are found
MOST_ENTRIES = 2 * MOST_SETS  # of a brick
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
    face_parts : (m,) uint8
        A small number for every face of the surface: where faces that look the same way need the
        same texels and are apart, they have different ones, and texels of their own. Empty where
        that is nowhere so.
    """

    texel: float
    level_first: Int64[np.ndarray, " l"]
    tables: OctreeTables
    face_parts: UInt8[np.ndarray, " m"]

    @classmethod
    def around(
        cls,
        mesh: Mesh,
        *,
        texel: Number | None = None,
        resolution: Number | None = None,
        divides: bool = False,
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
        divides : bool
            Whether faces that look the same way, are apart and need the same texels get texels of
            their own; if not, they share them. How they are divided depends on the whole surface:
            of a divided octree bricks may change far from where a mesh was edited.

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
        normals = face_normals(triangles)
        levels = []
        parents = top_bricks(triangles, n_levels := _n_levels(mesh, texel))
        for level in range(n_levels - 1, -1, -1):
            levels.append(build_level(triangles, normals, 0.5**level, parents))
            parents = levels[-1].reach
            progress("octree", 1 - level / n_levels)
        levels, parts = levels[::-1], np.empty(0, np.uint8)
        if divides:
            levels, parts = divided(triangles, normals, mesh.welded.table, levels)
        return assembled(texel, levels, parts)

    @property
    def n_faces(self) -> int:
        """Faces of the surface, as far as they have numbers: 0 if no sheet is divided."""
        return len(self.face_parts)

    @property
    def is_divided(self) -> bool:
        """Whether some sheet is divided into parts that have texels of their own."""
        return len(self.face_parts) > 0

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

    def texel_counts(self, entries: Entries) -> np.ndarray:
        """(n,) int64: how many texels each of these entries has; costs O(n)."""
        first = self.tables.texel_first
        return first[entries + 1] - first[entries]

    def texel_rows(self, entries: Entries) -> np.ndarray:
        """(n + 1,) int64: where each entry's texels begin if they lie one after another, and the
        number of them all."""
        return _starts(self.texel_counts(entries))

    def find(
        self,
        level: int,
        bricks: BrickCoordinates,
        normals: np.ndarray | None = None,
        parts: Parts | None = None,
    ):
        """(n,) int32 entries of bricks (n, 3), of the sheets that look along normals (n, 3) and are
        of parts (n,), as bits."""
        found = np.empty(len(bricks), np.int32)
        if normals is None:
            normals = np.zeros((len(bricks), 3))
        if parts is None:
            parts = np.full(len(bricks), ANY_PART, np.int64)
        find_entries(self.tables, level, np.ascontiguousarray(bricks), normals, parts, found)
        return found

    def parts_of(self, faces: np.ndarray) -> Parts | None:
        """(n,) parts of faces, as bits; None if no sheet is divided."""
        if not self.is_divided:
            return None
        return np.left_shift(np.int64(1), self.face_parts[faces].astype(np.int64))


def assembled(texel: float, levels: list[Level], face_parts: np.ndarray) -> Octree:
    """One table of all levels."""
    heads, pages, groups = np.empty((len(levels), 4), np.int64), [], []
    n_pages = n_entries = n_groups = 0
    level_first = [0]
    for number, level in enumerate(levels):
        index = BrickIndex.from_coordinates(level.reach.bricks)
        code = n_entries + np.cumsum(level.n_sheets) - level.n_sheets
        split = np.flatnonzero(level.n_sheets > 1)
        groups.append(_groups(level, code[split] - n_entries, n_entries, split))
        code[split] = FIRST_GROUP - n_groups - np.arange(len(split))
        n_groups += len(split)
        heads[number] = *index.origin, n_pages
        pages.append(_page_table(index, code, n_pages))
        n_pages += len(pages[-1])
        n_entries += int(level.n_sheets.sum())
        level_first.append(n_entries)
    groups = np.concatenate(groups).astype(np.int32)
    if (groups[:, FIRST_BITS:] == ANY_PART).all():
        groups = np.ascontiguousarray(groups[:, :FIRST_BITS])
    masks = np.concatenate([level.masks for level in levels])
    tables = OctreeTables(
        heads=heads,
        pages=np.concatenate(pages),
        groups=groups,
        bricks=np.concatenate([np.repeat(v.reach.bricks, v.n_sheets, axis=0) for v in levels]),
        levels=np.repeat(np.arange(len(levels), dtype=np.int32), np.diff(level_first)),
        masks=masks,
        sheets=np.concatenate([level.means for level in levels]),
        neighbors=np.empty((n_entries, 27), np.int32),
        parents=np.full(n_entries, NO_ENTRY, np.int32),
        texel_first=_starts(np.bitwise_count(masks).sum(axis=1)),
        texel_normals=np.concatenate([level.texel_normals for level in levels]),
        texel=texel,
        texel_parts=np.concatenate([level.texel_parts for level in levels]),
    )
    run_pieces(
        lambda piece: link_entries(tables, 4096 * piece, min(4096 * (piece + 1), n_entries)),
        -(-n_entries // 4096),
    )
    return Octree(texel, np.array(level_first, np.int64), tables, face_parts)


def _groups(level: Level, own: np.ndarray, first: int, split: np.ndarray) -> np.ndarray:
    """Rows of `OctreeTables.groups` for the bricks ``split`` of a level, whose entries begin at
    ``own``, counted from the level's ``first``."""
    rows = np.full((len(split), FIRST_BITS + MOST_ENTRIES), ANY_PART, np.int64)
    rows[:, 0], rows[:, 1] = first + own, level.n_sheets[split]
    for sheet in range(MOST_ENTRIES):
        has = rows[:, 1] > sheet
        rows[has, FIRST_BITS + sheet] = level.parts[own[has] + sheet]
    return rows


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
