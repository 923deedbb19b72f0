"""Pictures of where two surfaces differ: both, painted with the distance between them.

Every pixel shows the exact distance of what it sees to the other surface. One scale serves all
whole views of a report, up to what 99 % of the area is within, and another one all close-ups, up
to the largest distance; their colours follow square roots, for what matters spans powers of ten.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from ..arrays import Number, Points
from ..box import Box
from ..mesh import Mesh
from ..progress import Progress, silent
from ..ray import Scene, frame, render_mesh
from ..spatial.closest_point import ClosestPoint
from .close_up import CloseUp, close_ups
from .color_bar import LEAST_TOP, Scale
from .compare import Comparison
from .pair_words import ROUND_TRIP, PairWords
from .pictures import Picture, file_bytes
from .roundtrip import RoundTripRow

VIEWS = {
    "front": "from +z",
    "back": "from −z",
    "left": "from −x",
    "right": "from +x",
    "top": "from +y",
    "bottom": "from −y",
}
WIDTH, HEIGHT, SAMPLES = 480, 400, 2
CLIPPED_AT = 99
"""The percentile of the area at which the colours of whole views end: one worst place would leave
all the rest in the colour of nothing."""

LEAST_SHARE = 1e-6  # of the diagonal: as `LEAST_TOP`, where no voxel is known


@dataclass(frozen=True, eq=False)
class Side:
    """One surface from all sides."""

    title: str
    views: tuple[Picture, ...]


@dataclass(frozen=True, eq=False)
class HeatMaps:
    """The pictures of one row.

    Attributes
    ----------
    scale : Scale
        Of the whole views; the same for all rows of a report.
    near_scale : Scale
        Of the close-ups; the same for all rows of a report.
    sides : tuple of Side
        The mesh, and what came back.
    close_ups : tuple of CloseUp
        The worst place of each direction.
    """

    scale: Scale
    near_scale: Scale
    sides: tuple[Side, ...]
    close_ups: tuple[CloseUp, ...]


def common_scales(rows: list[RoundTripRow]) -> tuple[Scale, Scale]:
    """Return the scales of whole views and of close-ups that serve all rows."""
    tops = [[row.comparison.in_voxels(t) for t in _tops(row.comparison)] for row in rows]
    far, all_of_it = (float(max([LEAST_TOP, *column])) for column in zip(*tops, strict=True))
    return Scale(far, goes_on=far < all_of_it), Scale(all_of_it)


def _tops(found: Comparison) -> tuple[float, float]:
    """What 99 % of both areas are within, if that is known, and the largest distance."""
    largest = float(found.distance.upper)
    sides = found.forward_statistics, found.backward_statistics
    known = [side.percentiles[CLIPPED_AT].upper for side in sides if side is not None]
    return min(float(max(known, default=largest)), largest), largest


def heat_maps(
    mesh: Mesh, row: RoundTripRow, scales: tuple[Scale, Scale], *, progress: Progress = silent
) -> HeatMaps:
    """Draw a row that brought something back: both surfaces from six sides, and the worst places.

    Parameters
    ----------
    mesh : Mesh
        What made the round trip.
    row : RoundTripRow
        With a comparison.
    scales : pair of Scale
        From `common_scales`.
    """
    return pair_maps((mesh, row.surface), row.comparison, scales, ROUND_TRIP, progress=progress)


def pair_scales(found: Comparison) -> tuple[Scale, Scale]:
    """Return both scales of two surfaces: in voxels, or in units of length where none is known."""
    tops, least, unit = _tops(found), LEAST_SHARE * found.diagonal, "units"
    if found.voxel_size is not None:
        tops, least, unit = [found.in_voxels(top) for top in tops], LEAST_TOP, "voxels"
    far, all_of_it = (max(least, top) for top in tops)
    return Scale(far, unit, goes_on=far < all_of_it), Scale(all_of_it, unit)


def pair_maps(
    pair: tuple[Mesh, Mesh],
    found: Comparison,
    scales: tuple[Scale, Scale],
    says: PairWords,
    *,
    progress: Progress = silent,
) -> HeatMaps:
    """Draw two surfaces of which `compare` found something, called as ``says`` says."""
    unit = 1.0 if found.voxel_size is None else found.voxel_size
    # Each surface is painted with its distance to the other one
    others = [ClosestPoint(other) for other in reversed(pair)]
    paints, near = ([painter(other, unit, scale) for other in others] for scale in scales)
    titles = (
        f"{says.starts[0]}: how far it is from {says.b_of_a}",
        f"{says.starts[1]}: how far it is from {says.a}",
    )
    box = Box.around(np.concatenate([surface.vertices[surface.faces.ravel()] for surface in pair]))
    steps = _steps(2 * len(VIEWS), progress)
    sides = []
    for surface, paint, title in zip(pair, paints, titles, strict=True):
        scene, views = Scene(surface), []
        for name, words in VIEWS.items():
            next(steps)
            camera = frame(box, name, WIDTH / HEIGHT, orthographic=True)
            picture = render_mesh(
                scene, camera, width=WIDTH, height=HEIGHT, paint=paint, samples=SAMPLES
            )
            alt = f"{title}, {words}"
            views.append(Picture(file_bytes(picture), WIDTH, HEIGHT, words, alt))
        sides.append(Side(title, tuple(views)))
    return HeatMaps(*scales, tuple(sides), close_ups(pair, found, near, says))


def painter(
    closest: ClosestPoint, unit: Number, scale: Scale
) -> Callable[[Points, np.ndarray], Points]:
    """Return what gives points the colour of their distance, in a unit of so many world units."""

    def paint(points: Points, faces: np.ndarray) -> Points:
        distance = closest.distances(np.ascontiguousarray(points)).distance
        return scale.colors(distance / unit)

    return paint


def _steps(n: int, progress: Progress) -> Iterator[None]:
    for step in range(n):
        progress("pictures", step / n)
        yield
