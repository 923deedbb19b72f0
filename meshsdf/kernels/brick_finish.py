"""From squared distances and signs to the bricks that are kept."""

import numpy as np
from numba import njit

from .brick_lookup import INSIDE, OUTSIDE, find_page
from .point_triangle import closest_on_triangle

NEGATIVE_ZERO = np.float32(-(2.0**-126))
"""Stored for inner nodes at distance 0: the least number whose sign every reader keeps."""


@njit(cache=True, nogil=True)
def keep_active(
    coordinates, squared, inside, reach, scale, background, root, pages, values, active, kept
):
    """Write the bricks that hold an active node, one after the other; return how many.

    A node is active when its distance is below ``reach`` voxels and, as stored, below
    ``background``. ``kept[i]`` is the slab's number of the i-th brick written. Bricks without
    active nodes are coded inside or outside in ``pages``.
    """
    n = 0
    one = np.uint64(1)
    for b in range(len(coordinates)):
        any_active = False
        for i in range(8):
            mask = np.uint64(0)
            for jk in range(64):
                node = 64 * i + jk
                negative = (inside[b, i] >> np.uint64(jk)) & one
                d = squared[b, node]
                value = background
                if d < reach * reach:
                    value = np.float32(np.sqrt(d) * scale)
                    if value < background:
                        mask |= one << np.uint64(jk)
                    else:
                        value = background
                if negative:
                    value = -value if value > 0.0 else NEGATIVE_ZERO
                values[n, node] = value
            active[n, i] = mask
            any_active |= mask != 0
        if any_active:
            kept[n] = b
            n += 1
        else:
            x, y, z = coordinates[b, 0], coordinates[b, 1], coordinates[b, 2]
            code = INSIDE if inside[b, 0] & one else OUTSIDE
            page = find_page(root, pages, x >> 4, y >> 4, z >> 4)
            pages[page, x & 15, y & 15, z & 15] = code
    return n


@njit(cache=True, nogil=True)
def renumber(coordinates, slot0, root, pages):
    """Write slot numbers ``slot0 + n`` for bricks (n, 3) of local coordinates into the pages."""
    for n in range(len(coordinates)):
        x, y, z = coordinates[n, 0], coordinates[n, 1], coordinates[n, 2]
        page = find_page(root, pages, x >> 4, y >> 4, z >> 4)
        pages[page, x & 15, y & 15, z & 15] = slot0 + n


@njit(cache=True, nogil=True)
def closest_in_bricks(
    coordinates, nearest, active, points, faces, face_ids, weights, closest_face, barycentric
):
    """Fill the closest face and the barycentrics of every active node, -1 and 0 elsewhere.

    ``nearest`` (b, 512) indexes ``faces``; ``face_ids`` turns that into the mesh's own numbers.
    ``weights`` (m, 3, 3) are the barycentrics there of the corners of ``faces``, where these are
    parts of the mesh's faces; else it is empty.
    """
    for b in range(len(coordinates)):
        for node in range(512):
            i, j, k = node >> 6, (node >> 3) & 7, node & 7
            if not (active[b, i] >> np.uint64(node & 63)) & np.uint64(1):
                closest_face[b, node] = -1
                barycentric[b, node, 0] = barycentric[b, node, 1] = 0.0
                continue
            f = nearest[b, node]
            x = float(8 * coordinates[b, 0] + i)
            y = float(8 * coordinates[b, 1] + j)
            z = float(8 * coordinates[b, 2] + k)
            corner0, corner1, corner2 = faces[f, 0], faces[f, 1], faces[f, 2]
            _, first, second, third = closest_on_triangle(
                x, y, z, points[corner0], points[corner1], points[corner2]
            )
            if len(weights) > 0:
                w = weights[f]
                second, third = (
                    first * w[0, 1] + second * w[1, 1] + third * w[2, 1],
                    first * w[0, 2] + second * w[1, 2] + third * w[2, 2],
                )
            closest_face[b, node] = face_ids[f]
            barycentric[b, node, 0] = second
            barycentric[b, node, 1] = third
