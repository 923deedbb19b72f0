"""Which face a texel of an atlas shows, and where on it."""

import math

import numpy as np
from numba import njit

NO_FACE = -1


@njit(cache=True, nogil=True)
def draw_faces(uv, faces, height, width, margin, face_of, places):
    """Give every texel to the first face that covers its centre, or else comes within ``margin``.

    Coordinates (n, 2) are in texels, rows counted downwards: texel (row, column) has its centre at
    (column + 1/2, row + 1/2). ``places`` (h, w, 2) float32 are the weights of the face's second and
    third corner there; beyond the face's edge they continue its plane. Of texels beside faces the
    nearest face takes each; ``face_of`` (h, w) is NO_FACE where there is none. The picture repeats:
    what leaves it on one side enters on the other. Faces wider than the picture are left out.
    """
    gap = np.full((height, width), np.float32(np.inf))
    for f in range(len(faces)):
        ax, ay = uv[faces[f, 0], 0], uv[faces[f, 0], 1]
        ux, uy = uv[faces[f, 1], 0] - ax, uv[faces[f, 1], 1] - ay
        vx, vy = uv[faces[f, 2], 0] - ax, uv[faces[f, 2], 1] - ay
        cross = ux * vy - uy * vx
        if cross == 0.0 or not math.isfinite(cross):
            continue
        low_x, high_x = min(0.0, ux, vx) + ax, max(0.0, ux, vx) + ax
        low_y, high_y = min(0.0, uy, vy) + ay, max(0.0, uy, vy) + ay
        if high_x - low_x > width or high_y - low_y > height:
            continue
        for y in range(math.floor(low_y - margin), math.ceil(high_y + margin) + 1):
            for x in range(math.floor(low_x - margin), math.ceil(high_x + margin) + 1):
                row, column = y % height, x % width
                px, py = x + 0.5 - ax, y + 0.5 - ay
                s, t = (px * vy - py * vx) / cross, (ux * py - uy * px) / cross
                away = 0.0
                if s < 0.0 or t < 0.0 or s + t > 1.0:
                    away = _distance(px, py, ux, uy, vx, vy)
                    if away > margin:
                        continue
                if away < gap[row, column]:
                    gap[row, column] = away
                    face_of[row, column] = f
                    places[row, column, 0], places[row, column, 1] = s, t


@njit(cache=True, nogil=True, inline="always")
def _to_segment(px, py, dx, dy):
    length = dx * dx + dy * dy
    along = 0.0
    if length > 0.0:
        along = min(max((px * dx + py * dy) / length, 0.0), 1.0)
    return math.hypot(px - along * dx, py - along * dy)


@njit(cache=True, nogil=True)
def _distance(px, py, ux, uy, vx, vy):
    """Distance of p from the nearest edge of the triangle (0, u, v)."""
    first = min(_to_segment(px, py, ux, uy), _to_segment(px, py, vx, vy))
    return min(first, _to_segment(px - ux, py - uy, vx - ux, vy - uy))
