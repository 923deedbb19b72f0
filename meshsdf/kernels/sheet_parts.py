"""Which faces of a sheet are apart within a brick though they need the same texels.

Two parts of a surface that face the same way (parallel plates, a folded sheet, nested shells) may
need the same texel and be two things to paint: they are in conflict. Parts are faces of one sheet
joined over edges that meet the brick's support, the cube of its cells; such as touch there
(T-junctions, cracks) are one.
"""

import math

import numpy as np
from numba import njit

from .clip import clip_segment
from .sheets import cosine_to_pole, find_poles, mark_texels, pack_bits
from .touching import sets_touch

MOST_PARTS = 32  # of a brick; one with more is left as it is
NO_PART = -1
LOW, HIGH = -1.0 - 1e-9, 8.0 + 1e-9  # the support, in nodes of the brick
GAP = 1.0 / 64.0  # texels; nearer parts touch
TEXEL_BETWEEN = 2.0 + 1e-6  # what needs one texel lies in the cells around it
ALIKE = 0.5  # least cosine between normals that count as facing the same way


@njit(cache=True, nogil=True)
def find_parts(
    triangles, edges, normals, scale, bricks, first, faces, n_sheets, begin, end, labels, clash,
    second, n_parts,
):  # fmt: skip
    """Parts of the bricks ``begin ... end - 1`` where two of one sheet are in conflict.

    ``edges`` (m, 3) are the edges of faces, -1 for none. For such a brick ``n_parts[i]`` becomes
    their number, ``labels[first[i]:]`` tells which part the faces there are of, bit b of
    ``clash[i, a]`` whether parts a and b are in conflict, and bit a of ``second[i]`` whether part a
    is of the second sheet. Other bricks stay as they are.
    """
    most = 1
    for i in range(begin, end):
        most = max(most, first[i + 1] - first[i])
    local, parent = np.empty((most, 3, 3)), np.empty(most, np.int32)
    sheet, part_of = np.empty(most, np.uint8), np.empty(most, np.int8)
    size = 8
    while size < 6 * most:
        size *= 2
    keys, owners = np.empty(size, np.int64), np.empty(size, np.int32)
    pole, marked = np.zeros((2, 3)), np.zeros((MOST_PARTS, 512), np.bool_)
    sums, bits = np.zeros((MOST_PARTS, 512, 3), np.float32), np.zeros((MOST_PARTS, 8), np.uint64)
    sheet_of, boxes = np.empty(MOST_PARTS, np.uint8), np.empty((MOST_PARTS, 2, 3))
    for i in range(begin, end):
        start, n = first[i], first[i + 1] - first[i]
        if n < 2:
            continue
        sheet_of_faces(normals, faces, start, start + n, n_sheets[i] > 1, pole, sheet)
        for a in range(n):
            place_face(triangles, faces[start + a], scale, bricks, i, local[a])
        _join_over_edges(edges, faces, start, n, local, sheet, keys, owners, parent)
        n_found = _number(parent, n, sheet, part_of, sheet_of)
        if n_found < 2 or n_found > MOST_PARTS or (n_found == 2 and sheet_of[0] != sheet_of[1]):
            continue
        if not _may_share(local, n, part_of, sheet_of, n_found, boxes):
            continue
        marked[:n_found], sums[:n_found] = False, 0.0
        for a in range(n):
            part = part_of[a]
            mark_texels(local[a], normals, faces[start + a], marked[part], sums[part])
        for a in range(n_found):
            pack_bits(marked[a], bits[a])
        if not _join_touching(local, n, part_of, sheet_of, bits, sums, n_found, parent):
            continue
        n_found = _number(parent, n, sheet, part_of, sheet_of)
        for a in range(n):
            labels[start + a] = part_of[a]
        n_parts[i] = n_found
        second[i] |= _note_clashes(sheet_of, bits, sums, n_found, clash[i])


@njit(cache=True, nogil=True)
def _note_clashes(sheet_of, bits, sums, n_found, clash):
    """Set the bits of ``clash`` for parts of one sheet; which parts are of the second, as bits."""
    second = np.uint32(0)
    for a in range(n_found):
        second |= np.uint32(sheet_of[a]) << np.uint32(a)
        for b in range(n_found):
            if a != b and sheet_of[a] == sheet_of[b] and _share(bits, sums, a, b):
                clash[a] |= np.uint32(1) << np.uint32(b)
    return second


@njit(cache=True, nogil=True)
def sheet_of_faces(normals, faces, start, stop, two, pole, sheet):
    """``sheet[a]`` = 1 if ``faces[start + a]`` is of the second sheet of a brick of two, else 0."""
    if two:
        find_poles(normals, faces, start, stop, pole)
    for s in range(start, stop):
        away = two and cosine_to_pole(normals, faces[s], pole, 1) > cosine_to_pole(
            normals, faces[s], pole, 0
        )
        sheet[s - start] = 1 if away else 0


@njit(cache=True, nogil=True, inline="always")
def place_face(triangles, face, scale, bricks, i, local):
    """The triangle in the nodes of brick i."""
    for corner in range(3):
        for axis in range(3):
            local[corner, axis] = triangles[face, corner, axis] * scale - 8.0 * bricks[i, axis]


@njit(cache=True, nogil=True)
def _join_over_edges(edges, faces, start, n, local, sheet, keys, owners, parent):
    """Join the faces of a sheet that share an edge in the support (a hash table of edges)."""
    size = 8
    while size < 6 * n:
        size *= 2
    for h in range(size):
        keys[h] = -1
    for a in range(n):
        parent[a] = a
    for a in range(n):
        for side in range(3):
            edge = edges[faces[start + a], side]
            if edge < 0 or not _meets_support(local[a], side):
                continue
            key = 2 * np.int64(edge) + sheet[a]
            h = (key * 40503) & (size - 1)
            while keys[h] != -1 and keys[h] != key:
                h = (h + 1) & (size - 1)
            if keys[h] == -1:
                keys[h], owners[h] = key, a
            else:
                _join(parent, np.int32(a), owners[h])


