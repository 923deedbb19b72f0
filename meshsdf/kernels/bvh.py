"""A tree of boxes over triangles, and the closest triangle to many points.

Build: top down, binned surface-area heuristic along the longest side of the centroids' box (Wald
2007, doi:10.1109/RT.2007.4342588), leaves of at most ``LEAF_SIZE`` triangles. Every node holds the
boxes of both its children, so one cache line decides where to go.

Query: depth first, near child first, starting from the answer to the previous query: points come
in Morton order, so the first bound is already close.

The answer is the smallest (computed squared distance, face index) over *all* triangles, bit for
bit, whatever the order of the queries: boxes are float32, padded by ``PAD`` of the coordinates'
size, far more than any rounding of the distance to what they hold, and the distance to a box is
lowered by the relative ``SLACK`` before it may rule a box out.
"""

import numpy as np
from numba import njit

from .point_triangle import barycentric_foot, squared_distance

LEAF_SIZE = 4
N_BINS = 16
MAX_BINNED_DEPTH = 48  # deeper, halves only: at most 31 more levels for 2**31 triangles
STACK_SIZE = 128
PAD = 2.0**-23  # times the largest |coordinate|; float32 rounding is half of it
SLACK = 1.0 - 2.0**-46  # 2 * (1 rounding per difference, square and sum) is below 2**-49
EMPTY = -1
TINY = 1e-30  # extents below it have no float32 reciprocal; halve without looking


@njit(cache=True, nogil=True)
def triangle_boxes(corners, pad, boxes):
    """``boxes[f]`` = (lower xyz, upper xyz) of triangle f, float32, grown by ``pad``."""
    for f in range(len(corners)):
        for axis in range(3):
            a, b, c = corners[f, 0, axis], corners[f, 1, axis], corners[f, 2, axis]
            boxes[f, axis] = min(a, b, c) - pad
            boxes[f, 3 + axis] = max(a, b, c) + pad


@njit(cache=True, nogil=True)
def build_tree(boxes, order, children, child_boxes):
    """Fill ``order``, ``children`` (nodes, 2) and ``child_boxes`` (nodes, 12); return n of nodes.

    ``boxes`` (m, 6) is permuted along with ``order``. A child is a node (>= 0) or a leaf:
    ``-2 - (8 * first + count - 1)``, or EMPTY.
    """
    m = len(boxes)
    for s in range(m):
        order[s] = s
    for side in range(2):
        children[0, side] = EMPTY
        for axis in range(3):
            child_boxes[0, 6 * side + axis] = np.inf
            child_boxes[0, 6 * side + 3 + axis] = -np.inf
    # Each task: fill side ``slot & 1`` of node ``slot >> 1`` with triangles first..last
    task_slot = np.empty(STACK_SIZE, np.int64)
    task_first = np.empty(STACK_SIZE, np.int64)
    task_last = np.empty(STACK_SIZE, np.int64)
    task_depth = np.empty(STACK_SIZE, np.int64)
    bin_count = np.empty(N_BINS, np.int64)
    bin_box = np.empty((N_BINS, 6), np.float32)
    right_cost = np.empty(N_BINS, np.float64)
    middle = np.empty(6, np.float32)  # box of the doubled centroids
    box = np.empty(6, np.float32)
    task_slot[0], task_first[0], task_last[0], task_depth[0] = 0, 0, m, 0
    n_tasks, n_nodes = 1, 1
    while n_tasks > 0:
        n_tasks -= 1
        slot, first, last = task_slot[n_tasks], task_first[n_tasks], task_last[n_tasks]
        depth = task_depth[n_tasks]
        # The box of the triangles and that of their centroids
        _reset(box)
        _reset(middle)
        for s in range(first, last):
            for axis in range(3):
                lower, upper = boxes[s, axis], boxes[s, 3 + axis]
                box[axis] = min(box[axis], lower)
                box[3 + axis] = max(box[3 + axis], upper)
                middle[axis] = min(middle[axis], lower + upper)
                middle[3 + axis] = max(middle[3 + axis], lower + upper)
        node, side = slot >> 1, slot & 1
        for axis in range(6):
            child_boxes[node, 6 * side + axis] = box[axis]
        if last - first <= LEAF_SIZE:
            children[node, side] = -2 - (8 * first + last - first - 1)
            continue
        # Bin the centroids along their longest side
        axis = 0
        for other in range(1, 3):
            if middle[3 + other] - middle[other] > middle[3 + axis] - middle[axis]:
                axis = other
        start, extent = middle[axis], middle[3 + axis] - middle[axis]
        half = (first + last) // 2
        if extent > TINY and depth < MAX_BINNED_DEPTH:
            scale = np.float32(N_BINS) * np.float32(0.9999) / extent
            for b in range(N_BINS):
                bin_count[b] = 0
                _reset(bin_box[b])
            for s in range(first, last):
                b = int((boxes[s, axis] + boxes[s, 3 + axis] - start) * scale)
                bin_count[b] += 1
                _grow(bin_box[b], boxes[s])
            # Cost of a cut before bin b: area * count on both sides
            _reset(box)
            count = 0
            for b in range(N_BINS - 1, 0, -1):
                _grow(box, bin_box[b])
                count += bin_count[b]
                right_cost[b] = _half_area(box) * count if count > 0 else 0.0
            _reset(box)
            count, best_cut, least = 0, 0, np.inf
            for b in range(1, N_BINS):
                _grow(box, bin_box[b - 1])
                count += bin_count[b - 1]
                if 0 < count < last - first:
                    cost = _half_area(box) * count + right_cost[b]
                    if cost < least:
                        best_cut, least = b, cost
            # Move the triangles before the cut to the front
            back = last - 1
            if best_cut > 0:
                half = first
            while best_cut > 0 and half <= back:
                b = int((boxes[half, axis] + boxes[half, 3 + axis] - start) * scale)
                if b < best_cut:
                    half += 1
                else:
                    order[half], order[back] = order[back], order[half]
                    for number in range(6):
                        keep = boxes[half, number]
                        boxes[half, number] = boxes[back, number]
                        boxes[back, number] = keep
                    back -= 1
        new = n_nodes
        n_nodes += 1
        children[node, side] = new
        for side in range(2):
            task_slot[n_tasks] = 2 * new + side
            task_first[n_tasks] = first if side == 0 else half
            task_last[n_tasks] = half if side == 0 else last
            task_depth[n_tasks] = depth + 1
            n_tasks += 1
    return n_nodes


