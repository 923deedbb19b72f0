"""Pictures of where two surfaces differ: both, painted with the distance between them.

Every pixel shows the exact distance of what it sees to the other surface. One scale serves all
pictures of a report; its colours follow square roots, for what matters spans powers of ten.
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
        The same for all rows of a report.
    sides : tuple of Side
        The mesh, and what came back.
    close_ups : tuple of CloseUp
        The worst place of each direction.
    """

    scale: Scale
    sides: tuple[Side, ...]
    close_ups: tuple[CloseUp, ...]


def common_scale(rows: list[RoundTripRow]) -> Scale:
    """Return the scale that holds the largest distance of all rows."""
    found = [row.comparison.in_voxels(row.comparison.distance.upper) for row in rows]
    return Scale(float(max([LEAST_TOP, *found])))


def heat_maps(
    mesh: Mesh, row: RoundTripRow, scale: Scale, *, progress: Progress = silent
) -> HeatMaps:
    """Draw a row that brought something back: both surfaces from six sides, and the worst places.

    Parameters
    ----------
    mesh : Mesh
        What made the round trip.
    row : RoundTripRow
        With a comparison.
    scale : Scale
        From `common_scale`.
    """
    return pair_maps((mesh, row.surface), row.comparison, scale, ROUND_TRIP, progress=progress)


def pair_scale(found: Comparison) -> Scale:
    """Return the scale of two surfaces: in voxels, or in units of length where none is known."""
    upper = float(found.distance.upper)
    if found.voxel_size is None:
        return Scale(max(LEAST_SHARE * found.diagonal, upper), "units")
    return Scale(max(LEAST_TOP, found.in_voxels(upper)))


def pair_maps(
    pair: tuple[Mesh, Mesh],
    found: Comparison,
    scale: Scale,
    says: PairWords,
    *,
    progress: Progress = silent,
) -> HeatMaps:
    """Draw two surfaces of which `compare` found something, called as ``says`` says."""
    unit = 1.0 if found.voxel_size is None else found.voxel_size
    # Each surface is painted with its distance to the other one
    paints = [painter(ClosestPoint(other), unit, scale) for other in reversed(pair)]
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
    return HeatMaps(scale, tuple(sides), close_ups(pair, found, paints, says))


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
