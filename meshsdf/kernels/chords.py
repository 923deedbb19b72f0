"""Where straight lines beside a flat region meet its creases. Lengths are in voxels."""

import numpy as np
from numba import njit

from .bvh import EMPTY, STACK_SIZE

MOST_CUTS = 32
MOST_CORNERS = 6
TOUCH = 1e-9  # of a chord's length: so near to it a crease's end lies on it


@njit(cache=True, nogil=True)
def _list_creases(features, label, p, q, grown, stack, found):
    """List the creases of a region in the box around p and q; return how many."""
    tree = features.crease_tree
    n_found, n_stack = 0, 1
    stack[0] = 0
    while n_stack > 0:
        n_stack -= 1
        node = stack[n_stack]
        for side in range(2):
            child = tree.children[node, side]
            if child == EMPTY:
                continue
            box, meets = tree.boxes[node], True
            for k in range(3):
                meets &= box[6 * side + k] <= max(p[k], q[k]) + grown
                meets &= box[6 * side + 3 + k] >= min(p[k], q[k]) - grown
            if not meets:
                continue
            if child >= 0:
                stack[n_stack] = child
                n_stack += 1
                continue
            first = (-2 - child) >> 3
            for s in range(first, first + ((-2 - child) & 7) + 1):
                e = tree.order[s]
                is_side = features.sides[e, 0] == label or features.sides[e, 1] == label
                if is_side and n_found < len(found):
                    found[n_found] = e
                    n_found += 1
    return n_found


@njit(cache=True, nogil=True)
def cut_chords(features, labels, normals, starts, stops, begin, end, cuts, n_cuts):
    """``cuts[n, :n_cuts[n]]`` (n, 32): where chords meet the creases of their flat regions.

    As shares of the length from ``starts[n]`` to ``stops[n]``, in rising order, without the ends.
    """
    stack, found = np.empty(STACK_SIZE, np.int32), np.empty(MOST_CUTS, np.int32)
    for n in range(begin, end):
        p, q, n_cuts[n] = starts[n], stops[n], 0
        # Seen along the axis that is steepest on the plane
        drop = 0
        for k in range(1, 3):
            if abs(normals[n, k]) > abs(normals[n, drop]):
                drop = k
        u, v = (drop + 1) % 3, (drop + 2) % 3
        du, dv = q[u] - p[u], q[v] - p[v]
        square = du * du + dv * dv
        if square == 0.0:
            continue
        near = TOUCH * np.sqrt(square)
        n_found = _list_creases(features, labels[n], p, q, 1e-6, stack, found)
        for i in range(n_found):
            a = features.points[features.creases[found[i], 0]]
            b = features.points[features.creases[found[i], 1]]
            side_a = du * (a[v] - p[v]) - dv * (a[u] - p[u])
            side_b = du * (b[v] - p[v]) - dv * (b[u] - p[u])
            if min(side_a, side_b) > near or max(side_a, side_b) < -near:
                continue
            along = (du * (a[u] - p[u]) + dv * (a[v] - p[v])) / square
            other = (du * (b[u] - p[u]) + dv * (b[v] - p[v])) / square
            if abs(side_a - side_b) > 2.0 * near:
                share = min(max(side_a / (side_a - side_b), 0.0), 1.0)
                along = other = along + share * (other - along)
            for _ in range(2):
                if 0.0 < along < 1.0 and n_cuts[n] < MOST_CUTS:
                    m = n_cuts[n]
                    while m > 0 and cuts[n, m - 1] > along:
                        cuts[n, m] = cuts[n, m - 1]
                        m -= 1
                    cuts[n, m] = along
                    n_cuts[n] += 1
                along = other


@njit(cache=True, nogil=True)
def corners_around(features, labels, starts, stops, reach, corners):
    """``corners[n]`` (n, 6) int32: vertices on creases of the region, the least detour first.

    Only those within ``reach`` of the box around the chord are looked at.
    """
    stack, found = np.empty(STACK_SIZE, np.int32), np.empty(4 * MOST_CUTS, np.int32)
    detour = np.empty(MOST_CORNERS)
    for n in range(len(labels)):
        p, q = starts[n], stops[n]
        for m in range(MOST_CORNERS):
            corners[n, m], detour[m] = -1, np.inf
        n_found = _list_creases(features, labels[n], p, q, reach, stack, found)
        for i in range(2 * n_found):
            vertex = features.creases[found[i >> 1], i & 1]
            x = features.points[vertex]
            here, there = 0.0, 0.0
            for k in range(3):
                here += (x[k] - p[k]) ** 2
                there += (x[k] - q[k]) ** 2
            length = np.sqrt(here) + np.sqrt(there)
            known = min(here, there) < TOUCH * TOUCH
            for m in range(MOST_CORNERS):
                known |= corners[n, m] == vertex
            m = MOST_CORNERS
            while not known and m > 0 and length < detour[m - 1]:
                m -= 1
                if m + 1 < MOST_CORNERS:
                    corners[n, m + 1], detour[m + 1] = corners[n, m], detour[m]
                corners[n, m], detour[m] = vertex, length
