"""Mesh to volume to mesh at several resolutions, and what each lost."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from ..arrays import Number, Values
from ..errors import MemoryLimitError, ReportError
from ..grid import NarrowBand
from ..mesh import Mesh
from ..mesh.measures import area
from ..mesh.two_set import TwoSetReport, check
from ..progress import Progress, silent
from ..sdf import mesh_to_band
from ..sdf.memory import require_memory
from ..sdf.sign import SignMethod
from ..surface import default_level, dual_contouring, marching_cubes, surface_nets
from .color_difference import ColorLoss
from .compare import Comparison, compare
from .row_details import RowDetails, coarse_details, row_details

Method = Literal["marching-cubes", "dual-contouring", "surface-nets"]
METHODS = ("marching-cubes", "dual-contouring", "surface-nets")

VOXEL_SHARE = 1e-3
"""The interval of the maximum is narrowed until it is no wider than this part of a voxel."""

STUCK_SHARE = 0.8
"""Two halvings of the voxel divide an error of first order by four; one that stays above this
part of what it was comes from what the volume cannot hold, such as sheets within."""

BYTES_PER_FACE = 500  # trees over both meshes and the queue of the comparison, as measured


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
        The mesh against its round trip; None when nothing came back.
    method : str
        How the surface was extracted.
    surface : Mesh
        What came back.
    sign : str
        How inside was told.
    warnings : tuple of str
        What to know about this row.
    seconds : dict
        Time for distance, surface and compare, and for colors and details where asked.
    details : RowDetails or None
        How distances are spread, and where the error comes from; None unless asked for.
    colors : ColorLoss or None
        What became of the mesh's colours; None unless asked for, and where nothing came back.
    """

    resolution: float
    voxel_size: float
    comparison: Comparison | None
    method: str
    surface: Mesh
    sign: str
    warnings: tuple[str, ...]
    seconds: dict[str, float]
    details: RowDetails | None = None
    colors: ColorLoss | None = None

    def is_within(self, limit: Number, in_voxels: bool = False) -> bool:
        """Whether the error is certainly at most ``limit``, in world units or in voxels."""
        if self.comparison is None:
            return False
        scale = self.voxel_size if in_voxels else 1.0
        return self.comparison.distance.upper <= limit * scale

    @property
    def trip_seconds(self) -> float:
        """How long the round trip and its largest distance took: all times but the details'."""
        return sum(spent for name, spent in self.seconds.items() if name != "details")

    def to_json(self) -> dict:
        """Return plain types, as the command prints them."""
        head = {
            "resolution": self.resolution,
            "voxel_size": self.voxel_size,
            "sign": self.sign,
            "method": self.method,
        }
        if self.comparison is None:
            body = {"hausdorff": None, "forward": None, "backward": None}
        else:
            body = self.comparison.to_json()
        return head | body | {"warnings": list(self.warnings), "seconds": self.seconds}


@dataclass(frozen=True, eq=False)
class RoundTrip:
    """All rows, coarse to fine as asked, and whether colours were carried, too."""

    rows: tuple[RoundTripRow, ...]
    has_colors: bool = False

    @property
    def methods(self) -> tuple[str, ...]:
        """The methods of extraction, as asked."""
        return tuple(dict.fromkeys(row.method for row in self.rows))

    def last(self, method: str) -> RoundTripRow:
        """Return the finest row of a method."""
        return [row for row in self.rows if row.method == method][-1]

    def rows_to_json(self) -> list[dict]:
        """Return plain types; "colors" are among them only if they were asked for."""
        plain = [row.to_json() for row in self.rows]
        if self.has_colors:
            for row, told in zip(self.rows, plain, strict=True):
                told["colors"] = row.colors and row.colors.to_json()
        return plain

    def order(self, method: str) -> float | None:
        """Return the slope of log error against log voxel size by least squares; None for one row.

        The error is the largest distance seen: the lower end of each row's interval.
        """
        rows = [row for row in self.rows if row.method == method and row.comparison is not None]
        if len({row.voxel_size for row in rows}) < 2:
            return None
        sizes = np.array([row.voxel_size for row in rows])
        errors = np.array([row.comparison.distance.lower for row in rows])
        if (errors <= 0).any():
            return None
        return _slope(np.log(sizes), np.log(errors))


