"""Distances to the nearest and second nearest of points strewn one to a cell of the lattice.

Worley 1996 (doi:10.1145/237170.237267), with one feature point per cell. A search of the 3 x 3 x 3
cells around may miss the nearest; that of 5 x 5 x 5 cannot: both distances are at most sqrt(3), by
the own cell and the neighbour across the nearest face, and cells beyond are at least 2 away.
"""

import math

import numpy as np
from numba import njit

from .noise import lattice_hash, pcg3d

_UNIT = 1.0 / 4294967296.0  # 2**-32


@njit(cache=True, nogil=True)
def _gap(x, cell):
    """Distance of a coordinate to the cell [cell, cell + 1]."""
    return max(cell - x, x - cell - 1.0, 0.0)


@njit(cache=True, nogil=True)
def nearest_features(points, reach, jitter, seed, distances, marks):
    """``distances[n]`` = F1, F2 of a point; ``marks[n]`` = three numbers in [0, 1) of its cell.

    ``reach`` 1 searches 3 x 3 x 3 cells, 2 searches 5 x 5 x 5. Feature points lie ``jitter`` times
    as far from the middle of their cell as the hash says.
    """
    turn = np.uint64(0x5BD1E995)
    for n in range(len(points)):
        x, y, z = points[n, 0], points[n, 1], points[n, 2]
        fi, fj, fk = math.floor(x), math.floor(y), math.floor(z)
        i, j, k = np.int64(fi), np.int64(fj), np.int64(fk)
        # Offsets from the cell's corner, which keep all digits however far the point is
        x, y, z = x - fi, y - fj, z - fk
        first = second = np.inf
        mark_x = mark_y = mark_z = np.uint64(0)
        for ring in range(reach + 1):
            for di in range(-ring, ring + 1):
                gap_x = _gap(x, float(di))
                for dj in range(-ring, ring + 1):
                    gap_xy = gap_x * gap_x + _gap(y, float(dj)) ** 2
                    if gap_xy > second:
                        continue
                    step = 1
                    if ring > 0 and abs(di) < ring and abs(dj) < ring:
                        step = 2 * ring
                    for dk in range(-ring, ring + 1, step):
                        if gap_xy + _gap(z, float(dk)) ** 2 > second:
                            continue
                        hx, hy, hz = lattice_hash(i + di, j + dj, k + dk, seed)
                        dx = di + 0.5 + jitter * (hx * _UNIT - 0.5) - x
                        dy = dj + 0.5 + jitter * (hy * _UNIT - 0.5) - y
                        dz = dk + 0.5 + jitter * (hz * _UNIT - 0.5) - z
                        square = dx * dx + dy * dy + dz * dz
                        if square < first:
                            first, second = square, first
                            mark_x, mark_y, mark_z = hx, hy, hz
                        elif square < second:
                            second = square
        distances[n, 0], distances[n, 1] = math.sqrt(first), math.sqrt(second)
        # Hashed once more, so that the numbers say nothing of the place
        a, b, c = pcg3d(mark_x ^ turn, mark_y, mark_z)
        marks[n, 0], marks[n, 1], marks[n, 2] = a * _UNIT, b * _UNIT, c * _UNIT
