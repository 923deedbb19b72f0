"""A stroke's coverage of texels, and laying its paint over what was there before it.

Coverage k of a texel grows with every dab: k + f w (1 - k) where dabs build up, max(k, f w) where
they do not; f is the flow and w the dab's weight there. A stroke's paint is laid on with k times
its opacity over the texels as they were before the stroke, so that rounding never adds up and
overlapping copies do not double.
"""

import math

import numpy as np
from numba import njit

from .blending import NORMAL, composite
from .brush_reach import HALF_DIAGONAL, MARGIN, ROW, segment_distance2
from .texel_codes import F0, F1, HALF1, VALUE8, decoded, encode
from .texel_neighbors import is_beside, parts_beside
from .texture_lookup import ABSENT, FIRST_TILE, stored_texel

FALLOFFS = ("smooth", "linear", "round")
SMOOTH, LINEAR, ROUND = range(3)
PAINT, ERASE, COPY = range(3)
WANTED, CHANGED = 1, 2
HALF, TWO, THREE = np.float32(0.5), np.float32(2.0), np.float32(3.0)
SQRT_HALF = np.float32(math.sqrt(0.5))
PER_STEP = np.float32(1.0 / 127.0)  # of the texels' octahedral normals
NEAR_POLE = np.float32(0.999)


@njit(cache=True, nogil=True, inline="always")
def falloff_weight(falloff, hardness, d):
    """Weight of a dab at ``d`` radii from its axis: 1 up to ``hardness``, 0 from the rim on."""
    if d >= F1:
        return F0
    if d <= hardness:
        return F1
    x = (d - hardness) / (F1 - hardness)
    if falloff == SMOOTH:
        return F1 - x * x * (THREE - TWO * x)
    if falloff == LINEAR:
        return F1 - x
    return np.float32(math.sqrt(F1 - x * x))


@njit(cache=True, nogil=True, inline="always")
def picture_value(picture, u, v):
    """A picture (h, w) at (u, v) in [0, 1]^2, v down, linear between pixels; 0 beside it."""
    if not (u >= 0.0 and u <= 1.0 and v >= 0.0 and v <= 1.0):
        return F0
    height, width = picture.shape
    x = min(max(u * width - 0.5, 0.0), width - 1.0)
    y = min(max(v * height - 0.5, 0.0), height - 1.0)
    i, j = min(int(y), max(height - 2, 0)), min(int(x), max(width - 2, 0))
    fy, fx = np.float32(y - i), np.float32(x - j)
    i1, j1 = min(i + 1, height - 1), min(j + 1, width - 1)
    top = picture[i, j] + fx * (picture[i, j1] - picture[i, j])
    bottom = picture[i1, j] + fx * (picture[i1, j1] - picture[i1, j])
    return top + fy * (bottom - top)


@njit(cache=True, nogil=True)
def deposit(
    tables, found, begin, end, slots, marks, dabs, parts, copies, tip, numbers, stamp, stencil,
    matrix, gates, coverage, changed, state,
):  # fmt: skip
    """Let dabs cover the texels of the entries ``found[begin:end]``.

    ``parts`` (d,) are those that dabs are on, as bits: where sheets are divided, they cover no
    other part. ``copies`` dabs after another are one step of the stroke; of these the strongest
    counts. ``tip`` is falloff, build-up, has stamp, has stencil, is gated; ``numbers`` hardness and
    the two cosines; ``matrix`` takes finest nodes to the stencil. ``gates`` (dabs, found, 8) uint64
    are the texels connected to a dab, if it is gated. Sets rows of ``coverage``, the bits of texels
    whose coverage changed, (found, 8), and for each entry whether it is WANTED (dabs come near) and
    CHANGED.
    """
    places = np.empty((8, 512), np.float32)
    which = np.empty(512, np.int64)
    weights = np.zeros(512, np.float32)
    origin = np.empty(3)
    gated = tip[4]
    for i in range(begin, end):
        e = found[i]
        shrink = 1.0 / (1 << tables.levels[e])
        for axis in range(3):
            origin[axis] = 8.0 * tables.bricks[e, axis]
        n, is_new = -1, slots[e] == ABSENT
        beside = parts_beside(tables, e)
        row = coverage[marks[e, ROW] - 1]
        state[i] = 0
        changed[i, :] = np.uint64(0)
        for step in range(0, len(dabs), copies):
            covered = False
            for d in range(step, step + copies):
                if not _is_near(dabs, d, shrink, origin):
                    continue
                if beside and is_beside(tables, e, beside, parts[d]):
                    continue
                if n < 0:
                    n = _unpack(tables.masks, e, places, which)
                    _directions(tables.texel_normals, tables.texel_first[e], n, places)
                gate = gates[d, i] if gated else gates[0, 0]
                seen = _weigh(
                    places, which, n, dabs[d], shrink, origin, tip, numbers, is_new, stamp,
                    stencil, matrix, gate, row, weights,
                )  # fmt: skip
                state[i] |= seen & WANTED
                covered |= seen & CHANGED != 0
            if covered and _add(weights, which, n, tip[1], row, changed[i]):
                state[i] |= CHANGED


