"""Marching cubes: the surface where a volume takes one value, as a closed, oriented manifold.

Lorensen and Cline 1987 (doi:10.1145/37401.37422), with cases derived in `cube_cases` so that
neighbouring cubes always agree, and with vertices named by the integer edge they lie on.
"""

from typing import Literal

import numpy as np

from ..errors import SurfaceError
from ..grid import Grid, NarrowBand
from ..kernels.marching_cubes import count_bricks, fill_faces, fill_vertices
from ..mesh import Mesh
from ..mesh.pieces import connected_labels
from ..progress import Progress, silent
from .brick_field import BrickField, field_of_band, field_of_grid, in_ranges
from .cap import weld_border_nodes
from .cube_cases import cube_cases

BORDERS = ("open", "cap", "pad")
MAX_VERTICES = 2**31 - 1  # faces are int32


def marching_cubes(
    volume: NarrowBand | Grid,
    *,
    level: float = 0.0,
    border: Literal["open", "cap", "pad"] = "open",
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
        The level is not finite, outside the band, or not above 0 for an unsigned volume; the border
        is none of the three; the grid has an axis with fewer than 2 nodes; the surface would need
        more than 2^31 - 1 vertices; or the band marks missing bricks side by side as inside and
        outside.

    Notes
    -----
    Promise: whatever the values, ties and zeros included, every edge belongs to two faces, in
    opposite directions, and the faces around every vertex form one cycle; both hold by index, and
    up to the open border or to cells without data. Vertices may coincide where a node has exactly
    the value ``level``, which counts as outside.
    Where the diagonals of a cube's face have different signs, the inside corners are kept
    apart; the surface may thus be connected otherwise than that of the trilinear interpolant.
    Accuracy: a vertex lies on an edge of the grid, where linear interpolation of the two values
    puts it, to rounding of float64. For exact samples of a distance whose level surface has
    principal curvatures up to kappa, no point of the mesh is farther from it than
    ``voxel_size**2 / 2 * kappa / (1 - sqrt(3) * voxel_size * kappa)``. In a band that asks for both
    ends of every crossed edge to be active: ``abs(level) <= background - voxel_size``.
    Cost: for a band, time and memory grow with its bricks; for a grid, the values are read once,
    and memory grows with the blocks of 8^3 nodes around the surface.
    The same volume gives the same mesh with any number of threads.

    References
    ----------
    W. E. Lorensen and H. E. Cline, "Marching cubes", 1987, doi:10.1145/37401.37422.
    C. Montani, R. Scateni and R. Scopigno, "A modified look-up table for implicit
    disambiguation of marching cubes", 1994, doi:10.1007/BF01900830.

    Examples
    --------
    >>> i, j, k = np.indices((5, 5, 5)) - 2.0
    >>> ball = Grid(np.sqrt(i * i + j * j + k * k) - 1.5, voxel_size=1.0, origin=np.zeros(3))
    >>> mesh = marching_cubes(ball)
    >>> mesh.n_vertices - mesh.n_faces // 2  # Euler characteristic of a sphere
    2
    """
    _check(volume, level, border)
    level = float(level)
    is_capped = border == "cap" and isinstance(volume, Grid)
    if isinstance(volume, NarrowBand):
        field, translation = field_of_band(volume, level, progress), volume.translation
    else:
        field, translation = field_of_grid(volume, level, border, progress), volume.origin
    toward_infinity = 0.0 if is_capped else 0.5
    place = np.array(
        [field.background, level, toward_infinity, volume.voxel_size, *translation], float
    )
    vertices, faces, crossings = _extract(field, place, progress)
    if is_capped:
        vertices, faces = weld_border_nodes(
            vertices, faces, crossings, field.corners, volume.values.shape
        )
    if field.has_gaps:
        vertices, faces = _separate_fans(vertices, faces)
    return Mesh(vertices, faces)


def _extract(
    field: BrickField, place: np.ndarray, progress: Progress
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Count, add up, fill: every brick then writes at a place of its own.

    Vertices and faces, and the crossing words they were made from.
    """
    cases = cube_cases()
    n = len(field.corners)
    shared = field.inside, field.valid, field.near
    crossings = np.empty((n, 24), np.uint64)
    n_faces = np.empty(n, np.int64)
    in_ranges(
        lambda start, stop: count_bricks(
            *shared, cases.n_triangles, start, stop, crossings, n_faces
        ),
        n,
        "counting",
        progress,
    )
    per_word = np.bitwise_count(crossings)
    last = np.cumsum(per_word, dtype=np.int64).reshape(n, 24)
    n_vertices = int(last[-1, -1]) if n else 0
    _check_size(n_vertices)
    first = (last - per_word).astype(np.int32)
    first_face = np.concatenate([[0], np.cumsum(n_faces)])
    vertices = np.empty((n_vertices, 3))
    faces = np.empty((int(first_face[-1]), 3), np.int32)

    def fill(start: int, stop: int) -> None:
        fill_vertices(
            field.values, field.inside, field.near, crossings, first, field.corners, place,
            start, stop, vertices,
        )  # fmt: skip
        fill_faces(
            *shared, crossings, first, first_face, cases.crossed, cases.triangles,
            start, stop, faces,
        )  # fmt: skip

    in_ranges(fill, n, "surface", progress)
    return vertices, faces, crossings


def _separate_fans(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Drop vertices without faces, and repeat those where cells without data part the faces."""
    corner = np.arange(faces.size).reshape(-1, 3)
    start, end = faces, np.roll(faces, -1, axis=1)
    key = start.astype(np.int64) * len(vertices) + end
    reverse = end.astype(np.int64) * len(vertices) + start
    order = np.argsort(key, axis=None)
    at = np.searchsorted(key.ravel()[order], reverse.ravel()).clip(max=max(key.size - 1, 0))
    partner = order[at]
    has_partner = key.ravel()[partner] == reverse.ravel()
    # The edge runs from this corner to the next; its partner from that corner's twin to ours.
    here = corner.ravel()[has_partner]
    there = np.roll(corner, -1, axis=1).ravel()[partner[has_partner]]
    fan = connected_labels(faces.size, np.column_stack([here, there]))
    n_fans = int(fan.max(initial=-1)) + 1
    origin = np.empty(n_fans, np.int64)
    origin[fan] = faces.ravel()
    ordered = np.lexsort((np.arange(n_fans), origin))
    rank = np.empty(n_fans, np.int32)
    rank[ordered] = np.arange(n_fans, dtype=np.int32)
    return vertices[origin[ordered]], rank[fan].reshape(-1, 3)


def _check(volume: NarrowBand | Grid, level: float, border: str) -> None:
    where = "marching_cubes(level=...)"
    if border not in BORDERS:
        raise SurfaceError(
            f"border is {border!r}", "marching_cubes(border=...)", f"pass one of {BORDERS}"
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
            "marching_cubes(volume=...)",
            "pass at least 2 nodes along each axis",
        )


def _check_size(n_vertices: int) -> None:
    if n_vertices > MAX_VERTICES:
        raise SurfaceError(
            f"the surface has {n_vertices} vertices, faces can name {MAX_VERTICES}",
            "marching_cubes(volume=...)",
            "cut the volume into parts, or use a larger voxel size",
        )
