"""Where the trilinear interpolant F is zero, a piece of plane: proved to within a thickness.

If |F - L| <= e over a box, for a linear L with gradient g, then, with t = e / |g|, within the box

- every zero of F is within t of the plane L = 0: it lies where |L| <= e;
- every point p of the plane is within t of a zero of F: at p + t g / |g| F is not negative, at
  p - t g / |g| not positive, and F is continuous.

The second needs the box to reach t beyond p, so e is taken over a box that is larger all around.
It then overlaps other cells, in which F is another polynomial; the block has their nodes. Half the
spread of F - L over the corners (`trilinear_block`) is the least e that a shift of L allows.
"""

import numpy as np
from numba import njit

from .trilinear_block import (
    ROUNDING,
    corner_values,
    largest_value,
    linear_range,
    mean_gradient,
    set_ticks,
)

EMPTY, FITTED, OPEN, UNSURE = 0, 1, 2, 3
"""States of a box: F keeps its sign; is proved to be near a plane; changes its sign; may do so."""

PAD = 1e-12  # voxels: far above the rounding of a place in a block, far below any tolerance
LEAST = 1e-13  # voxels added to a thickness, so that signs beyond it are strict
LEAST_REACH = 1e-10  # voxels: over it the kink of F at a cell face is seen, and does not matter
ATTEMPTS = 4


@njit(cache=True, nogil=True)
def fit_planes(blocks, cells, lows, size, limit, begin, end, state, planes, thickness):
    """Fit a plane to the zeros of F in each box, or say that there are none or that it fails.

    Box n has the side ``size`` and the lowest corner ``size * lows[n]`` in the middle cell of
    ``blocks[cells[n]]`` (4, 4, 4). Where it is FITTED, L(x) = planes[n, 0] + planes[n, 1:] . x in
    block coordinates, and ``thickness[n] <= limit`` (voxels, at most 1/4).
    """
    ticks, n_ticks = np.empty((3, 6)), np.empty(3, np.int64)
    f, low, high, g = np.empty(8), np.empty(3), np.empty(3), np.empty(3)
    for n in range(begin, end):
        block = blocks[cells[n]]
        for axis in range(3):
            low[axis] = size * lows[n, axis]
            high[axis] = low[axis] + size
        corner_values(block, 1, low, high, f)
        noise = ROUNDING * largest_value(block)
        state[n] = _signs(f, low, high, noise)
        if state[n] == EMPTY:
            continue
        g[0], g[1], g[2], norm = mean_gradient(f, low, high)
        half = _half_spread(f, g, size) + noise
        if not half <= limit * norm or norm == 0.0:
            continue
        # Enlarge the box until what is beyond it cannot matter
        reach = max(3.0 * half / norm, LEAST_REACH)
        for _ in range(ATTEMPTS):
            for axis in range(3):
                more = reach * abs(g[axis]) / norm + PAD
                first, last = 1.0 + low[axis] - more, 1.0 + high[axis] + more
                n_ticks[axis] = set_ticks(ticks[axis], first, last)
            least, most = linear_range(block, ticks, n_ticks, g[0], g[1], g[2])
            thick = (0.5 * (most - least) + noise) / norm * (1.0 + 1e-9) + LEAST
            if not thick <= limit:
                break
            if 2.0 * thick <= reach:
                state[n], thickness[n] = FITTED, thick
                planes[n, 0] = 0.5 * (least + most)
                for axis in range(3):
                    planes[n, 1 + axis] = g[axis]
                break
            reach = 2.5 * thick


@njit(cache=True, nogil=True)
def _signs(f, low, high, noise):
    """EMPTY, OPEN or UNSURE, by the signs of F at the corners, which are exact at nodes."""
    n_below, n_above = 0, 0
    for c in range(8):
        is_node = True
        for axis in range(3):
            at_end = (c >> (2 - axis)) & 1
            is_node = is_node and (high[axis] == 1.0 if at_end else low[axis] == 0.0)
        n_below += f[c] < -noise or (is_node and f[c] < 0.0)
        n_above += f[c] > noise or (is_node and f[c] >= 0.0)
    if n_below == 8 or n_above == 8:
        return EMPTY
    return OPEN if n_below > 0 and n_above > 0 else UNSURE


