"""The nearest triangle along many rays, and whether anything is in the way at all.

Triangles: the watertight test of Woop, Benthin, Wald 2013 (Journal of Computer Graphics Techniques
2(1), 65-82). The ray's largest component becomes the third axis, a shear makes the ray that axis,
and the ray hits where the origin lies within the sheared triangle: three 2 x 2 determinants, one
per edge, none below zero or none above. A corner is sheared the same way for all its triangles,
and two triangles compute the determinant of a common edge from the same two products. Rounding is
monotone and differences of unequal numbers are not zero, so a computed sign is right or zero, and
zero counts as a hit on both sides: no ray slips through an edge or a corner of a closed mesh.

    So every answer is the exact one for a mesh whose corners moved by at most 12 u |v - o|,

u = 2**-53, v - o from the ray's origin to the corner: 2 u and 4 u for the parts across and along
the ray, in both of the sheared coordinates, rounded up with 2 u for determinants that became zero.

Boxes: slabs (Kay, Kajiya 1986, doi:10.1145/15886.15916), entered a little earlier and left a little
later than computed (Ize 2013, JCGT 2(2), 12-27): 4 u of that for the slab's own rounding, 6 u for
that of the corners, which along x and y is relative to how far the ray goes there. So a box holds
all that its triangles' test would hit, from however far; from near, its padding does (see `bvh`).

Triangles seen edge-on, or without area, are never hit.
"""

import numpy as np
from numba import njit

from .bvh import STACK_SIZE

EARLIER = 1.0 - 2.0**-48  # 32 u, for 10 u on either side
LATER = 1.0 + 2.0**-48
STEEPEST = 1e150  # stands for the reciprocal of a direction's zero: far beyond any box
MISS = -1.0


@njit(cache=True, nogil=True)
def _axes(dx, dy, dz):
    """(x, y, z axis of the sheared space, the ray's sign along z, its length, its x and y per z).

    z is the direction's largest component; the length is that of the ray scaled to |z| = 1.
    """
    ax, ay, az = abs(dx), abs(dy), abs(dz)
    if ax >= ay and ax >= az:
        kx, ky, kz, sx, sy, along = 1, 2, 0, dy / ax, dz / ax, dx
    elif ay >= az:
        kx, ky, kz, sx, sy, along = 2, 0, 1, dz / ay, dx / ay, dy
    else:
        kx, ky, kz, sx, sy, along = 0, 1, 2, dx / az, dy / az, dz
    return kx, ky, kz, (1.0 if along > 0.0 else -1.0), np.sqrt(1.0 + sx * sx + sy * sy), sx, sy


@njit(cache=True, nogil=True)
def _reciprocal(x):
    """1 / x, but finite."""
    if abs(x) * STEEPEST < 1.0:
        return STEEPEST
    return 1.0 / x


@njit(cache=True, nogil=True)
def _entry(boxes, node, first, ox, oy, oz, ix, iy, iz):
    """Where the ray enters one box of the node, in lengths of its direction; infinite if never."""
    x, y, z = 3 * (ix < 0.0), 3 * (iy < 0.0), 3 * (iz < 0.0)
    near = max((boxes[node, first + x] - ox) * ix, 0.0)
    near = max((boxes[node, first + 1 + y] - oy) * iy, near)
    near = max((boxes[node, first + 2 + z] - oz) * iz, near)
    far = (boxes[node, first + 3 - x] - ox) * ix
    far = min((boxes[node, first + 4 - y] - oy) * iy, far)
    far = min((boxes[node, first + 5 - z] - oz) * iz, far)
    return near * EARLIER if near <= far * LATER else np.inf


@njit(cache=True, nogil=True)
def _entry_at(boxes, node, x, y, z, far_x, far_y, far_z, ox, oy, oz, ix, iy, iz):
    """As `_entry`, by the six places of the box's near and far sides in its node."""
    near = max((boxes[node, x] - ox) * ix, 0.0)
    near = max((boxes[node, y] - oy) * iy, near)
    near = max((boxes[node, z] - oz) * iz, near)
    far = (boxes[node, far_x] - ox) * ix
    far = min((boxes[node, far_y] - oy) * iy, far)
    far = min((boxes[node, far_z] - oz) * iz, far)
    return near * EARLIER if near <= far * LATER else np.inf


