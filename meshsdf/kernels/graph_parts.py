"""Cut the part of a triangle P under one face of a graph to pieces with linear bounds of the
distance (see `graph_distance`).

A rival of a face F is another face that may be nearer to a point under F: it is within reach
sideways, its plane is nearer somewhere, and it is not all behind F's plane, which would keep it
farther away. Where no rival's plane is nearer and the foot on F's plane lies in F, the distance to
that plane is the distance, and it is linear. What is cut off is a narrow strip.
"""

import numpy as np
from numba import njit

from .graph_shadows import CRUMB, plane_height


@njit(cache=True, nogil=True)
def cut_parts(
    n_near, n_cells, cells, n_sides, face_of_cell, solid, plane, turn, steep, margin, polygons,
    values, rivals, parts,
):  # fmt: skip
    """Cut all cells to triangles with linear bounds; their number, -1 if too many.

    ``parts[k]`` = area, lower bound at three corners, upper bound at three corners, side of T.
    """
    n_parts = np.int64(0)  # typed, as a literal would have everything compiled twice
    for c in range(n_cells):
        for sign in (1.0, -1.0):
            # The part of the cell that T is above, or below
            n, inside = n_sides[c], 0
            for i in range(n):
                values[i] = sign * cells[c, i, 2]
                inside += values[i] >= 0.0
                for column in range(3):
                    polygons[0, i, column] = cells[c, i, column]
            if inside == 0:
                continue
            if inside < n:
                _, n = _split(polygons[0], n, values, polygons[2], polygons[1])
                _copy(polygons[1], n, polygons[0])
            for i in range(n):
                polygons[0, i, 2] = max(sign * polygons[0, i, 2], 0.0)
            n_parts = _cell_parts(
                n_near, n, face_of_cell[c], solid, plane, turn, sign, steep, margin, polygons,
                values, rivals, parts, n_parts,
            )  # fmt: skip
            if n_parts < 0 or inside == n_sides[c]:
                break
        if n_parts < 0:
            return -1
    return n_parts


@njit(cache=True, nogil=True)
def _split(polygon, n, values, outside, inside):
    """Cut a convex polygon where a linear function, given at the corners, is zero.

    Numbers of corners of the parts where it is negative, and where it is not.
    """
    n_out = n_in = 0
    last = n - 1
    for i in range(n):
        if (values[last] < 0.0) != (values[i] < 0.0):
            share = values[last] / (values[last] - values[i])
            for column in range(3):
                x = polygon[last, column]
                x += share * (polygon[i, column] - x)
                outside[n_out, column] = inside[n_in, column] = x
            n_out += 1
            n_in += 1
        for column in range(3):
            if values[i] < 0.0:
                outside[n_out, column] = polygon[i, column]
            else:
                inside[n_in, column] = polygon[i, column]
        if values[i] < 0.0:
            n_out += 1
        else:
            n_in += 1
        last = i
    return n_out, n_in


@njit(cache=True, nogil=True)
def _copy(polygon, n, copy):
    for i in range(n):
        for column in range(3):
            copy[i, column] = polygon[i, column]


@njit(cache=True, nogil=True)
def _cell_parts(
    n_near, n, face, solid, plane, turn, sign, steep, margin, polygons, values, rivals, parts,
    n_parts,
):  # fmt: skip
    """Parts of one cell, ``polygons[0]`` with |t| in its last column."""
    polygon, own, nobody = polygons[0], plane[face], np.int64(0)
    cos = 1.0 / np.sqrt(1.0 + own[8] * own[8])
    n_rivals = _find_rivals(
        n_near, polygon, n, face, solid, plane, turn, sign, steep, cos, margin, rivals
    )
    # Where the plane of another face is nearer
    for r in range(n_rivals):
        other = plane[rivals[r]]
        scale, below = sign / np.sqrt(1.0 + other[8] * other[8]), 0
        for i in range(n):
            values[i] = (
                scale * plane_height(other, polygon[i, 0], polygon[i, 1]) - cos * polygon[i, 2]
            )
            below += values[i] < 0.0
        if below == 0:
            continue
        n_out, n_in = _split(polygon, n, values, polygons[2], polygons[1])
        n_parts = _emit(
            polygons[2], n_out, face, n_rivals, rivals, solid, plane, turn, sign, steep, cos,
            margin, parts, n_parts,
        )  # fmt: skip
        n = n_in
        _copy(polygons[1], n, polygon)
        if n < 3 or n_parts < 0:
            return n_parts
    # Where the foot on the face's own plane is outside the face
    for edge in range(3):
        below = 0
        for i in range(n):
            values[i] = _foot_inside(polygon[i], solid[face], own, edge, turn, sign, cos)
            below += values[i] < -CRUMB * margin
        if below == 0:
            continue
        n_out, n_in = _split(polygon, n, values, polygons[2], polygons[1])
        n_parts = _emit(
            polygons[2], n_out, face, nobody, rivals, solid, plane, turn, sign, steep, cos, margin,
            parts, n_parts,
        )  # fmt: skip
        n = n_in
        _copy(polygons[1], n, polygon)
        if n < 3 or n_parts < 0:
            return n_parts
    return _emit(
        polygon,
        n,
        face,
        nobody,
        rivals,
        solid,
        plane,
        turn,
        sign,
        steep,
        cos,
        margin,
        parts,
        n_parts,
    )


