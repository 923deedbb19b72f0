"""Continuation: follow a surface from cell to cell, and touch no others.

Wyvill, McPheeters and Wyvill 1986 (doi:10.1007/BF01900346) and Bloomenthal 1988
(doi:10.1016/0167-8396(88)90013-1), with the cases of `cube_cases` and a wave of cells at a time.
"""

from typing import Literal

import numpy as np

from ..arrays import Number, Points
from ..box import Box
from ..errors import SurfaceError
from ..implicit import Implicit
from ..kernels.continuation import mark_edges, write_faces, write_shares
from ..mesh import Mesh
from ..progress import Progress, silent
from .cube_cases import EDGES, cube_cases
from .edge_roots import edge_roots
from .fans import separate_fans
from .lattice_cells import LatticeCells, evaluate
from .limits import require_nameable
from .seeds import cells_not_proved_empty, enter_seeds, start_cells

PLACEMENTS = ("linear", "root")

_ENDS = np.array(EDGES, np.int64)


def continue_surface(
    shape: Implicit,
    *,
    voxel_size: Number,
    level: Number = 0.0,
    seeds: Points | None = None,
    box: Box | None = None,
    placement: Literal["linear", "root"] = "linear",
    progress: Progress = silent,
) -> Mesh:
    """Extract the surface ``shape = level``, touching only the cells it enters.

    Parameters
    ----------
    shape : Implicit
        Smaller inside. NaN means no data: a cell with such a corner yields nothing.
    voxel_size : float
        World units. Nodes are at ``voxel_size * (i, j, k)``.
    level : float
        In the unit of the values.
    seeds : (n, 3) float64 or None
        Points on the surface, one on each component that is wanted. Where the corners of the cell
        around a seed all lie on one side, the cells around that one are taken. With None the whole
        box is searched, by values that bound the distance: the shape must be EXACT or a BOUND.
    box : Box or None
        Only cells that meet it are entered; a surface that leaves them ends there, open. None for
        the shape's own box, and one cell more on every side, so that nothing is cut.
    placement : {"linear", "root"}
        Where on its edge a vertex lies: where linear interpolation between the two nodes puts it,
        or where the function itself crosses the level, found by more evaluations.
    progress : callable
        Told the stage, and the part of the cells known so far that is done.

    Returns
    -------
    mesh : Mesh
        Faces counter-clockwise seen from where the values are larger; in an order that does not
        depend on the seeds. Without faces if a search finds no cell.

    Raises
    ------
    SurfaceError
        The level is not finite; voxel_size is not a positive number; no box is given or known; a
        seed is outside the box or not near the surface; there are no seeds, and the shape is known
        by its sign only; the box has 2^62 nodes or more; the surface would need more than 2^31 - 1
        vertices; or the function gives another number of values than it was given points.

    Notes
    -----
    Promise: with all components seeded, the faces are those of `marching_cubes` on a grid of all
    nodes of the box, border open, topology "manifold"; with some, those of whole components (of
    cells that hang together: sheets that share a cell come together). Closed and manifold likewise.
    Accuracy: with "linear", that of `marching_cubes`, bit for bit where the grid begins at node
    (0, 0, 0). With "root" a vertex is within ``2**-41`` voxels of a crossing, and no point of the
    mesh is farther from a surface of principal curvatures up to kappa than
    ``voxel_size**2 * 3/8 * kappa / (1 - sqrt(3) * voxel_size * kappa)``, whatever the values.
    Cost: each node of an entered cell is evaluated once, O(n^2) for n cells along the box, in as
    many calls as the surface is cells long, or one call for each 65536 cells. The search adds about
    as many again. "root" adds 8 to 10 evaluations per vertex for smooth functions, and never more
    than 46.

    References
    ----------
    G. Wyvill, C. McPheeters and B. Wyvill, "Data structure for soft objects", 1986,
    doi:10.1007/BF01900346.
    J. Bloomenthal, "Polygonization of implicit surfaces", 1988, doi:10.1016/0167-8396(88)90013-1.

    Examples
    --------
    >>> from meshsdf.implicit import torus
    >>> ring = continue_surface(torus(2.0, 0.5), voxel_size=0.125)
    >>> ring.n_vertices - ring.n_faces // 2  # Euler characteristic of a torus
    0
    """
    check_placement(placement)
    cells = start_cells(shape, voxel_size, level, box, is_searched=seeds is None)
    if seeds is None:
        cells.enter(cells_not_proved_empty(cells), progress)
    else:
        enter_seeds(cells, seeds)
    cells.grow(progress)
    return _mesh_of(cells, placement, progress)


def check_placement(placement: str) -> None:
    """Refuse a placement of another name.

    Raises
    ------
    SurfaceError
        It is none of the two.
    """
    if placement not in PLACEMENTS:
        raise SurfaceError(
            f"placement is {placement!r}",
            "continue_surface(placement=...)",
            f"pass one of {PLACEMENTS}",
        )


def _mesh_of(cells: LatticeCells, placement: str, progress: Progress) -> Mesh:
    """The vertices on crossed edges in order of their nodes, the faces in order of their cells."""
    cases = cube_cases()
    n = cells.cells.n
    patterns, corners = cells.patterns[:n], cells.corners[:n]
    keys = cells.nodes.keys[: cells.nodes.n]
    other_end = np.full((len(keys), 3), -1, np.int32)
    mark_edges(patterns, corners, _ENDS, cases.crossed, other_end)
    order = np.argsort(keys)
    place, axis = np.nonzero(other_end[order] >= 0)
    require_nameable(len(place))
    low = order[place]
    high = other_end[low, axis]
    vertices = _place(cells, placement, low, high, axis, progress)
    number = other_end  # from here on: the vertex of each edge
    number[low, axis] = np.arange(len(low), dtype=np.int32)
    faces = np.empty((int(cases.n_triangles[patterns].sum(dtype=np.int64)), 3), np.int32)
    by_key = np.argsort(cells.cells.keys[:n])
    write_faces(patterns, corners, by_key, _ENDS, cases.triangles, number, faces)
    if np.isnan(cells.values[: cells.nodes.n]).any():
        vertices, faces = separate_fans(vertices, faces)
    progress("surface", 1.0)
    return Mesh(vertices, faces)


def _place(
    cells: LatticeCells,
    placement: str,
    low: np.ndarray,
    high: np.ndarray,
    axis: np.ndarray,
    progress: Progress,
) -> Points:
    """Return the positions of vertices on the edges from node ``low`` along ``axis``."""
    lattice = cells.lattice
    first = lattice.indices(cells.nodes.keys[low])

    def at(edge: np.ndarray, share: np.ndarray) -> Points:
        index = first[edge].astype(np.float64)
        index[np.arange(len(edge)), axis[edge]] += share
        return lattice.voxel_size * index

    a, b = cells.values[low], cells.values[high]
    if placement == "root":
        progress("roots", 0.0)
        shares = edge_roots(
            lambda edge, share: evaluate(cells.function, at(edge, share)), a, b, cells.level
        )
    else:
        shares = np.empty(len(a))
        write_shares(a, b, cells.level, shares)
    return at(np.arange(len(low)), shares)
