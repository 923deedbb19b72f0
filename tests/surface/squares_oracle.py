"""Marching squares written plainly: one square at a time, in fractions; and the same by others."""

from fractions import Fraction

import contourpy
import numpy as np

STEPS = ((0, 0, 0), (1, 0, 1), (0, 1, 0), (0, 0, 1))  # node and axis of the edges ab, bc, cd, da


def pieces_of(values, level, rule):
    """[(name of the edge a piece starts from, name of the edge it ends on)] of all squares."""
    pieces = []
    for i, j in np.ndindex(values.shape[0] - 1, values.shape[1] - 1):
        corners = values[i, j], values[i + 1, j], values[i + 1, j + 1], values[i, j + 1]
        if np.isnan(corners).any():
            continue
        inside = [value < level for value in corners]
        names = [(i + x, j + y, axis) for x, y, axis in STEPS]
        leaving = [e for e in range(4) if inside[e] and not inside[(e + 1) % 4]]
        entering = [e for e in range(4) if not inside[e] and inside[(e + 1) % 4]]
        if len(leaving) == 2:
            is_joined = joins_inside([Fraction(float(v)) - Fraction(level) for v in corners], rule)
            # A corner is cut off alone: an inside one if apart, an outside one if joined
            entering = [(e + 1) % 4 if is_joined else (e - 1) % 4 for e in leaving]
        pieces += [(names[e], names[f]) for e, f in zip(leaving, entering, strict=True)]
    return pieces


def joins_inside(corners, rule):
    """Whether the inside corners of an alternating square hang together."""
    a, b, c, d = corners
    if rule == "mean":
        return (a + b + c + d) / 4 < 0
    if rule == "bilinear":
        return (a * c - b * d) / (a + c - b - d) < 0  # the value at the saddle point
    return (a < 0) == (rule == "diagonal")


def place_of(name, values, level):
    """(2,) position of the vertex on an edge, by linear interpolation."""
    i, j, axis = name
    a, b = float(values[i, j]), float(values[i + 1 - axis, j + axis])
    place = np.array([i, j], float)
    place[axis] += (level - a) / (b - a)
    return place


def curves_of(values, level, rule):
    """Lists of names, those of closed curves with the first one repeated."""
    after = dict(pieces_of(values, level, rule))
    found = []
    for name in sorted(set(after) - set(after.values())) + sorted(after):
        if name in after:
            names = [name]
            while names[-1] in after:
                names.append(after.pop(names[-1]))
            found.append(names)
    return found


def cleaned(points, offsets, is_closed):
    """(points, offsets, is_closed) without points that repeat the one before, or curves of one.

    Of closed curves the last point is a repetition of the first, and goes too.
    """
    keep = np.ones(len(points), bool)
    keep[1:] = (points[1:] != points[:-1]).any(axis=1)
    keep[offsets[:-1]] = True
    number = np.repeat(np.arange(len(is_closed)), np.diff(offsets))
    is_lone = np.bincount(number[keep], minlength=len(is_closed)) < 2
    keep[offsets[1:][is_closed] - 1] = False
    keep[is_lone[number]] = False
    sizes = np.bincount(number[keep], minlength=len(is_closed))[~is_lone]
    return points[keep], np.concatenate([[0], np.cumsum(sizes)]), is_closed[~is_lone]


def tiled(grids):
    """(m * m, a, b) grids as one large array with lines of NaN between them."""
    n, a, b = grids.shape
    m = round(n**0.5)
    around = np.full((m, m, a + 1, b + 1), np.nan)
    around[:, :, :a, :b] = grids.reshape(m, m, a, b)
    return around.transpose(0, 2, 1, 3).reshape(m * (a + 1), m * (b + 1))


def measures(points, offsets, is_closed, grids):
    """(n, 4) of each of n tiled grids: closed and open curves, area on the left, length."""
    m, size = round(len(grids) ** 0.5), np.array(grids.shape[1:]) + 1
    tile = (points[offsets[:-1]] + 1e-9) // size  # contourpy's points are off by rounding
    tile = np.repeat(tile, np.diff(offsets), axis=0)
    x, y = (points - tile * size).T
    after = np.arange(1, len(points) + 1)
    after[offsets[1:] - 1] = offsets[:-1]
    is_piece = np.ones(len(points), bool)
    is_piece[offsets[1:][~is_closed] - 1] = False
    area = np.where(is_piece, 0.5 * (x * y[after] - y * x[after]), 0.0)
    length = np.where(is_piece, np.hypot(x[after] - x, y[after] - y), 0.0)
    number = (tile @ [m, 1]).astype(int)
    one = number[offsets[:-1]]
    columns = (one, is_closed), (one, ~is_closed), (number, area), (number, length)
    return np.stack([np.bincount(k, weights, len(grids)) for k, weights in columns], axis=1)


def contourpy_curves(values, level):
    """(points, offsets, is_closed) by contourpy, which asks for the mean of the four corners.

    It calls a curve closed, too, when both ends lie on two edges of one node at the level.
    """
    generator = contourpy.contour_generator(
        z=-values, name="serial", line_type="ChunkCombinedOffset", corner_mask=False
    )
    # Inside is where -values > -level, so that a tie is outside
    (points,), (offsets,) = generator.lines(-level)
    # Its points are (j, i): the exchange turns curves around, and the reversal turns them back
    points, offsets = points[::-1, ::-1], (len(points) - offsets[::-1]).astype(int)
    return cleaned(points, offsets, (points[offsets[:-1]] == points[offsets[1:] - 1]).all(axis=1))