@njit(cache=True, nogil=True)
def entries_of(rows, n, ix, iy, iz, entries):
    """``entries[c]`` = where a ray enters box c of n; infinite if never.

    ``rows`` (6, n) holds the boxes relative to the ray's origin: lower xyz, upper xyz.
    """
    x, far_x = rows[3 * (ix < 0.0)], rows[3 * (ix >= 0.0)]
    y, far_y = rows[1 + 3 * (iy < 0.0)], rows[1 + 3 * (iy >= 0.0)]
    z, far_z = rows[2 + 3 * (iz < 0.0)], rows[2 + 3 * (iz >= 0.0)]
    # As `_entry`, in a form that the compiler turns into vector instructions
    for c in range(n):
        near = max(x[c] * ix, 0.0)
        near = max(y[c] * iy, near)
        near = max(z[c] * iz, near)
        far = far_x[c] * ix
        far = min(far_y[c] * iy, far)
        far = min(far_z[c] * iz, far)
        entries[c] = near * EARLIER if near <= far * LATER else np.inf


@njit(cache=True, nogil=True)
def _hit(corners, s, kx, ky, kz, sign, sx, sy, px, py, pz):
    """(t, weight of the first corner, of the second) where the ray hits triangle s; t MISS."""
    # Corners relative to the origin, sheared so that the ray is the z axis
    az = sign * (corners[s, 0, kz] - pz)
    bz = sign * (corners[s, 1, kz] - pz)
    cz = sign * (corners[s, 2, kz] - pz)
    ax, ay = corners[s, 0, kx] - px - sx * az, corners[s, 0, ky] - py - sy * az
    bx, by = corners[s, 1, kx] - px - sx * bz, corners[s, 1, ky] - py - sy * bz
    cx, cy = corners[s, 2, kx] - px - sx * cz, corners[s, 2, ky] - py - sy * cz
    # Scaled weights: one determinant per opposite edge
    u, v, w = cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax
    if (u < 0.0 or v < 0.0 or w < 0.0) and (u > 0.0 or v > 0.0 or w > 0.0):
        return MISS, 0.0, 0.0
    total = u + v + w
    if total == 0.0:
        return MISS, 0.0, 0.0
    u, v, w = u / total, v / total, w / total
    t = az + v * (bz - az) + w * (cz - az)  # exact where all are equal
    return (t if t >= 0.0 else MISS), u, v


@njit(cache=True, nogil=True)
def nearest_hits(
    origins, directions, begin, end, center, corners, order, children, child_boxes,
    distances, faces, weights,
):  # fmt: skip
    """The nearest triangle along rays begin..end; the lowest face of several at one distance.

    ``corners`` are relative to ``center`` and in the order of the tree's slots. Distances are in
    world units; where nothing is hit they are infinite, the face is -1 and the weights are zero.
    """
    stack_code = np.empty(STACK_SIZE, np.int32)
    stack_near = np.empty(STACK_SIZE, np.float64)
    for q in range(begin, end):
        distances[q], faces[q] = np.inf, -1
        weights[q, 0], weights[q, 1], weights[q, 2] = 0.0, 0.0, 0.0
        dx, dy, dz = directions[q, 0], directions[q, 1], directions[q, 2]
        kx, ky, kz, sign, length, sx, sy = _axes(dx, dy, dz)
        largest = max(abs(dx), abs(dy), abs(dz))
        dx, dy, dz = dx / largest, dy / largest, dz / largest
        ox, oy, oz = origins[q, 0] - center[0], origins[q, 1] - center[1], origins[q, 2] - center[2]
        ix, iy, iz = _reciprocal(dx), _reciprocal(dy), _reciprocal(dz)
        px = ox if kx == 0 else (oy if kx == 1 else oz)
        py = ox if ky == 0 else (oy if ky == 1 else oz)
        pz = ox if kz == 0 else (oy if kz == 1 else oz)
        best, face, best_u, best_v = np.inf, np.int32(-1), 0.0, 0.0
        n_stack, code = 0, np.int32(0)
        while True:
            if code >= 0:
                near, far = children[code, 0], children[code, 1]
                near_t = _entry(child_boxes, code, 0, ox, oy, oz, ix, iy, iz)
                far_t = _entry(child_boxes, code, 6, ox, oy, oz, ix, iy, iz)
                if far_t < near_t:
                    near, far = far, near
                    near_t, far_t = far_t, near_t
                if far_t <= best and far_t < np.inf:
                    stack_code[n_stack] = far
                    stack_near[n_stack] = far_t
                    n_stack += 1
                if near_t <= best and near_t < np.inf:
                    code = near
                    continue
            else:
                first = (-2 - code) >> 3
                for s in range(first, first + ((-2 - code) & 7) + 1):
                    t, u, v = _hit(corners, s, kx, ky, kz, sign, sx, sy, px, py, pz)
                    if t >= 0.0 and (t < best or (t == best and order[s] < face)):
                        best, face, best_u, best_v = t, order[s], u, v
            while n_stack > 0 and stack_near[n_stack - 1] > best:
                n_stack -= 1
            if n_stack == 0:
                break
            n_stack -= 1
            code = stack_code[n_stack]
        if face >= 0:
            distances[q], faces[q] = best * length, face
            weights[q, 0], weights[q, 1] = best_u, best_v
            weights[q, 2] = max(1.0 - best_u - best_v, 0.0)