@njit(cache=True, nogil=True, inline="always")
def _is_near(dabs, d, shrink, origin):
    """Whether a dab may reach texels of the brick: by its sphere, and by the box of the dab."""
    reach = max(dabs[d, 6], dabs[d, 7]) * shrink + MARGIN
    away2 = 0.0
    for axis in range(3):
        low = min(dabs[d, axis], dabs[d, 3 + axis]) * shrink - origin[axis]
        high = max(dabs[d, axis], dabs[d, 3 + axis]) * shrink - origin[axis]
        gap = max(low - 7.0, -high, 0.0)
        away2 += gap * gap
    if away2 > reach * reach:
        return False
    far = reach + HALF_DIAGONAL
    near = segment_distance2(dabs, d, shrink, origin[0] + 3.5, origin[1] + 3.5, origin[2] + 3.5)
    return near <= far * far


@njit(cache=True, nogil=True)
def _unpack(masks, e, places, which):
    """Nodes, in the brick, of the entry's texels, and their numbers; returns how many."""
    n = 0
    for x in range(8):
        word = masks[e, x]
        if word == np.uint64(0):
            continue
        for bit in range(64):
            if (word >> np.uint64(bit)) & np.uint64(1):
                which[n] = 64 * x + bit
                places[0, n], places[1, n], places[2, n] = x, bit >> 3, bit & 7
                n += 1
    return n


@njit(cache=True, nogil=True)
def _directions(normals, code, n, places):
    """Rows 5 to 7 of ``places``: normals of the entry's texels, as `sheets.decode_normal`."""
    nx, ny, nz = places[5], places[6], places[7]
    for m in range(n):
        a, b = normals[code + m, 0], normals[code + m, 1]
        x, y = np.float32(a) * PER_STEP, np.float32(b) * PER_STEP
        z = F1 - abs(x) - abs(y)
        fold = max(-z, F0)
        x += -fold if x >= F0 else fold
        y += -fold if y >= F0 else fold
        scale = F1 / math.sqrt(x * x + y * y + z * z)
        scale = F0 if a == -128 else scale
        nx[m], ny[m], nz[m] = x * scale, y * scale, z * scale


@njit(cache=True, nogil=True)
def _distances(places, n, px, py, pz, dx, dy, dz, over):
    """Rows 3 and 4 of ``places``: squared distance to the axis from p by d, and where on it."""
    x, y, z, far2, along = places[0], places[1], places[2], places[3], places[4]
    for m in range(n):
        qx, qy, qz = x[m] - px, y[m] - py, z[m] - pz
        t = (qx * dx + qy * dy + qz * dz) * over
        t = F0 if t < F0 else t
        t = F1 if t > F1 else t
        qx, qy, qz = qx - t * dx, qy - t * dy, qz - t * dz
        far2[m] = qx * qx + qy * qy + qz * qz
        along[m] = t


