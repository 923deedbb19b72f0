"""What a report tells of one row beyond the largest distance.

How distances are spread, what is lost, where the error comes from, and what of sharp edges.
"""

from dataclasses import dataclass

from ..arrays import Number
from ..grid import NarrowBand
from ..mesh import Mesh
from ..mesh.measures import area
from ..progress import Progress, silent
from ..surface import default_level
from .compare import Comparison
from .conditioning import Conditioning, conditioning
from .error_budget import ErrorBudget, error_budget
from .hausdorff import OneSided
from .sharp_edges import SharpEdges, sharp_edges
from .statistics import Statistics, one_sided_statistics
from .tolerance import Tolerance

MOST_EVALUATIONS = 1_500_000  # some seconds; then intervals are true, but wider

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
        How distances are spread over the mesh, and over what came back; None of no area, and
        ``backward_statistics`` is measured of the finest row only.
    budget : ErrorBudget or None
        The error of every step; of the finest row only.
    conditioning : Conditioning or None
        How much the surface moves when values change; of the finest row only.
    sharp_edges : SharpEdges or None
        How far the mesh's sharp edges are from what came back; None if it has none, and of the
        finest row only.
    """

    forward_statistics: Statistics | None
    backward_statistics: Statistics | None = None
    budget: ErrorBudget | None = None
    conditioning: Conditioning | None = None
    sharp_edges: SharpEdges | None = None


def coarse_details(
    mesh: Mesh,
    surface: Mesh,
    found: Comparison,
    voxel_size: Number,
    *,
    progress: Progress = silent,
) -> RowDetails:
    """Measure what the table of all rows shows: how distances are spread over the mesh."""
    return RowDetails(_statistics(mesh, surface, found.forward, voxel_size, progress))


def row_details(
    mesh: Mesh,
    band: NarrowBand,
    surface: Mesh,
    found: Comparison,
    *,
    progress: Progress = silent,
) -> RowDetails:
    """Measure them for a surface with faces that was extracted from a band of the mesh.

    ``found`` is how far the two are apart.
    """
    tolerance = BUDGET_SHARE * band.voxel_size
    level, _ = default_level(band)
    budget = error_budget(mesh, band, surface, level=level, tolerance=tolerance, progress=progress)
    edges = sharp_edges(
        mesh, surface, voxel_size=band.voxel_size, tolerance=tolerance, progress=progress
    )
    sides = (mesh, surface, found.forward), (surface, mesh, found.backward)
    spread = [_statistics(*pair, band.voxel_size, progress) for pair in sides]
    return RowDetails(*spread, budget, conditioning(band, level), edges)


def _statistics(
    source: Mesh, target: Mesh, side: OneSided, voxel_size: Number, progress: Progress
) -> Statistics | None:
    if area(source) == 0:
        return None
    tolerance = Tolerance(absolute=NOTHING * voxel_size, relative=STATISTICS_SHARE)
    return one_sided_statistics(
        source,
        target,
        tolerance=tolerance,
        max_evaluations=max(MOST_EVALUATIONS, 8 * source.n_faces),
        at_most=side.distance.upper,
        voxel_size=voxel_size,
        progress=progress,
    )
