"""The two-set check done slowly and plainly: every edge of every face, in rational numbers."""

from collections import Counter
from fractions import Fraction

import numpy as np

from meshsdf.mesh import Mesh


def boundary_jumps(mesh: Mesh) -> Counter:
    """Signed ends of all face edges on their supporting lines: (line, place) -> sum of jumps.

    A line is (k, u, o): the first axis k along which it runs, its direction divided by the k-th
    component, and the point where its k-th coordinate is 0. The place is the k-th coordinate.
    """
    positions = [[Fraction(x) for x in p] for p in mesh.vertices.tolist()]
    jumps: Counter = Counter()
    for face in mesh.faces.tolist():
        for e in range(3):
            p, q = positions[face[e]], positions[face[(e + 1) % 3]]
            d = [b - a for a, b in zip(p, q, strict=True)]
            if not any(d):
                continue
            k = next(axis for axis in range(3) if d[axis])
            u = tuple(x / d[k] for x in d)
            line = (k, u, tuple(a - p[k] * x for a, x in zip(p, u, strict=True)))
            jumps[line, p[k]] += 1
            jumps[line, q[k]] -= 1
    return jumps


def is_two_set(mesh: Mesh) -> bool:
    """Every place on every line ends an even number of edges."""
    return all(jump % 2 == 0 for jump in boundary_jumps(mesh).values())


def is_oriented(mesh: Mesh) -> bool:
    """The directed ends cancel everywhere."""
    return not any(boundary_jumps(mesh).values())


def open_length(mesh: Mesh) -> float:
    """Total length of the intervals that an odd number of edges cover."""
    odd: dict = {}
    for (line, place), jump in boundary_jumps(mesh).items():
        if jump % 2:
            odd.setdefault(line, []).append(place)
    total = 0.0
    for (_, u, _), places in odd.items():
        places.sort()
        stretch = np.sqrt(sum(float(x) ** 2 for x in u))
        total += stretch * float(sum(b - a for a, b in zip(places[::2], places[1::2], strict=True)))
    return total


def ray_votes(mesh: Mesh, point: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Parity of the crossings of each ray from a point; rays in general position."""
    a, b, c = np.moveaxis(mesh.triangles, 1, 0) - point
    votes = []
    for d in directions:
        with np.errstate(divide="ignore", invalid="ignore"):
            u = np.einsum("ij,ij->i", np.cross(b, c), d[None])
            v = np.einsum("ij,ij->i", np.cross(c, a), d[None])
            w = np.einsum("ij,ij->i", np.cross(a, b), d[None])
            inside = ((u > 0) & (v > 0) & (w > 0)) | ((u < 0) & (v < 0) & (w < 0))
            height = np.einsum("ij,ij->i", np.cross(b - a, c - a), a) / (u + v + w)
        votes.append(int((inside & (height > 0)).sum()) % 2)
    return np.array(votes)
