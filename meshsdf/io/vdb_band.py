"""Narrow bands as grids of a ``.vdb`` file, and level sets as narrow bands.

A band is one level set: bricks are leaves, inside and outside are tiles of -background and
background. What a level set cannot say stands in metadata: ``meshsdf_sign``, and the half width as
``meshsdf_half_width``, because the background (a float32) does not tell it exactly, and, where
there are such faces, ``meshsdf_n_inner_faces``. Closest faces, barycentrics and doubtful nodes are
grids of their own beside it, which ``meshsdf_of`` ties to it: ``closest_face`` (int32),
``barycentric`` (vec3s: the weights of the face's second and third corner, then 0) and
``uncertain`` (float: active, and 1, where the side is not certain).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Matrix4, Number, Vector3
from ..grid import Grid, NarrowBand
from ..grid.brick_grid import node_mask
from ..grid.brick_index import INSIDE, OUTSIDE
from .vdb_fill import fill_tiles
from .vdb_grid import VdbGrid
from .vdb_stream import UnsuitedError
from .vdb_transform import uniform_scale
from .warn import Warn

SIGN, HALF_WIDTH, OF = "meshsdf_sign", "meshsdf_half_width", "meshsdf_of"
INNER = "meshsdf_n_inner_faces"
COMPANIONS = {"closest_face": "int32", "barycentric": "vec3s", "uncertain": "float"}
"""Names and value types of the grids beside a band."""

_FOREIGN_SIGN = "winding"  # of level sets that other programs made
_LONGEST_SIGN = 32


@dataclass(frozen=True, eq=False)
class _Made:
    """Values of bricks that are made when asked for."""

    dtype: np.dtype
    shape: tuple[int, ...]
    make: Callable[[np.ndarray], np.ndarray]

    def __getitem__(self, slots: np.ndarray) -> np.ndarray:
        return self.make(slots)


def band_to_grids(band: NarrowBand, name: str, *, is_half: bool) -> list[VdbGrid]:
    """Return the grids that say all there is to say of a band; its values are not copied."""
    surface = VdbGrid(
        name,
        band.index,
        band.values,
        band.active,
        np.array(band.background, np.float32),
        placing(band.voxel_size, band.translation),
        grid_class="level set" if band.is_signed else "unknown",
        metadata={SIGN: band.sign, HALF_WIDTH: float(band.half_width)} | inner_words(band),
        is_half=is_half,
    )
    plain = without_inside(surface)
    single, shape = np.dtype(np.float32), band.values.shape
    beside = []
    if band.closest_face is not None:
        none = np.array(-1, np.int32)
        faces = {"name": "closest_face", "values": band.closest_face, "background": none}
        beside.append(replace(plain, **faces, metadata={OF: name}))
    if band.barycentric is not None:
        given = band.barycentric
        made = _Made(single, (*shape, 3), lambda s: np.pad(given[s], [(0, 0)] * 4 + [(0, 1)]))
        weights = {"name": "barycentric", "values": made, "background": np.zeros(3, single)}
        beside.append(replace(plain, **weights, metadata={OF: name}))
    if band.uncertain is not None:
        words = band.uncertain
        made = _Made(single, shape, lambda s: node_mask(words[s]).astype(single))
        doubts = {"name": "uncertain", "values": made, "active": words}
        doubts["background"] = np.zeros((), single)
        beside.append(replace(plain, **doubts, metadata={OF: name}))
    return [surface, *beside]


def without_inside(surface: VdbGrid) -> VdbGrid:
    """The grid of a band made ready for what stands beside it: nothing is inside, nothing half."""
    index = surface.index
    tables = [np.where(table == INSIDE, OUTSIDE, table) for table in (index.root, index.pages)]
    index = replace(index, root=tables[0], pages=tables[1])
    return replace(surface, index=index, grid_class="unknown", metadata={}, is_half=False)


def placing(voxel_size: Number, origin: Vector3) -> Matrix4:
    """The matrix from index to world."""
    matrix = np.diag([voxel_size, voxel_size, voxel_size, 1.0])
    matrix[:3, 3] = origin
    return matrix


def require_uniform(grid: VdbGrid) -> float:
    """The voxel size; UnsuitedError if the transform does more than scale evenly and move."""
    size = uniform_scale(grid.matrix)
    if size is None:
        rows = "; ".join(" ".join(f"{x:g}" for x in row[:3]) for row in grid.matrix[:3])
        raise UnsuitedError(
            f"the voxels of the grid {grid.name!r} are no cubes along the axes (rows of its "
            f"transform: {rows})",
            "resample it where it was made, or read it with read_vdb_grids",
        )
    return size


def grid_to_band(grid: VdbGrid, warn: Warn) -> NarrowBand:
    """Return a level set as a band.

    Tiles tell the side by their sign; active ones become bricks. The half width is the
    background / voxel size, unless the file tells it exactly.

    Raises
    ------
    UnsuitedError
        The transform does not suit a band, the background is not above 0, or active tiles would
        take too much memory.
    """
    size = require_uniform(grid)
    background = float(grid.background)
    if not (np.isfinite(background) and background > 0):
        what = f"the level set {grid.name!r} has the background {background:g}, not above 0"
        raise UnsuitedError(what, "rebuild the level set where it was made")
    filled, n_odd = fill_tiles(grid)
    if n_odd:
        warn(
            f"{n_odd} tiles of the grid {grid.name!r} hold other values than its background; "
            "of them only the sign is kept"
        )
    with np.errstate(over="ignore"):  # what does not fit becomes infinite, and is refused so
        values = filled.values.astype(np.float32, copy=False)
    return NarrowBand(
        filled.index,
        values,
        filled.active,
        size,
        np.ascontiguousarray(grid.matrix[:3, 3]),
        _half_width(grid, size, background),
        told_sign(grid, _FOREIGN_SIGN),
        n_inner_faces=told_inner(grid),
    )


def with_companions(band: NarrowBand, grids: list[VdbGrid], warn: Warn) -> NarrowBand:
    """Attach what stands in the grids beside the band's own."""
    found = {}
    for grid in grids:
        same = np.array_equal(grid.index.coordinates, band.index.coordinates)
        if not same or grid.value_type != COMPANIONS.get(grid.name):
            warn(f"the grid {grid.name!r} does not fit its band, and is left out")
        elif grid.name == "uncertain":
            found[grid.name] = grid.active
        elif grid.name == "barycentric":
            found[grid.name] = np.ascontiguousarray(grid.values[..., :2])
        else:
            found[grid.name] = grid.values
    return replace(band, **found)


