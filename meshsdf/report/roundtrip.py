"""Mesh to volume to mesh at several resolutions, and what each lost."""

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Number, Values
from ..errors import ReportError
from ..mesh import Mesh
from ..mesh.two_set import TwoSetReport, check
from ..progress import Progress, silent
from ..sdf import mesh_to_band
from ..sdf.sign import SignMethod
from ..surface import default_level, marching_cubes, require_faces
from .compare import Comparison, compare

VOXEL_SHARE = 1e-2
"""The interval of the maximum is narrowed until it is no wider than this part of a voxel."""


@dataclass(frozen=True, eq=False)
class RoundTripRow:
    """One resolution.

    Attributes
    ----------
    resolution : float
        Voxels along the longest side.
    voxel_size : float
        World units.
    comparison : Comparison
        The mesh against its round trip.
    surface : Mesh
        What came back.
    sign : str
        How inside was told.
    warnings : tuple of str
        What to know about this row.
    seconds : dict
        Time for distance, surface and compare.
    """

    resolution: float
    voxel_size: float
    comparison: Comparison
    surface: Mesh
    sign: str
    warnings: tuple[str, ...]
    seconds: dict[str, float]

    def is_within(self, limit: Number, in_voxels: bool = False) -> bool:
        """Whether the error is certainly at most ``limit``, in world units or in voxels."""
        scale = self.voxel_size if in_voxels else 1.0
        return self.comparison.distance.upper <= limit * scale

    def to_json(self) -> dict:
        """Return plain types, as the command prints them."""
        head = {"resolution": self.resolution, "voxel_size": self.voxel_size, "sign": self.sign}
        body = self.comparison.to_json()
        return head | body | {"warnings": list(self.warnings), "seconds": self.seconds}


@dataclass(frozen=True, eq=False)
class RoundTrip:
    """All rows, coarse to fine as asked, and the order of the error between them."""

    rows: tuple[RoundTripRow, ...]

    @property
    def order(self) -> float | None:
        """Slope of log error against log voxel size by least squares; None for one row.

        The error is the middle of each row's interval of the Hausdorff distance.
        """
        if len({row.voxel_size for row in self.rows}) < 2:
            return None
        sizes = np.array([row.voxel_size for row in self.rows])
        errors = np.array([row.comparison.distance.middle for row in self.rows])
        if (errors <= 0).any():
            return None
        return _slope(np.log(sizes), np.log(errors))


def roundtrip(
    mesh: Mesh,
    resolutions: Sequence[Number],
    *,
    sign: SignMethod = "auto",
    half_width: Number = 3.0,
    report: TwoSetReport | None = None,
    max_memory: Number | None = None,
    progress: Progress = silent,
) -> RoundTrip:
    """Convert a mesh to a narrow band and back, and measure what was lost.

    Parameters
    ----------
    mesh : Mesh
        Any triangles with area.
    resolutions : sequence of float
        Voxels along the longest side, one row each.
    sign, half_width, report, max_memory, progress
        As for `mesh_to_band`.

    Raises
    ------
    ReportError
        No resolution given.
    SdfError, SurfaceError, MemoryLimitError
        The mesh cannot be converted, or nothing comes back.

    Notes
    -----
    Accuracy: the Hausdorff distance is an interval that contains the truth (see `hausdorff`),
    narrowed to a hundredth of a voxel unless that takes too many evaluations.
    """
    if len(resolutions) == 0:
        raise ReportError("no resolution given", "roundtrip(resolutions=...)", "give at least one")
    if report is None:
        report = check(mesh, self_intersections=False)
    options = {
        "sign": sign,
        "half_width": half_width,
        "report": report,
        "max_memory": max_memory,
        "progress": progress,
    }
    return RoundTrip(tuple(_row(mesh, resolution, options) for resolution in resolutions))


def _row(mesh: Mesh, resolution: Number, options: dict) -> RoundTripRow:
    marks = [time.perf_counter()]
    band = mesh_to_band(mesh, resolution=resolution, **options)
    marks.append(time.perf_counter())
    level, warnings = default_level(band)
    surface = marching_cubes(band, level=level, progress=options["progress"])
    require_faces(surface, level=level)
    marks.append(time.perf_counter())
    comparison = compare(
        mesh,
        surface,
        voxel_size=band.voxel_size,
        tolerance=VOXEL_SHARE * band.voxel_size,
        progress=options["progress"],
    )
    marks.append(time.perf_counter())
    spent = np.round(np.diff(marks), 4).tolist()
    seconds = dict(zip(("distance", "surface", "compare"), spent, strict=True))
    return RoundTripRow(
        float(resolution), band.voxel_size, comparison, surface, band.sign, warnings, seconds
    )


def _slope(x: Values, y: Values) -> float:
    return float(((x - x.mean()) * (y - y.mean())).sum() / ((x - x.mean()) ** 2).sum())