@njit(cache=True, nogil=True)
def _meets_support(triangle, side):
    """Whether a side of a triangle meets the support."""
    p, q = triangle[side], triangle[side + 1 if side < 2 else 0]
    t0, t1 = 0.0, 1.0
    for axis in range(3):
        t0, t1 = clip_segment(t0, t1, p[axis], q[axis] - p[axis], LOW, HIGH)
        if t0 > t1:
            return False
    return True


@njit(cache=True, nogil=True)
def _root(parent, a):
    while parent[a] != a:
        parent[a] = parent[parent[a]]
        a = parent[a]
    return a


@njit(cache=True, nogil=True)
def _join(parent, a, b):
    """Make two trees one; the lower root stays."""
    a, b = _root(parent, a), _root(parent, b)
    if a < b:
        parent[b] = a
    else:
        parent[a] = b


@njit(cache=True, nogil=True)
def _number(parent, n, sheet, part_of, sheet_of):
    """Number the trees by their first faces; returns how many there are, at most one too many."""
    n_found = 0
    for a in range(n):
        root = _root(parent, np.int32(a))
        if root == a:
            if n_found == MOST_PARTS:
                return MOST_PARTS + 1
            sheet_of[n_found] = sheet[a]
            part_of[a] = n_found
            n_found += 1
        else:
            part_of[a] = part_of[root]
    return n_found


@njit(cache=True, nogil=True)
def _may_share(local, n, part_of, sheet_of, n_found, boxes):
    """Whether two parts of a sheet are so near that some texel may be next to both."""
    boxes[:n_found, 0], boxes[:n_found, 1] = np.inf, -np.inf
    for a in range(n):
        box = boxes[part_of[a]]
        for axis in range(3):
            p, q, r = local[a, 0, axis], local[a, 1, axis], local[a, 2, axis]
            box[0, axis] = min(box[0, axis], max(min(p, q, r), LOW))
            box[1, axis] = max(box[1, axis], min(max(p, q, r), HIGH))
    for a in range(n_found):
        for b in range(a + 1, n_found):
            near = sheet_of[a] == sheet_of[b]
            for axis in range(3):
                near &= boxes[a, 0, axis] <= boxes[b, 1, axis] + TEXEL_BETWEEN
                near &= boxes[b, 0, axis] <= boxes[a, 1, axis] + TEXEL_BETWEEN
            if near:
                return True
    return False


@njit(cache=True, nogil=True)
def _share(bits, sums, a, b):
    """Whether two parts need the same texel, and look the same way there."""
    for word in range(8):
        both = bits[a, word] & bits[b, word]
        if both == np.uint64(0):
            continue
        for bit in range(64):
            if (both >> np.uint64(bit)) & np.uint64(1):
                p, q = sums[a, 64 * word + bit], sums[b, 64 * word + bit]
                dot = p[0] * q[0] + p[1] * q[1] + p[2] * q[2]
                p2 = p[0] * p[0] + p[1] * p[1] + p[2] * p[2]
                q2 = q[0] * q[0] + q[1] * q[1] + q[2] * q[2]
                if dot > ALIKE * math.sqrt(p2 * q2):
                    return True
    return False


@njit(cache=True, nogil=True)
def _join_touching(local, n, part_of, sheet_of, bits, sums, n_found, parent):
    """Join parts of one sheet that are in conflict and touch; whether others are in conflict.

    Afterwards ``bits`` and ``sums`` are those of the parts that `_number` would find.
    """
    low, high = np.empty((n, 3)), np.empty((n, 3))
    is_boxed = False
    group = np.arange(n_found).astype(np.int32)
    for a in range(n_found):
        for b in range(a + 1, n_found):
            if sheet_of[a] != sheet_of[b] or _root(group, np.int32(a)) == _root(group, np.int32(b)):
                continue
            if not _share(bits, sums, a, b):
                continue
            if not is_boxed:
                _find_boxes(local, n, low, high)
                is_boxed = True
            one = np.flatnonzero(part_of[:n] == a)
            other = np.flatnonzero(part_of[:n] == b)
            if sets_touch(local, low, high, one, other, LOW, HIGH, GAP):
                _join(group, np.int32(a), np.int32(b))
                _join(parent, np.int32(one[0]), np.int32(other[0]))
    # The bits of what became one, in the order of the lowest of each
    n_left = 0
    for a in range(n_found):
        root = _root(group, np.int32(a))
        if root == a:
            for b in range(a + 1, n_found):
                if _root(group, np.int32(b)) == root:
                    bits[a] |= bits[b]
                    sums[a] += sums[b]
            sheet_of[n_left] = sheet_of[a]
            bits[n_left], sums[n_left] = bits[a], sums[a]
            n_left += 1
    for a in range(n_left):
        for b in range(a + 1, n_left):
            if sheet_of[a] == sheet_of[b] and _share(bits, sums, a, b):
                return True
    return False


@njit(cache=True, nogil=True)
def _find_boxes(local, n, low, high):
    """Boxes of triangles, cut by the support."""
    for a in range(n):
        for axis in range(3):
            p, q, r = local[a, 0, axis], local[a, 1, axis], local[a, 2, axis]
            low[a, axis] = max(min(p, q, r), LOW)
            high[a, axis] = min(max(p, q, r), HIGH)