def told_sign(grid: VdbGrid, default: str) -> str:
    """How inside was told, if the file says it."""
    sign = grid.metadata.get(SIGN)
    is_word = isinstance(sign, str) and sign.isascii() and sign.isprintable()
    return sign if is_word and 0 < len(sign) <= _LONGEST_SIGN else default


def inner_words(volume: NarrowBand | Grid) -> dict[str, int]:
    """Metadata that tells the number of inner faces, if there are any."""
    return {INNER: volume.n_inner_faces} if volume.n_inner_faces else {}


def told_inner(grid: VdbGrid) -> int:
    """The number of inner faces, if the file says it."""
    told = grid.metadata.get(INNER, 0)
    return told if isinstance(told, int) and 0 <= told < 1 << 62 else 0


def _half_width(grid: VdbGrid, size: float, background: float) -> float:
    """Half width in voxels: as told, if it gives this background; else a round one, if it does."""
    told = grid.metadata.get(HALF_WIDTH)
    plain = background / size
    stored = np.float16 if grid.is_half else grid.background.dtype
    with np.errstate(all="ignore"):
        for width in (told, round(plain, 3)):
            if isinstance(width, float) and width > 0:
                exact = np.float32(width * size)
                if np.isfinite(exact) and float(exact.astype(stored)) == background:
                    return width
    return plain
