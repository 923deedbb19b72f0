"""Where a surface is: a search that misses no component, by values that bound the distance.

If a function changes by no more than one moves, ``|f - level|`` at the center of a cube that
exceeds half its diagonal proves that the level is not taken in the cube. Cubes that are not proved
empty are cut into eight, down to cubes of 2^3 cells (Hart 1996, doi:10.1007/s003710050084, uses
the same bound along rays). What is left is a layer of thickness proportional to the cubes
around the surface, so the work grows with the surface's area.
"""

import numpy as np

from ..arrays import Number, Points
from ..box import Box
from ..errors import SurfaceError
from ..implicit import Exactness, Implicit
from ..mesh.pieces import connected_labels
from .lattice_cells import Lattice, LatticeCells, evaluate

# Values are believed to this part of the largest coordinate: rounding of some thousand operations.
ROUNDING = 2.0**-40

_OCTANTS = np.stack(np.indices((2, 2, 2)), axis=-1).reshape(-1, 3)
_AROUND = np.stack(np.indices((3, 3, 3)), axis=-1).reshape(-1, 3) - 1


def find_seeds(
    shape: Implicit, *, voxel_size: Number, level: Number = 0.0, box: Box | None = None
) -> Points:
    """Find a point in one cell of each component of the surface ``shape = level``.

    Parameters
    ----------
    shape : Implicit
        Must be EXACT or a BOUND.
    voxel_size : float
        World units. Cells are those of the lattice ``voxel_size * (i, j, k)``.
    level : float
        In the unit of the values.
    box : Box or None
        Where to search; None for the shape's own.

    Returns
    -------
    seeds : (n, 3) float64
        Centers of cells whose corners lie on both sides of the level, one for each set of such
        cells that hang together across faces with corners on both sides, in order of x, y, z.

    Raises
    ------
    SurfaceError
        As for `continue_surface`.

    Notes
    -----
    Complete: every cell of the box whose corners are on both sides is found, because no cube that
    holds one can be proved empty. A component that passes between all nodes is not seen.
    Cost: O(n^2) evaluations for n cells along the box.

    Examples
    --------
    >>> from meshsdf.implicit import sphere, union
    >>> apart = union(sphere(1.0), sphere(0.5, np.array([9.0, 0.0, 0.0])))
    >>> find_seeds(apart, voxel_size=0.25)
    array([[-0.875, -0.625, -0.375],
           [ 8.625, -0.375, -0.375]])
    """
    cells = start_cells(shape, voxel_size, level, box, is_searched=True)
    cells.enter(cells_not_proved_empty(cells))
    is_mixed = cells.patterns[: cells.cells.n] > 0
    rank = np.cumsum(is_mixed) - 1
    label = connected_labels(int(is_mixed.sum()), rank[cells.links()])
    keys = cells.cells.keys[: cells.cells.n][is_mixed]
    order = np.argsort(keys)
    _, first = np.unique(label[order], return_index=True)
    lattice = cells.lattice
    return lattice.voxel_size * (lattice.indices(keys[order[np.sort(first)]]) + 0.5)


def start_cells(
    shape: Implicit, voxel_size: Number, level: Number, box: Box | None, *, is_searched: bool
) -> LatticeCells:
    """Check what was asked for, and return the lattice of the box, with no cell entered."""
    if not (np.isfinite(voxel_size) and voxel_size > 0):
        raise SurfaceError(
            f"voxel_size is {voxel_size}",
            "continue_surface(voxel_size=...)",
            "pass a length above 0",
        )
    if not np.isfinite(level):
        raise SurfaceError(
            f"level is {level}", "continue_surface(level=...)", "pass a finite number"
        )
    if is_searched and shape.exactness < Exactness.BOUND:
        raise SurfaceError(
            "the function is only known by its sign, so no cell can be proved empty",
            "continue_surface(seeds=None)",
            "pass seeds: for each component, a point on it",
        )
    level = float(level)
    if box is not None:
        return LatticeCells(shape, level, Lattice.over(box, voxel_size))
    # One more cell on every side, so that rounding does not open a surface that touches the box
    return LatticeCells(shape, level, Lattice.over(_own_box(shape, level), voxel_size, padding=1))


def _own_box(shape: Implicit, level: float) -> Box:
    """A box around all points where the value is at most the level."""
    if shape.box is None:
        raise SurfaceError(
            "the shape has no box", "continue_surface(box=None)", "pass a box to stay in"
        )
    if level <= 0:
        return shape.box
    if shape.exactness < Exactness.EXACT:
        raise SurfaceError(
            f"level is {level:g}, and the shape's box need not hold its surface: the values are "
            "not exact distances",
            "continue_surface(box=None)",
            "pass a box to stay in",
        )
    return Box(shape.box.lower - level, shape.box.upper + level)


def cells_not_proved_empty(cells: LatticeCells) -> np.ndarray:
    """Return the keys of all cells in cubes of 2^3 cells that cannot be proved empty."""
    lattice, n_cells = cells.lattice, cells.lattice.shape - 1
    reach = lattice.voxel_size * np.abs([lattice.first, lattice.first + n_cells]).max()
    size = 1 << max(1, int(n_cells.max() - 1).bit_length())
    cubes = np.zeros((1, 3), np.int64)  # in units of their size, from the first node on
    while True:
        centers = lattice.voxel_size * (lattice.first + size * cubes + size // 2)
        values = evaluate(cells.function, centers)
        half_diagonal = np.sqrt(3) / 2 * size * lattice.voxel_size
        is_empty = np.abs(values - cells.level) > half_diagonal + ROUNDING * (reach + half_diagonal)
        size //= 2
        cubes = (2 * cubes[~is_empty][:, None] + _OCTANTS).reshape(-1, 3)
        cubes = cubes[(size * cubes < n_cells).all(axis=1)]
        if size == 1:
            return lattice.keys(lattice.first + cubes)


def enter_seeds(cells: LatticeCells, seeds: Points) -> None:
    """Enter the cell of each seed, and where the surface does not enter it the cells around.

    Raises
    ------
    SurfaceError
        A seed lies outside the box, or the surface enters none of those cells.
    """
    lattice = cells.lattice
    where = "continue_surface(seeds=...)"
    if len(seeds) == 0:
        raise SurfaceError("there are no seeds", where, "pass at least one, or None to search")
    place = np.floor(seeds / lattice.voxel_size)
    # The far sides of the box belong to its last cells
    last = lattice.first + lattice.shape - 1
    place -= (place == last) & (seeds == lattice.voxel_size * last)
    within = (place >= lattice.first) & (place < last)
    if not within.all():
        bad = int(np.flatnonzero(~within.all(axis=1))[0])
        raise SurfaceError(
            f"seed {bad} at {seeds[bad].tolist()} lies outside the box", where, "pass a larger box"
        )
    own = place.astype(np.int64)
    cells.enter(lattice.keys(own))
    is_mixed = cells.is_mixed(lattice.keys(own))
    around = own[~is_mixed][:, None] + _AROUND
    around = around.reshape(-1, 3)
    cells.enter(lattice.keys(around[lattice.cells_among(around)]))
    for seed, near in zip(np.flatnonzero(~is_mixed), around.reshape(-1, 27, 3), strict=True):
        near = near[lattice.cells_among(near)]
        if not cells.is_mixed(lattice.keys(near)).any():
            raise SurfaceError(
                f"seed {seed} at {seeds[seed].tolist()} is not on the surface: in the cells around "
                f"it no value crosses the level {cells.level:g}",
                where,
                "pass a point on the surface, or a smaller voxel_size",
            )