@njit(cache=True, nogil=True)
def _weigh(
    places, which, n, dab, shrink, origin, tip, numbers, is_new, stamp, stencil, matrix, gate, row,
    weights,
):  # fmt: skip
    """Raise the weights of texels to those that one dab has there; WANTED and CHANGED if any."""
    falloff, build_up, has_stamp, has_stencil, gated = tip
    hardness = np.float32(numbers[0])
    c0, c1 = np.float32(numbers[1]), np.float32(numbers[2])
    scale = np.float32(shrink)
    # The dab in the brick's own nodes
    px, py, pz = (
        np.float32(dab[0] * shrink - origin[0]),
        np.float32(dab[1] * shrink - origin[1]),
        np.float32(dab[2] * shrink - origin[2]),
    )
    dx, dy, dz = (
        np.float32(dab[3] - dab[0]) * scale,
        np.float32(dab[4] - dab[1]) * scale,
        np.float32(dab[5] - dab[2]) * scale,
    )
    length2 = dx * dx + dy * dy + dz * dz
    _distances(places, n, px, py, pz, dx, dy, dz, F1 / length2 if length2 > F0 else F0)
    r0, dr = np.float32(dab[6]) * scale, np.float32(dab[7] - dab[6]) * scale
    flow, more = np.float32(dab[8]), np.float32(dab[9] - dab[8])
    nx, ny, nz = np.float32(dab[10]), np.float32(dab[11]), np.float32(dab[12])
    mx, my, mz = np.float32(dab[13]) - nx, np.float32(dab[14]) - ny, np.float32(dab[15]) - nz
    turns = mx != F0 or my != F0 or mz != F0
    ux, uy, uz, vx, vy, vz = _tangents(nx, ny, nz) if has_stamp else (F0, F0, F0, F0, F0, F0)
    margin = np.float32(MARGIN) if is_new else F0
    # A texel that is covered more than this dab could cover it gains nothing
    most = F1 if build_up else max(flow, flow + more)
    seen = 0
    for m in range(n):
        d2, t = places[3, m], places[4, m]
        r = r0 + t * dr
        if d2 >= (r + margin) * (r + margin):
            continue
        k = which[m]
        known = F0 if build_up else row[k]
        known = max(known, weights[m])
        w = F0
        if d2 < r * r and known < most:
            if has_stamp:
                side = SQRT_HALF / r
                qx, qy, qz = places[0, m] - px, places[1, m] - py, places[2, m] - pz
                u, v = (qx * ux + qy * uy + qz * uz) * side, (qx * vx + qy * vy + qz * vz) * side
                w = picture_value(stamp, HALF + u, HALF - v)
            else:
                w = falloff_weight(falloff, hardness, math.sqrt(d2) / r)
            w *= flow + t * more
        if w <= known and not is_new:
            continue
        if gated and not (gate[k >> 6] >> np.uint64(k & 63)) & np.uint64(1):
            continue
        ax, ay, az = places[5, m], places[6, m], places[7, m]
        looks = _angle_weight(ax, ay, az, nx + t * mx, ny + t * my, nz + t * mz, turns, c0, c1)
        if looks <= F0:
            continue
        seen |= WANTED
        w *= looks
        if has_stencil and w > known:
            w *= _stencil_weight(stencil, matrix, places, m, origin, shrink)
        if w > known:
            weights[m] = w
            seen |= CHANGED
    return seen


@njit(cache=True, nogil=True, inline="always")
def _angle_weight(ax, ay, az, bx, by, bz, turns, c0, c1):
    """How much paint a texel that looks along a takes from a dab that looks along b."""
    cosine = ax * bx + ay * by + az * bz
    if turns and (cosine < c1 or c1 < F0):  # b is no longer than 1
        size2 = bx * bx + by * by + bz * bz
        cosine = cosine / math.sqrt(size2) if size2 > F0 else F0
    if cosine >= c1 or (ax == F0 and ay == F0 and az == F0):
        return F1
    if cosine <= c0:
        return F0
    x = (cosine - c0) / (c1 - c0)
    return x * x * (THREE - TWO * x)


