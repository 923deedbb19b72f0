"""A tree over the boundary of an open mesh: pieces of loops, loops, groups of loops.

The boundary edges come as a sequence of closed loops. A tree node is a run of that sequence: whole
loops, or a piece of one. Its chain, closed by the chord from its last to its first vertex if it is
a piece, bounds the fan of triangles to the hub h, the centre of the chain's box. Seen from p, with
r = h - p and y measured from the hub, the fan's signed solid angle is the flux of
(r + y) / |r + y|^3, which is expanded in y:

    A.r / r^3  -  3 r^T T r / r^5,     A = sum of area vectors,  T = integral of n y^T

(the trace of T vanishes, as y lies in each triangle's plane). A term of order k is the derivative
of a Legendre term y^k P_k / r^(k+1), at most (k + 1) y^k / r^(k+2); so what is left out is at most

    S2 / r^4 (3 - 2 q) / (1 - q)^2,    S2 = integral of |y|^2,  q = R / r,  R = max |vertex - h|.

References: A. Barill, N. G. Dickson, R. Schmidt, D. I. W. Levin, A. Jacobson, "Fast winding
numbers for soups and clouds", 2018, doi:10.1145/3197517.3201337 (the expansion, over faces).
"""

import numpy as np
from numba import njit

LEAF_EDGES = 8
N_COLUMNS = 22

# Columns of a tree node's floats
LOW = 0  # 3: box of the chain
HIGH = 3  # 3
HUB = 6  # 3
AREA = 9  # 3: A
MOMENT = 12  # 6: T, symmetric part: xx yy zz xy xz yz
RADIUS = 18  # R
SECOND = 19  # S2
LENGTH = 20  # of the chain
FAN_AREA = 21  # sum of the fan's areas, each positive


@njit(cache=True, nogil=True)
def follow_loops(after, order, loop):
    """List edges loop by loop: ``order`` (h,) and ``loop`` (h,) int32; ``after[e]`` follows e."""
    done = np.zeros(len(after), np.bool_)
    n, n_loops = 0, 0
    for start in range(len(after)):
        e = start
        while not done[e]:
            done[e] = True
            order[n], loop[n] = e, n_loops
            n += 1
            e = after[e]
        n_loops = loop[n - 1] + 1
    return n_loops


@njit(cache=True, nogil=True)
def split_chain(loop, nodes):
    """Cut the sequence in two again and again; fill ``nodes`` (n, 5) in preorder, return n.

    ``loop`` (h,) int32 is the loop of each edge, loops in one piece. A run of several loops is cut
    between loops. A tree node holds: first and last (one past) edge, the node to go on with when
    this one is done, 1 for leaves, 1 for pieces of a loop. Call with ``nodes`` (2 h, 5).
    """
    stack = [(0, len(loop), -1)]
    parent = np.empty(len(nodes), np.int32)
    n = 0
    while len(stack) > 0:
        first, last, above = stack.pop()
        parent[n] = above
        whole = (first == 0 or loop[first - 1] != loop[first]) and (
            last == len(loop) or loop[last - 1] != loop[last]
        )
        nodes[n, 0], nodes[n, 1], nodes[n, 2] = first, last, 1
        nodes[n, 3] = 1 if last - first <= LEAF_EDGES else 0
        nodes[n, 4] = 0 if whole else 1
        if last - first > LEAF_EDGES:
            middle = (first + last) // 2
            if loop[first] != loop[last - 1]:
                low, high = middle, middle
                while low > first and loop[low - 1] == loop[low]:
                    low -= 1
                while high < last and loop[high - 1] == loop[high]:
                    high += 1
                near_low = low > first and (high >= last or middle - low <= high - middle)
                middle = low if near_low else high
            stack.append((middle, last, n))
            stack.append((first, middle, n))
        n += 1
    for node in range(n - 1, 0, -1):
        nodes[parent[node], 2] += nodes[node, 2]
    for node in range(n):
        nodes[node, 2] += node
    return n


@njit(cache=True, nogil=True)
def measure_nodes(points, chain, nodes, data):
    """Fill ``data`` (n, N_COLUMNS) float64 for the runs of ``chain`` (h, 2) int32 vertices."""
    for n in range(len(nodes)):
        first, last, is_piece = nodes[n, 0], nodes[n, 1], nodes[n, 4]
        box = data[n]
        box[:] = 0.0
        box[LOW : LOW + 3] = np.inf
        box[HIGH : HIGH + 3] = -np.inf
        for e in range(first, last):
            for end in range(2):
                for axis in range(3):
                    x = points[chain[e, end], axis]
                    box[LOW + axis] = min(box[LOW + axis], x)
                    box[HIGH + axis] = max(box[HIGH + axis], x)
        for axis in range(3):
            box[HUB + axis] = 0.5 * (box[LOW + axis] + box[HIGH + axis])
        for e in range(first, last + is_piece):
            # The last edge of a piece is the chord back to its first vertex
            v = chain[e, 0] if e < last else chain[last - 1, 1]
            w = chain[e, 1] if e < last else chain[first, 0]
            ax, bx = points[v, 0] - box[HUB], points[w, 0] - box[HUB]
            ay, by = points[v, 1] - box[HUB + 1], points[w, 1] - box[HUB + 1]
            az, bz = points[v, 2] - box[HUB + 2], points[w, 2] - box[HUB + 2]
            if e < last:
                squared = (bx - ax) ** 2 + (by - ay) ** 2 + (bz - az) ** 2
                box[LENGTH] += np.sqrt(squared)
            from_hub = ax * ax + ay * ay + az * az
            to_hub = bx * bx + by * by + bz * bz
            box[RADIUS] = max(box[RADIUS], np.sqrt(max(from_hub, to_hub)))
            area_x = 0.5 * (ay * bz - az * by)
            area_y = 0.5 * (az * bx - ax * bz)
            area_z = 0.5 * (ax * by - ay * bx)
            area = np.sqrt(area_x * area_x + area_y * area_y + area_z * area_z)
            x, y, z = (ax + bx) / 3.0, (ay + by) / 3.0, (az + bz) / 3.0
            box[AREA] += area_x
            box[AREA + 1] += area_y
            box[AREA + 2] += area_z
            box[MOMENT] += area_x * x
            box[MOMENT + 1] += area_y * y
            box[MOMENT + 2] += area_z * z
            box[MOMENT + 3] += 0.5 * (area_x * y + area_y * x)
            box[MOMENT + 4] += 0.5 * (area_x * z + area_z * x)
            box[MOMENT + 5] += 0.5 * (area_y * z + area_z * y)
            box[FAN_AREA] += area
            mixed = ax * bx + ay * by + az * bz
            box[SECOND] += area * (from_hub + to_hub + mixed) / 6.0
