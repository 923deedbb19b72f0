"""Exact distances at all nodes of a grid that a narrow band leaves out.

The grid is cut into blocks of 16^3 nodes. Each lists once, from the tree, the triangles that can
be closest to any of its nodes; its 8^3, 4^3 and 2^3 parts shorten that list step by step, by the
rules proved in `far_lists`. The eight nodes of a 2^3 part then measure every triangle left, side
by side. Nothing is propagated from node to node: the answer is the least distance over *all*
triangles, within the rounding that `point_triangle` states (the same frame and the same formulas
but for the order of sums).

Nodes that the band holds are copied from it; where it has no brick it still knows the side.
"""

import numpy as np
from numba import njit

from .brick_lookup import INSIDE, find_brick
from .far_lists import ETA, N_ROWS, foot, gather, keep, score, select
from .point_triangle import H, L, M

BLOCK = 16


@njit(cache=True, nogil=True)
def edge_inverses(frames, inverses):
    """``inverses[s]`` = one over the squared length of both shorter edges; 0 for length 0."""
    for s in range(len(frames)):
        l, m, h = frames[s, L], frames[s, M], frames[s, H]  # noqa: E741
        left, right = m * m + h * h, (l - m) * (l - m) + h * h
        inverses[s, 0] = 1.0 / left if left > 0.0 else 0.0
        inverses[s, 1] = 1.0 / right if right > 0.0 else 0.0


@njit(cache=True, nogil=True)
def _measure(frame, left, right, nodes):
    """Lower ``nodes[24:32]`` to the squared distances of the nodes (x: 0-7, y: 8-15, z: 16-23).

    One array, a constant count and no other load in the loop: so it becomes vector instructions.
    """
    ax, ay, az = frame[0], frame[1], frame[2]
    ux, uy, uz = frame[3], frame[4], frame[5]
    vx, vy, vz = frame[6], frame[7], frame[8]
    nx, ny, nz = frame[9], frame[10], frame[11]
    l, m, h = frame[L], frame[M], frame[H]  # noqa: E741
    rest = l - m
    for n in range(8):
        dx, dy, dz = nodes[n] - ax, nodes[8 + n] - ay, nodes[16 + n] - az
        x = dx * ux + dy * uy + dz * uz
        y = dx * vx + dy * vy + dz * vz
        z = dx * nx + dy * ny + dz * nz
        back = l - x
        # Base, left and right edge; then the face
        e = x - min(max(x, 0.0), l)
        square = e * e + y * y
        t = min(max((x * m + y * h) * left, 0.0), 1.0)
        e, f = x - t * m, y - t * h
        square = min(square, e * e + f * f)
        t = min(max((back * rest + y * h) * right, 0.0), 1.0)
        e, f = back - t * rest, y - t * h
        square = min(square, e * e + f * f)
        inner = min(min(y, x * h - y * m), back * h - y * rest)
        square = 0.0 if inner > 0.0 else square
        nodes[24 + n] = min(nodes[24 + n], square + z * z)


@njit(cache=True, nogil=True)
def _place(xs, ys, zs, low, high, c, half):
    """Centre and half sides of the box around nodes low..high - 1."""
    c[0], half[0] = 0.5 * (xs[low[0]] + xs[high[0] - 1]), 0.5 * (xs[high[0] - 1] - xs[low[0]])
    c[1], half[1] = 0.5 * (ys[low[1]] + ys[high[1] - 1]), 0.5 * (ys[high[1] - 1] - ys[low[1]])
    c[2], half[2] = 0.5 * (zs[low[2]] + zs[high[2] - 1]), 0.5 * (zs[high[2] - 1] - zs[low[2]])


@njit(cache=True, nogil=True)
def _part(out, first, size, number, background, low, high):
    """Set low..high to one of the eight parts at ``first``; say whether any node there is far."""
    for axis in range(3):
        begin = first[axis] + size * ((number >> (2 - axis)) & 1)
        low[axis], high[axis] = max(begin, 0), min(begin + size, out.shape[axis])
    for i in range(low[0], high[0]):
        for j in range(low[1], high[1]):
            for k in range(low[2], high[2]):
                if abs(out[i, j, k]) >= background:
                    return True
    return False


@njit(cache=True, nogil=True)
def _copy_band(first, root, pages, values, background, brick0, out):
    """Fill a block with the band's values, +-background where it has none; count the latter."""
    n_far = 0
    for number in range(8):
        b = (
            first[0] + 8 * (number >> 2),
            first[1] + 8 * ((number >> 1) & 1),
            first[2] + 8 * (number & 1),
        )
        bx, by, bz = (b[0] >> 3) + brick0[0], (b[1] >> 3) + brick0[1], (b[2] >> 3) + brick0[2]
        slot = find_brick(root, pages, bx, by, bz)
        value = -background if slot == INSIDE else background
        for i in range(max(b[0], 0), min(b[0] + 8, out.shape[0])):
            for j in range(max(b[1], 0), min(b[1] + 8, out.shape[1])):
                for k in range(max(b[2], 0), min(b[2] + 8, out.shape[2])):
                    if slot >= 0:
                        value = values[slot, i - b[0], j - b[1], k - b[2]]
                    out[i, j, k] = value
                    n_far += abs(value) >= background
    return n_far


