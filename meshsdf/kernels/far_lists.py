"""Short lists of the triangles that can be closest to some point of a block.

A block is all points p = c + w with |w_i| <= a_i. The witness q is a point of the surface near the
foot of c, so that d(p) <= |p - q| everywhere. A triangle t may be left out when d(p, t) > |p - q|
for all p of the block, and three rules prove that, each by the convexity of a square:

- **Box rule**, for subtrees. For any point e, |p - e|^2 - |p - q|^2 is affine in p, so
  d(p, box)^2 - |p - q|^2, a least of affine functions, is concave and least at a corner of the
  block; it is a sum over axes, hence its least value a sum of the least of two terms each.
- **Vertex rule**, for triangles. Let f be the foot of p on t and e the longest edge. p - f is
  orthogonal to the face, edge or vertex that f lies in, so |p - v|^2 = d^2 + |f - v|^2 for the
  vertices v of that feature, and one of them has |f - v| <= e / sqrt(3) (Jung 1901). So t is out
  when all its vertices have |p - v|^2 - |p - q|^2 > e^2 / 3 throughout, and the left side, with
  u = v - q, is at least u . (u + 2 (q - c)) - 2 sum a_i |u_i|.
- **Foot rule**, for triangles larger than the block. With the foot f of c, d(p, t)^2 >=
  d(c, t)^2 + 2 (c - f) . w by convexity, so t is out when
  d(c, t)^2 - |c - q|^2 > |a|^2 + 2 sum a_i |q_i - f_i|.

Far from the surface these keep what lies within about two block diagonals of the foot, however
far that is, where the usual rule d(c, t) <= d(c) + 2 r keeps sqrt(4 r d) around it.

Rounding: the vertex rule is evaluated in float32, in voxels from the centre of a block within
which vertices, witnesses and nodes have coordinates of at most R. With u = 2**-24, storing v and q
moves the left side by at most 24 u R^2 and the slack by 4 u R^2; all else (g = 2 (q - c), a and the
sums) by at most 68 u R sum |u_i|. So every a_i is raised by ``ETA R``, which adds
128 u R sum |u_i|, and the bound by ``ETA R^2``, for ETA = 2**-18 = 64 u. The other rules are in
float64, with ``margin`` for the witness and their own rounding.
"""

import numpy as np
from numba import njit

from .bvh import EMPTY, STACK_SIZE
from .point_triangle import H, L, M, planar_foot

ETA = 2.0**-18
N_ROWS = 10  # three vertices, then the slack e^2 / 3
THIRD = (1.0 + 2.0**-20) / 3.0  # raised for the rounding of the slack to float32


@njit(cache=True, nogil=True)
def foot(frame, p, out):
    """Closest point of a triangle to p."""
    dx, dy, dz = p[0] - frame[0], p[1] - frame[1], p[2] - frame[2]
    x = dx * frame[3] + dy * frame[4] + dz * frame[5]
    y = dx * frame[6] + dy * frame[7] + dz * frame[8]
    fx, fy, _ = planar_foot(x, y, frame[L], frame[M], frame[H])
    for axis in range(3):
        out[axis] = frame[axis] + fx * frame[3 + axis] + fy * frame[6 + axis]


@njit(cache=True, nogil=True)
def _box_gain(boxes, first, c, half, q):
    """Least d(p, box)^2 - |p - q|^2 over the block."""
    gain = 0.0
    for axis in range(3):
        low, high = np.float64(boxes[first + axis]), np.float64(boxes[first + 3 + axis])
        p0, p1 = c[axis] - half[axis], c[axis] + half[axis]
        e0, e1 = min(max(p0, low), high), min(max(p1, low), high)
        at = q[axis]
        gain += min((e0 - at) * (e0 + at - 2.0 * p0), (e1 - at) * (e1 + at - 2.0 * p1))
    return gain


@njit(cache=True, nogil=True)
def _vertex_gain(corners, c, half, q):
    """Least of ``|p - v|^2 - |p - q|^2`` over block and vertices, less e^2 / 3; and e^2 / 3."""
    least, longest = np.inf, 0.0
    for v in range(3):
        gain, edge = 0.0, 0.0
        for axis in range(3):
            edge += (corners[v - 2, axis] - corners[v, axis]) ** 2
            u = corners[v, axis] - q[axis]
            gain += u * (u + 2.0 * (q[axis] - c[axis])) - 2.0 * half[axis] * abs(u)
        least, longest = min(least, gain), max(longest, edge)
    return least - longest * THIRD, longest * THIRD


