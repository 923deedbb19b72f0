"""Two linear functions on a triangle that the distance to a mesh lies between, wherever it is.

Above: the distance to one face F is convex, so on the triangle it is at most the linear function
with the same values at the corners. F is the closest face of a corner or of the centroid c.

Below: the distance to a convex set K is at least n . p - max over K of n . k for every unit vector
n, with equality at c for n from c's foot on K towards c. The least of such functions over all faces
is a lower bound of the distance; as a minimum of linear functions it is concave, so the linear
function with its values at the corners is below it. Of the directions to c from the face's own
foot, to c from the foot on the mesh, and across the face, the one that lowers the corners least is
taken: the second sees that whatever lies behind the tangent plane of a convex body does not matter.

The tree rules whole boxes out by the same bound, a box being convex; what is above the upper
function at all corners matters nowhere. Both functions are of second order in the size of the
triangle against the distance. If more than ``MAX_VISITS`` boxes are in question, the bounds of
the boxes stand for what is in them.

Rounding: any n will do, as the maximum over K is computed anew, so only that |n| is 1 to 4 u and
three scalar products count: less than 64 u S, S the size of all coordinates.
"""

import numpy as np
from numba import njit

from .point_triangle import barycentric_foot, squared_distance

STACK_SIZE = 128
MAX_VISITS = 256


@njit(cache=True, nogil=True)
def tangent_bounds(
    pieces,
    slots,
    begin,
    end,
    frames,
    corners,
    order,
    children,
    child_boxes,
    lower,
    upper,
):
    """``lower[n]``, ``upper[n]`` (3,): corner values of the bounds on ``pieces[n]`` (3, 3).

    ``slots[n]`` (4,) are the closest faces of the corners and of the centroid. Lower values may be
    negative.
    """
    center, toward, normal = np.empty(3), np.empty(3), np.empty(3)
    found, best = np.empty(3), np.empty(3)
    stack = np.empty(STACK_SIZE, np.int32)
    for n in range(begin, end):
        piece = pieces[n]
        for axis in range(3):
            center[axis] = (piece[0, axis] + piece[1, axis] + piece[2, axis]) / 3.0
        _upper(piece, slots[n], frames, upper[n])
        for i in range(3):
            lower[n, i] = upper[n, i]
        if not _direction_to(center, slots[n, 3], frames, corners, order, toward):
            for axis in range(3):
                toward[axis] = frames[slots[n, 3], 9 + axis]
        n_stack, n_visits = 1, 0
        stack[0] = 0
        while n_stack > 0:
            n_stack -= 1
            node = stack[n_stack]
            for side in range(2):
                code = children[node, side]
                if code == -1:
                    continue
                n_visits += 1
                _box_bound(piece, center, child_boxes[node], 6 * side, toward, normal, found)
                if _is_above(found, lower[n]):
                    continue
                if code >= 0 and n_visits < MAX_VISITS and n_stack < STACK_SIZE:
                    stack[n_stack] = code
                    n_stack += 1
                elif code >= 0 or n_visits >= MAX_VISITS:
                    _lower(found, lower[n])
                else:
                    leaf = -2 - code
                    first = leaf >> 3
                    for s in range(first, first + (leaf & 7) + 1):
                        _face_bound(
                            piece, center, s, frames, corners, order, toward, normal, lower[n],
                            found, best,
                        )  # fmt: skip
                        _lower(best, lower[n])


@njit(cache=True, nogil=True)
def _upper(piece, slots, frames, upper):
    """Distances of the corners to that closest face where they are least on the average."""
    least = np.inf
    for c in range(4):
        frame = frames[slots[c]]
        a = np.sqrt(squared_distance(frame, piece[0, 0], piece[0, 1], piece[0, 2], np.inf))
        b = np.sqrt(squared_distance(frame, piece[1, 0], piece[1, 1], piece[1, 2], np.inf))
        d = np.sqrt(squared_distance(frame, piece[2, 0], piece[2, 1], piece[2, 2], np.inf))
        if a + b + d < least:
            least = a + b + d
            upper[0], upper[1], upper[2] = a, b, d


@njit(cache=True, nogil=True)
def _direction_to(center, slot, frames, corners, order, normal):
    """Unit vector from the foot of ``center`` on a face to it; False if they coincide."""
    u, v, w = barycentric_foot(frames[slot], center[0], center[1], center[2])
    face = order[slot]
    for axis in range(3):
        normal[axis] = center[axis] - (
            u * corners[face, 0, axis] + v * corners[face, 1, axis] + w * corners[face, 2, axis]
        )
    return _normalize(normal)


@njit(cache=True, nogil=True)
def _normalize(normal):
    length = np.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)
    if length < 1e-150:
        return False
    normal[0], normal[1], normal[2] = normal[0] / length, normal[1] / length, normal[2] / length
    return True


@njit(cache=True, nogil=True)
def _box_bound(piece, center, boxes, at, toward, normal, found):
    """The better of two bounds for what is in a box."""
    for axis in range(3):
        x = center[axis]
        normal[axis] = x - min(max(x, boxes[at + axis]), boxes[at + 3 + axis])
    has_own = _normalize(normal)
    total = -np.inf
    for trial in range(2):
        if trial == 1 and not has_own:
            break
        way = toward if trial == 0 else normal
        top = 0.0
        for axis in range(3):
            top += max(way[axis] * boxes[at + axis], way[axis] * boxes[at + 3 + axis])
        a = _dot(way, piece[0]) - top
        b = _dot(way, piece[1]) - top
        c = _dot(way, piece[2]) - top
        if a + b + c > total:
            total = a + b + c
            found[0], found[1], found[2] = a, b, c


@njit(cache=True, nogil=True)
def _face_bound(
    piece, center, slot, frames, corners, order, toward, normal, lower, found, best
):  # fmt: skip
    """The bound for a face that lowers ``lower`` least."""
    least = np.inf
    for trial in range(4):
        way = toward
        if trial == 1:
            if not _direction_to(center, slot, frames, corners, order, normal):
                continue
            way = normal
        elif trial >= 2:
            sign = 1.0 if trial == 2 else -1.0
            for axis in range(3):
                normal[axis] = sign * frames[slot, 9 + axis]
            way = normal
        face = order[slot]
        top = max(
            _dot(way, corners[face, 0]), _dot(way, corners[face, 1]), _dot(way, corners[face, 2])
        )
        loss = 0.0
        for i in range(3):
            found[i] = _dot(way, piece[i]) - top
            loss += max(lower[i] - found[i], 0.0)
        if loss < least:
            least = loss
            best[0], best[1], best[2] = found[0], found[1], found[2]
        if least == 0.0:
            return


@njit(cache=True, nogil=True)
def _is_above(found, lower):
    return found[0] >= lower[0] and found[1] >= lower[1] and found[2] >= lower[2]


@njit(cache=True, nogil=True)
def _lower(found, lower):
    for i in range(3):
        lower[i] = min(lower[i], found[i])


@njit(cache=True, nogil=True)
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
