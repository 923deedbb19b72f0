"""Which texels of a brick a surface needs, one set for every sheet that passes through it.

A texel is needed where it is a corner of a cell that the surface cuts. Where surfaces that look
opposite ways need the same texel, each way gets its own set (a sheet), as colours on the two sides
of a plate are two colours (DeBry et al. 2002, doi:10.1145/566654.566649; Benson and Davis 2002,
doi:10.1145/566654.566652, part sheets by normal, too).
"""

import math

import numpy as np
from numba import njit

from .box_overlap import touches_cube

MAX_SHEETS = 2


@njit(cache=True, nogil=True)
def find_sheets(
    triangles, normals, scale, bricks, first, faces, begin, end, masks, n_sheets, means, texels
):
    """Sheets of the bricks ``begin ... end - 1``, which the faces ``faces[first[i]:]`` reach.

    Fills masks (b, 2, 8) uint64 (bit 8 j + k of word i), n_sheets (b,), means (b, 2, 3) float32
    and, counted from ``begin``, texels (b, 2, 512, 2) int8: the mean normal at each texel, as
    `encode_normal` codes it.
    """
    marked = np.zeros((2, 512), np.bool_)
    sums = np.zeros((2, 512, 3), np.float32)
    pole = np.zeros((2, 3))
    local = np.empty((3, 3))
    for i in range(begin, end):
        marked[:] = False
        sums[:] = 0.0
        two = find_poles(normals, faces, first[i], first[i + 1], pole)
        for s in range(first[i], first[i + 1]):
            face = faces[s]
            sheet = 0
            if two and cosine_to_pole(normals, face, pole, 1) > cosine_to_pole(
                normals, face, pole, 0
            ):
                sheet = 1
            for corner in range(3):
                for axis in range(3):
                    local[corner, axis] = (
                        triangles[face, corner, axis] * scale - 8.0 * bricks[i, axis]
                    )
            mark_texels(local, normals, face, marked[sheet], sums[sheet])
        if two and not _opposed(marked, sums):
            for t in range(512):
                marked[0, t] |= marked[1, t]
                marked[1, t] = False
                for axis in range(3):
                    sums[0, t, axis] += sums[1, t, axis]
            two = False
        n_sheets[i] = 2 if two else 1
        for sheet in range(2):
            pack_bits(marked[sheet], masks[i, sheet])
            mean_normal(sums[sheet], means[i, sheet])
            for t in range(512):
                encode_normal(sums[sheet, t], texels[i - begin, sheet, t])


@njit(cache=True, nogil=True, inline="always")
def cosine_to_pole(normals, face, pole, sheet):
    return (
        normals[face, 0] * pole[sheet, 0]
        + normals[face, 1] * pole[sheet, 1]
        + normals[face, 2] * pole[sheet, 2]
    )


@njit(cache=True, nogil=True)
def find_poles(normals, faces, start, stop, pole):
    """Two opposed normals, each the mean of those nearer to it; False if none look apart."""
    if _within_cone(normals, faces, start, stop, pole):
        return False
    first = second = faces[start]
    apart = 0.0
    # The faces furthest along 26 directions: of two that are opposed, one is near to some of these
    for direction in range(27):
        pole[0, 0] = direction // 9 - 1
        pole[0, 1] = direction // 3 % 3 - 1
        pole[0, 2] = direction % 3 - 1
        along = _extreme(normals, faces, start, stop, pole, 1.0)
        pole[0] = normals[along]
        away = _extreme(normals, faces, start, stop, pole, -1.0)
        d = cosine_to_pole(normals, away, pole, 0)
        if d < apart:
            first, second, apart = along, away, d
    if apart >= 0.0:
        return False
    pole[0], pole[1] = normals[first], normals[second]
    total = np.zeros((2, 3))
    for s in range(start, stop):
        sheet = (
            1
            if cosine_to_pole(normals, faces[s], pole, 1)
            > cosine_to_pole(normals, faces[s], pole, 0)
            else 0
        )
        for axis in range(3):
            total[sheet, axis] += normals[faces[s], axis]
    for sheet in range(2):
        length = math.sqrt(total[sheet, 0] ** 2 + total[sheet, 1] ** 2 + total[sheet, 2] ** 2)
        if length > 0.0:
            for axis in range(3):
                pole[sheet, axis] = total[sheet, axis] / length
    return True


@njit(cache=True, nogil=True)
def _within_cone(normals, faces, start, stop, pole):
    """Whether all normals are within 45 degrees of their mean: no two are opposed then."""
    pole[0] = 0.0
    for s in range(start, stop):
        for axis in range(3):
            pole[0, axis] += normals[faces[s], axis]
    length = math.sqrt(pole[0, 0] ** 2 + pole[0, 1] ** 2 + pole[0, 2] ** 2)
    least = 4.0
    for s in range(start, stop):
        least = min(least, cosine_to_pole(normals, faces[s], pole, 0))
    return least > 0.7072 * length


