"""Are three points on one line? A filter in floating point that answers only when it is sure."""

from numba import njit

APART, ON_A_LINE, UNDECIDED = 0, 1, 2

# A difference of products of differences, computed in float64 with unit roundoff u = 2**-53, is
# off by less than (3 u + 16 u**2) (|product| + |product|) (Shewchuk 1997, doi:10.1007/PL00009321,
# the bound A of orient2d). 4 u leaves room for the rounding of the bound itself.
ERROR = 4 * 2.0**-53
# Below this the products may have lost bits to underflow, which the relative bound ignores.
SMALLEST = 1e-280


@njit(cache=True, nogil=True)
def _minor(ax, ay, bx, by):
    """APART if ax * by - ay * bx cannot be 0, ON_A_LINE if it must be 0."""
    if (ax == 0.0 or by == 0.0) and (ay == 0.0 or bx == 0.0):
        return ON_A_LINE
    left, right = ax * by, ay * bx
    size = abs(left) + abs(right)
    if size > SMALLEST and abs(left - right) > ERROR * size:
        return APART
    return UNDECIDED


@njit(cache=True, nogil=True)
def classify_triples(points, triples, start, stop, verdict):
    """Fill ``verdict`` (n,) uint8 for triples [start, stop) of (n, 3); overflow is undecided."""
    for t in range(start, stop):
        p, q, r = triples[t, 0], triples[t, 1], triples[t, 2]
        ax, bx = points[q, 0] - points[p, 0], points[r, 0] - points[p, 0]
        ay, by = points[q, 1] - points[p, 1], points[r, 1] - points[p, 1]
        az, bz = points[q, 2] - points[p, 2], points[r, 2] - points[p, 2]
        yz, zx, xy = _minor(ay, az, by, bz), _minor(az, ax, bz, bx), _minor(ax, ay, bx, by)
        if yz == APART or zx == APART or xy == APART:
            verdict[t] = APART
        elif yz == ON_A_LINE and zx == ON_A_LINE and xy == ON_A_LINE:
            verdict[t] = ON_A_LINE
        else:
            verdict[t] = UNDECIDED