@njit(cache=True, nogil=True)
def prepared(ox, oy, oz, dx, dy, dz):
    """(reciprocals of the direction, the ray's length per unit of it, what `_hit` takes)."""
    kx, ky, kz, sign, length, sx, sy = _axes(dx, dy, dz)
    largest = max(abs(dx), abs(dy), abs(dz))
    slopes = _reciprocal(dx / largest), _reciprocal(dy / largest), _reciprocal(dz / largest)
    px = ox if kx == 0 else (oy if kx == 1 else oz)
    py = ox if ky == 0 else (oy if ky == 1 else oz)
    pz = ox if kz == 0 else (oy if kz == 1 else oz)
    return slopes, length, (kx, ky, kz, sign, sx, sy, px, py, pz)


@njit(cache=True, nogil=True)
def is_below_in_the_way(
    code, ox, oy, oz, slopes, shear, end, corners, children, child_boxes, stack
):  # fmt: skip
    """Whether any triangle below the node or leaf ``code`` is hit at ``end`` or before."""
    ix, iy, iz = slopes
    kx, ky, kz, sign, sx, sy, px, py, pz = shear
    # Without signs, or every index would be asked whether it counts from the end
    other, one, two = np.uint64(6), np.uint64(1), np.uint64(2)
    x, far_x = np.uint64(3 * (ix < 0.0)), np.uint64(3 * (ix >= 0.0))
    y, far_y = np.uint64(3 * (iy < 0.0)) + one, np.uint64(3 * (iy >= 0.0)) + one
    z, far_z = np.uint64(3 * (iz < 0.0)) + two, np.uint64(3 * (iz >= 0.0)) + two
    n_stack = 0
    while True:
        if code >= 0:
            node = np.uint64(code)
            near, far = children[node, 0], children[node, 1]
            near_t = _entry_at(
                *(child_boxes, node, x, y, z, far_x, far_y, far_z, ox, oy, oz, ix, iy, iz)
            )
            far_t = _entry_at(
                *(child_boxes, node, x + other, y + other, z + other),
                *(far_x + other, far_y + other, far_z + other, ox, oy, oz, ix, iy, iz),
            )
            if far_t < near_t:
                near, far = far, near
                near_t, far_t = far_t, near_t
            if far_t <= end and far_t < np.inf:
                stack[n_stack] = far
                n_stack += 1
            if near_t <= end and near_t < np.inf:
                code = near
                continue
        else:
            first = np.uint64((-2 - code) >> 3)
            for s in range(first, first + np.uint64(((-2 - code) & 7) + 1)):
                t, _, _ = _hit(corners, s, kx, ky, kz, sign, sx, sy, px, py, pz)
                if t >= 0.0 and t <= end:
                    return True
        if n_stack == 0:
            return False
        n_stack -= 1
        code = stack[n_stack]


@njit(cache=True, nogil=True)
def blocked_rays(
    origins, directions, longest, begin, end, center, corners, children, child_boxes,
    blocked,
):  # fmt: skip
    """``blocked[q]``: whether ray q hits anything within ``longest[q]`` world units."""
    stack = np.empty(STACK_SIZE, np.int32)
    for q in range(begin, end):
        ox, oy, oz = origins[q, 0] - center[0], origins[q, 1] - center[1], origins[q, 2] - center[2]
        slopes, length, shear = prepared(
            ox, oy, oz, directions[q, 0], directions[q, 1], directions[q, 2]
        )
        blocked[q] = is_below_in_the_way(
            *(np.int32(0), ox, oy, oz, slopes, shear, longest[q] / length),
            *(corners, children, child_boxes, stack),
        )
