"""Creases and corners near many points.

Both are found through trees of boxes as in `bvh`. Lengths are in voxels.
"""

import numpy as np
from numba import njit

from .bvh import EMPTY, STACK_SIZE
from .dual_arrays import place_of

MOST_LABELS = 12  # a loop has no more crossings
ANY = -1


@njit(cache=True, nogil=True)
def mark_loops(loops, normals, labels, is_curved, cosine, begin, end, is_marked):
    """Mark the loops that see two regions, or two normals with a cosine less than that.

    Normals are compared in loops marked as curved alone; unknown labels (-1) and normals are none.
    """
    for l in range(begin, end):  # noqa: E741
        first, last = loops.start[l], loops.start[l + 1]
        found, label = False, np.int32(-1)
        for s in range(first, last):
            other = labels[loops.sides[s]]
            found |= label >= 0 and other >= 0 and other != label
            label = max(label, other)
            if not is_curved[l]:
                continue
            a = normals[loops.sides[s]]
            for t in range(first, s):
                b = normals[loops.sides[t]]
                dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
                aa = a[0] * a[0] + a[1] * a[1] + a[2] * a[2]
                bb = b[0] * b[0] + b[1] * b[1] + b[2] * b[2]
                found |= dot < cosine and aa * bb > 0.5
        is_marked[l] = found


@njit(cache=True, nogil=True)
def list_labels(loops, labels, chosen, seen, n_seen):
    """``seen[n, :n_seen[n]]`` (n, 12) = the different labels of loop ``chosen[n]``, without -1."""
    for n in range(len(chosen)):
        n_seen[n] = 0
        for s in range(loops.start[chosen[n]], loops.start[chosen[n] + 1]):
            label = labels[loops.sides[s]]
            is_new = label >= 0
            for i in range(n_seen[n]):
                is_new &= seen[n, i] != label
            if is_new:
                seen[n, n_seen[n]] = label
                n_seen[n] += 1


@njit(cache=True, nogil=True)
def measure_fit(loops, crossings, chosen, places, outside, misfit):
    """How far ``places[n]`` lies outside the cell of loop ``chosen[n]``, and from its planes.

    Outside is measured along the axis where that is most; of the planes the farthest counts.
    """
    p = np.empty(3)
    for n in range(len(chosen)):
        cell, x = loops.cells[chosen[n]], places[n]
        outside[n], misfit[n] = 0.0, 0.0
        for k in range(3):
            outside[n] = max(outside[n], cell[k] - x[k], x[k] - cell[k] - 1.0)
        for s in range(loops.start[chosen[n]], loops.start[chosen[n] + 1]):
            place_of(crossings, loops.sides[s], p)
            d = 0.0
            for k in range(3):
                d += crossings.normals[loops.sides[s], k] * (x[k] - p[k])
            misfit[n] = max(misfit[n], abs(d))


@njit(cache=True, nogil=True)
def _box_square(boxes, at, x):
    """Squared distance from x to a box of a tree."""
    total = 0.0
    for k in range(3):
        d = max(boxes[at + k] - x[k], x[k] - boxes[at + 3 + k], 0.0)
        total += d * d
    return total


@njit(cache=True, nogil=True)
def nearest_creases(features, places, pairs, limits, begin, end, feet, squares):
    """The nearest point of a crease between two regions to ``places[n]``, begin <= n < end.

    ``pairs`` (n, 2): the regions, the lower first, or one and ANY. ``squares[n]`` is infinite when
    none is as near as ``limits[n]``, both squared distances.
    """
    tree, stack = features.crease_tree, np.empty(STACK_SIZE, np.int32)
    foot = np.empty(3)
    for n in range(begin, end):
        a, b, x = pairs[n, 0], pairs[n, 1], places[n]
        best, squares[n] = limits[n], np.inf
        stack[0] = 0
        n_stack = 1
        while n_stack > 0:
            n_stack -= 1
            node = stack[n_stack]
            for side in range(2):
                child = tree.children[node, side]
                if child == EMPTY or _box_square(tree.boxes[node], 6 * side, x) > best:
                    continue
                if child >= 0:
                    stack[n_stack] = child
                    n_stack += 1
                    continue
                first = (-2 - child) >> 3
                for s in range(first, first + ((-2 - child) & 7) + 1):
                    e = tree.order[s]
                    low, high = features.sides[e, 0], features.sides[e, 1]
                    if not (low == a and high == b) and not (b == ANY and (low == a or high == a)):
                        continue
                    # The nearest point of the segment
                    p = features.points[features.creases[e, 0]]
                    q = features.points[features.creases[e, 1]]
                    length, along, square = 0.0, 0.0, 0.0
                    for k in range(3):
                        length += (q[k] - p[k]) ** 2
                        along += (q[k] - p[k]) * (x[k] - p[k])
                    t = min(max(along / length, 0.0), 1.0) if length > 0.0 else 0.0
                    for k in range(3):
                        foot[k] = p[k] + t * (q[k] - p[k]) if t < 1.0 else q[k]
                        square += (x[k] - foot[k]) ** 2
                    if square <= best:
                        best = squares[n] = square
                        for k in range(3):
                            feet[n, k] = foot[k]


@njit(cache=True, nogil=True)
def nearest_corners(features, places, seen, n_seen, least, limit, begin, end, feet, squares):
    """The corner with the most of the labels seen, at least ``least``; of those the nearest.

    ``squares[n]`` is infinite when none is as near as ``limit``, both squared distances.
    """
    tree, stack = features.corner_tree, np.empty(STACK_SIZE, np.int32)
    for n in range(begin, end):
        x = places[n]
        most, best, squares[n] = least, limit, np.inf
        stack[0] = 0
        n_stack = 1
        while n_stack > 0:
            n_stack -= 1
            node = stack[n_stack]
            for side in range(2):
                child = tree.children[node, side]
                if child == EMPTY or _box_square(tree.boxes[node], 6 * side, x) > limit:
                    continue
                if child >= 0:
                    stack[n_stack] = child
                    n_stack += 1
                    continue
                first = (-2 - child) >> 3
                for s in range(first, first + ((-2 - child) & 7) + 1):
                    corner = tree.order[s]
                    common, square = 0, 0.0
                    for t in range(
                        features.corner_start[corner], features.corner_start[corner + 1]
                    ):
                        for i in range(n_seen[n]):
                            common += features.corner_labels[t] == seen[n, i]
                    p = features.points[features.corners[corner]]
                    for k in range(3):
                        square += (x[k] - p[k]) ** 2
                    if common > most or (common == most and square <= best):
                        most, best, squares[n] = common, square, square
                        for k in range(3):
                            feet[n, k] = p[k]
