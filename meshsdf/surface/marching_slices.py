"""Marching cubes on a grid that comes slice by slice, in the memory of two slices."""

from collections.abc import Iterable, Iterator

import numpy as np

from ..arrays import Number, Vector3
from ..errors import SurfaceError
from .marching_cubes import Border, Topology, cases_of, check_choices, place_of
from .plane_sweep import MeshPart, PlaneSweep

WHERE = "marching_cubes_slices(slices=...)"


def marching_cubes_slices(
    slices: Iterable[np.ndarray],
    *,
    voxel_size: Number = 1.0,
    origin: Vector3 | None = None,
    level: Number = 0.0,
    border: Border = "open",
    topology: Topology = "manifold",
) -> Iterator[MeshPart]:
    """Extract the surface ``value = level`` of a grid that comes slice by slice.

    Parameters
    ----------
    slices : iterable of (nj, nk) float32 or float64
        Slice i holds the values at the nodes ``origin + voxel_size * (i, j, k)``, at least 2 along
        each axis; NaN means no data. Two slices are held at a time, as copies.
    voxel_size : float
        World units.
    origin : (3,) float64 or None
        World position of node (0, 0, 0); None for zero.
    level, border, topology
        As for `marching_cubes`.

    Yields
    ------
    part : MeshPart
        After every slice, and at the end: vertices, numbered on from those of earlier parts, and
        faces, which name vertices given so far; perhaps none. Together they are the vertices and
        faces of `marching_cubes` for the whole grid, bit for bit and in the same order.

    Raises
    ------
    SurfaceError
        Level or origin is not finite, voxel_size is not a positive number, or a word is unknown: at
        the call. There are fewer than 2 slices, or a slice is not of the first one's shape and
        type: when it is reached. So is NaN at a border node with ``border="cap"``, where there
        would be nothing to close.

    Notes
    -----
    Cost: time as for the whole grid; memory for two slices of values, a few bits per node of a
    slice, and the vertices and faces between two slices.

    Examples
    --------
    >>> j, k = np.indices((9, 9)) - 4.0
    >>> slices = (np.sqrt(i * i + j * j + k * k) - 3.0 for i in range(-4, 5))
    >>> parts = list(marching_cubes_slices(slices))
    >>> n_vertices = sum(len(part.vertices) for part in parts)
    >>> n_vertices - sum(len(part.faces) for part in parts) // 2
    2
    """
    origin = np.zeros(3) if origin is None else origin
    check_choices(border, topology, level, "marching_cubes_slices")
    if not np.isfinite(origin).all():
        raise SurfaceError(
            f"origin is {origin}", "marching_cubes_slices(origin=...)", "pass finite numbers"
        )
    if not (np.isfinite(voxel_size) and voxel_size > 0):
        raise SurfaceError(
            f"voxel_size is {voxel_size}",
            "marching_cubes_slices(voxel_size=...)",
            "pass a length above 0",
        )
    return _walk(slices, place_of(level, border, voxel_size, origin), border, topology)


def _walk(
    slices: Iterable[np.ndarray], place: np.ndarray, border: str, topology: str
) -> Iterator[MeshPart]:
    sweep, plane, i = None, None, -1
    for i, given in enumerate(slices):
        _check_slice(i, given, plane)
        plane = np.array(given, order="C")
        del given  # the caller's: not held while parts are looked at
        if border == "cap":
            _check_border(i, plane, whole=i == 0)
        if sweep is None:
            sweep = PlaneSweep(plane.shape, plane.dtype, place, cases_of(topology), border=border)
        yield sweep.feed(plane)
    if i < 1:
        raise SurfaceError(f"there are {i + 1} slices, so no cell", WHERE, "pass at least 2 slices")
    if border == "cap":
        _check_border(i, plane, whole=True)
    yield from sweep.finish()


def _check_slice(i: int, given: object, before: np.ndarray | None) -> None:
    if not isinstance(given, np.ndarray) or given.dtype not in (np.float32, np.float64):
        kind = given.dtype if isinstance(given, np.ndarray) else type(given).__name__
        raise SurfaceError(f"slice {i} holds {kind}", WHERE, "pass arrays of float32 or float64")
    if given.ndim != 2 or min(given.shape) < 2:
        raise SurfaceError(
            f"slice {i} has the shape {given.shape}", WHERE, "pass (nj, nk) with 2 nodes or more"
        )
    if before is not None and (given.shape, given.dtype) != (before.shape, before.dtype):
        raise SurfaceError(
            f"slice {i} is {given.shape} of {given.dtype}, those before are "
            f"{before.shape} of {before.dtype}",
            WHERE,
            "pass slices of one shape and one type",
        )


def _check_border(i: int, plane: np.ndarray, *, whole: bool) -> None:
    missing = np.isnan(plane)
    if not whole:
        missing[1:-1, 1:-1] = False
    if missing.any():
        raise SurfaceError(
            f"slice {i} has {np.count_nonzero(missing)} border nodes without data",
            "marching_cubes_slices(border='cap')",
            "fill them in, or pass border='open' or border='pad'",
        )
