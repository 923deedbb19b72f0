"""Slow twins of the kernels: plainly right, and used by tests only."""

from fractions import Fraction
from math import sqrt

import numpy as np


def distance_to_triangle(point, triangle) -> float:
    """Distance of one point to one triangle in rational arithmetic; rounded once, at the end."""
    return _root(square_to_triangle(point, triangle))


def square_to_triangle(point, triangle) -> Fraction:
    """Squared distance of one point to one triangle, without rounding."""
    p = [Fraction(float(x)) for x in point]
    a, b, c = ([Fraction(float(x)) for x in corner] for corner in triangle)
    squares = [_to_segment(p, a, b), _to_segment(p, b, c), _to_segment(p, c, a)]
    ab, ac, ap = _minus(b, a), _minus(c, a), _minus(p, a)
    bb, bc, cc = _dot(ab, ab), _dot(ab, ac), _dot(ac, ac)
    pb, pc = _dot(ap, ab), _dot(ap, ac)
    determinant = bb * cc - bc * bc
    if determinant > 0:
        v, w = (cc * pb - bc * pc) / determinant, (bb * pc - bc * pb) / determinant
        if v >= 0 and w >= 0 and v + w <= 1:
            rest = [ap[i] - v * ab[i] - w * ac[i] for i in range(3)]
            squares.append(_dot(rest, rest))
    return min(squares)


def closest_by_brute_force(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(n,) distances of (n, 3) points to (m, 3, 3) triangles: each against each.

    In extended precision where the machine has it, so that slivers have a plane.
    """
    p = points[:, None, :].astype(np.longdouble)
    a, b, c = (triangles[None, :, i, :].astype(np.longdouble) for i in range(3))
    squares = [_segments(p, a, b), _segments(p, b, c), _segments(p, c, a)]
    normal = np.cross(b - a, c - a)
    area = (normal**2).sum(-1)
    inside = np.ones(np.broadcast_shapes(p.shape, a.shape)[:2], bool)
    for start, end in ((a, b), (b, c), (c, a)):
        inside &= (np.cross(end - start, p - start) * normal).sum(-1) >= 0
    height = ((p - a) * normal).sum(-1) ** 2 / np.where(area > 0, area, 1.0)
    squares.append(np.where(inside & (area > 0), height, np.inf))
    return np.sqrt(np.minimum.reduce(squares).min(axis=1)).astype(np.float64)


def _segments(p, a, b):
    along = ((p - a) * (b - a)).sum(-1)
    square = ((b - a) ** 2).sum(-1)
    share = np.clip(along / np.where(square > 0, square, 1.0), 0.0, 1.0)[..., None]
    return ((p - a - share * (b - a)) ** 2).sum(-1)


def _to_segment(p, a, b):
    ab, ap = _minus(b, a), _minus(p, a)
    square = _dot(ab, ab)
    share = min(max(_dot(ap, ab) / square, Fraction(0)), Fraction(1)) if square else Fraction(0)
    rest = [ap[i] - share * ab[i] for i in range(3)]
    return _dot(rest, rest)


def _minus(p, q):
    return [x - y for x, y in zip(p, q, strict=True)]


def _dot(p, q):
    return sum(x * y for x, y in zip(p, q, strict=True))


def _root(square: Fraction) -> float:
    """Square root, scaled by a power of four so that tiny squares keep their digits."""
    if square == 0:
        return 0.0
    shift = 2 * ((square.denominator.bit_length() - square.numerator.bit_length()) // 2)
    scale = Fraction(2) ** shift
    return sqrt(float(square * scale)) / 2.0 ** (shift // 2)