@njit(cache=True, nogil=True)
def _reset(box):
    for axis in range(3):
        box[axis] = np.inf
        box[3 + axis] = -np.inf


@njit(cache=True, nogil=True)
def _grow(box, other):
    for axis in range(3):
        box[axis] = min(box[axis], other[axis])
        box[3 + axis] = max(box[3 + axis], other[3 + axis])


@njit(cache=True, nogil=True)
def _half_area(box):
    a, b, c = box[3] - box[0], box[4] - box[1], box[5] - box[2]
    return a * b + b * c + c * a


@njit(cache=True, nogil=True)
def _box_distance(boxes, first, px, py, pz):
    """Squared distance of p to the box, lowered so that rounding cannot raise it."""
    dx = max(boxes[first] - px, px - boxes[first + 3], 0.0)
    dy = max(boxes[first + 1] - py, py - boxes[first + 4], 0.0)
    dz = max(boxes[first + 2] - pz, pz - boxes[first + 5], 0.0)
    return (dx * dx + dy * dy + dz * dz) * SLACK


@njit(cache=True, nogil=True)
def closest_slots(
    points, sequence, begin, end, seeds, frames, order, children, child_boxes, squares, slots
):
    """Squared distance and slot of the closest triangle for ``points[sequence[begin:end]]``.

    ``seeds`` is empty or holds a slot per point to start from; any slot is right, a near one fast.
    """
    stack_code = np.empty(STACK_SIZE, np.int32)
    stack_square = np.empty(STACK_SIZE, np.float64)
    slot = 0
    for n in range(begin, end):
        q = sequence[n]
        px, py, pz = points[q, 0], points[q, 1], points[q, 2]
        # Start from the previous answer, or from the seed if that is nearer
        best = squared_distance(frames[slot], px, py, pz, np.inf)
        if len(seeds) > 0 and seeds[q] != slot:
            square = squared_distance(frames[seeds[q]], px, py, pz, best)
            if square < best or (square == best and order[seeds[q]] < order[slot]):
                best, slot = square, seeds[q]
        n_stack, code = 0, np.int32(0)
        while True:
            if code >= 0:
                boxes = child_boxes[code]
                near, far = children[code, 0], children[code, 1]
                near_square = _box_distance(boxes, 0, px, py, pz)
                far_square = _box_distance(boxes, 6, px, py, pz)
                if far_square < near_square:
                    near, far = far, near
                    near_square, far_square = far_square, near_square
                if far_square <= best:
                    stack_code[n_stack] = far
                    stack_square[n_stack] = far_square
                    n_stack += 1
                if near_square <= best:
                    code = near
                    continue
            else:
                leaf = -2 - code
                first = leaf >> 3
                for s in range(first, first + (leaf & 7) + 1):
                    square = squared_distance(frames[s], px, py, pz, best)
                    if square < best or (square == best and order[s] < order[slot]):
                        best, slot = square, s
            while n_stack > 0 and stack_square[n_stack - 1] > best:
                n_stack -= 1
            if n_stack == 0:
                break
            n_stack -= 1
            code = stack_code[n_stack]
        squares[q] = best
        slots[q] = slot


@njit(cache=True, nogil=True)
def closest_details(points, begin, end, slots, frames, order, corners, faces, weights, feet):
    """Face index, barycentrics and closest point, from the slots that `closest_slots` found."""
    for q in range(begin, end):
        face = order[slots[q]]
        faces[q] = face
        u, v, w = barycentric_foot(frames[slots[q]], points[q, 0], points[q, 1], points[q, 2])
        weights[q, 0], weights[q, 1], weights[q, 2] = u, v, w
        a, b, c = corners[face, 0], corners[face, 1], corners[face, 2]
        for axis in range(3):
            feet[q, axis] = u * a[axis] + v * b[axis] + w * c[axis]


@njit(cache=True, nogil=True)
def morton_codes(points, lower, scale, codes):
    """``codes[n]`` = 30-bit Morton code of the cell ``(points[n] - lower) * scale`` of 1024³."""
    for n in range(len(points)):
        code = np.uint32(0)
        for axis in range(3):
            cell = np.uint32(min(max((points[n, axis] - lower[axis]) * scale, 0.0), 1023.0))
            # Spread ten bits three apart
            cell = (cell | (cell << np.uint32(16))) & np.uint32(0x030000FF)
            cell = (cell | (cell << np.uint32(8))) & np.uint32(0x0300F00F)
            cell = (cell | (cell << np.uint32(4))) & np.uint32(0x030C30C3)
            cell = (cell | (cell << np.uint32(2))) & np.uint32(0x09249249)
            code |= cell << np.uint32(axis)
        codes[n] = code
