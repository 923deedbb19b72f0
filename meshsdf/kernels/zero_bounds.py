"""How far a triangle is at most from the zeros of a band's trilinear interpolant F.

If |F - L| <= e over a box around the triangle, for a linear L with gradient g, a point p of the
triangle has a zero of F within (|L(p)| + e) / |g|: going so far along g, one way or the other, F
changes sign, as long as the box reaches so far. |L| is largest at a corner of the triangle. No
sample and no piece of the zero set is needed, and where F is nearly linear the bound is as good as
the distance itself, whatever the size of the triangle.
"""

import numpy as np
from numba import njit

from .brick_lookup import INSIDE, find_brick
from .trilinear_block import ROUNDING, largest_value, linear_range, set_ticks, value_in_cell

NODES = 8  # along each side of the block that a triangle may need
LEAST_WIDTH = 0.5  # voxels: slopes are taken over boxes at least so wide
LEAST_REACH = 0.3  # voxels around the triangle for which nodes are read; at least half that width
LARGEST_REACH = 1.0
PAD = 1e-12  # voxels, as in `zero_planes`
LEAST = 1e-13
ATTEMPTS = 4


@njit(cache=True, nogil=True)
def bound_triangles(points, pieces, root, pages, values, numbers, enough, begin, end, upper):
    """``upper[n]`` >= the distance of triangle ``pieces[n]`` from the zeros, or infinite.

    ``numbers`` holds background, level, voxel size, and the position (3,) of the points' origin
    in lattice units from the first node of the page table. Lengths are those of the points;
    bounds above ``enough`` are of no use and need not be found.
    """
    block = np.empty((NODES, NODES, NODES))
    ticks, n_ticks = np.empty((3, NODES + 2)), np.empty(3, np.int64)
    corners, lower, higher = np.empty((3, 3)), np.empty(3), np.empty(3)
    base, g = np.empty(3, np.int64), np.empty(3)
    size = numbers[2]
    most = enough / size
    margin = min(max(most, LEAST_REACH), LARGEST_REACH) + 1e-6
    for n in range(begin, end):
        upper[n] = np.inf
        if not most > 0.0:
            continue
        # The triangle in lattice units, and its box
        fits = True
        for axis in range(3):
            for c in range(3):
                corners[c, axis] = points[pieces[n, c], axis] / size + numbers[3 + axis]
            lower[axis] = min(corners[0, axis], corners[1, axis], corners[2, axis])
            higher[axis] = max(corners[0, axis], corners[1, axis], corners[2, axis])
            base[axis] = int(np.floor(lower[axis] - margin))
            fits = fits and higher[axis] + margin < base[axis] + NODES - 1
        if not fits:
            continue
        for axis in range(3):
            lower[axis] -= base[axis]
            higher[axis] -= base[axis]
            for c in range(3):
                corners[c, axis] -= base[axis]
        _read_block(root, pages, values, numbers, base, higher, margin, block)
        norm = _slope(block, lower, higher, g)
        if not 0.0 < norm < np.inf:
            continue
        # The least |F| to be bridged: give up at once where that is too far
        reach = 0.0
        for c in range(3):
            reach = max(reach, abs(_value(block, corners[c, 0], corners[c, 1], corners[c, 2])))
        reach = 1.2 * reach / norm + 0.05 * min(most, 1.0)
        if reach > min(2.0 * most, margin - 1e-9):
            continue
        noise = ROUNDING * largest_value(block)
        for _ in range(ATTEMPTS):
            for axis in range(3):
                more = reach * abs(g[axis]) / norm + PAD
                n_ticks[axis] = set_ticks(ticks[axis], lower[axis] - more, higher[axis] + more)
            least, largest = linear_range(block, ticks, n_ticks, g[0], g[1], g[2])
            rest = 0.5 * (least + largest)
            farthest = 0.0
            for c in range(3):
                at = rest + g[0] * corners[c, 0] + g[1] * corners[c, 1] + g[2] * corners[c, 2]
                farthest = max(farthest, abs(at))
            found = (farthest + 0.5 * (largest - least) + noise) / norm * (1.0 + 1e-9) + LEAST
            if found <= reach:
                upper[n] = min(upper[n], found * size)
                if found > 0.8 * reach:
                    break
            reach = 1.05 * found
            if not reach <= margin - 1e-9:
                break


@njit(cache=True, nogil=True)
def _read_block(root, pages, values, numbers, base, higher, margin, block):
    """Copy value - level of the nodes from ``base`` to beyond ``higher + margin``, zeros after."""
    background, level = numbers[0], numbers[1]
    block[:] = 0.0
    for i in range(min(int(higher[0] + margin) + 2, NODES)):
        x = base[0] + i
        for j in range(min(int(higher[1] + margin) + 2, NODES)):
            y = base[1] + j
            slot, last = np.int32(0), np.int64(-(2**62))
            for k in range(min(int(higher[2] + margin) + 2, NODES)):
                z = base[2] + k
                if z >> 3 != last:
                    last = z >> 3
                    slot = find_brick(root, pages, x >> 3, y >> 3, last)
                if slot >= 0:
                    block[i, j, k] = np.float64(values[slot, x & 7, y & 7, z & 7]) - level
                elif slot == INSIDE:
                    block[i, j, k] = -background - level
                else:
                    block[i, j, k] = background - level


@njit(cache=True, nogil=True)
def _value(block, x, y, z):
    i, j, k = int(x), int(y), int(z)
    return value_in_cell(block, i, j, k, x - i, y - j, z - k)


@njit(cache=True, nogil=True)
def _slope(block, lower, higher, g):
    """Write the slopes of F between the faces of a box, made wide enough; return their norm."""
    a, b = np.empty(3), np.empty(3)
    for axis in range(3):
        more = 0.5 * max(LEAST_WIDTH - (higher[axis] - lower[axis]), 0.0)
        a[axis], b[axis] = lower[axis] - more, higher[axis] + more
        g[axis] = 0.0
    for c in range(8):
        x = b[0] if c >> 2 else a[0]
        y = b[1] if (c >> 1) & 1 else a[1]
        z = b[2] if c & 1 else a[2]
        f = 0.25 * _value(block, x, y, z)
        g[0] += f / (b[0] - a[0]) if c >> 2 else -f / (b[0] - a[0])
        g[1] += f / (b[1] - a[1]) if (c >> 1) & 1 else -f / (b[1] - a[1])
        g[2] += f / (b[2] - a[2]) if c & 1 else -f / (b[2] - a[2])
    return np.sqrt(g[0] ** 2 + g[1] ** 2 + g[2] ** 2)
