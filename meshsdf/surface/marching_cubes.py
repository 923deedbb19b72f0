"""Marching cubes: the surface where a volume takes one value, as a closed, oriented manifold.

Lorensen and Cline 1987 (doi:10.1145/37401.37422), with cases derived in `cube_cases` and
`trilinear_cases` so that neighbouring cubes always agree, and with vertices named by the integer
edge they lie on.
"""

from typing import Literal

import numpy as np

from ..arrays import Ijk, Number
from ..errors import SurfaceError
from ..grid import Grid, NarrowBand
from ..mesh import Mesh
from ..progress import Progress, silent
from .brick_field import field_of_band
from .brick_surface import brick_surface, special_brick_cells
from .cap import MATERIALS, name_vertices
from .fans import separate_fans
from .level import check_level
from .plane_surface import plane_surface, special_plane_cells
from .trilinear_cases import CellCases, manifold_cells, trilinear_cells

Border = Literal["open", "cap", "pad"]
Topology = Literal["manifold", "trilinear"]

BORDERS = ("open", "cap", "pad")
TOPOLOGIES = ("manifold", "trilinear")


def marching_cubes(
    volume: NarrowBand | Grid,
    *,
    level: Number = 0.0,
    border: Border = "open",
    topology: Topology = "manifold",
    progress: Progress = silent,
) -> Mesh:
    """Extract the surface ``value = level``.

    Parameters
    ----------
    volume : NarrowBand or Grid
        Values at nodes, smaller inside. A grid needs 2 nodes per axis; NaN there means no data,
        and a cell with such a corner yields nothing.
    level : float
        In the unit of the values. For a band it must lie strictly between +-background.
    border : {"open", "cap", "pad"}
        What happens where the inside reaches the border of a grid: the surface ends there; is
        closed by faces that lie exactly in the border planes; or is closed half a voxel beyond
        them. A band has no border, and this has no effect on it.
    topology : {"manifold", "trilinear"}
        What the surface does where the signs of a cell's corners leave a choice: where the
        diagonals of a cell's face have different signs, inside corners are kept apart and nothing
        else is asked; or it has, in every cell, the components, holes and tunnels of the
        trilinear interpolant.
    progress : callable
        Told the stage and the fraction done.

    Returns
    -------
    mesh : Mesh
        Faces counter-clockwise seen from where the values are larger. Without faces if no value
        lies below the level, or none above. A grid's with ``border="cap"`` has a material
        index: 0 for the surface, 1 for cap faces, by the names "surface" and "cap".

    Raises
    ------
    SurfaceError
        The level is not finite, outside the band, or not above 0 for an unsigned volume; border or
        topology is none of those listed; the grid has an axis with fewer than 2 nodes; the surface
        would need more than 2^31 - 1 vertices; or the band marks missing bricks side by side as
        inside and outside.

    Notes
    -----
    Promise: whatever the values, ties and zeros included, every edge belongs to two faces, in
    opposite directions, and the faces around every vertex form one cycle; both hold by index, and
    up to the open border or to cells without data. Vertices may coincide where a node has exactly
    the value ``level``, which counts as outside.
    Promise of "trilinear": decided without rounding error, for the numbers given and the
    interpolant of ``value - level``. A saddle point exactly at the level counts as outside, as a
    node does; where the surface would cross itself there, it is a manifold all the same, and
    `singular_cells` lists the cells. Infinite values have no interpolant: faces with one keep the
    inside apart, cells with one have no tunnels.
    Accuracy: a vertex lies on an edge of the grid, where linear interpolation of the two values
    puts it, to rounding of float64; some vertices of "trilinear" lie within a cell, at the mean of
    such points. For exact samples of a distance whose level surface has principal curvatures up
    to kappa, no point of the mesh is farther from it than
    ``voxel_size**2 / 2 * kappa / (1 - sqrt(3) * voxel_size * kappa)``. In a band that asks for both
    ends of every crossed edge to be active: ``abs(level) <= background - voxel_size``.
    Cost: for a band, time and memory grow with its bricks; for a grid, the values are read twice,
    and memory grows with the surface.
    The same volume gives the same mesh with any number of threads.

    References
    ----------
    W. E. Lorensen and H. E. Cline, "Marching cubes", 1987, doi:10.1145/37401.37422.
    C. Montani, R. Scateni and R. Scopigno, "A modified look-up table for implicit
    disambiguation of marching cubes", 1994, doi:10.1007/BF01900830.
    G. M. Nielson and B. Hamann, "The asymptotic decider", 1991, doi:10.1109/VISUAL.1991.175782.

    Examples
    --------
    >>> i, j, k = np.indices((5, 5, 5)) - 2.0
    >>> ball = Grid(np.sqrt(i * i + j * j + k * k) - 1.5, voxel_size=1.0, origin=np.zeros(3))
    >>> mesh = marching_cubes(ball)
    >>> mesh.n_vertices - mesh.n_faces // 2  # Euler characteristic of a sphere
    2
    """
    check_choices(border, topology, level, "marching_cubes")
    check_level(volume, float(level), "marching_cubes")
    cases = cases_of(topology)
    is_capped = border == "cap" and isinstance(volume, Grid)
    where = volume.translation if isinstance(volume, NarrowBand) else volume.origin
    place = place_of(level, border if is_capped else "pad", volume.voxel_size, where)
    if isinstance(volume, NarrowBand):
        field = field_of_band(volume, float(level), progress)
        return Mesh(*brick_surface(field, place, cases, progress))
    shift = 0 if border == "open" else 1
    surface = plane_surface(
        volume.values, place, cases, shift=shift, with_keys=is_capped, progress=progress
    )
    if not is_capped:
        return Mesh(surface.vertices, surface.faces)
    naming = name_vertices(surface.keys, volume.values.shape)
    vertices = surface.vertices[naming.is_new]
    faces, material = naming.faces(surface.faces)
    faces = faces.astype(np.int32)
    if _has_gaps_at_border(volume.values):
        vertices, faces = separate_fans(vertices, faces)
    return Mesh(vertices, faces, material_index=material, materials=MATERIALS)


