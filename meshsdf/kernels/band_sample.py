"""Read a narrow band between its nodes, linearly along each axis."""

import numpy as np
from numba import njit

from .brick_lookup import INSIDE, find_brick


@njit(cache=True, nogil=True, inline="always")
def node_value(root, pages, values, background, i, j, k):
    """The stored value of a local node; +-background where there is no brick."""
    slot = find_brick(root, pages, i >> 3, j >> 3, k >> 3)
    if slot >= 0:
        return np.float64(values[slot, i & 7, j & 7, k & 7])
    return -background if slot == INSIDE else background


@njit(cache=True, nogil=True)
def sample_band(root, pages, values, background, first, voxel_size, points, begin, end, out):
    """``out[n]`` = the trilinear interpolant at ``points[n]``, n from ``begin`` to before ``end``.

    ``first`` (3,) is the world position of local node (0, 0, 0); points must not be as far from it
    as 2^62 voxels.
    """
    corner = np.empty(8)
    for n in range(begin, end):
        # Cell and place in it
        x = (points[n, 0] - first[0]) / voxel_size
        y = (points[n, 1] - first[1]) / voxel_size
        z = (points[n, 2] - first[2]) / voxel_size
        fx, fy, fz = np.floor(x), np.floor(y), np.floor(z)
        i, j, k = np.int64(fx), np.int64(fy), np.int64(fz)
        x, y, z = x - fx, y - fy, z - fz
        a, b, c = i & 7, j & 7, k & 7
        if a < 7 and b < 7 and c < 7:
            # The whole cell is in one brick, or in none
            slot = find_brick(root, pages, i >> 3, j >> 3, k >> 3)
            if slot < 0:
                out[n] = -background if slot == INSIDE else background
                continue
            for m in range(8):
                corner[m] = values[slot, a + (m >> 2), b + ((m >> 1) & 1), c + (m & 1)]
        else:
            for m in range(8):
                corner[m] = node_value(
                    root, pages, values, background, i + (m >> 2), j + ((m >> 1) & 1), k + (m & 1)
                )
        # One axis after the other
        for m in range(4):
            corner[m] += x * (corner[m + 4] - corner[m])
        for m in range(2):
            corner[m] += y * (corner[m + 2] - corner[m])
        out[n] = corner[0] + z * (corner[1] - corner[0])
