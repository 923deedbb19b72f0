"""Where a round trip loses: in sampling, in interpolation, or in extraction; each with proof.

M is the mesh, F the trilinear interpolant of the stored samples, Z its zero set (where F changes
from below the level to not below), E the surface extracted. Samples are rounded, which moves Z a
little; Z is not M, for between the samples F is not the distance; and E is not Z, for triangles
are flat and Z is not.
"""

from dataclasses import asdict, dataclass
from math import inf, isfinite

import numpy as np

from ..arrays import Ijk, Number
from ..errors import ReportError
from ..grid import NarrowBand
from ..mesh import Mesh
from ..progress import Progress, silent
from ..spatial.closest_point import ClosestPoint
from ..surface.level import default_level
from .enclosure import Enclosure, ceil_digits, floor_digits
from .level_shift import level_shift
from .tolerance import Tolerance
from .zero_distance import ZeroSides
from .zero_set import ZeroSet

VOXEL_SHARE = 1e-2
"""Width asked of the intervals if nothing else is, in voxels."""

MAX_BOXES = 2**22  # into which cells are cut, or for large bands:
BOXES_PER_CELL = 32
MAX_EVALUATIONS = 5_000_000
COMPUTATION = 1e-7  # voxels: of a stored distance before it is rounded, as `mesh_to_band` promises
HALF_ULP = 2.0**-24  # of float32, relative


@dataclass(frozen=True, eq=False)
class ErrorBudget:
    """The loss of a round trip, step by step. Lengths in world units.

    Attributes
    ----------
    sample_error : float
        No sample at a corner of a cell that the surface enters is off the exact distance by more.
    sampling : float
        Exact samples in their place would move Z by at most this; infinite if nothing bounds it.
    zero_set_to_mesh, mesh_to_zero_set : Enclosure
        Interpolation: the largest distance of a point of Z from M, and of a point of M from Z.
    surface_to_zero_set, zero_set_to_surface : Enclosure
        Extraction: the same between E and Z. A surface made with the mesh's help, as by dual
        contouring, may leave Z on purpose, to be nearer to M.
    voxel_size, level : float
        Of the band.
    is_within_tolerance : bool
        False if an interval is wider than asked.
    """

    sample_error: float
    sampling: float
    zero_set_to_mesh: Enclosure
    mesh_to_zero_set: Enclosure
    surface_to_zero_set: Enclosure
    zero_set_to_surface: Enclosure
    voxel_size: float
    level: float
    is_within_tolerance: bool

    @property
    def interpolation(self) -> Enclosure:
        """The Hausdorff distance of M and Z."""
        return self.zero_set_to_mesh.largest(self.mesh_to_zero_set)

    @property
    def extraction(self) -> Enclosure:
        """The Hausdorff distance of Z and E."""
        return self.zero_set_to_surface.largest(self.surface_to_zero_set)

    def describe(self) -> str:
        """Return the budget in a sentence or two, in voxels."""
        if isfinite(self.sampling):
            share = ceil_digits(self.sampling / self.voxel_size, 3)
            first = f"Rounding of the samples moves the level set by at most {share} voxels"
        else:
            first = "Nothing bounds how far the rounding of the samples moves the level set"
        text = (
            f"{first}; interpolation between them takes it {self._range(self.interpolation)} "
            f"voxels from the mesh; the surface extracted is {self._range(self.extraction)} "
            "voxels from it."
        )
        if not self.is_within_tolerance:
            text += " Not all intervals are as narrow as asked."
        return text

    def to_json(self) -> dict:
        """Return plain types, in world units; None for what is infinite."""
        names = (
            "zero_set_to_mesh",
            "mesh_to_zero_set",
            "surface_to_zero_set",
            "zero_set_to_surface",
            "interpolation",
            "extraction",
        )
        sides = {name: _finite(asdict(getattr(self, name))) for name in names}
        head = {"voxel_size": self.voxel_size, "level": self.level}
        numbers = _finite({"sample_error": self.sample_error, "sampling": self.sampling})
        return head | numbers | sides | {"is_within_tolerance": self.is_within_tolerance}

    def _range(self, length: Enclosure) -> str:
        low = floor_digits(length.lower / self.voxel_size, 3)
        return f"{low} to {ceil_digits(length.upper / self.voxel_size, 3)}"


