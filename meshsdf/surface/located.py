"""Loops with a place for every vertex."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, Int64

from ..arrays import Points
from ..kernels.dual_arrays import Crossings
from .dual_loops import DualLoops


@dataclass(frozen=True, eq=False)
class Located:
    """Loops, and where all vertices but crossings lie; voxels from the base of the loops.

    Attributes
    ----------
    loops : DualLoops
        Of the field.
    crossings : Crossings
        Of the loops, with normals.
    points : (l, 3) float64
        Of the loops.
    arcs, arc_points : (t,) int64, (t, 3) float64
        Keys of arcs with a vertex, in rising order, and where it lies.
    allowed : float
        How far from the surface the middle of a polygon may be, if that is known.
    """

    loops: DualLoops
    crossings: Crossings
    points: Points
    arcs: Int64[np.ndarray, " t"]
    arc_points: Float64[np.ndarray, "t 3"]
    allowed: float