@njit(cache=True, nogil=True)
def gather(corners, children, child_boxes, c, half, q, margin, scale, rows, slots):
    """List the triangles of the tree for a block; return their number and their reach R.

    ``rows`` (10, m) float32 receives vertices, in voxels (``scale`` per unit) from c, and slack.
    """
    stack = np.empty(STACK_SIZE, np.int32)
    stack[0] = 0
    n_stack, n, reach = 1, 0, 0.0
    while n_stack > 0:
        n_stack -= 1
        node = stack[n_stack]
        for side in range(2):
            child = children[node, side]
            if child == EMPTY or _box_gain(child_boxes[node], 6 * side, c, half, q) > margin:
                continue
            if child >= 0:
                stack[n_stack] = child
                n_stack += 1
                continue
            first = (-2 - child) >> 3
            for s in range(first, first + ((-2 - child) & 7) + 1):
                gain, slack = _vertex_gain(corners[s], c, half, q)
                if gain > margin:
                    continue
                for v in range(3):
                    for axis in range(3):
                        x = (corners[s, v, axis] - c[axis]) * scale
                        rows[3 * v + axis, n] = x
                        reach = max(reach, abs(x))
                rows[9, n] = slack * scale * scale
                slots[n] = s
                n += 1
    return n, reach


@njit(cache=True, nogil=True)
def _nearest(ax, ay, az, x, y, z, scores):
    """Position of the first vertex nearest to (x, y, z)."""
    for n in range(len(ax)):
        dx, dy, dz = ax[n] - x, ay[n] - y, az[n] - z
        scores[n] = dx * dx + dy * dy + dz * dz
    least, at = np.float32(np.inf), 0
    for n in range(len(ax)):
        if scores[n] < least:
            least, at = scores[n], n
    return at


@njit(cache=True, nogil=True, inline="always")
def _gain(x, y, z, q, g, h):
    x, y, z = x - q[0], y - q[1], z - q[2]
    along = x * (x + g[0]) - h[0] * abs(x) + (y * (y + g[1]) - h[1] * abs(y))
    return along + (z * (z + g[2]) - h[2] * abs(z))


@njit(cache=True, nogil=True)
def _gains(ax, ay, az, bx, by, bz, cx, cy, cz, slack, q, g, h, scores):
    for n in range(len(ax)):
        a = _gain(ax[n], ay[n], az[n], q, g, h)
        b = _gain(bx[n], by[n], bz[n], q, g, h)
        c = _gain(cx[n], cy[n], cz[n], q, g, h)
        scores[n] = min(min(a, b), c) - slack[n]


@njit(cache=True, nogil=True)
def score(rows, slots, begin, end, frames, origin, scale, eta, c, half, q, scores):
    """Find a witness q for the block among entries begin..end, and score them by the vertex rule.

    An entry whose score exceeds the bound may be left out of the block's list.
    """
    f = np.float32
    px, py, pz = (c[0] - origin[0]) * scale, (c[1] - origin[1]) * scale, (c[2] - origin[2]) * scale
    near = (rows[0][begin:end], rows[1][begin:end], rows[2][begin:end])
    at = _nearest(*near, f(px), f(py), f(pz), scores)
    foot(frames[slots[begin + at]], c, q)
    qx, qy, qz = (q[0] - origin[0]) * scale, (q[1] - origin[1]) * scale, (q[2] - origin[2]) * scale
    g = (f(2.0 * (qx - px)), f(2.0 * (qy - py)), f(2.0 * (qz - pz)))
    h = (
        f(2.0 * (half[0] * scale + eta)),
        f(2.0 * (half[1] * scale + eta)),
        f(2.0 * (half[2] * scale + eta)),
    )
    _gains(
        *near,
        *(rows[3][begin:end], rows[4][begin:end], rows[5][begin:end]),
        *(rows[6][begin:end], rows[7][begin:end], rows[8][begin:end], rows[9][begin:end]),
        *((f(qx), f(qy), f(qz)), g, h, scores),
    )


@njit(cache=True, nogil=True)
def select(scores, begin, end, bound, chosen):
    """List in ``chosen`` the entries begin..end that score no more than the bound; count them."""
    n = 0
    for entry in range(begin, end):
        # No branch: which entries stay cannot be predicted
        chosen[n] = entry
        n += scores[entry - begin] <= bound
    return n


@njit(cache=True, nogil=True)
def _drop_large(rows, slots, frames, scale, margin, c, half, q, chosen, n_chosen):
    """Apply the foot rule to the chosen triangles larger than the block; count those left."""
    large = 4.0 * (max(half[0], half[1], half[2]) * scale) ** 2
    f = np.empty(3)
    square = 0.0
    for axis in range(3):
        square += (q[axis] - c[axis]) ** 2 + half[axis] ** 2
    n = 0
    for number in range(n_chosen):
        entry = chosen[number]
        if rows[9, entry] > large:
            foot(frames[slots[entry]], c, f)
            gain = -square
            for axis in range(3):
                gain += (f[axis] - c[axis]) ** 2 - 2.0 * half[axis] * abs(q[axis] - f[axis])
            if gain > margin:
                continue
        chosen[n] = entry
        n += 1
    return n


@njit(cache=True, nogil=True)
def keep(rows, slots, begin, end, frames, scale, bound, margin, c, half, q, scores, chosen):
    """Append to the lists the entries begin..end that the block needs; return the new end."""
    n = select(scores, begin, end, bound, chosen)
    n = _drop_large(rows, slots, frames, scale, margin, c, half, q, chosen, n)
    for row in range(N_ROWS):
        values = rows[row]
        for number in range(n):
            values[end + number] = values[chosen[number]]
    for number in range(n):
        slots[end + number] = slots[chosen[number]]
    return end + n
