"""What a report tells of one row beyond the largest distance.

How distances are spread, what is lost, where the error comes from, and what of sharp edges.
"""

from dataclasses import dataclass

from ..grid import NarrowBand
from ..mesh import Mesh
from ..mesh.measures import area
from ..progress import Progress, silent
from ..surface import default_level
from .conditioning import Conditioning, conditioning
from .error_budget import ErrorBudget, error_budget
from .sharp_edges import SharpEdges, sharp_edges
from .statistics import Statistics, one_sided_statistics
from .tolerance import Tolerance

BUDGET_SHARE = 1e-2
"""The intervals of the budget are narrowed until they are no wider than this part of a voxel."""

NOTHING = 1e-5
"""In voxels: means need not be known better, so that none of surfaces that coincide are sought."""

STATISTICS_SHARE = 2e-2
"""Those of mean and RMS, until no wider than this part of them; half takes twice as long."""


@dataclass(frozen=True, eq=False)
class RowDetails:
    """Why a round trip lost what it lost.

    Attributes
    ----------
    forward_statistics, backward_statistics : Statistics or None
        How distances are spread over the mesh, and over what came back; None of no area.
    budget : ErrorBudget
        The error of every step.
    conditioning : Conditioning
        How much the surface moves when values change.
    sharp_edges : SharpEdges or None
        How far the mesh's sharp edges are from what came back; None if it has none.
    """

    forward_statistics: Statistics | None
    backward_statistics: Statistics | None
    budget: ErrorBudget
    conditioning: Conditioning
    sharp_edges: SharpEdges | None


def row_details(
    mesh: Mesh, band: NarrowBand, surface: Mesh, *, progress: Progress = silent
) -> RowDetails:
    """Measure them for a surface with faces that was extracted from a band of the mesh."""
    tolerance = BUDGET_SHARE * band.voxel_size
    level, _ = default_level(band)
    budget = error_budget(mesh, band, surface, level=level, tolerance=tolerance, progress=progress)
    edges = sharp_edges(
        mesh, surface, voxel_size=band.voxel_size, tolerance=tolerance, progress=progress
    )
    sides = (mesh, surface), (surface, mesh)
    spread = [_statistics(*pair, band.voxel_size, progress) for pair in sides]
    return RowDetails(*spread, budget, conditioning(band, level), edges)


def _statistics(
    source: Mesh, target: Mesh, voxel_size: float, progress: Progress
) -> Statistics | None:
    if area(source) == 0:
        return None
    tolerance = Tolerance(absolute=NOTHING * voxel_size, relative=STATISTICS_SHARE)
    return one_sided_statistics(
        source, target, tolerance=tolerance, voxel_size=voxel_size, progress=progress
    )
