"""Which entries of an octree the dabs of a stroke may reach.

A dab is a row of numbers, lengths in finest texels: the two ends of a capsule (columns 0-2, 3-5),
the radii there (6, 7), the flows (8, 9), the surface's unit normals there (10-12, 13-15), and the
way from the dab before (16-18).
"""

import math

from numba import njit

from .octree_tables import find_code, sheets_of
from .texture_lookup import ABSENT

DAB = 19  # columns
HALF_DIAGONAL = 3.5 * math.sqrt(3.0)  # of a brick's texels, from the first to the last
BATCH, PLACE, ROW = range(3)  # columns of marks
MARGIN = 1.0  # texels around a dab that are stored with it, so that its rim is not cut


@njit(cache=True, nogil=True)
def segment_distance2(dabs, d, shrink, x, y, z):
    """Squared distance of (x, y, z) to the axis of dab d, whose lengths are times ``shrink``."""
    px, py, pz = dabs[d, 0] * shrink, dabs[d, 1] * shrink, dabs[d, 2] * shrink
    dx, dy, dz = dabs[d, 3] * shrink - px, dabs[d, 4] * shrink - py, dabs[d, 5] * shrink - pz
    qx, qy, qz = x - px, y - py, z - pz
    length2 = dx * dx + dy * dy + dz * dz
    if length2 > 0.0:
        t = min(max((qx * dx + qy * dy + qz * dz) / length2, 0.0), 1.0)
        qx, qy, qz = qx - t * dx, qy - t * dy, qz - t * dz
    return qx * qx + qy * qy + qz * qz


@njit(cache=True, nogil=True)
def entries_in_reach(
    tables, level_first, slots, dabs, finest, wanted, all_levels, batch, marks, n_rows, found,
):  # fmt: skip
    """``found[:n]`` = the entries near dabs: of level ``wanted``, and finer ones that are stored.

    With ``all_levels``, finer ones that are not stored, too. ``marks[entry]`` holds the last batch
    in which it was found, its place in ``found`` then, and its row, which is 1 more than the
    number of those that had one before, ``n_rows``. Returns n and the number of rows.
    """
    n = 0
    for level in range(finest, wanted + 1):
        shrink = 1.0 / (1 << level)
        only_stored = level < wanted and not all_levels
        for d in range(len(dabs)):
            reach = max(dabs[d, 6], dabs[d, 7]) * shrink + MARGIN
            far = reach + HALF_DIAGONAL
            # Bricks whose texels the capsule's box, with its margin, may hold
            x0, x1 = _bricks(dabs[d, 0], dabs[d, 3], shrink, reach)
            y0, y1 = _bricks(dabs[d, 1], dabs[d, 4], shrink, reach)
            z0, z1 = _bricks(dabs[d, 2], dabs[d, 5], shrink, reach)
            first, last = level_first[level], level_first[level + 1]
            if (x1 - x0 + 1.0) * (y1 - y0 + 1.0) * (z1 - z0 + 1.0) > last - first:
                for e in range(first, last):
                    x, y, z = tables.bricks[e, 0], tables.bricks[e, 1], tables.bricks[e, 2]
                    near = segment_distance2(
                        dabs, d, shrink, 8.0 * x + 3.5, 8.0 * y + 3.5, 8.0 * z + 3.5
                    )
                    if near <= far * far:
                        n, n_rows = _take(e, only_stored, slots, batch, marks, n_rows, found, n)
                continue
            for x in range(int(x0), int(x1) + 1):
                for y in range(int(y0), int(y1) + 1):
                    for z in range(int(z0), int(z1) + 1):
                        near = segment_distance2(
                            dabs, d, shrink, 8.0 * x + 3.5, 8.0 * y + 3.5, 8.0 * z + 3.5
                        )
                        if near > far * far:
                            continue
                        code = find_code(tables.heads, tables.pages, level, x, y, z)
                        begin, end = sheets_of(tables.groups, code)
                        for e in range(begin, end):
                            n, n_rows = _take(e, only_stored, slots, batch, marks, n_rows, found, n)
    return n, n_rows


@njit(cache=True, nogil=True, inline="always")
def _bricks(a, b, shrink, reach):
    """First and last brick along one axis, as whole float64 numbers."""
    low, high = min(a, b) * shrink - reach, max(a, b) * shrink + reach
    return math.floor((low - 7.0) * 0.125) + 1.0, math.floor(high * 0.125)


@njit(cache=True, nogil=True, inline="always")
def _take(e, only_stored, slots, batch, marks, n_rows, found, n):
    if marks[e, BATCH] == batch or (only_stored and slots[e] == ABSENT):
        return n, n_rows
    marks[e, BATCH] = batch
    marks[e, PLACE] = n
    if marks[e, ROW] == 0:
        n_rows += 1
        marks[e, ROW] = n_rows
    found[n] = e
    return n + 1, n_rows
