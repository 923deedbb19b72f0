"""Mean, rms and percentiles of the distance of one surface from another, between proven bounds.

A mean over samples says nothing certain about what lies between them. Here the distance is
integrated over all of the source's faces. Where the target is a graph above a face, which is
proven face by face, the integrals over its shadows are closed forms but for narrow strips along
their borders (`kernels.graph_distance`); elsewhere the distance lies between two linear functions
(`kernels.tangent_distance`). Pieces that leave the widest gaps are cut in two until mean and rms
are as narrow as asked, or the work runs out: the intervals are then wider, and still true.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field

import numpy as np

from ..arrays import Number
from ..errors import ReportError
from ..kernels.graph_distance import SIGNED_HIGH, SIGNED_LOW
from ..mesh import Mesh
from ..mesh.measures import area, is_watertight, volume, welded
from ..progress import Progress, silent
from ..sdf import MeshDistance
from .area_search import AreaSearch
from .enclosure import Enclosure
from .lost_parts import LostPart, parts_of
from .percentiles import Shares, check_percents, find_percentiles, first_shares
from .tolerance import Tolerance

RELATIVE_TOLERANCE = 1e-2  # of mean and rms
DIAGONAL_TOLERANCE = 1e-6  # of the target's diagonal, for surfaces that coincide
PERCENTILES = (50, 90, 95, 99)


@dataclass(frozen=True, eq=False)
class Statistics:
    """How far ``source`` is from ``target``, over all of its area; world units.

    Attributes
    ----------
    mean, rms : Enclosure
        Hold the mean of the distance and the root of the mean of its square.
    percentiles : dict of float to Enclosure
        For each percentage p: holds the least t such that p % of the area is within t.
    shares : Shares
        Bounds on the share of the area within each of about 64 distances.
    signed_mean : Enclosure or None
        Holds the mean of the distance taken negative inside the target; None unless the target is
        watertight, equal positions joined.
    volume_difference : float or None
        Of the source minus that of the target, cubic world units, to rounding; None unless both
        are watertight.
    normal_deviation, largest_normal_deviation : float
        Degrees between the normals of the source and of the nearest face of the target, mean and
        maximum; estimates without proof (see `one_sided_statistics`).
    lost_parts : tuple of LostPart
        What is certainly farther than a voxel, largest area first; empty if no voxel size is known.
    n_evaluations : int
        Closest points computed and pieces bounded.
    is_within_tolerance : bool
        False if a limit stopped the search before mean and rms were as narrow as asked.
    """

    mean: Enclosure
    rms: Enclosure
    percentiles: dict[float, Enclosure]
    shares: Shares
    signed_mean: Enclosure | None
    volume_difference: float | None
    normal_deviation: float
    largest_normal_deviation: float
    lost_parts: tuple[LostPart, ...] = field(default=())
    n_evaluations: int = 0
    is_within_tolerance: bool = True

    def to_json(self) -> dict:
        """Return plain types; bounds as {lower, upper}, percentiles by their written numbers."""
        signed = self.signed_mean
        return {
            "mean_bounds": asdict(self.mean),
            "rms_bounds": asdict(self.rms),
            "percentiles": {f"{p:g}": asdict(t) for p, t in sorted(self.percentiles.items())},
            "shares": {name: getattr(self.shares, name).tolist() for name in _SHARES},
            "signed_mean_bounds": None if signed is None else asdict(signed),
            "volume_difference": self.volume_difference,
            "normal_deviation": self.normal_deviation,
            "largest_normal_deviation": self.largest_normal_deviation,
            "lost_parts": [_part_json(part) for part in self.lost_parts],
            "statistics_evaluations": self.n_evaluations,
            "statistics_within_tolerance": self.is_within_tolerance,
        }


_SHARES = ("thresholds", "lower", "upper")


def one_sided_statistics(
    source: Mesh,
    target: Mesh,
    *,
    tolerance: Number | Tolerance | None = None,
    max_evaluations: int | None = None,
    at_most: Number = np.inf,
    percentiles: Sequence[Number] = PERCENTILES,
    voxel_size: Number | None = None,
    progress: Progress = silent,
) -> Statistics:
    """Enclose the statistics of the distance from all points of ``source`` to ``target``.

    Parameters
    ----------
    source, target : Mesh
        At least one face each; the source with area. Any soup will do.
    tolerance : float or Tolerance, optional
        Width asked of the enclosures of mean and rms: a length in world units, or a `Tolerance`.
        By default 1e-2 of each, or 1e-6 of the target's diagonal where that is more.
    max_evaluations : int, optional
        Closest points and bounds after which nothing is cut any more; by default 1,000,000, or 4
        per face of the source where that is more. All faces are always bounded once.
    at_most : float
        What no point of the source is farther away than, if that is known; world units.
    percentiles : sequence of float
        Percentages above 0, up to 100.
    voxel_size : float, optional
        Look for lost parts: farther than this, world units.
    progress : Progress
        Told how far the first look at all faces is, and then the share of the gap that is closed.

    Raises
    ------
    ReportError
        A mesh has no faces, the source has no area, or a number makes no sense.

    Notes
    -----
    Accuracy: mean, rms, percentiles, shares and lost parts are true in exact arithmetic; both ends
    are moved outwards by ``4096 u (R + r)``, u = 2**-53, R the largest distance of a source vertex
    from the centre of the target's box, r half the diagonal of that box, and by what the areas are
    rounded. Percentiles are narrowed to the same tolerance as far as the pieces at hand allow.
    The signed mean goes by the side of the nearest face where the target is a graph, and by that of
    the piece's centroid where a piece does not touch the target; pieces that may cross it count
    with both signs. It is certified for a target without self-intersections.
    Normal deviation: over the shadows of the target's faces where it is a graph above the source,
    which is exact but for narrow strips, and at centroids of pieces elsewhere.
    Cost: about 20 microseconds of one core per face of the source, and for each of the two halves
    of a cut; as much again for the distribution. A source with large faces is cut until no more
    than 256 faces of the target are around a piece.

    Examples
    --------
    >>> face = np.array([[0, 1, 2]], np.int32)
    >>> plate = Mesh(np.array([[0, 0, 1.0], [1, 0, 2], [0, 1, 3]]), face)  # heights 1, 2, 3
    >>> floor = Mesh(np.array([[-99, -99, 0.0], [99, -99, 0], [0, 99, 0]]), face)
    >>> found = one_sided_statistics(plate, floor)
    >>> print(found.mean, found.rms)  # sqrt(25 / 6)
    [1.99999, 2.00001] [2.04124, 2.04125]
    """
    _check(source, target, percentiles, voxel_size, at_most)
    if tolerance is None:
        shortest = DIAGONAL_TOLERANCE * target.box.diagonal
        tolerance = Tolerance(absolute=shortest, relative=RELATIVE_TOLERANCE)
    if max_evaluations is None:
        max_evaluations = max(1_000_000, 4 * source.n_faces)
    search = AreaSearch(source, target, Tolerance.of(tolerance), progress, at_most=at_most)
    lost = ()
    if voxel_size is not None:
        lost = parts_of(source, search.ruler, search.all_pieces(), voxel_size)
    first = excess = float(search.excess.max())
    while excess > 1.0 and search.ruler.n_evaluations < max_evaluations:
        search.step()
        excess = float(search.excess.max())
        progress("statistics", _share_done(first, excess))
    shares = first_shares(search)
    found = find_percentiles(search, shares, percentiles)
    return _result(source, target, search, shares, found, lost)


def _result(
    source: Mesh,
    target: Mesh,
    search: AreaSearch,
    shares: Shares,
    percentiles: dict[float, Enclosure],
    lost: tuple[LostPart, ...],
) -> Statistics:
    """Round all ends outwards."""
    rounding, slack = search.ruler.rounding, search.area_rounding
    ends = search.sums[:4] / search.area
    low, high = np.maximum(ends[[0, 2]] * (1.0 - slack), 0.0), ends[[1, 3]] * (1.0 + slack)
    low[1], high[1] = np.sqrt([low[1], high[1]])
    low = np.maximum(low - rounding, 0.0)
    high = np.maximum(np.minimum(high + rounding, search.ruler.at_most), low)
    mean, rms = (Enclosure(float(a), float(b)) for a, b in zip(low, high, strict=True))
    joined = welded(source), welded(target)
    is_closed = [is_watertight(mesh) for mesh in joined]
    angles = np.degrees(search.angle)
    return Statistics(
        mean=mean,
        rms=rms,
        percentiles=percentiles,
        shares=shares,
        signed_mean=_signed_mean(search, target, mean) if is_closed[1] else None,
        volume_difference=volume(joined[0]) - volume(joined[1]) if all(is_closed) else None,
        normal_deviation=float(angles[0]),
        largest_normal_deviation=float(angles[1]),
        lost_parts=lost,
        n_evaluations=search.ruler.n_evaluations,
        is_within_tolerance=bool(search.excess.max() <= 1.0),
    )


def _signed_mean(search: AreaSearch, target: Mesh, mean: Enclosure) -> Enclosure:
    """Sum the signed integrals; pieces that may cross the target have either sign."""
    sums, span, ruler = search.bounds.sums, search.bounds.span, search.ruler
    rest = np.flatnonzero(~search.bounds.is_graph)
    low, high = -sums[rest, 1], sums[rest, 1].copy()
    apart = np.flatnonzero(span[rest, 0] > ruler.rounding)
    if len(apart) > 0:
        centers = search.pieces.take(rest[apart]).centers + ruler.closest.center
        is_inside = MeshDistance(target)(centers).distance < 0
        near, far = sums[rest[apart], 0], sums[rest[apart], 1]
        low[apart] = np.where(is_inside, -far, near)
        high[apart] = np.where(is_inside, -near, far)
    total = search.sums[[SIGNED_LOW, SIGNED_HIGH]] + [low.sum(), high.sum()]
    slack = ruler.rounding + search.area_rounding * mean.upper
    ends = total / search.area + [-slack, slack]
    return Enclosure(max(float(ends[0]), -mean.upper), min(float(ends[1]), mean.upper))


def _share_done(first: float, excess: float) -> float:
    """How far a gap has come on its way from ``first`` to 1, by logarithms."""
    return float(np.clip(1.0 - np.log(max(excess, 1.0)) / np.log(first), 0.0, 1.0))


def _part_json(part: LostPart) -> dict:
    return {
        "n_faces": part.n_faces,
        "area": part.area,
        "center": part.center.tolist(),
        "largest": asdict(part.largest),
    }


def _check(
    source: Mesh,
    target: Mesh,
    percentiles: Sequence[Number],
    voxel_size: Number | None,
    at_most: Number,
) -> None:
    for mesh, name in ((source, "source"), (target, "target")):
        if mesh.n_faces == 0:
            what = f"the {name} mesh has no faces, so there is no distance to measure"
            fix = "compare meshes with at least one face each"
            raise ReportError(what, f"one_sided_statistics({name}=...)", fix)
    if area(source) == 0:
        what = f"the {source.n_faces} faces of the source have no area to take a mean over"
        fix = "compare a mesh with area, or ask for one_sided_hausdorff"
        raise ReportError(what, "one_sided_statistics(source=...)", fix)
    check_percents(percentiles)
    if not at_most >= 0:
        what = f"no point is said to be farther than {at_most:g}"
        raise ReportError(what, "one_sided_statistics(at_most=...)", "pass a length of 0 or more")
    if voxel_size is not None and not voxel_size > 0:
        what = f"the voxel size is {voxel_size:g}"
        raise ReportError(what, "one_sided_statistics(voxel_size=...)", "pass a positive length")
