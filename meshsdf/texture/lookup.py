"""Looking up a texture at many points, on all cores."""

import numpy as np
from jaxtyping import Float64, Int64

from ..arrays import Number, Points, Values
from ..errors import TextureError
from ..kernels.octree_tables import ANY_PART
from ..kernels.parallel import even_ranges, n_threads, run_pieces
from ..kernels.texture_sample import nearest, sample
from .channels import Numbers
from .octree import Octree

Footprint = Number | Values

POINTS_PER_PIECE = 65536
FEWEST_PER_PIECE = 2048
WHATEVER = np.array([ANY_PART], np.int64)


def look_up(
    octree: Octree,
    slots: np.ndarray,
    pool: np.ndarray,
    tiles: np.ndarray,
    kind: int,
    points: Points,
    normals: Float64[np.ndarray, "n 3"] | None = None,
    footprint: Footprint = 0.0,
    *,
    parts: Int64[np.ndarray, " n"] | None = None,
    interpolate: bool = True,
    out: Numbers | None = None,
) -> Numbers:
    """(n, 4) float32 that one channel shows at points: see `kernels.texture_lookup`.

    ``parts`` are those that the points are on, as bits, if that is known. ``out`` is filled if it
    is given: new memory for millions of colours takes as long as they do.

    Raises
    ------
    TextureError
        A footprint is negative or not a number.
    """
    widths = np.atleast_1d(np.asarray(footprint, np.float64))
    if not (widths >= 0).all():
        what = "the footprint is negative or not a number"
        raise TextureError(what, "footprint=...", "give widths of 0 or more, world units")
    directions = np.zeros((1, 3)) if normals is None else np.ascontiguousarray(normals)
    bits = WHATEVER if parts is None else parts
    points = np.ascontiguousarray(points)
    out = np.empty((len(points), 4), np.float32) if out is None else out
    n_pieces = max(-(-len(points) // POINTS_PER_PIECE), n_threads())
    ranges = even_ranges(len(points), min(n_pieces, max(1, len(points) // FEWEST_PER_PIECE)))

    def work(piece: int) -> None:
        place = (octree.tables, slots, pool, tiles, kind, points, directions, bits)
        if interpolate:
            sample(*place, widths, *ranges[piece], out)
        else:
            nearest(*place, *ranges[piece], out)

    if len(points):
        run_pieces(work, len(ranges))
    return out