@njit(cache=True, nogil=True)
def _half_spread(f, g, size):
    """Half the spread of F - g.x over the corners of a box with these values."""
    low, high = np.inf, -np.inf
    for c in range(8):
        rest = f[c] - size * (g[0] * (c >> 2) + g[1] * ((c >> 1) & 1) + g[2] * (c & 1))
        low, high = min(low, rest), max(high, rest)
    return 0.5 * (high - low)


@njit(cache=True, nogil=True)
def count_pieces(lows, sizes, planes, thickness, begin, end, counts):
    """``counts[n]`` = corners of plane n within its box, enlarged by the plane's thickness.

    Fewer than three is none. Boxes as for `fit_planes`, each with its size.
    """
    points, work = np.empty((12, 3)), np.empty(14)
    for n in range(begin, end):
        counts[n] = _cut_box(lows[n], sizes[n], planes[n], thickness[n], points, work)


@njit(cache=True, nogil=True)
def fill_pieces(
    lows, sizes, planes, thickness, corners, place, first, begin, end, vertices, faces, box
):
    """Write the corners of each piece from ``vertices[first[n]]`` on, and the triangles.

    A piece with c corners has c - 2 triangles, from ``faces[first[n] - 2 n]`` on; ``box`` says of
    which box each is. ``corners`` (n, 3) are the lowest nodes of the boxes' cells, ``place`` holds
    voxel size and translation.
    """
    points, work = np.empty((12, 3)), np.empty(14)
    for n in range(begin, end):
        count = _cut_box(lows[n], sizes[n], planes[n], thickness[n], points, work)
        v = first[n]
        for p in range(count):
            for axis in range(3):
                node = corners[n, axis] + (points[p, axis] - 1.0)
                vertices[v + p, axis] = place[0] * node + place[1 + axis]
        f = v - 2 * n
        for p in range(count - 2):
            faces[f + p, 0], faces[f + p, 1], faces[f + p, 2] = v, v + p + 1, v + p + 2
            box[f + p] = n


@njit(cache=True, nogil=True)
def _cut_box(low, size, plane, thick, points, work):
    """The corners, in order, of a plane within a box; block coordinates; their number.

    A corner of the box has one sign for all its edges, however near to the plane it is.
    """
    lower, upper, at = work[0:3], work[3:6], work[6:14]
    norm = np.sqrt(plane[1] ** 2 + plane[2] ** 2 + plane[3] ** 2)
    for axis in range(3):
        more = thick * abs(plane[1 + axis]) / norm + 0.5 * PAD
        lower[axis] = 1.0 + size * low[axis] - more
        upper[axis] = 1.0 + size * low[axis] + size + more
    for c in range(8):
        at[c] = plane[0]
        for axis in range(3):
            place = upper[axis] if (c >> (2 - axis)) & 1 else lower[axis]
            at[c] += plane[1 + axis] * place
    count = 0
    for c in range(8):
        for axis in range(3):
            d = c | (4 >> axis)
            if d == c or (at[c] < 0.0) == (at[d] < 0.0):
                continue
            for x in range(3):
                points[count, x] = upper[x] if (c >> (2 - x)) & 1 else lower[x]
            share = min(max(at[c] / (at[c] - at[d]), 0.0), 1.0)
            points[count, axis] += share * (upper[axis] - lower[axis])
            count += 1
    _sort_around(points, count, plane, work)
    return count


@njit(cache=True, nogil=True)
def _sort_around(points, count, plane, angles):
    """Sort points of a plane by their direction from their mean."""
    axis = 0
    for other in range(1, 3):
        if abs(plane[1 + other]) > abs(plane[1 + axis]):
            axis = other
    # Seen along the axis most nearly across the plane, the order is the same
    b, c = (axis + 1) % 3, (axis + 2) % 3
    mean_b, mean_c = 0.0, 0.0
    for p in range(count):
        mean_b += points[p, b] / count
        mean_c += points[p, c] / count
    for p in range(count):
        angles[p] = np.arctan2(points[p, c] - mean_c, points[p, b] - mean_b)
    for p in range(1, count):
        q = p
        while q > 0 and angles[q - 1] > angles[q]:
            angles[q - 1], angles[q] = angles[q], angles[q - 1]
            for x in range(3):
                keep = points[q - 1, x]
                points[q - 1, x] = points[q, x]
                points[q, x] = keep
            q -= 1
