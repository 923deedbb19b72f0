"""The part of a full grid near the surface, as a narrow band."""

import numpy as np

from ..arrays import BrickRuns, Ijk1, Number, Vector3
from ..errors import GridError
from .brick_grid import NarrowBand, node_words
from .brick_index import BRICK, BrickIndex
from .grid import Grid

LEAST_HALF_WIDTH = 1.0

_SIDES = [
    tuple(end if axis == other else slice(None) for other in range(3))
    for axis in range(3)
    for end in (0, -1)
]


def cut_band(grid: Grid, half_width: Number | None = None) -> NarrowBand:
    """Keep the nodes nearer to the surface than a half width, and the side of all others.

    Parameters
    ----------
    grid : Grid
        Distances, with a value at every node.
    half_width : number or None
        In voxels, at least 1; None for that at which the grid is clipped already, else 3.

    Returns
    -------
    band : NarrowBand
        Values within the band are those of the grid, bit by bit if these are float32. Its nodes are
        numbered from the world's origin where that gives the grid's place exactly, so bands line
        up; else from the grid's first node. Beyond the grid all is outside.

    Raises
    ------
    GridError
        No node is near the surface, some have no value, or the grid is clipped nearer than that.

    Examples
    --------
    >>> from meshsdf import mesh_to_grid
    >>> from meshsdf.mesh.primitives import box_mesh
    >>> grid = mesh_to_grid(box_mesh((2.0, 2.0, 2.0)), voxel_size=0.125)
    >>> band = cut_band(grid, 2)
    >>> band.value_at(np.array([[0, 0, 7], [0, 0, 9], [0, 0, 0]]))
    array([-0.125,  0.125, -0.25 ])
    """
    if half_width is None:
        half_width = 3.0 if grid.half_width is None else grid.half_width
    half_width = float(half_width)
    _check(grid, half_width)
    background = np.float32(half_width * grid.voxel_size)
    first, translation = _lattice(grid)
    low = first // BRICK
    shape = -(-(first + grid.values.shape) // BRICK) - low
    skip = first - low * BRICK
    parts = [
        _plane(grid.values, x, skip, shape, background, is_signed=grid.is_signed)
        for x in range(shape[0])
    ]
    places, values, words, runs = (np.concatenate(found) for found in zip(*parts, strict=True))
    if len(places) == 0:
        raise GridError(
            f"none of the {grid.values.size} nodes is nearer to a surface than {background:g}",
            f"cut_band(half_width={half_width:g})",
            "pass distances, in the unit of the voxel size",
        )
    runs[:, :2] += low[:2]
    runs[:, 2:] += low[2]
    index = BrickIndex.from_coordinates(places + low, runs)
    return NarrowBand(
        index,
        values,
        words,
        float(grid.voxel_size),
        translation,
        half_width,
        grid.sign,
        n_inner_faces=grid.n_inner_faces,
    )


def reaches_border(grid: Grid) -> bool:
    """Whether a node on the border of a grid is inside."""
    sides = (grid.values[side] for side in _SIDES if all(grid.values.shape))
    return any(bool((side < 0).any()) for side in sides)


def _check(grid: Grid, half_width: float) -> None:
    where = f"cut_band(half_width={half_width:g})"
    if not LEAST_HALF_WIDTH <= half_width < np.inf:
        raise GridError(f"half_width is {half_width:g} voxels", where, "pass 1 at least")
    if grid.half_width is not None and half_width > grid.half_width:
        what = f"values are clipped beyond {grid.half_width:g} voxels"
        raise GridError(what, where, f"pass {grid.half_width:g} at most")
    n_gaps = int(np.count_nonzero(np.isnan(grid.values)))
    if n_gaps:
        what = f"{n_gaps} of {grid.values.size} nodes have no value, so their side is unknown"
        raise GridError(what, where, "fill them, or keep the full grid")


def _lattice(grid: Grid) -> tuple[Ijk1, Vector3]:
    """Number of the first node, and world position of node (0, 0, 0)."""
    first = np.rint(grid.origin / grid.voxel_size)
    if (np.abs(first) < 1 << 40).all() and (first * grid.voxel_size == grid.origin).all():
        return first.astype(np.int64), np.zeros(3)
    return np.zeros(3, np.int64), grid.origin


def _plane(
    values: np.ndarray, x: int, skip: Ijk1, shape: Ijk1, background: np.float32, *, is_signed: bool
) -> tuple[np.ndarray, np.ndarray, np.ndarray, BrickRuns]:
    """Bricks of one plane: places, values and masks of those kept, runs of those inside."""
    padded = np.full((BRICK, *(shape[1:] * BRICK)), background, np.float32)
    begin = x * BRICK - skip[0]
    rows = values[max(begin, 0) : begin + BRICK]
    start = max(-begin, 0)
    _, ny, nz = values.shape
    padded[start : start + len(rows), skip[1] : skip[1] + ny, skip[2] : skip[2] + nz] = rows
    bricks = padded.reshape(BRICK, shape[1], BRICK, shape[2], BRICK).transpose(1, 3, 0, 2, 4)
    active, inner = np.abs(bricks) < background, bricks < 0
    all_inner = inner.all(axis=(2, 3, 4))
    # Signs are kept even where a field jumps across 0 without being small there
    keep = active.any(axis=(2, 3, 4)) | (inner.any(axis=(2, 3, 4)) & ~all_inner)
    far = np.where(inner[keep], -background, background)
    places = np.argwhere(keep)
    places = np.column_stack([np.full(len(places), x), places])
    runs = _runs(all_inner & ~keep, x) if is_signed else np.empty((0, 4), np.int64)
    return places, np.where(active[keep], bricks[keep], far), node_words(active[keep]), runs


def _runs(inside: np.ndarray, x: int) -> BrickRuns:
    """Runs (x, y, z0, z1) of the marked bricks of a plane [y, z]."""
    edges = np.diff(inside.astype(np.int8), axis=1, prepend=0, append=0)
    starts, stops = np.argwhere(edges == 1), np.argwhere(edges == -1)
    column = np.full(len(starts), x)
    return np.column_stack([column, starts, stops[:, 1]]).astype(np.int64)
