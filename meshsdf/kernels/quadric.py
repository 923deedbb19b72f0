"""The point that fits the tangent planes at the crossings of a loop best.

It minimises the sum of (n . (x - p))^2 over crossings p with unit normals n (Ju, Losasso, Schaefer
and Warren 2002, doi:10.1145/566654.566586), starting from the mean m of the crossings: with the
eigenvectors e_i and eigenvalues l_i of A = sum n n^T and b = sum n (n . (p - m)),

    x = m + sum over the first r of e_i (e_i . b) / l_i.

Eigenvalues below the square of ``truncation`` times the largest are noise, and are left out
(Lindstrom 2000, doi:10.1145/344779.344912). If x is too far from the cell, r is lowered; m itself
lies in the cell. A normal of length 0 is unknown: its crossing counts for the mean alone.
"""

import numpy as np
from numba import njit

CURVED = 0.14
"""Of singular values: about 16 degrees between two halves of a cell, which sag by 0.07 voxels."""

FIT = 0.01
"""In voxels; a point this near to all planes may lie outside its cell, within ``reach``."""

STEEP = 0.1
"""Of singular values: planes that meet at less than 11 degrees must not lead out of the cell."""

SWEEPS = 12  # of Jacobi's method, which converges quadratically: 4 or 5 are usual


@njit(cache=True, nogil=True)
def _diagonalise(a, v):
    """Make the symmetric (3, 3) ``a`` diagonal, largest first; the columns of v are eigenvectors.

    Jacobi's method: every rotation annuls one pair of entries.
    """
    for i in range(3):
        for j in range(3):
            v[i, j] = 1.0 if i == j else 0.0
    for turn in range(3 * SWEEPS):
        off = abs(a[0, 1]) + abs(a[0, 2]) + abs(a[1, 2])
        if off <= 1e-14 * (a[0, 0] + a[1, 1] + a[2, 2]):
            break
        i, j = (0 if turn % 3 < 2 else 1), (1 if turn % 3 == 0 else 2)
        if a[i, j] == 0.0:
            continue
        theta = (a[j, j] - a[i, i]) / (2.0 * a[i, j])
        t = (1.0 if theta >= 0.0 else -1.0) / (abs(theta) + np.sqrt(theta * theta + 1.0))
        c = 1.0 / np.sqrt(t * t + 1.0)
        s = t * c
        for k in range(3):
            x, y = a[k, i], a[k, j]
            a[k, i], a[k, j] = c * x - s * y, s * x + c * y
        for k in range(3):
            x, y = a[i, k], a[j, k]
            a[i, k], a[j, k] = c * x - s * y, s * x + c * y
            x, y = v[k, i], v[k, j]
            v[k, i], v[k, j] = c * x - s * y, s * x + c * y
    for turn in range(3):
        j = turn % 2
        if a[j, j] < a[j + 1, j + 1]:
            a[j, j], a[j + 1, j + 1] = a[j + 1, j + 1], a[j, j]
            for k in range(3):
                v[k, j], v[k, j + 1] = v[k, j + 1], v[k, j]


@njit(cache=True, nogil=True)
def _gather(crossings, sides, cell, p, mean, total):
    """Write the crossings relative to the cell, their mean, and the sum of their normals.

    Returns how many normals are known.
    """
    known = 0.0
    for k in range(3):
        mean[k], total[k] = 0.0, 0.0
    for s in range(len(sides)):
        c = sides[s]
        for k in range(3):
            p[s, k] = crossings.nodes[c, k] - cell[k]
        p[s, crossings.ways[c] >> 1] += crossings.fractions[c]
        for k in range(3):
            mean[k] += p[s, k]
            total[k] += crossings.normals[c, k]
            known += crossings.normals[c, k] ** 2
    for k in range(3):
        mean[k] /= len(sides)
    return known


@njit(cache=True, nogil=True)
def _fit_one_plane(normals, sides, p, direction, x):
    """Move x, the mean of the crossings, along a direction until it fits their planes best."""
    up, down = 0.0, 0.0
    for s in range(len(sides)):
        n = normals[sides[s]]
        slope = n[0] * direction[0] + n[1] * direction[1] + n[2] * direction[2]
        d = n[0] * (p[s, 0] - x[0]) + n[1] * (p[s, 1] - x[1]) + n[2] * (p[s, 2] - x[2])
        up += slope * d
        down += slope * slope
    for k in range(3):
        x[k] += up / down * direction[k]


@njit(cache=True, nogil=True)
def _outside(x):
    """How far x lies outside the unit cube, along the axis where that is most."""
    return max(-x[0], x[0] - 1.0, -x[1], x[1] - 1.0, -x[2], x[2] - 1.0, 0.0)


@njit(cache=True, nogil=True)
def _fit_planes(normals, sides, p, truncation, reach, mean, x, a, v, b):
    """Write the point that fits the planes best, of the highest rank that stays near the cell."""
    for i in range(3):
        b[i] = 0.0
        for j in range(3):
            a[i, j] = 0.0
    for s in range(len(sides)):
        n = normals[sides[s]]
        d = 0.0
        for k in range(3):
            d += n[k] * (p[s, k] - mean[k])
        for i in range(3):
            b[i] += n[i] * d
            for j in range(3):
                a[i, j] += n[i] * n[j]
    _diagonalise(a, v)
    rank = 1
    while rank < 3 and a[rank, rank] > truncation * truncation * a[0, 0]:
        rank += 1
    for r in range(rank, -1, -1):
        for k in range(3):
            x[k] = mean[k]
        for i in range(r):
            d = (v[0, i] * b[0] + v[1, i] * b[1] + v[2, i] * b[2]) / a[i, i]
            for k in range(3):
                x[k] += d * v[k, i]
        out = _outside(x)
        if out <= 0.0:
            break
        worst = np.inf
        if out <= reach and a[r - 1, r - 1] > STEEP**2 * a[0, 0]:
            worst = 0.0
            for s in range(len(sides)):
                n = normals[sides[s]]
                d = n[0] * (x[0] - p[s, 0]) + n[1] * (x[1] - p[s, 1]) + n[2] * (x[2] - p[s, 2])
                worst = max(worst, abs(d))
        if worst <= FIT:
            break


@njit(cache=True, nogil=True)
def fit_points(loops, crossings, truncation, reach, begin, end, points, is_curved):
    """``points[l]`` for loops begin <= l < end; in the cell, or within ``reach`` if it fits well.

    ``is_curved[l]`` tells whether the normals of a loop differ so much that its point may be off
    the surface.
    """
    a, v, p = np.empty((3, 3)), np.empty((3, 3)), np.empty((12, 3))
    mean, total, b, x = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for l in range(begin, end):  # noqa: E741
        sides, cell = loops.sides[loops.start[l] : loops.start[l + 1]], loops.cells[l]
        known = _gather(crossings, sides, cell, p, mean, total)
        # The largest eigenvalue is at least |total|^2 / known, and the others share the rest
        square = total[0] ** 2 + total[1] ** 2 + total[2] ** 2
        rest = known * known - square
        is_curved[l] = rest > CURVED**2 * square
        for k in range(3):
            x[k] = mean[k]
        if rest > truncation * truncation * square:
            _fit_planes(crossings.normals, sides, p, truncation, reach, mean, x, a, v, b)
        elif known > 0.0:
            _fit_one_plane(crossings.normals, sides, p, total, x)
            if _outside(x) > reach:
                for k in range(3):
                    x[k] = mean[k]
        for k in range(3):
            points[l, k] = cell[k] + x[k]