def roundtrip(
    mesh: Mesh,
    resolutions: Sequence[Number],
    *,
    methods: Sequence[Method] = ("marching-cubes",),
    sign: SignMethod = "auto",
    half_width: Number = 3.0,
    until: Number | None = None,
    report: TwoSetReport | None = None,
    max_memory: Number | None = None,
    details: bool = False,
    carry_texture: bool = False,
    progress: Progress = silent,
) -> RoundTrip:
    """Convert a mesh to a narrow band and back, and measure what was lost.

    Parameters
    ----------
    mesh : Mesh
        Any triangles with area.
    resolutions : sequence of float
        Voxels along the longest side, one row each.
    methods : sequence of {"marching-cubes", "dual-contouring", "surface-nets"}
        How the surface is extracted; with both, each has its rows. Dual contouring sees the mesh.
    sign, half_width, report, max_memory, progress
        As for `mesh_to_band`.
    until : float, optional
        World units. Double the last resolution until each method's error is certainly below,
        stops shrinking, or the next one would not fit in memory.
    details : bool
        Also certify means and percentiles, and of the finest row of each method find thin parts
        lost and say where the error comes from (`row_details`); takes many times as long.
    carry_texture : bool
        Also carry the mesh's colours to what came back, in texels of a voxel, and tell what
        became of them (`color_loss`).

    Raises
    ------
    ReportError
        No resolution or no method given, or colours are to be carried and there are none.
    SdfError, MemoryLimitError
        The mesh cannot be converted.
    TextureError
        The mesh's colours are broken.

    Notes
    -----
    Accuracy: the Hausdorff distance is an interval that contains the truth (see `hausdorff`),
    narrowed to a thousandth of a voxel unless that takes too many evaluations.
    """
    if len(resolutions) == 0:
        raise ReportError("no resolution given", "roundtrip(resolutions=...)", "give at least one")
    if len(methods) == 0:
        raise ReportError("no method given", "roundtrip(methods=...)", f"give some of {METHODS}")
    if report is None:
        report = check(mesh, self_intersections=False)
    options = {
        "sign": sign,
        "half_width": half_width,
        "report": report,
        "max_memory": max_memory,
        "progress": progress,
    }
    work = _Work(mesh, options, _carrier(mesh, options) if carry_texture else None)
    rows = [row for n in resolutions for row in work.rows(n, methods)]
    while until is not None:
        resolution = 2 * rows[-1].resolution
        left = [method for method in methods if _can_improve(rows, method, until)]
        if not left:
            break
        try:
            rows += work.rows(resolution, left)
        except MemoryLimitError:
            break
    if details:
        work.add_details(rows)
    return RoundTrip(tuple(rows), has_colors=carry_texture)


def _carrier(mesh: Mesh, options: dict) -> Any:
    """A `ColorCarrier` of the mesh's colours."""
    from .color_loss import ColorCarrier  # which imports all of the textures

    return ColorCarrier(mesh, max_memory=options["max_memory"], progress=options["progress"])


