"""Dual contouring: a vertex in every cell that the surface enters, polygons around crossed edges.

Ju, Losasso, Schaefer and Warren 2002 (doi:10.1145/566654.566586), with one vertex for every loop
(Nielson 2004, doi:10.1109/VISUAL.2004.28) so that the mesh is a manifold, and with crossings,
normals and features taken from the mesh itself where it is at hand.
"""

import numpy as np

from ..arrays import Number
from ..errors import SurfaceError
from ..grid import Grid, NarrowBand
from ..mesh import Mesh
from ..progress import Progress, silent
from .brick_field import field_of_band, field_of_grid
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
from .marching_cubes import BORDERS, Border

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
    """Extract the surface ``value = level`` with its creases and corners."""
    _check(volume, level, feature_angle, border)
    level = float(level)
    toward_infinity = 0.0 if border == "cap" else 0.5
    if isinstance(volume, NarrowBand):
        field = field_of_band(volume, level, progress)
    else:
        field = field_of_grid(volume, level, border, progress)
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
    where = "dual_contouring(level=...)"
    if border not in BORDERS:
        raise SurfaceError(
            f"border is {border!r}", "dual_contouring(border=...)", f"pass one of {BORDERS}"
        )
    if not 0 < feature_angle <= LARGEST_ANGLE:
        raise SurfaceError(
            f"feature_angle is {feature_angle}",
            "dual_contouring(feature_angle=...)",
            "pass degrees above 0, up to 180; 30 is usual",
        )
    if not np.isfinite(level):
        raise SurfaceError(f"level is {level}", where, "pass a finite number")
    if not volume.is_signed and level <= 0:
        raise SurfaceError(
            f"level is {level:g}, but the volume is unsigned: no value lies below 0",
            where,
            f"pass a level above 0, such as the voxel size, {volume.voxel_size:g}",
        )
    if isinstance(volume, NarrowBand):
        if abs(level) >= volume.background:
            raise SurfaceError(
                f"level is {level:g}, but the band holds only values between "
                f"{-volume.background:g} and {volume.background:g}",
                where,
                "pass a level strictly between, or make the band wider with half_width",
            )
    elif min(volume.values.shape) < 2:
        raise SurfaceError(
            f"the grid has {' x '.join(map(str, volume.values.shape))} nodes, so it has no cell",
            "dual_contouring(volume=...)",
            "pass at least 2 nodes along each axis",
        )
