"""The Hausdorff distance of two meshes, between proven bounds.

The one-sided distance h(A, B) = max over p in A of d(p, B) is attained inside faces as often as at
vertices, so no set of samples gives more than a lower bound. Here every face of A also gets an
upper bound (`kernels.hausdorff_bounds`), and faces whose bound exceeds the best distance found by
more than the tolerance are cut in two until none is left: branch and
bound (Tang, Lee, Kim 2009, doi:10.1145/1576246.1531345; Sacht, Jacobson 2024,
doi:10.1111/cgf.15129). What is left when the work runs out widens the interval; it stays true.
Rounding is part of the interval (`branch_and_bound` adds it up).
"""

from dataclasses import dataclass
from time import monotonic

import numpy as np

from ..arrays import Number, Vector3
from ..errors import ReportError
from ..kernels.bvh import closest_details
from ..kernels.parallel import run_pieces
from ..mesh import Mesh
from ..progress import Progress, silent
from ..spatial.closest_point import LARGEST, ClosestPoint
from .branch_and_bound import Search
from .enclosure import Enclosure
from .mean_estimate import estimated_means
from .tolerance import Tolerance

MAX_EVALUATIONS = 10_000_000
RELATIVE_TOLERANCE = 1e-3  # of the distance itself: three digits are enough to compare
DIAGONAL_TOLERANCE = 1e-6  # of the target's diagonal, for surfaces that coincide


@dataclass(frozen=True, eq=False)
class OneSided:
    """How far ``source`` strays from ``target``, world units.

    Attributes
    ----------
    distance : Enclosure
        Holds the maximum over all points of the source's surface of the distance to the target.
    mean, rms : float or None
        Over the source's area; estimates by quadrature, without proof (see `one_sided_hausdorff`).
    witness : (3,) float64
        A point of the source at distance ``distance.lower`` or more, but for the rounding of its
        coordinates.
    nearest : (3,) float64
        The point of the target closest to it.
    source_face, target_face : int
        The faces these two lie on.
    n_evaluations : int
        Number of closest points computed.
    is_within_tolerance : bool
        False if ``distance`` is wider than asked: a limit or the last digit stopped the search.
    """

    distance: Enclosure
    mean: float | None
    rms: float | None
    witness: Vector3
    nearest: Vector3
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

    @property
    def farthest(self) -> OneSided:
        """The side whose witness is farthest from the other surface."""
        return max(self.forward, self.backward, key=lambda side: side.distance.lower)


def hausdorff(
    a: Mesh,
    b: Mesh,
    *,
    tolerance: Number | Tolerance | None = None,
    time_budget: Number | None = None,
    max_evaluations: int | None = None,
    means: bool = True,
    progress: Progress = silent,
) -> Hausdorff:
    """Enclose the Hausdorff distance of two meshes; arguments as for `one_sided_hausdorff`.

    ``forward`` runs from a to b, ``backward`` from b to a. ``forward`` may use half of the time
    budget, ``backward`` what is left of it; each has all of ``max_evaluations``.
    """
    _check_meshes(a, b)
    _check_limits(tolerance, time_budget, max_evaluations)
    end = None if time_budget is None else monotonic() + time_budget
    targets: list[Mesh | ClosestPoint] = [a, b]

    def build(which: int) -> None:
        targets[which] = ClosestPoint(targets[which])

    run_pieces(build, 2)
    options = tolerance, max_evaluations, means, progress
    middle = None if end is None else 0.5 * (monotonic() + end)
    forward = _enclose(a, targets.pop(), middle, *options)
    backward = _enclose(b, targets.pop(), end, *options)
    return Hausdorff(forward.distance.largest(backward.distance), forward, backward)


