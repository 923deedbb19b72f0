"""A paint that shows how far every point seen lies from another mesh."""

from math import isfinite

import numpy as np
from jaxtyping import Float64, Int32

from ..arrays import Number
from ..errors import RayError
from ..mesh import Mesh
from ..progress import Progress, silent
from ..spatial import ClosestPoint
from .color_maps import color_map


class DistancePaint:
    """Colours points by their distance to a mesh; for ``render_mesh(paint=...)``.

    Parameters
    ----------
    other : Mesh
        Distances are to it; at least one face.
    largest : float, optional
        The distance at the upper end of the colours, world units; by default the largest at the
        points of the first call, which are what the middles of pixels show.
    colors : str
        Name of a `color_map`.
    progress : Progress
        Called between pieces of work.

    Attributes
    ----------
    largest : float or None
        The upper end; None before the first call, unless it was given.
    n_seen : int
        How many points the first call had; 0 before it.
    max_seen, mean_seen : float
        Of their distances, world units; 0 of none.

    Raises
    ------
    RayError
        ``largest`` is not positive and finite.
    SpatialError
        ``other`` has no faces.

    Notes
    -----
    Accuracy: every distance is the exact one, see `ClosestPoint`. The largest seen is no bound:
    what no pixel shows may lie farther away.
    """

    def __init__(
        self,
        other: Mesh,
        *,
        largest: Number | None = None,
        colors: str = "magma_r",
        progress: Progress = silent,
    ) -> None:
        if largest is not None and not (isfinite(largest) and largest > 0):
            fix = "pass a positive length"
            raise RayError(f"the scale ends at {largest:g}", "DistancePaint(largest=...)", fix)
        self.closest = ClosestPoint(other)
        self.colors = color_map(colors)
        self.largest = None if largest is None else float(largest)
        self.n_seen, self.max_seen, self.mean_seen = 0, 0.0, 0.0
        self.progress = progress
        self._was_called = False

    def __call__(
        self, points: Float64[np.ndarray, "k 3"], faces: Int32[np.ndarray, " k"]
    ) -> Float64[np.ndarray, "k 3"]:
        """Return the linear colours of (k, 3) points."""
        distance = self.closest.distances(points, progress=self.progress).distance
        if not self._was_called:
            self._was_called = True
            self.n_seen = len(distance)
            if self.n_seen > 0:
                self.max_seen, self.mean_seen = float(distance.max()), float(distance.mean())
            if self.largest is None:
                self.largest = self.max_seen
        return self.colors(distance / self.largest if self.largest > 0 else distance)