@njit(cache=True, nogil=True)
def _extreme(normals, faces, start, stop, pole, sign):
    """The first face whose normal is furthest along (sign 1) or against (-1) ``pole[0]``."""
    found, most = faces[start], -4.0
    for s in range(start, stop):
        d = sign * cosine_to_pole(normals, faces[s], pole, 0)
        if d > most:
            found, most = faces[s], d
    return found


@njit(cache=True, nogil=True)
def mark_texels(local, normals, face, marked, sums):
    """Mark the corners in the brick of every cell that the triangle touches, and add its normal."""
    low = np.empty(3, np.int64)
    high = np.empty(3, np.int64)
    for axis in range(3):
        least = min(local[0, axis], local[1, axis], local[2, axis])
        most = max(local[0, axis], local[1, axis], local[2, axis])
        low[axis] = max(-1, math.floor(max(least, -2.0) - 1e-9))
        high[axis] = min(7, math.floor(min(most, 9.0) + 1e-9))
    for i in range(low[0], high[0] + 1):
        for j in range(low[1], high[1] + 1):
            for k in range(low[2], high[2] + 1):
                if not touches_cube(local, i + 0.5, j + 0.5, k + 0.5, 0.5):
                    continue
                for x in range(max(i, 0), min(i + 2, 8)):
                    for y in range(max(j, 0), min(j + 2, 8)):
                        for z in range(max(k, 0), min(k + 2, 8)):
                            t = x * 64 + y * 8 + z
                            marked[t] = True
                            for axis in range(3):
                                sums[t, axis] += normals[face, axis]


@njit(cache=True, nogil=True)
def _opposed(marked, sums):
    """Some texel is needed by both sheets, which there look apart by more than a right angle."""
    for t in range(512):
        if marked[0, t] and marked[1, t]:
            dot = (
                sums[0, t, 0] * sums[1, t, 0]
                + sums[0, t, 1] * sums[1, t, 1]
                + sums[0, t, 2] * sums[1, t, 2]
            )
            if dot < 0.0:
                return True
    return False


@njit(cache=True, nogil=True)
def pack_bits(marked, mask):
    for i in range(8):
        word = np.uint64(0)
        for bit in range(64):
            if marked[i * 64 + bit]:
                word |= np.uint64(1) << np.uint64(bit)
        mask[i] = word


@njit(cache=True, nogil=True)
def mean_normal(sums, mean):
    x, y, z = 0.0, 0.0, 0.0
    for t in range(512):
        x += sums[t, 0]
        y += sums[t, 1]
        z += sums[t, 2]
    length = math.sqrt(x * x + y * y + z * z)
    if length > 0.0:
        mean[0], mean[1], mean[2] = x / length, y / length, z / length
    else:
        mean[:] = 0.0


@njit(cache=True, nogil=True)
def encode_normal(normal, code):
    """Octahedral code of a direction of any length, in 2 x 8 bits; (-128, -128) for none.

    (Meyer et al. 2010, doi:10.1111/j.1467-8659.2010.01737.x; off by at most 0.9 degrees.)
    """
    total = abs(normal[0]) + abs(normal[1]) + abs(normal[2])
    if total == 0.0:
        code[0] = code[1] = -128
        return
    x, y = normal[0] / total, normal[1] / total
    if normal[2] < 0.0:
        x, y = (
            (1.0 - abs(y)) * (1.0 if x >= 0.0 else -1.0),
            (1.0 - abs(x)) * (1.0 if y >= 0.0 else -1.0),
        )
    code[0] = round(127.0 * x)
    code[1] = round(127.0 * y)


@njit(cache=True, nogil=True, inline="always")
def decode_normal(a, b):
    """The unit vector of an octahedral code; (0, 0, 0) for none."""
    if a == -128:
        return np.float32(0.0), np.float32(0.0), np.float32(0.0)
    x, y = np.float32(a) / np.float32(127.0), np.float32(b) / np.float32(127.0)
    z = np.float32(1.0) - abs(x) - abs(y)
    fold = max(-z, np.float32(0.0))
    x += -fold if x >= 0.0 else fold
    y += -fold if y >= 0.0 else fold
    scale = np.float32(1.0) / math.sqrt(x * x + y * y + z * z)
    return x * scale, y * scale, z * scale


@njit(cache=True, nogil=True)
def pack_normals(begin, end, masks, n_sheets, texels, packed):
    """Write the codes of needed texels one after another, brick by brick and sheet by sheet."""
    at = 0
    for i in range(begin, end):
        for sheet in range(n_sheets[i]):
            for t in range(512):
                if (masks[i, sheet, t >> 6] >> np.uint64(t & 63)) & np.uint64(1):
                    packed[at, 0] = texels[i - begin, sheet, t, 0]
                    packed[at, 1] = texels[i - begin, sheet, t, 1]
                    at += 1
