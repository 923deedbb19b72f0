"""Dual contouring: a vertex in every cell that the surface enters, polygons around crossed edges.

Ju, Losasso, Schaefer and Warren 2002 (doi:10.1145/566654.566586), with one vertex for every loop
(Nielson 2004, doi:10.1109/VISUAL.2004.28) so that the mesh is a manifold, and with crossings,
normals and features taken from the mesh itself where it is at hand.
"""

from ..arrays import Number
from ..errors import SurfaceError
from ..grid import Grid, NarrowBand
from ..mesh import Mesh
from ..progress import Progress, silent
from .brick_field import field_of
from .cell_clamp import clamped
from .dual_faces import join_loops
from .dual_loops import find_loops
from .fans import separate_fans
from .hermite import (
    FEATURE_ANGLE,
    choose_normals,
    locate_by_gradients,
    locate_by_store,
    locate_on_mesh,
    to_world,
)
from .level import check_level
from .marching_cubes import Border, check_choices

LARGEST_ANGLE = 180.0


def dual_contouring(
    volume: NarrowBand | Grid,
    mesh: Mesh | None = None,
    *,
    level: Number = 0.0,
    clamp: bool = False,
    feature_angle: Number = FEATURE_ANGLE,
    border: Border = "open",
    progress: Progress = silent,
) -> Mesh:
    """Extract the surface ``value = level`` with its creases and corners.

    Parameters
    ----------
    volume : NarrowBand or Grid
        Values at nodes, smaller inside. A grid needs 2 nodes per axis; NaN there means no data,
        and a cell with such a corner yields nothing.
    mesh : Mesh, optional
        The mesh that the volume was made from. Without it the Hermite data of a band are taken
        (`sample_hermite`), and without these gradients of the values; `choose_normals` says which.
    level : float
        In the unit of the values. For a band it must lie strictly between +-background. Mesh and
        Hermite data know level 0 alone.
    clamp : bool
        Keep every vertex in its cell, so that no two triangles cross. By default vertices may
        leave their cells for the corner or crease they belong to: nothing else brings a polyhedron
        back exactly, and what crosses then are slivers beside features.
    feature_angle : float
        In degrees: edges of the mesh whose faces turn by more are creases, and all edges of flats
        at least a voxel wide. Other edges are met by the quadric alone. Of no effect on stored
        data and gradients.
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
        Arguments out of range, as for `marching_cubes`; a feature angle not in (0, 180]; or Hermite
        data that belong to another band.

    Notes
    -----
    Promise: whatever the values, every edge belongs to two faces, in opposite directions, and the
    faces around every vertex form one cycle; both hold by index, and up to the open border or to
    cells without data. With ``clamp`` no two triangles have a point in common but what they share
    by index, as long as a millionth of a voxel is more than the rounding of coordinates.
    Accuracy, from a mesh or stored data: where all that is not flat (an edge, a corner, another
    sheet) is two voxels from the next such thing, every face lies in the plane of a face of the
    mesh, and a polyhedron comes back to rounding, or to 1e-7 voxels where faces turn by less than
    1e-7, as those of one plane do after rounding to float32.
    Elsewhere vertices are within 0.05 voxels of the mesh wherever it is near the crossing at all;
    edges and polygons whose middles are farther get one vertex more. With ``clamp`` features
    outside the cells that see them are lost. With gradients vertices are estimates, within their
    cells, and creases come back rounded.
    Limits: without ``clamp`` triangles may fold over beside features, above all at edges sharper
    than a right angle. Where bodies overlap, the lines in which they cross are met by the quadric.
    Cost: time and memory grow with the surface in voxels and with the faces of the mesh.
    The same input gives the same mesh with any number of threads.
    Method: a crossing of a lattice edge is that with a face of the mesh, to which signs are
    consistent. One vertex per loop of crossings: on the crease or at the corner where the regions
    it sees meet, else where the squared distances to the tangent planes are least; triangles as in
    `kernels.dual_faces` and `kernels.cell_clamp`.

    References
    ----------
    T. Ju, F. Losasso, S. Schaefer and J. Warren, "Dual contouring of Hermite data", 2002,
    doi:10.1145/566654.566586.
    G. M. Nielson, "Dual marching cubes", 2004, doi:10.1109/VISUAL.2004.28.
    S. Schaefer, T. Ju and J. Warren, "Manifold dual contouring", 2007,
    doi:10.1109/TVCG.2007.1012.
    T. Ju and T. Udeshi, "Intersection-free contouring on an octree grid", 2006.

    Examples
    --------
    >>> from meshsdf.mesh.primitives import box_mesh
    >>> i, j, k = np.indices((8, 8, 8)) - 3.5
    >>> cube = Grid(np.maximum(np.maximum(abs(i), abs(j)), abs(k)) - 2.25, 1.0, np.full(3, -3.5))
    >>> surface = dual_contouring(cube, box_mesh((4.5, 4.5, 4.5)))
    >>> surface.vertices.max(axis=0)
    array([2.25, 2.25, 2.25])
    """
    _check(volume, level, feature_angle, border)
    level = float(level)
    toward_infinity = 0.0 if border == "cap" else 0.5
    field = field_of(volume, level, border, progress)
    loops = find_loops(field, level, toward_infinity, progress)
    source = choose_normals(volume, mesh, level=level).kind
    if source == "mesh":
        located, _ = locate_on_mesh(mesh, volume, field, loops, feature_angle, progress)
    elif source == "stored":
        located = locate_by_store(volume, loops, progress)
    else:
        located = locate_by_gradients(volume, field, loops, progress)
    if clamp:
        located = clamped(located)
    vertices, faces = join_loops(
        loops.arrays, located.crossings, located.points, located.arcs, located.arc_points,
        allowed=located.allowed, progress=progress,
    )  # fmt: skip
    vertices = to_world(volume, loops, vertices)
    if (loops.around < 0).any():
        vertices, faces = separate_fans(vertices, faces)
    return Mesh(vertices, faces)


def _check(volume: NarrowBand | Grid, level: Number, feature_angle: Number, border: str) -> None:
    check_choices(border, "manifold", level, "dual_contouring")
    if not 0 < feature_angle <= LARGEST_ANGLE:
        raise SurfaceError(
            f"feature_angle is {feature_angle}",
            "dual_contouring(feature_angle=...)",
            "pass degrees above 0, up to 180; 30 is usual",
        )
    check_level(volume, float(level), "dual_contouring")
