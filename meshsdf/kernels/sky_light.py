"""How much of the sky the points of a picture see, by rays, and smoothed among neighbours.

Every pixel sends few rays, spread by the cosine over its hemisphere; 4 x 4 pixels send 16 different
sets that together are one dense set (interleaved sampling: Keller, Heidrich 2001,
doi:10.1007/978-3-7091-6242-2_25). The share that a pixel sees is then a ratio of two means over the
pixels around it that lie on the same smooth piece of surface. Every mean over 4 x 4 pixels holds
each set once; a mean of means leaves no pattern.

Rays start where the surface is, deep in the tree. What they may meet is the place's own leaf, and
the siblings of all nodes above it, near ones first; that list is made once for all rays of a place,
without boxes below the tangent plane, where no ray goes.
"""

import numpy as np
from numba import njit

from .bvh import EMPTY, STACK_SIZE
from .mesh_rays import entries_of, is_below_in_the_way, prepared

SIDE = 4  # of a block of pixels, each with its own set of rays
LANES = 8  # lists are filled up to whole vectors
TURNED = 0.7  # neighbours whose normals' cosine is below do not count


@njit(cache=True, nogil=True)
def _radiance(x, y, z, sky):
    """The sky's brightness in a direction: even, plus a slope along up, plus a lobe around key."""
    up = x * sky[3] + y * sky[4] + z * sky[5]
    key = max(x * sky[6] + y * sky[7] + z * sky[8], 0.0)
    return sky[0] + sky[1] * up + sky[2] * key * key * key


@njit(cache=True, nogil=True)
def _rises_above(code, corners, gx, gy, gz, level):
    """Whether any triangle of a leaf reaches the plane g . x = level."""
    first = (-2 - code) >> 3
    for s in range(first, first + ((-2 - code) & 7) + 1):
        for k in range(3):
            if corners[s, k, 0] * gx + corners[s, k, 1] * gy + corners[s, k, 2] * gz >= level:
                return True
    return False


