"""A picture of how far a mesh is from another, with the bar that explains its colours."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Number
from ..errors import RayError
from ..mesh import Mesh
from ..progress import Progress, silent
from .distance_paint import DistancePaint
from .framing import Up, frame
from .legend import legend_width, with_legend
from .picture import Picture, render_mesh


@dataclass(frozen=True, eq=False)
class DistancePicture:
    """A picture, and what the middles of its pixels show.

    Attributes
    ----------
    picture : (h, w, 4) float32
        Linear RGB and alpha; the colour bar is at its right.
    largest : float
        The distance at the upper end of the bar, world units.
    max_seen, mean_seen : float
        Of the distances at the points that pixels show, world units; no bound on what they do not.
    n_seen : int
        How many points those are.
    """

    picture: Picture
    largest: float
    max_seen: float
    mean_seen: float
    n_seen: int


def render_distances(
    mesh: Mesh,
    other: Mesh,
    *,
    view: str | tuple[Number, Number] = "three-quarter",
    up: Up = "y",
    width: int = 1280,
    height: int = 960,
    largest: Number | None = None,
    title: str = "distance, world units",
    colors: str = "magma_r",
    smooth: bool | None = None,
    background: Sequence[Number] | np.ndarray | None = None,
    progress: Progress = silent,
) -> DistancePicture:
    """Draw a mesh, painted with the exact distance from every point seen to another mesh.

    Parameters
    ----------
    mesh, other : Mesh
        What is drawn, and what distances are to.
    view, up
        As for `frame`.
    width, height : int
        Of the whole picture, pixels.
    largest : float, optional
        The distance at the upper end of the colours, world units; by default the largest seen.
    title : str
        Stands beside the colour bar.
    colors : str
        Name of a `color_map`.
    smooth, background, progress
        As for `render_mesh`.

    Raises
    ------
    RayError
        No room for the colour bar, or as `frame`, `DistancePaint` and `render_mesh`.
    """
    columns = width - legend_width(height)
    if columns < 1:
        what = f"{width} x {height} pixels have no room beside a colour bar {width - columns} wide"
        raise RayError(what, "render_distances(width=...)", "make the picture wider")
    paint = DistancePaint(other, largest=largest, colors=colors, progress=progress)
    look = {"width": columns, "height": height, "smooth": smooth, "background": background}
    camera = frame(mesh, view, columns / height, up=up)
    picture = render_mesh(mesh, camera, paint=paint, progress=progress, **look)
    whole = with_legend(picture, paint.colors, paint.largest, title=title, background=background)
    return DistancePicture(whole, paint.largest, paint.max_seen, paint.mean_seen, paint.n_seen)
