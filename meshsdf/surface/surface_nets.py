"""Surface nets: a vertex in the middle of a cell's crossings, polygons around crossed edges.

Gibson 1998 (doi:10.1007/BFb0056277), without her relaxation: the extractor of OpenVDB's volumes
to meshes, with the same vertices and the same polygons.
"""

import numpy as np

from ..arrays import Number, Points
from ..grid import Grid, NarrowBand
from ..kernels.dual_arrays import Crossings
from ..mesh import Mesh
from ..progress import Progress, silent
from .brick_field import field_of
from .dual_faces import crossing_places, join_loops
from .dual_loops import DualLoops, find_loops
from .fans import separate_fans
from .hermite import to_world, with_folded
from .level import check_level
from .marching_cubes import Border, check_choices

NO_ARCS = np.empty(0, np.int64)


def surface_nets(
    volume: NarrowBand | Grid,
    *,
    level: Number = 0.0,
    border: Border = "open",
    progress: Progress = silent,
) -> Mesh:
    """Extract the surface ``value = level`` with well-shaped faces, its details rounded.

    Parameters
    ----------
    volume : NarrowBand or Grid
        Values at nodes, smaller inside. A grid needs 2 nodes per axis; NaN there means no data,
        and a cell with such a corner yields nothing.
    level : float
        In the unit of the values. For a band it must lie strictly between +-background.
    border : {"open", "cap", "pad"}
        As for `marching_cubes`; an open surface ends in the same lines.
    progress : callable
        Told the stage and the fraction done.

    Returns
    -------
    mesh : Mesh
        Faces counter-clockwise seen from where the values are larger. Without faces if no value
        lies below the level, or none above.

    Raises
    ------
    SurfaceError
        Arguments out of range, as for `marching_cubes`.

    Notes
    -----
    Promise: every edge belongs to two faces, in opposite directions, and the faces around every
    vertex form one cycle; both hold by index, and up to the open border or to cells without data.
    Accuracy: a vertex is the mean of where linear interpolation along the cell's edges puts the
    level. At distance from creases that is off the surface by the square of the voxel size times
    its curvature, to first order; creases are cut by up to half a voxel.
    Two vertices take the place of one where a cell's crossings form two loops; of corners that
    face each other across a cell's side, those inside are joined.
    Cost: time and memory grow with the surface in voxels.

    References
    ----------
    S. F. F. Gibson, "Constrained elastic surface nets: generating smooth surfaces from binary
    segmented data", MICCAI 1998.

    Examples
    --------
    >>> i, j, k = np.indices((8, 8, 8)) - 3.5
    >>> ball = Grid(np.sqrt(i * i + j * j + k * k) - 2.5, 1.0, np.full(3, -3.5))
    >>> radius = np.linalg.norm(surface_nets(ball).vertices, axis=1)
    >>> bool(2.3 < radius.min() and radius.max() < 2.5)
    True
    """
    check_choices(border, "manifold", level, "surface_nets")
    check_level(volume, float(level), "surface_nets")
    level = float(level)
    field = field_of(volume, level, border, progress)
    toward_infinity = 0.0 if border == "cap" else 0.5
    loops = find_loops(field, level, toward_infinity, progress, joined=True)
    unknown = np.zeros((loops.n_crossings, 3))
    crossings = Crossings(loops.nodes, loops.ways, loops.fractions, unknown)
    vertices, faces = join_loops(
        loops.arrays, crossings, _middles(loops, crossings),
        *with_folded(loops, crossings, NO_ARCS), allowed=np.inf, progress=progress,
    )  # fmt: skip
    vertices = to_world(volume, loops, vertices)
    if (loops.around < 0).any():
        vertices, faces = separate_fans(vertices, faces)
    return Mesh(vertices, faces)


def _middles(loops: DualLoops, crossings: Crossings) -> Points:
    """The mean of every loop's crossings, voxels."""
    if loops.n_loops == 0:
        return np.empty((0, 3))
    places = crossing_places(crossings, np.arange(loops.n_crossings))
    sums = np.add.reduceat(places[loops.crossings], loops.start[:-1])
    return sums / np.diff(loops.start)[:, None]
