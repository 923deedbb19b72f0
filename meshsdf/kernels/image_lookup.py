"""Colours of an image at texture coordinates: bilinear, between the levels of a pyramid.

Williams 1983 (doi:10.1145/800059.801126): each level halves the image, and a lookup takes the two
levels whose texels are next below and next above the width asked for. Where the width differs
along u and v, several lookups along the longer side replace one that would blur the shorter.

Texels are linear RGB times alpha, and alpha; row 0 is the image's uppermost. A level is a run of
rows of the array: ``table[level]`` holds its first texel, height and width. The first level lies in
an array of its own, for many lookups need no other.
"""

from math import log2

import numpy as np
from numba import njit

REPEAT, CLAMP, MIRROR, TRANSPARENT = 0, 1, 2, 3
MOST_PROBES = 16  # lookups along the longer side of a footprint
WIDEST = 2.0**40  # texels; keeps probes of the widest footprints finite


@njit(cache=True, nogil=True)
def shrink(texels, height, width, rows, columns, begin, end, out):
    """Rows [begin, end) of a level with rows x columns texels: means over equal areas.

    Texel i of n along an axis of m smaller ones covers [i m / n, (i + 1) m / n]; overlaps are
    counted in units of 1 / n, as integers, so that they are exact.
    """
    area = float(height) * float(width)
    for row in range(begin, end):
        upper, lower = row * height, (row + 1) * height
        for column in range(columns):
            left, right = column * width, (column + 1) * width
            red = green = blue = alpha = 0.0
            for i in range(upper // rows, (lower - 1) // rows + 1):
                down = min((i + 1) * rows, lower) - max(i * rows, upper)
                for j in range(left // columns, (right - 1) // columns + 1):
                    across = min((j + 1) * columns, right) - max(j * columns, left)
                    share, k = down * across / area, i * width + j
                    red += share * texels[k, 0]
                    green += share * texels[k, 1]
                    blue += share * texels[k, 2]
                    alpha += share * texels[k, 3]
            k = row * columns + column
            out[k, 0], out[k, 1], out[k, 2], out[k, 3] = red, green, blue, alpha


@njit(cache=True, nogil=True)
def _folded(u, wrap):
    """The coordinate where the image itself has what is asked for, or just outside."""
    if wrap == REPEAT:
        return u - np.floor(u)
    if wrap == MIRROR:
        u -= 2.0 * np.floor(0.5 * u)
        return 2.0 - u if u > 1.0 else u
    if wrap == CLAMP:
        return min(max(u, 0.0), 1.0)
    return min(max(u, -1.0), 2.0)  # as far as the only texel of the last level is felt


@njit(cache=True, nogil=True)
def _neighbours(x, n, wrap):
    """(texel before x, texel after it, how far x is from the first); -1 for no texel."""
    before = np.floor(x)
    i = int(before)
    j = i + 1
    if wrap == REPEAT:
        return (n - 1 if i < 0 else i), (0 if j >= n else j), x - before
    if wrap == TRANSPARENT:
        return (i if 0 <= i < n else -1), (j if 0 <= j < n else -1), x - before
    # After folding, a mirror shows beyond the border what clamping does
    return max(i, 0), min(j, n - 1), x - before


@njit(cache=True, nogil=True)
def _bilinear(texels, start, height, width, u, v, wrap_u, wrap_v):
    """Premultiplied RGBA of one level at folded coordinates."""
    i, j, s = _neighbours(u * width - 0.5, width, wrap_u)
    k, m, t = _neighbours((1.0 - v) * height - 0.5, height, wrap_v)
    red = green = blue = alpha = 0.0
    if min(i, j, k, m) >= 0:
        a, b = start + k * width + i, start + k * width + j
        c, d = start + m * width + i, start + m * width + j
        wa, wb, wc, wd = (1.0 - s) * (1.0 - t), s * (1.0 - t), (1.0 - s) * t, s * t
        red = wa * texels[a, 0] + wb * texels[b, 0] + wc * texels[c, 0] + wd * texels[d, 0]
        green = wa * texels[a, 1] + wb * texels[b, 1] + wc * texels[c, 1] + wd * texels[d, 1]
        blue = wa * texels[a, 2] + wb * texels[b, 2] + wc * texels[c, 2] + wd * texels[d, 2]
        alpha = wa * texels[a, 3] + wb * texels[b, 3] + wc * texels[c, 3] + wd * texels[d, 3]
        return red, green, blue, alpha
    # Part of the four lie outside a transparent border
    for side in range(4):
        column, row = (j if side & 1 else i), (m if side & 2 else k)
        if column >= 0 and row >= 0:
            weight = (s if side & 1 else 1.0 - s) * (t if side & 2 else 1.0 - t)
            a = start + row * width + column
            red += weight * texels[a, 0]
            green += weight * texels[a, 1]
            blue += weight * texels[a, 2]
            alpha += weight * texels[a, 3]
    return red, green, blue, alpha


@njit(cache=True, nogil=True)
def _between(base, coarse, table, level, t, u, v, wrap_u, wrap_v):
    """Premultiplied RGBA between a level and the next."""
    u, v = _folded(u, wrap_u), _folded(v, wrap_v)
    texels = base if level == 0 else coarse
    start, height, width = table[level, 0], table[level, 1], table[level, 2]
    fine = _bilinear(texels, start, height, width, u, v, wrap_u, wrap_v)
    if t == 0.0:
        return fine
    start, height, width = table[level + 1, 0], table[level + 1, 1], table[level + 1, 2]
    blurred = _bilinear(coarse, start, height, width, u, v, wrap_u, wrap_v)
    return (
        fine[0] + t * (blurred[0] - fine[0]),
        fine[1] + t * (blurred[1] - fine[1]),
        fine[2] + t * (blurred[2] - fine[2]),
        fine[3] + t * (blurred[3] - fine[3]),
    )


@njit(cache=True, nogil=True)
def _level(sizes, wide):
    """(level, how far on to the next) whose texels are ``wide`` texels of the first level."""
    last = len(sizes) - 1
    if wide <= 1.0 or last == 0:
        return 0, 0.0
    if wide >= sizes[last]:
        return last, 0.0
    level = 0
    while sizes[level + 1] <= wide:
        level += 1
    return level, log2(wide / sizes[level]) / log2(sizes[level + 1] / sizes[level])


@njit(cache=True, nogil=True)
def sample_pyramid(base, coarse, table, sizes, uv, widths, wrap_u, wrap_v, begin, end, out):
    """Straight linear RGBA at uv[begin:end]; all zero where nothing covers.

    ``widths`` are the footprint's along u and v, one row for all or one each; ``sizes`` how many
    texels of the first level one of each level is wide.
    """
    height, width = table[0, 1], table[0, 2]
    for k in range(begin, end):
        of = k if len(widths) > 1 else 0
        du, dv = widths[of, 0], widths[of, 1]
        x, y = min(du * width, WIDEST), min(dv * height, WIDEST)  # in texels
        n_probes, wide = 1, max(x, y)
        if wide > 1.0:
            n_probes = int(min(np.ceil(wide / max(min(x, y), 1.0)), MOST_PROBES))
            wide = max(wide / n_probes, min(x, y))
        level, t = _level(sizes, wide)
        red = green = blue = alpha = 0.0
        for probe in range(n_probes):
            along = (probe + 0.5) / n_probes - 0.5
            u, v = uv[k, 0], uv[k, 1]
            if n_probes > 1:
                u, v = (u + along * x / width, v) if x > y else (u, v + along * y / height)
            r, g, b, a = _between(base, coarse, table, level, t, u, v, wrap_u, wrap_v)
            red, green, blue, alpha = red + r, green + g, blue + b, alpha + a
        scale = 1.0 / alpha if alpha > 0.0 else 0.0
        out[k, 0], out[k, 1], out[k, 2] = red * scale, green * scale, blue * scale
        out[k, 3] = alpha / n_probes


@njit(cache=True, nogil=True)
def blend_corners(attributes, faces, face, weights, begin, end, out):
    """Rows [begin, end): what the corners of faces have, weighted by barycentrics."""
    for k in range(begin, end):
        f = face[k]
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        for channel in range(attributes.shape[1]):
            out[k, channel] = (
                weights[k, 0] * attributes[a, channel]
                + weights[k, 1] * attributes[b, channel]
                + weights[k, 2] * attributes[c, channel]
            )