def one_sided_hausdorff(
    source: Mesh,
    target: Mesh,
    *,
    tolerance: Number | Tolerance | None = None,
    time_budget: Number | None = None,
    max_evaluations: int | None = None,
    means: bool = True,
    progress: Progress = silent,
) -> OneSided:
    """Enclose the largest distance from a point of ``source`` to ``target``.

    Parameters
    ----------
    source, target : Mesh
        At least one face each. Any soup will do; faces without area count as what they are.
    tolerance : float or Tolerance, optional
        Width asked of the enclosure: a length in world units, or a `Tolerance`, which can be a
        share of the distance itself, or of a voxel. By default 1e-3 of the distance, or 1e-6 of
        the target's diagonal where that is more.
    time_budget : float, optional
        Seconds after which no further face is cut. The result then depends on the machine.
    max_evaluations : int, optional
        Closest points after which no further face is cut; by default 10 million, or 10 per face
        where that is more. The trees and the distances of all vertices are always computed.
    means : bool
        Estimate mean and rms, which takes one more closest point per face, or some 200,000.
    progress : Progress
        Told the share of the gap that is closed, while cutting.

    Raises
    ------
    ReportError
        A mesh has no faces or coordinates beyond 1e30, or a limit makes no sense.

    Notes
    -----
    Accuracy: the enclosure is true in exact arithmetic. Both ends are moved outwards by
    ``328 u (R + r)``, u = 2**-53, R the largest distance of a source vertex from the centre of the
    target's box, r half the diagonal of that box; see `branch_and_bound`. A tolerance below three
    times as much cannot be met.
    Mean and rms are estimates by quadrature (`estimated_means`); `one_sided_statistics` encloses
    them.
    Cost: one closest point per vertex of the source, and one per cut. Where the
    distance is nearly constant, as between offset surfaces, or nearly zero between different
    triangulations of one surface, many cuts are needed; a looser tolerance saves most of them.

    Examples
    --------
    >>> from meshsdf.mesh.primitives import box_mesh
    >>> side = one_sided_hausdorff(box_mesh((2.0, 2.0, 2.0)), box_mesh(), tolerance=1e-9)
    >>> print(side.distance)  # corner to corner: sqrt(3) / 2
    [0.866025, 0.866026]
    """
    _check_meshes(source, target)
    _check_limits(tolerance, time_budget, max_evaluations)
    end = None if time_budget is None else monotonic() + time_budget
    options = tolerance, max_evaluations, means, progress
    return _enclose(source, ClosestPoint(target), end, *options)


def _enclose(
    source: Mesh,
    closest: ClosestPoint,
    end: float | None,
    tolerance: Number | Tolerance | None,
    max_evaluations: int | None,
    means: bool,
    progress: Progress,
) -> OneSided:
    """Search until the interval is narrow enough, or the clock shows ``end``."""
    if tolerance is None:
        shortest = 2.0 * DIAGONAL_TOLERANCE * closest.radius
        tolerance = Tolerance(absolute=shortest, relative=RELATIVE_TOLERANCE)
    if max_evaluations is None:
        max_evaluations = max(MAX_EVALUATIONS, 10 * source.n_faces)
    search = Search(source, closest, Tolerance.of(tolerance), progress, probes=True)
    first_gap = search.upper - search.best
    while not search.is_done and search.n_evaluations < max_evaluations:
        if end is not None and monotonic() >= end:
            break
        search.step()
        progress("hausdorff", 1.0 - (search.upper - search.best) / first_gap)
    found = (None, None)
    if means:
        squares = search.corner_squares[search.corners]
        found = estimated_means(source, closest, squares, progress=progress)
    return _result(source, search, found)


def _result(source: Mesh, search: Search, means: tuple[float | None, float | None]) -> OneSided:
    """Round both ends outwards."""
    closest = search.closest
    lower, upper = max(search.best - search.rounding, 0.0), search.upper + search.rounding
    witness, slot = search.witness[None], np.array([search.slot], np.int32)
    face, weights, nearest = np.empty(1, np.int32), np.empty((1, 3)), np.empty((1, 3))
    closest_details(
        *(witness, 0, 1, slot, closest.frames, closest.face_of_slot, closest.corners),
        *(face, weights, nearest),
    )
    return OneSided(
        distance=Enclosure(lower, upper),
        mean=means[0],
        rms=means[1],
        witness=witness[0] + closest.center,
        nearest=nearest[0] + closest.center,
        source_face=search.source_face,
        target_face=int(face[0]),
        n_evaluations=search.n_evaluations,
        is_within_tolerance=upper - lower <= search.tolerance.width(lower),
    )


def _check_meshes(source: Mesh, target: Mesh) -> None:
    for mesh, name in ((source, "source"), (target, "target")):
        where = f"one_sided_hausdorff({name}=...)"
        if mesh.n_faces == 0:
            what = f"the {name} mesh has no faces, so there is no distance to measure"
            raise ReportError(what, where, "compare meshes with at least one face each")
        farthest = float(np.abs([mesh.box.lower, mesh.box.upper]).max())
        if farthest > LARGEST:
            what = f"coordinates of the {name} mesh reach {farthest:g}"
            raise ReportError(what, where, f"scale both meshes to stay below {LARGEST:g}")


def _check_limits(
    tolerance: Number | Tolerance | None,
    time_budget: Number | None,
    max_evaluations: int | None,
) -> None:
    if tolerance is not None:
        Tolerance.of(tolerance)
    for name, value in (("time_budget", time_budget), ("max_evaluations", max_evaluations)):
        if value is not None and not value >= 0:
            what, where = f"the limit is {value:g}", f"one_sided_hausdorff({name}=...)"
            raise ReportError(what, where, "pass a number that is not negative")
