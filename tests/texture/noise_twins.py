"""Slow twins of the noise kernels: plain loops, and quadrature where the kernel integrates."""

import itertools
import math

import numpy as np

GRADIENTS = [
    (1, 1, 0), (-1, 1, 0), (1, -1, 0), (-1, -1, 0), (1, 0, 1), (-1, 0, 1), (1, 0, -1), (-1, 0, -1),
    (0, 1, 1), (0, -1, 1), (0, 1, -1), (0, -1, -1), (1, 1, 0), (0, -1, 1), (-1, 1, 0), (0, -1, -1),
]  # fmt: skip
WORD = 0xFFFFFFFF
FOLD = 0x9E3779B1


def pcg3d(x: int, y: int, z: int) -> tuple[int, int, int]:
    """The hash as its paper lists it, in unbounded integers."""
    x, y, z = ((v * 1664525 + 1013904223) & WORD for v in (x, y, z))
    for last in (False, True):
        x = (x + y * z) & WORD
        y = (y + z * x) & WORD
        z = (z + x * y) & WORD
        if not last:
            x, y, z = (v ^ (v >> 16) for v in (x, y, z))
    return x, y, z


def lattice_hash(i: int, j: int, k: int, seed: int) -> tuple[int, int, int]:
    """Fold 64 bits and a seed to three words, and hash these."""
    x, y, z = (int(v) % 2**64 for v in (i, j, k))
    salt = (seed * FOLD) % 2**64
    x = (x ^ ((x >> 32) * FOLD) ^ salt) & WORD
    y = (y ^ ((y >> 32) * FOLD) ^ (salt >> 16)) & WORD
    z = (z + (z >> 32) * FOLD + salt) & WORD
    return pcg3d(x, y, z)


def noise(point, seed: int) -> float:
    """Gradient noise at one point: eight corners, faded and blended along x, y, z."""
    cell = [math.floor(v) for v in point]
    offset = [v - c for v, c in zip(point, cell, strict=True)]
    corners = {}
    for corner in itertools.product((0, 1), repeat=3):
        at = [c + d for c, d in zip(cell, corner, strict=True)]
        gradient = GRADIENTS[lattice_hash(*at, seed)[0] & 15]
        arm = [o - d for o, d in zip(offset, corner, strict=True)]
        corners[corner] = gradient[0] * arm[0] + gradient[1] * arm[1] + gradient[2] * arm[2]
    u, v, w = (t * t * t * (t * (t * 6 - 15) + 10) for t in offset)

    def mix(t, a, b):
        return a + t * (b - a)

    rows = {(y, z): mix(u, corners[0, y, z], corners[1, y, z]) for y in (0, 1) for z in (0, 1)}
    return mix(w, mix(v, rows[0, 0], rows[1, 0]), mix(v, rows[0, 1], rows[1, 1]))


def mean_over_box(point, widths, seed: int) -> float:
    """Mean of `noise` over a box by Gauss's rule on each cell, exact for its polynomials."""
    nodes, weights = np.polynomial.legendre.leggauss(4)  # exact to degree 7; the noise has 6
    axes = []
    for x, width in zip(point, widths, strict=True):
        low, high = x - width / 2, x + width / 2
        cuts = [low, *range(math.floor(low) + 1, math.ceil(high)), high]
        axes.append(
            [
                ((a + b) / 2 + (b - a) / 2 * node, weight * (b - a) / 2 / width)
                for a, b in itertools.pairwise(cuts)
                for node, weight in zip(nodes, weights, strict=True)
            ]
        )
    return sum(
        x[1] * y[1] * z[1] * noise((x[0], y[0], z[0]), seed) for x, y, z in itertools.product(*axes)
    )


def features(point, reach: int, jitter: float, seed: int) -> tuple[float, float]:
    """F1 and F2 of one point by looking at every cell within reach."""
    cell = [math.floor(v) for v in point]
    squares = []
    for step in itertools.product(range(-reach, reach + 1), repeat=3):
        at = [c + d for c, d in zip(cell, step, strict=True)]
        marks = lattice_hash(*at, seed)
        square = 0.0
        for c, d, x, mark in zip(cell, step, point, marks, strict=True):
            square += (d + 0.5 + jitter * (mark / 2**32 - 0.5) - (x - c)) ** 2
        squares.append(square)
    first, second = sorted(squares)[:2]
    return math.sqrt(first), math.sqrt(second)
