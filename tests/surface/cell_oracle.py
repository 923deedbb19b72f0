"""Components, Euler characteristic and border loops of {f = 0} in cells, by sampling alone.

The trilinear interpolant is sampled on a finer lattice, and linear between the samples on the six
tetrahedra of every small cube that share its diagonal (Kuhn). What lies on one side is then the
full complex on the samples of that side, up to homotopy: its components and its Euler
characteristic are counted. The cube is a ball, so the surface has one component less than the two
sides together, and chi(surface) = chi(one side) + chi(other) - 1; the cube's own surface
likewise is cut by one loop less than the number of its regions.
"""

from itertools import combinations, product

import numpy as np
from scipy.ndimage import generate_binary_structure, label

_STEPS = [step for step in product((0, 1), repeat=3) if any(step)]


def _links():
    """(3, 3, 3, 3) neighbours of a sample in its own cell: along all steps, both ways."""
    links = np.zeros((3, 3, 3), bool)
    links[1, 1, 1] = True
    for step in _STEPS:
        links[tuple(1 + np.array(step))] = links[tuple(1 - np.array(step))] = True
    structure = np.zeros_like(generate_binary_structure(4, 1))
    structure[1] = links
    return structure


LINKS = _links()
# Simplices that start at a sample: chains of steps, each beyond the last on every axis
_CHAINS = [chain for n in range(4) for chain in combinations(_STEPS, n)
           if all((np.array(b) >= a).all() for a, b in combinations(chain, 2))]  # fmt: skip


def sampled(values, n):
    """(cells, n, n, n) interpolant of (cells, 8) corner values, order 4 x + 2 y + z."""
    t = np.linspace(0, 1, n)
    line = np.stack([1 - t, t])
    cube = values.reshape(-1, 2, 2, 2)
    return np.einsum("cxyz,xi,yj,zk->cijk", cube, line, line, line, optimize=True)


def count_pieces(mask):
    """(cells,) connected pieces of each cell's mask."""
    labels, n = label(mask, LINKS)
    highest = np.maximum.accumulate(labels.reshape(len(mask), -1).max(axis=1))
    assert len(mask) == 0 or highest[-1] == n
    return np.diff(highest, prepend=0)


def euler_of_side(mask):
    """(cells,) Euler characteristic of the full complex on the samples in the mask."""
    total = np.zeros(len(mask), np.int64)
    n = mask.shape[1]
    for chain in _CHAINS:
        reach = chain[-1] if chain else (0, 0, 0)
        size = [n - r for r in reach]
        found = np.ones((len(mask), *size), bool)
        for step in ((0, 0, 0), *chain):
            x, y, z = (slice(s, s + m) for s, m in zip(step, size, strict=True))
            found &= mask[:, x, y, z]
        total += (-1) ** len(chain) * found.sum(axis=(1, 2, 3))
    return total


def topology(values, n):
    """(cells, 3) components, Euler characteristic and loops; a sample at 0 is outside."""
    inside = sampled(values, n) < 0
    shell = np.ones((n, n, n), bool)
    shell[1:-1, 1:-1, 1:-1] = False
    sides = (inside, ~inside)
    components = sum(count_pieces(side) for side in sides) - 1
    euler = sum(euler_of_side(side) for side in sides) - 1
    loops = sum(count_pieces(side & shell) for side in sides) - 1
    return np.stack([components, euler, loops], axis=1)
