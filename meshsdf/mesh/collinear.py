"""Exactly collinear points.

Floats are integers times powers of two. Almost all triples are decided by floating-point bounds;
the rest is scaled to integers, which Python computes with exactly whatever their size.
"""

import numpy as np
from jaxtyping import Int32, Integer

from ..arrays import Points
from ..kernels.collinear import ON_A_LINE, UNDECIDED, classify_triples
from ..kernels.parallel import even_ranges, n_threads, run_pieces

MANTISSA_BITS = 53
TRIPLES_PER_PIECE = 2**16  # at least: less work than that is not worth a thread


def are_collinear(points: Points, triples: Int32[np.ndarray, "t 3"]) -> np.ndarray:
    """Tell which triples of points lie on one line; equal points do. Exact for the given floats."""
    verdict = np.empty(len(triples), dtype=np.uint8)
    ranges = even_ranges(len(triples), min(n_threads(), 1 + len(triples) // TRIPLES_PER_PIECE))
    run_pieces(lambda p: classify_triples(points, triples, *ranges[p], verdict), len(ranges))
    collinear = verdict == ON_A_LINE
    undecided = np.flatnonzero(verdict == UNDECIDED)
    if len(undecided):
        collinear[undecided] = _are_collinear_exactly(points[triples[undecided]])
    return collinear


def _are_collinear_exactly(corners: np.ndarray) -> np.ndarray:
    """The cross product of (t, 3, 3) corner positions, in integers, compared with zero."""
    with np.errstate(all="ignore"):
        p, q, r = np.moveaxis(_scaled_to_integers(corners), 1, 0)
    (ax, ay, az), (bx, by, bz) = (q - p).T, (r - p).T
    crossed = (ay * bz != az * by) | (az * bx != ax * bz) | (ax * by != ay * bx)
    return ~crossed.astype(np.bool_)


def _scaled_to_integers(values: np.ndarray) -> Integer[np.ndarray, "..."] | np.ndarray:
    """Multiply all values by one power of two that makes each a Python integer."""
    mantissa, exponent = np.frexp(values)
    whole = np.ldexp(mantissa, MANTISSA_BITS).astype(np.int64)
    lowest = exponent[whole != 0].min(initial=exponent.max())
    shift = np.where(whole == 0, 0, exponent - lowest)
    return whole.astype(object) << shift.astype(object)