def singular_cells(volume: NarrowBand | Grid, *, level: Number = 0.0) -> Ijk:
    """List the cells in which the trilinear interpolant's surface crosses itself.

    There a saddle point, within a cell or within one of its faces, has exactly the value
    ``level``, so that the least change of it would join or part what meets there.

    Parameters
    ----------
    volume, level
        As for `marching_cubes`.

    Returns
    -------
    cells : (n, 3) int64
        Lowest node of each: places in the values of a grid, index coordinates of a band. A face
        between two cells makes both singular.

    Raises
    ------
    SurfaceError
        As for `marching_cubes`.

    Notes
    -----
    A node exactly at the level makes no cell singular by itself: the surface passes through it.
    Cost: time of an extraction, memory for the cells whose signs leave a choice.

    Examples
    --------
    >>> checkers = Grid(np.indices((2, 2, 2)).sum(axis=0) % 2 - 0.5, 1.0, np.zeros(3))
    >>> singular_cells(checkers)
    array([[0, 0, 0]])
    """
    check_choices("open", "trilinear", level, "singular_cells")
    check_level(volume, float(level), "singular_cells")
    cases = trilinear_cells()
    if isinstance(volume, NarrowBand):
        found = special_brick_cells(field_of_band(volume, float(level)), level, cases)
    else:
        found = special_plane_cells(volume.values, level, cases)
    return found.cells[found.decision.is_singular]


def cases_of(topology: str) -> CellCases:
    """Return the tables of a choice of `TOPOLOGIES`."""
    return manifold_cells() if topology == "manifold" else trilinear_cells()


def place_of(level: Number, border: str, voxel_size: float, origin: np.ndarray) -> np.ndarray:
    """Return what kernels call ``place``: level, toward_infinity, voxel_size, origin."""
    return np.array([level, 0.0 if border == "cap" else 0.5, voxel_size, *origin], float)


def check_choices(border: str, topology: str, level: Number, function: str) -> None:
    """Refuse unknown words and levels that are not finite."""
    for name, value, known in (("border", border, BORDERS), ("topology", topology, TOPOLOGIES)):
        if value not in known:
            raise SurfaceError(
                f"{name} is {value!r}", f"{function}({name}=...)", f"pass one of {known}"
            )
    if not np.isfinite(level):
        raise SurfaceError(f"level is {level}", f"{function}(level=...)", "pass a finite number")


def _has_gaps_at_border(values: np.ndarray) -> bool:
    borders = [np.moveaxis(values, axis, 0)[side] for axis in range(3) for side in (0, -1)]
    return any(bool(np.isnan(border).any()) for border in borders)
