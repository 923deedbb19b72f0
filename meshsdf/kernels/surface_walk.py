"""The nearest place on a surface, looked for from face to face.

A walk starts on a face that is known to be near and crosses edges as long as that leads closer. It
ends where no neighbour is nearer: not always at the nearest point of the whole mesh, but on the
sheet it started from, where a search of all faces might jump to another one.
"""

import numpy as np
from numba import njit

from .point_triangle import closest_on_triangle

MOST_STEPS = 64
MOST_TURNS = 32  # faces looked at around one vertex


@njit(cache=True, nogil=True)
def find_neighbours(half_edges, first, beside):
    """``beside[f, e]`` = the face across edge e of face f; -1 unless there is exactly one."""
    for f in range(len(beside)):
        beside[f, 0] = beside[f, 1] = beside[f, 2] = -1
    for e in range(len(first) - 1):
        if first[e + 1] - first[e] == 2:
            h, g = half_edges[first[e]], half_edges[first[e] + 1]
            beside[h // 3, h % 3] = g // 3
            beside[g // 3, g % 3] = h // 3


@njit(cache=True, nogil=True)
def _measure(surface, f, x, weights):
    """Squared distance of x to a face; the weights of the nearest point."""
    v = surface.faces[f]
    square, weights[0], weights[1], weights[2] = closest_on_triangle(
        x[0], x[1], x[2], surface.points[v[0]], surface.points[v[1]], surface.points[v[2]]
    )
    return square


@njit(cache=True, nogil=True)
def _look_around(surface, f, corner, x, best, weights, trial):
    """Look at the faces around a corner of f; return the nearest and its squared distance."""
    nearest, v = f, surface.faces[f, corner]
    last, e = f, corner
    for _ in range(MOST_TURNS):
        g = surface.beside[last, e]
        if g < 0 or g == f:
            break
        square = _measure(surface, g, x, trial)
        if square < best:
            best, nearest = square, g
            for k in range(3):
                weights[k] = trial[k]
        # Two edges of g are at the vertex; leave by the one it was not entered by
        at = 0 if surface.faces[g, 0] == v else (1 if surface.faces[g, 1] == v else 2)
        e = (at + 2) % 3 if surface.beside[g, at] == last else at
        last = g
    return nearest, best


@njit(cache=True, nogil=True)
def walk(surface, f, x, weights, trial, foot):
    """Write the point nearest to x that is found from face f on; return its squared distance."""
    best = _measure(surface, f, x, weights)
    for _ in range(MOST_STEPS):
        nearest = f
        n_zero = (weights[0] == 0.0) + (weights[1] == 0.0) + (weights[2] == 0.0)
        if best == 0.0 or n_zero == 0:
            break
        if n_zero == 2:
            corner = 0 if weights[0] != 0.0 else (1 if weights[1] != 0.0 else 2)
            nearest, best = _look_around(surface, f, corner, x, best, weights, trial)
        else:
            opposite = 0 if weights[0] == 0.0 else (1 if weights[1] == 0.0 else 2)
            g = surface.beside[f, (opposite + 1) % 3]
            if g >= 0:
                square = _measure(surface, g, x, trial)
                if square < best:
                    best, nearest = square, g
                    for k in range(3):
                        weights[k] = trial[k]
        if nearest == f:
            break
        f = nearest
    for k in range(3):
        foot[k] = 0.0
        for corner in range(3):
            foot[k] += weights[corner] * surface.points[surface.faces[f, corner], k]
    return best


@njit(cache=True, nogil=True)
def _is_over(surface, f, normal, x, enough):
    """Tell whether x is no farther than ``enough`` (squared) from a place within a face."""
    a = surface.points[surface.faces[f, 0]]
    height = normal[0] * (x[0] - a[0]) + normal[1] * (x[1] - a[1]) + normal[2] * (x[2] - a[2])
    if height * height > enough:
        return False
    lowest, highest = np.inf, -np.inf
    for e in range(3):
        p = surface.points[surface.faces[f, e]]
        q = surface.points[surface.faces[f, (e + 1) % 3]]
        dx, dy, dz = q[0] - p[0], q[1] - p[1], q[2] - p[2]
        px, py, pz = x[0] - p[0], x[1] - p[1], x[2] - p[2]
        turn = (
            normal[0] * (dy * pz - dz * py)
            + normal[1] * (dz * px - dx * pz)
            + normal[2] * (dx * py - dy * px)
        )
        lowest, highest = min(lowest, turn), max(highest, turn)
    return lowest >= 0.0 or highest <= 0.0


@njit(cache=True, nogil=True)
def walk_points(surface, loops, normals, chosen, enough, begin, end, places, is_off):
    """Move ``places[n]`` onto the surface, as seen from loop ``chosen[n]``, if it is off.

    That is, if no walk from the faces that the loop's crossings lie on leads to a point nearer
    than ``enough[n]``, a squared distance; without such faces it stays. ``is_off[n]`` tells.
    """
    weights, trial, foot, best_foot = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for n in range(begin, end):
        first, last = loops.start[chosen[n]], loops.start[chosen[n] + 1]
        best, s = np.inf, first
        while s < last and best > enough[n]:
            f = surface.hits[loops.sides[s]]
            if f >= 0 and _is_over(surface, f, normals[loops.sides[s]], places[n], enough[n]):
                best = 0.0
            s += 1
        s = first
        while s < last and best > enough[n]:
            f = surface.hits[loops.sides[s]]
            s += 1
            if f < 0:
                continue
            square = walk(surface, f, places[n], weights, trial, foot)
            if square < best:
                best = square
                for k in range(3):
                    best_foot[k] = foot[k]
        is_off[n] = enough[n] < best < np.inf
        if is_off[n]:
            for k in range(3):
                places[n, k] = best_foot[k]