@dataclass(frozen=True, eq=False)
class _Work:
    """What all rows have in common."""

    mesh: Mesh
    options: dict  # of mesh_to_band
    carrier: Any = None  # a ColorCarrier, if colours are asked for

    @property
    def progress(self) -> Progress:
        return self.options["progress"]

    def rows(self, resolution: Number, methods: Sequence[Method]) -> list[RoundTripRow]:
        """One row for every method, from one band."""
        begin = time.perf_counter()
        band = mesh_to_band(self.mesh, resolution=resolution, **self.options)
        spent = time.perf_counter() - begin
        rows = [self._row(float(resolution), band, spent, method) for method in methods]
        return rows if self.carrier is None else self._colored(rows)

    def _colored(self, rows: list[RoundTripRow]) -> list[RoundTripRow]:
        """Rows of one voxel size with what became of the colours: one texture serves them all."""
        colored, texture, begin = [], None, time.perf_counter()
        for row in rows:
            found = None
            if row.surface.n_faces and area(row.surface) > 0:
                texture = texture or self.carrier.texture(row.voxel_size)
                found = self.carrier.loss(texture, row.surface)
            spent, begin = time.perf_counter() - begin, time.perf_counter()
            seconds = row.seconds | {"colors": round(spent, 4)}
            colored.append(replace(row, colors=found, seconds=seconds))
        return colored

    def _row(
        self, resolution: float, band: NarrowBand, spent: float, method: Method
    ) -> RoundTripRow:
        marks = [time.perf_counter()]
        level, warnings = default_level(band)
        if method == "marching-cubes":
            surface = marching_cubes(band, level=level, progress=self.progress)
        elif method == "surface-nets":
            surface = surface_nets(band, level=level, progress=self.progress)
        else:
            surface = dual_contouring(band, self.mesh, level=level, progress=self.progress)
        marks.append(time.perf_counter())
        comparison = None
        if surface.n_faces:
            comparison = self._compared(surface, resolution, band.voxel_size)
        else:
            warnings += ("nothing came back: no node is inside, the mesh is thinner than a voxel",)
        marks.append(time.perf_counter())
        parts = [round(part, 4) for part in (spent, *np.diff(marks).tolist())]
        return RoundTripRow(
            resolution,
            band.voxel_size,
            comparison,
            method,
            surface,
            band.sign,
            warnings,
            dict(zip(("distance", "surface", "compare"), parts, strict=True)),
        )

    def add_details(self, rows: list[RoundTripRow]) -> None:
        """Put details into rows, all of them into the finest of each method."""
        finest = {row.method: i for i, row in enumerate(rows)}.values()
        band = None  # made again for the finest rows, rather than kept
        for i, row in enumerate(rows):
            if row.comparison is None:
                continue
            begin = time.perf_counter()
            shapes, progress = (self.mesh, row.surface), self.progress
            if i in finest:
                if band is None or band.voxel_size != row.voxel_size:
                    band = mesh_to_band(self.mesh, resolution=row.resolution, **self.options)
                found = row_details(shapes[0], band, shapes[1], row.comparison, progress=progress)
            else:
                found = coarse_details(*shapes, row.comparison, row.voxel_size, progress=progress)
            seconds = row.seconds | {"details": round(time.perf_counter() - begin, 4)}
            known = row.comparison.with_statistics(
                found.forward_statistics, found.backward_statistics
            )
            rows[i] = replace(row, comparison=known, details=found, seconds=seconds)

    def _compared(self, surface: Mesh, resolution: float, voxel_size: float) -> Comparison:
        needed = BYTES_PER_FACE * (self.mesh.n_faces + surface.n_faces)
        where = f"roundtrip(resolution={resolution:g}): {surface.n_faces:,} faces to compare"
        require_memory(needed, self.options["max_memory"], where=where)
        return compare(
            self.mesh,
            surface,
            voxel_size=voxel_size,
            tolerance=VOXEL_SHARE * voxel_size,
            statistics=False,
            progress=self.progress,
        )


def _can_improve(rows: Sequence[RoundTripRow], method: str, until: Number) -> bool:
    """Whether a method's error is not yet below, and finer voxels still help."""
    own = [row for row in rows if row.method == method]
    return not own[-1].is_within(until) and not _is_stuck(own)


def _is_stuck(rows: Sequence[RoundTripRow]) -> bool:
    """Whether the last two refinements left the error where it was: finer voxels will not help."""
    if len(rows) < 3 or rows[-3].comparison is None or rows[-1].comparison is None:
        return False
    lowest = rows[-1].comparison.distance.lower
    return lowest > STUCK_SHARE * rows[-3].comparison.distance.upper


def _slope(x: Values, y: Values) -> float:
    return float(((x - x.mean()) * (y - y.mean())).sum() / ((x - x.mean()) ** 2).sum())