def error_budget(
    mesh: Mesh,
    band: NarrowBand,
    surface: Mesh,
    *,
    level: Number | None = None,
    tolerance: Number | Tolerance | None = None,
    max_evaluations: int = MAX_EVALUATIONS,
    progress: Progress = silent,
) -> ErrorBudget:
    """Say how much of a round trip's loss comes from which step.

    Parameters
    ----------
    mesh : Mesh
        What the band was made from, at least one face.
    band : NarrowBand
        Signed or unsigned distances to it.
    surface : Mesh
        What was extracted from the band, at least one face.
    level : float, optional
        Level of the surface, world units; by default 0, or one voxel for unsigned distances.
    tolerance : float or Tolerance, optional
        Width asked of the four intervals, world units; by default a hundredth of a voxel. A
        share of the length enclosed is of no effect.
    max_evaluations : int
        Closest points for each search, after which nothing is cut further: intervals are then
        true, but wider.
    progress : callable
        Told the stage and the fraction done.

    Raises
    ------
    ReportError
        A mesh has no faces, no value crosses the level, or the tolerance makes no sense.

    Notes
    -----
    Accuracy: intervals hold the truth in exact arithmetic on the samples as stored; all rounding
    is part of them. Distances go to all faces of the mesh, those inside a union of bodies too.
    Sampling: the distances of the corners to the mesh are computed anew, and the stored ones
    compared with them, but for their signs, which are taken as right; with inner faces, whose
    distances do not count, half the last digit of the largest, and 1e-7 voxel, are taken instead.
    Method: Z is replaced by pieces of planes, proved to be near (`zero_set`, `zero_distance`).
    Cost: that of comparing the mesh and the surface, about four times, where the tolerance is not
    far below the loss; else cells are cut until planes fit, and time grows like 1 / tolerance.

    Examples
    --------
    >>> from meshsdf.mesh.primitives import icosphere
    >>> from meshsdf.sdf import mesh_to_band
    >>> from meshsdf.surface import marching_cubes
    >>> ball = icosphere(subdivisions=4)
    >>> band = mesh_to_band(ball, resolution=16)
    >>> budget = error_budget(ball, band, marching_cubes(band))
    >>> budget.sampling < 1e-6 * band.voxel_size
    True
    >>> bool(budget.interpolation.upper < 0.05 * band.voxel_size)
    True
    """
    _check(mesh, "mesh")
    _check(surface, "surface")
    if level is None:
        level = default_level(band)[0]
    width = Tolerance.of(VOXEL_SHARE * band.voxel_size if tolerance is None else tolerance).absolute
    if not width > 0:
        what, fix = "the tolerance is no length", "pass a positive length, or Tolerance.in_voxels"
        raise ReportError(what, "error_budget(tolerance=...)", fix)
    zero = ZeroSet(band, level, MAX_BOXES)
    zero.max_boxes = max(MAX_BOXES, BOXES_PER_CELL * len(zero.cells))
    to_mesh = ClosestPoint(mesh)
    error = _sample_error(band, zero.cells, to_mesh, progress)
    sides = ZeroSides(zero, float(width), max_evaluations, progress)
    shift = level_shift(band, level, error).upper
    distances = {
        "zero_set_to_mesh": sides.from_zero_set(to_mesh),
        "mesh_to_zero_set": sides.to_zero_set(mesh),
        "surface_to_zero_set": sides.to_zero_set(surface),
        "zero_set_to_surface": sides.from_zero_set(ClosestPoint(surface)),
    }
    return ErrorBudget(
        sample_error=error,
        sampling=inf if shift is None else shift,
        **distances,
        voxel_size=band.voxel_size,
        level=float(level),
        is_within_tolerance=not sides.met_limit,
    )


def _sample_error(band: NarrowBand, cells: Ijk, to_mesh: ClosestPoint, progress: Progress) -> float:
    """How far samples are from the distances to the mesh, but for signs.

    At the corners of the cells, and next to these: there a band may hold its background in place
    of a larger distance, which can only keep the level set away.
    """
    corners = _nodes(cells, (0, 1))
    if band.n_inner_faces:
        largest = float(np.abs(band.value_at(corners)).max())
        return COMPUTATION * band.voxel_size + HALF_ULP * largest
    error = 0.0
    for nodes, is_corner in ((corners, True), (_nodes(cells, (-1, 0, 1, 2)), False)):
        points = band.to_world(nodes)
        stored = np.abs(band.value_at(nodes))
        found = to_mesh.distances(points, progress=progress).distance
        off = np.abs(stored - found)
        if not is_corner:
            off[(stored >= band.background) & (found > stored)] = 0.0
        place = 4 * 2.0**-53 * np.abs(points).max(axis=1)  # of a node's computed position
        error = max(error, float((off + to_mesh.rounding_bound(points) + place).max()))
    return error


def _nodes(cells: Ijk, steps: tuple[int, ...]) -> np.ndarray:
    """(k, 3): the nodes at these steps along every axis from the lowest nodes of cells, once."""
    low = cells.min(axis=0) + min(steps)
    shape = tuple(cells.max(axis=0) + max(steps) - low + 1)
    keys = np.ravel_multi_index(tuple((cells - low).T), shape)
    for stride in (1, shape[2], shape[1] * shape[2]):
        keys = np.unique(keys[:, None] + stride * np.array(steps))
    return np.stack(np.unravel_index(keys, shape), axis=1) + low


def _check(mesh: Mesh, name: str) -> None:
    if mesh.n_faces == 0:
        what = f"the {name} has no faces, so there is no distance to measure"
        raise ReportError(what, f"error_budget({name}=...)", "pass a mesh with at least one face")


def _finite(numbers: dict) -> dict:
    return {key: value if isfinite(value) else None for key, value in numbers.items()}