@njit(cache=True, nogil=True)
def _list_boxes(
    home, ox, oy, oz, gx, gy, gz, level, corners, children, child_boxes, parents, codes, rows
):  # fmt: skip
    """List the child at ``home`` and the siblings of all above it that reach g . x = level.

    Return their number n; ``codes[:n]`` are the children, ``rows[:, :n]`` their boxes relative to
    o. The lists go on to the next multiple of ``LANES`` with boxes that no ray enters.
    """
    x, y, z = 3 * (gx > 0.0), 1 + 3 * (gy > 0.0), 2 + 3 * (gz > 0.0)
    n, place, other = 0, home, home
    while place >= 0:
        node, first, code = other >> 1, 6 * (other & 1), children[other >> 1, other & 1]
        top = child_boxes[node, first + x] * gx + child_boxes[node, first + y] * gy
        top += child_boxes[node, first + z] * gz
        is_above = code != EMPTY and top >= level
        if is_above and (code >= 0 or _rises_above(code, corners, gx, gy, gz, level)):
            codes[n] = code
            for axis in range(0, 6, 3):
                rows[axis, n] = child_boxes[node, first + axis] - ox
                rows[axis + 1, n] = child_boxes[node, first + axis + 1] - oy
                rows[axis + 2, n] = child_boxes[node, first + axis + 2] - oz
            n += 1
        # After home itself its sibling, then one level up
        if other != home:
            place = parents[place >> 1]
        other = place ^ 1
    for c in range(n, -(-n // LANES) * LANES):
        for axis in range(3):
            rows[axis, c], rows[3 + axis, c] = np.inf, -np.inf
    return n


@njit(cache=True, nogil=True)
def sky_sums(
    points, normals, facets, lifts, sets, homes, begin, end, center, longest, directions, sky,
    corners, children, child_boxes, parents, sums,
):  # fmt: skip
    """``sums[q]`` = the sky's light along the rays of point q: all of it, and what arrives.

    Rays leave ``lifts[q]`` above the point, along ``facets[q]``, the normal of its face; those of
    the hemisphere around ``normals[q]`` that would go below the face are mirrored on it.
    ``homes[q]`` is any child, 2 * node + side, best that leaf which holds the point's face; so is
    ``parents[node]``, where that node is one, and -1 for the root.
    """
    stack = np.empty(STACK_SIZE, np.int32)
    codes = np.empty(STACK_SIZE, np.int32)
    rows, entries = np.empty((6, STACK_SIZE)), np.empty(STACK_SIZE)
    for q in range(begin, end):
        nx, ny, nz = normals[q, 0], normals[q, 1], normals[q, 2]
        gx, gy, gz = facets[q, 0], facets[q, 1], facets[q, 2]
        ox = points[q, 0] - center[0] + lifts[q] * gx
        oy = points[q, 1] - center[1] + lifts[q] * gy
        oz = points[q, 2] - center[2] + lifts[q] * gz
        # Half the lift below where the rays start: far more than rounding takes them down
        level = ox * gx + oy * gy + oz * gz - 0.5 * lifts[q]
        n = _list_boxes(
            *(homes[q], ox, oy, oz, gx, gy, gz, level),
            *(corners, children, child_boxes, parents, codes, rows),
        )
        # Two axes across the normal (Duff et al. 2017, JCGT 6(1), 1-8)
        side = 1.0 if nz >= 0.0 else -1.0
        a = -1.0 / (side + nz)
        b = nx * ny * a
        ux, uy, uz = 1.0 + side * nx * nx * a, side * b, -side * nx
        vx, vy, vz = b, side + ny * ny * a, -ny
        everything = arriving = 0.0
        for r in range(directions.shape[1]):
            ray = directions[sets[q], r]
            p, s, t = ray[0], ray[1], ray[2]
            x, y, z = p * ux + s * vx + t * nx, p * uy + s * vy + t * ny, p * uz + s * vz + t * nz
            below = x * gx + y * gy + z * gz
            if below < 0.0:
                x, y, z = x - 2.0 * below * gx, y - 2.0 * below * gy, z - 2.0 * below * gz
            light = _radiance(x, y, z, sky)
            everything += light
            slopes, length, shear = prepared(ox, oy, oz, x, y, z)
            entries_of(rows, -(-n // LANES) * LANES, *slopes, entries)
            far, is_free = longest / length, True
            for c in range(n):
                if entries[c] <= far and entries[c] < np.inf:
                    is_free = not is_below_in_the_way(
                        *(codes[c], ox, oy, oz, slopes, shear, far),
                        *(corners, children, child_boxes, stack),
                    )
                    if not is_free:
                        break
            if is_free:
                arriving += light
        sums[q, 0], sums[q, 1] = everything, arriving


@njit(cache=True, nogil=True)
def mean_sums(
    columns, rows, points, normals, lifts, begin, end, back, reach, index, near_points,
    near_normals, near_sums, result,
):  # fmt: skip
    """``result[q]`` = mean of ``near_sums`` around q; zero where no neighbour counts.

    ``index[row, column]`` is the place of a pixel in the ``near`` arrays, or -1. The block begins
    ``back`` pixels before q's. A neighbour counts the less, the farther it lies from the plane
    through q (nothing at ``reach * lifts[q]``), and the more its normal is turned.
    """
    height, width = index.shape
    for q in range(begin, end):
        everything = arriving = total = 0.0
        scale = 1.0 / (reach * lifts[q])
        top, left = rows[q] - back, columns[q] - back
        for row in range(max(top, 0), min(top + SIDE, height)):
            for column in range(max(left, 0), min(left + SIDE, width)):
                near = index[row, column]
                if near < 0:
                    continue
                turn = off = 0.0
                for axis in range(3):
                    turn += normals[q, axis] * near_normals[near, axis]
                    off += normals[q, axis] * (near_points[near, axis] - points[q, axis])
                weight = min((turn - TURNED) / (1.0 - TURNED), 1.0) * (1.0 - abs(off) * scale)
                if turn > TURNED and weight > 0.0:
                    everything += weight * near_sums[near, 0]
                    arriving += weight * near_sums[near, 1]
                    total += weight
        result[q, 0] = everything / total if total > 0.0 else 0.0
        result[q, 1] = arriving / total if total > 0.0 else 0.0