@njit(cache=True, nogil=True)
def _stencil_weight(stencil, matrix, places, m, origin, shrink):
    """The stencil's picture at a texel."""
    x, y, z = (
        (places[0, m] + origin[0]) / shrink,
        (places[1, m] + origin[1]) / shrink,
        (places[2, m] + origin[2]) / shrink,
    )
    w = matrix[2, 0] * x + matrix[2, 1] * y + matrix[2, 2] * z + matrix[2, 3]
    if not w > 0.0:
        return F0
    u = matrix[0, 0] * x + matrix[0, 1] * y + matrix[0, 2] * z + matrix[0, 3]
    v = matrix[1, 0] * x + matrix[1, 1] * y + matrix[1, 2] * z + matrix[1, 3]
    return picture_value(stencil, u / w, v / w)


@njit(cache=True, nogil=True)
def _tangents(nx, ny, nz):
    """A stamp's right and up at a normal: up leans towards +z, or +y where the normal is that."""
    if abs(nz) < NEAR_POLE:
        x, y = -ny, nx
        size = math.sqrt(x * x + y * y)
        ux, uy, uz = x / size, y / size, F0
    else:
        x, z = nz, -nx
        size = math.sqrt(x * x + z * z)
        ux, uy, uz = x / size, F0, z / size
    return ux, uy, uz, ny * uz - nz * uy, nz * ux - nx * uz, nx * uy - ny * ux


@njit(cache=True, nogil=True)
def _add(weights, which, n, build_up, row, changed):
    """Add the weights of a step to the coverage of texels, and forget them; whether it changed."""
    any_change = False
    for m in range(n):
        w = weights[m]
        if w <= F0:
            continue
        weights[m] = F0
        t = which[m]
        before = row[t]
        after = before + w * (F1 - before) if build_up else max(before, w)
        if after != before:
            row[t] = after
            changed[t >> 6] |= np.uint64(1) << np.uint64(t & 63)
            any_change = True
    return any_change


@njit(cache=True, nogil=True)
def lay(
    entries, begin, end, rows, changed, base, slots, coverage, source, action, kind, mode, color,
    opacity, nothing, pool, tiles,
):  # fmt: skip
    """Write the texels marked in ``changed[i]`` of ``entries[i]``, which are row ``rows[i]``.

    ``base[row]`` is the slot (or tile) of what was there before the stroke. ``action`` is PAINT
    with ``color`` (4,), ERASE towards the texel ``nothing``, or COPY of ``source`` (rows, 512, 4).
    """
    r, g, b, a = color[0], color[1], color[2], color[3]
    erases = action == ERASE
    if erases:
        r, g, b, a = decoded(kind, np.int64(nothing))
        mode = NORMAL
    fades = erases and kind != HALF1 and kind != VALUE8  # by alpha, where there is one
    for i in range(begin, end):
        row, slot = rows[i], slots[entries[i]]
        for t in range(512):
            if not (changed[i, t >> 6] >> np.uint64(t & 63)) & np.uint64(1):
                continue
            share = opacity * coverage[row, t]
            if fades and share >= F1:
                pool[slot, t] = nothing
                continue
            below = stored_texel(kind, base[row], pool, tiles, t)
            if action == COPY:
                r, g, b, a = (
                    source[row, t, 0],
                    source[row, t, 1],
                    source[row, t, 2],
                    source[row, t, 3],
                )
            if fades:
                out = below[0], below[1], below[2], below[3] * (F1 - share)
            else:
                out = composite(mode, below, (r, g, b), share * a)
            pool[slot, t] = encode(kind, out[0], out[1], out[2], out[3])


@njit(cache=True, nogil=True)
def same_texels(masks, entries, before, after, pool, tiles, same):
    """``same[i]`` = the slots or tiles ``before[i]`` and ``after[i]`` hold the same texels."""
    for i in range(len(entries)):
        e = entries[i]
        same[i] = True
        for t in range(512):
            if (masks[e, t >> 6] >> np.uint64(t & 63)) & np.uint64(1):
                old = pool[before[i], t] if before[i] >= 0 else tiles[FIRST_TILE - before[i]]
                if old != pool[after[i], t]:
                    same[i] = False
                    break