@njit(cache=True, nogil=True)
def _find_rivals(
    n_near, polygon, n, face, solid, plane, turn, sign, steep, cos, margin, rivals
):  # fmt: skip
    """List the faces that may be nearer to some point of a cell than the cell's own plane."""
    own, n_rivals, high = plane[face], 0, 0.0
    low_x = low_y = np.inf
    high_x = high_y = -np.inf
    for i in range(n):
        low_x, high_x = min(low_x, polygon[i, 0]), max(high_x, polygon[i, 0])
        low_y, high_y = min(low_y, polygon[i, 1]), max(high_y, polygon[i, 1])
        high = max(high, polygon[i, 2])
    # No closest point is farther off sideways
    width = high * (2.0 * steep / (1.0 + steep * steep) if steep < 1.0 else 1.0) + margin
    for k in range(n_near):
        t, p = solid[k], plane[k]
        if (
            k == face
            or turn * p[7] <= 0.0
            or max(t[0, 0], t[1, 0], t[2, 0]) < low_x - width
            or min(t[0, 0], t[1, 0], t[2, 0]) > high_x + width
            or max(t[0, 1], t[1, 1], t[2, 1]) < low_y - width
            or min(t[0, 1], t[1, 1], t[2, 1]) > high_y + width
        ):
            continue
        # Its plane is nearer somewhere
        scale, is_nearer = sign / np.sqrt(1.0 + p[8] * p[8]), False
        for i in range(n):
            z = scale * plane_height(p, polygon[i, 0], polygon[i, 1])
            is_nearer = is_nearer or z < cos * polygon[i, 2] - CRUMB * margin
        if not is_nearer:
            continue
        # It is not all behind the cell's own plane
        is_behind = True
        for i in range(3):
            rise = sign * (t[i, 2] - plane_height(own, t[i, 0], t[i, 1]))
            is_behind = is_behind and rise >= -CRUMB * margin
        if is_behind:
            continue
        # The cell is not beyond one of its sides
        is_beyond = False
        for i in range(3):
            j = (i + 1) % 3
            ex, ey = turn * (t[j, 0] - t[i, 0]), turn * (t[j, 1] - t[i, 1])
            most = -np.inf
            for v in range(n):
                most = max(most, ex * (polygon[v, 1] - t[i, 1]) - ey * (polygon[v, 0] - t[i, 0]))
            is_beyond = is_beyond or most < -width * np.sqrt(ex * ex + ey * ey)
        if not is_beyond:
            rivals[n_rivals] = k
            n_rivals += 1
    return n_rivals


@njit(cache=True, nogil=True)
def _foot_inside(point, triangle, own, edge, turn, sign, cos):
    """How far the foot on a face's plane is inside one of its sides, seen from above."""
    j = (edge + 1) % 3
    ex, ey = triangle[j, 0] - triangle[edge, 0], triangle[j, 1] - triangle[edge, 1]
    shift = sign * point[2] * cos * cos
    x = point[0] - shift * (own[4] * own[2] - own[5] * own[3]) - triangle[edge, 0]
    y = point[1] - shift * (own[4] * own[3] + own[5] * own[2]) - triangle[edge, 1]
    return turn * (ex * y - ey * x) / np.sqrt(ex * ex + ey * ey)


@njit(cache=True, nogil=True)
def _emit(
    polygon, n, face, n_rivals, rivals, solid, plane, turn, sign, steep, cos, margin, parts,
    n_parts,
):  # fmt: skip
    """Append a polygon as triangles.

    At each corner d is at most the distance to the face's plane if the foot lies in the face, |t|
    otherwise: d <= distance to the face, which is convex. It is at least the least distance to the
    planes of the face and its rivals, which is concave, and also |t| cos L.
    """
    if n < 3:
        return n_parts
    if n_parts + n > len(parts):
        return -1
    cos_least = 1.0 / np.sqrt(1.0 + steep * steep)
    first = n_parts
    for i in range(n):
        t = polygon[i, 2]
        low = high = cos * t
        for edge in range(3):
            inside = _foot_inside(polygon[i], solid[face], plane[face], edge, turn, sign, cos)
            if inside < -CRUMB * margin:
                high = t
        for r in range(n_rivals):
            other = plane[rivals[r]]
            scale = sign / np.sqrt(1.0 + other[8] * other[8])
            low = min(low, scale * plane_height(other, polygon[i, 0], polygon[i, 1]))
        # Each corner in the row of the triangle it completes; the first two wait in the first
        row = max(first, first + i - 2)
        at = 1 if i == 0 else (2 if i == 1 else 3)
        parts[row, at], parts[row, at + 3] = low, high
    n_parts = first + n - 2
    for i in range(2, n):
        row = first + i - 2
        parts[row, 0] = 0.5 * (
            (polygon[i - 1, 0] - polygon[0, 0]) * (polygon[i, 1] - polygon[0, 1])
            - (polygon[i - 1, 1] - polygon[0, 1]) * (polygon[i, 0] - polygon[0, 0])
        )
        if i > 2:
            parts[row, 1], parts[row, 4] = parts[first, 1], parts[first, 4]
            parts[row, 2], parts[row, 5] = parts[row - 1, 3], parts[row - 1, 6]
        # T above P: P is behind a face that looks up, so inside
        parts[row, 7] = -turn * sign
    for i in range(2, n):
        row = first + i - 2
        a, b, c = polygon[0, 2], polygon[i - 1, 2], polygon[i, 2]
        if parts[row, 1] + parts[row, 2] + parts[row, 3] < cos_least * (a + b + c):
            parts[row, 1], parts[row, 2], parts[row, 3] = (
                cos_least * a, cos_least * b, cos_least * c,
            )  # fmt: skip
    return n_parts