@njit(cache=True, nogil=True)
def _measure_part(
    xs, ys, zs, low, high, slots, chosen, n_chosen, frames, inverses, nodes, background, out
):
    """Write the distances of the far nodes of a 2^3 part, from the triangles it needs."""
    for n in range(8):
        nodes[n] = xs[min(low[0] + (n >> 2), high[0] - 1)]
        nodes[8 + n] = ys[min(low[1] + ((n >> 1) & 1), high[1] - 1)]
        nodes[16 + n] = zs[min(low[2] + (n & 1), high[2] - 1)]
        nodes[24 + n] = np.inf
    for number in range(n_chosen):
        s = slots[chosen[number]]
        _measure(frames[s], inverses[s, 0], inverses[s, 1], nodes)
    for n in range(8):
        i, j, k = low[0] + (n >> 2), low[1] + ((n >> 1) & 1), low[2] + (n & 1)
        if i < high[0] and j < high[1] and k < high[2] and abs(out[i, j, k]) >= background:
            distance = np.sqrt(nodes[24 + n])
            out[i, j, k] = -distance if out[i, j, k] < 0.0 else distance


@njit(cache=True, nogil=True)
def fill_blocks(
    firsts, seeds, begin, end, xs, ys, zs, scale, margin, frames, inverses, corners, children,
    child_boxes, root, pages, values, background, brick0, out,
):  # fmt: skip
    """Fill the blocks begin..end of ``out`` with signed distances.

    Parameters
    ----------
    firsts : (b, 3) int64
        First node of every block, relative to ``out`` (negative where the block begins before
        it), on a brick's border: brick ``(first >> 3) + brick0`` of the band's index.
    seeds : (b,) int32
        A triangle (slot) near the block's centre: its foot is the first witness.
    xs, ys, zs : float64
        Coordinates of the nodes along each axis, as those of ``corners`` (m, 3, 3), by slot.
    scale, margin : float
        Voxels per unit; bound on the rounding of differences of squares.
    """
    m = len(frames)
    rows, slots = np.empty((N_ROWS, 3 * m), np.float32), np.empty(3 * m, np.int32)
    scores, chosen = np.empty(m, np.float32), np.empty(m + 1, np.int32)
    c, half, q, origin = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    low, high = np.empty(3, np.int64), np.empty(3, np.int64)
    nodes = np.empty(32)
    first8, first4 = np.empty(3, np.int64), np.empty(3, np.int64)
    for b in range(begin, end):
        first = firsts[b]
        if _copy_band(first, root, pages, values, background, brick0, out) == 0:
            continue
        for axis in range(3):
            low[axis], high[axis] = (
                max(first[axis], 0),
                min(first[axis] + BLOCK, out.shape[axis]),
            )
        _place(xs, ys, zs, low, high, c, half)
        origin[:] = c
        foot(frames[seeds[b]], c, q)
        n1, reach = gather(corners, children, child_boxes, c, half, q, margin, scale, rows, slots)
        for axis in range(3):
            reach = max(reach, half[axis] * scale)
        eta = ETA * reach
        bound = np.float32(eta * reach + margin * scale * scale)
        for eight in range(8):
            if not _part(out, first, 8, eight, background, low, high):
                continue
            for axis in range(3):
                first8[axis] = first[axis] + 8 * ((eight >> (2 - axis)) & 1)
            _place(xs, ys, zs, low, high, c, half)
            score(rows, slots, 0, n1, frames, origin, scale, eta, c, half, q, scores)
            n2 = keep(rows, slots, 0, n1, frames, scale, bound, margin, c, half, q, scores, chosen)
            for four in range(8):
                if not _part(out, first8, 4, four, background, low, high):
                    continue
                for axis in range(3):
                    first4[axis] = first8[axis] + 4 * ((four >> (2 - axis)) & 1)
                _place(xs, ys, zs, low, high, c, half)
                score(rows, slots, n1, n2, frames, origin, scale, eta, c, half, q, scores)
                n3 = keep(
                    rows, slots, n1, n2, frames, scale, bound, margin, c, half, q, scores, chosen
                )
                for two in range(8):
                    if not _part(out, first4, 2, two, background, low, high):
                        continue
                    _place(xs, ys, zs, low, high, c, half)
                    score(rows, slots, n2, n3, frames, origin, scale, eta, c, half, q, scores)
                    n = select(scores, n2, n3, bound, chosen)
                    _measure_part(
                        *(xs, ys, zs, low, high, slots, chosen, n),
                        *(frames, inverses, nodes, background, out),
                    )
