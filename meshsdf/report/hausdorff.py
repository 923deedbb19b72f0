"""The Hausdorff distance of two meshes, between proven bounds.

The one-sided distance h(A, B) = max over p in A of d(p, B) is attained inside faces as often as at
vertices, so no set of samples gives more than a lower bound. Here every face of A also gets an
upper bound (`kernels.hausdorff_bounds`), and faces whose bound exceeds the best distance found by
more than the tolerance are cut in two until none is left: branch and
bound (Tang, Lee, Kim 2009, doi:10.1145/1576246.1531345; Sacht, Jacobson 2024,
doi:10.1111/cgf.15129). What is left when the work runs out widens the interval; it stays true.
"""

from dataclasses import dataclass
from time import monotonic

import numpy as np

from ..arrays import Vector3
from ..errors import ReportError
from ..mesh import Mesh
from ..mesh.measures import face_areas
from ..progress import Progress, silent
from ..spatial.closest_point import UNIT_ROUNDOFF, ClosestPoint
from .branch_and_bound import MAX_LEVEL, Search
from .enclosure import Enclosure

# Proven bound on all rounding, times (|p - c| + r) as in ClosestPoint: 64 for a distance, 104 for
# the place of a point (1 to centre it, 3 for a centroid, 1 per level), 24 to evaluate a bound
ROUNDING = (64 + (MAX_LEVEL + 4) + 24) * UNIT_ROUNDOFF


@dataclass(frozen=True, eq=False)
class OneSided:
    """How far ``source`` strays from ``target``, world units.

    Attributes
    ----------
    distance : Enclosure
        Holds the maximum over all points of the source's surface of the distance to the target.
    mean, rms : float
        Over the source's area; estimates by quadrature, without proof (see `one_sided_hausdorff`).
    witness : (3,) float64
        A point of the source at distance ``distance.lower`` or more.
    source_face, target_face : int
        Where the witness lies, and the face nearest to it.
    n_evaluations : int
        Number of closest points computed.
    is_within_tolerance : bool
        False if a limit stopped the search before ``distance`` was as narrow as asked.
    """

    distance: Enclosure
    mean: float
    rms: float
    witness: Vector3
    source_face: int
    target_face: int
    n_evaluations: int
    is_within_tolerance: bool


@dataclass(frozen=True, eq=False)
class Hausdorff:
    """Both one-sided distances, and the symmetric one: the larger of the two."""

    distance: Enclosure
    forward: OneSided
    backward: OneSided


def hausdorff(
    a: Mesh,
    b: Mesh,
    *,
    tolerance: float | None = None,
    time_budget: float | None = None,
    max_evaluations: int | None = None,
    progress: Progress = silent,
) -> Hausdorff:
    """Enclose the Hausdorff distance of two meshes; arguments as for `one_sided_hausdorff`.

    ``forward`` runs from a to b, ``backward`` from b to a; each has the whole budget.
    """
    limits = dict(tolerance=tolerance, time_budget=time_budget, max_evaluations=max_evaluations)
    forward = one_sided_hausdorff(a, b, progress=progress, **limits)
    backward = one_sided_hausdorff(b, a, progress=progress, **limits)
    return Hausdorff(forward.distance.largest(backward.distance), forward, backward)


def one_sided_hausdorff(
    source: Mesh,
    target: Mesh,
    *,
    tolerance: float | None = None,
    time_budget: float | None = None,
    max_evaluations: int | None = None,
    progress: Progress = silent,
) -> OneSided:
    """Enclose the largest distance from a point of ``source`` to ``target``.

    Parameters
    ----------
    source, target : Mesh
        At least one face each. Any soup will do; faces without area count as what they are.
    tolerance : float, optional
        Width asked of the enclosure, world units. By default 1e-3 of the distance, or 1e-6 of
        the target's diagonal where that is more.
    time_budget : float, optional
        Seconds after which no further face is cut. The result then depends on the machine.
    max_evaluations : int, optional
        Closest points after which no further face is cut; by default 10 million, or 40 per face
        where that is more. The distances of all vertices and centroids are always computed.
    progress : Progress
        Told the share of the gap that is closed, while cutting.

    Raises
    ------
    ReportError
        A mesh has no faces, or the tolerance is not positive.

    Notes
    -----
    Accuracy: the enclosure is true in exact arithmetic. Both ends are moved outwards by
    ``192 u (R + r)``, u = 2**-53, R the largest distance of a source vertex from the centre of the
    target's box, r half the diagonal of that box.
    Mean and rms: per face, 3/4 of the value at the centroid and 1/12 at each corner (exact for
    polynomials of degree 2, so for the squared distance to one plane), weighted by area. Where
    distances change within a face as at the target's own edges, they are off by O(size²).
    Cost: one closest point per vertex and per face of the source, and three per cut. Where the
    distance is nearly constant, as between offset surfaces, or nearly zero between different
    triangulations of one surface, many cuts are needed; a looser tolerance saves most of them.

    Examples
    --------
    >>> from meshsdf.mesh.primitives import box_mesh
    >>> side = one_sided_hausdorff(box_mesh((2.0, 2.0, 2.0)), box_mesh())
    >>> print(side.distance)  # corner to corner: sqrt(3) / 2
    [0.866025, 0.866026]
    """
    _check(source, target, tolerance)
    start = monotonic()
    limit = max_evaluations or max(10_000_000, 40 * source.n_faces)
    search = Search(source, ClosestPoint(target), tolerance, progress)
    first_gap = search.upper - search.best
    while not search.is_done and search.n_evaluations < limit:
        if time_budget is not None and monotonic() - start > time_budget:
            break
        search.step()
        progress("hausdorff", 1.0 - (search.upper - search.best) / first_gap)
    return _result(source, search)


def _result(source: Mesh, search: Search) -> OneSided:
    """Round both ends outwards and integrate."""
    closest = search.closest
    reach = np.linalg.norm(source.vertices[np.unique(source.faces)] - closest.center, axis=1).max()
    rounding = ROUNDING * (float(reach) + closest.radius)
    distance = Enclosure(max(search.best - rounding, 0.0), search.upper + rounding)
    areas = face_areas(source)
    if areas.sum() == 0:
        areas = np.ones(len(areas))
    weights = np.outer(areas / areas.sum(), [1 / 12, 1 / 12, 1 / 12, 3 / 4])
    squares = search.face_squares
    return OneSided(
        distance=distance,
        mean=float((weights * np.sqrt(squares)).sum()),
        rms=float(np.sqrt((weights * squares).sum())),
        witness=search.witness + closest.center,
        source_face=search.source_face,
        target_face=int(closest.face_of_slot[search.slot]),
        n_evaluations=search.n_evaluations,
        is_within_tolerance=search.upper <= search.enough,
    )


def _check(source: Mesh, target: Mesh, tolerance: float | None) -> None:
    for mesh, name in ((source, "source"), (target, "target")):
        if mesh.n_faces == 0:
            what = f"the {name} mesh has no faces, so there is no distance to measure"
            fix = "compare meshes with at least one face each"
            raise ReportError(what, f"one_sided_hausdorff({name}=...)", fix)
    if tolerance is not None and not tolerance > 0:
        what = f"the tolerance is {tolerance:g}"
        raise ReportError(what, "one_sided_hausdorff(tolerance=...)", "pass a positive length")
