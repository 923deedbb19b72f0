"""Do any two triangles of a mesh meet where they should not? Slow, and exact for the floats given.

Signs of volumes come from floating point where a generous bound leaves no doubt, and from rational
arithmetic where it does.
"""

from fractions import Fraction

import numpy as np
from scipy.spatial import cKDTree

DOUBT = 1e-12  # of the product of the sizes: far above rounding, 1e-15


def meeting_pairs(mesh):
    """(n, 2) faces that have a point in common beyond the corners that they share."""
    corners, faces = mesh.triangles, mesh.faces
    return [pair for pair in _near_pairs(corners) if _meet(corners, faces, *pair)]


def _near_pairs(corners):
    low, high = corners.min(axis=1), corners.max(axis=1)
    middle, radius = (low + high) / 2, np.linalg.norm(high - low, axis=1).max() / 2
    pairs = cKDTree(middle).query_pairs(2 * radius * (1 + 1e-9), output_type="ndarray")
    a, b = pairs.T
    overlap = ((low[a] <= high[b]) & (low[b] <= high[a])).all(axis=1)
    pairs = pairs[overlap]
    # One triangle clearly on one side of the other's plane
    apart = np.zeros(len(pairs), bool)
    for a, b in (pairs.T, pairs[:, ::-1].T):
        apart |= _clearly_beside(corners[a], corners[b])
    return pairs[~apart].tolist()


def _clearly_beside(plane, points):
    """The corners of one triangle are all clearly on one side of the plane of another."""
    normal = np.cross(plane[:, 1] - plane[:, 0], plane[:, 2] - plane[:, 0])
    height = np.einsum("nx,npx->np", normal, points - plane[:, :1])
    doubt = DOUBT * np.linalg.norm(normal, axis=1) * np.abs(points - plane[:, :1]).max(axis=(1, 2))
    return (height > doubt[:, None]).all(axis=1) | (height < -doubt[:, None]).all(axis=1)


def _meet(corners, faces, f, g):
    shared = [v for v in faces[f] if v in faces[g]]
    a = [tuple(map(Fraction, p)) for p in corners[f].tolist()]
    b = [tuple(map(Fraction, p)) for p in corners[g].tolist()]
    if len(shared) == 2:
        return _folded(a, b, [v in shared for v in faces[f]], [v in shared for v in faces[g]])
    if len(shared) == 1:
        # Beyond a common corner they meet only if an opposite side reaches the other
        own = [p for p, v in zip(a, faces[f], strict=True) if v not in shared]
        other = [p for p, v in zip(b, faces[g], strict=True) if v not in shared]
        return _side_meets(*own, b) or _side_meets(*other, a)
    sides = ((0, 1), (1, 2), (2, 0))
    return any(_side_meets(a[i], a[j], b) or _side_meets(b[i], b[j], a) for i, j in sides)


def _folded(a, b, is_shared_a, is_shared_b):
    """Two triangles on one edge lie in one plane, on the same side of the edge."""
    (p,) = [x for x, s in zip(a, is_shared_a, strict=True) if not s]
    (q,) = [x for x, s in zip(b, is_shared_b, strict=True) if not s]
    e, d = [x for x, s in zip(a, is_shared_a, strict=True) if s]
    if _volume(e, d, p, q) != 0:
        return False
    return _dot(_cross(_minus(d, e), _minus(p, e)), _cross(_minus(d, e), _minus(q, e))) > 0


def _side_meets(p, q, triangle):
    a, b, c = triangle
    s, t = _volume(a, b, c, p), _volume(a, b, c, q)
    if (s > 0 and t > 0) or (s < 0 and t < 0):
        return False
    if s == 0 and t == 0:
        return _flat_meets(p, q, triangle)
    turns = [_volume(p, q, a, b), _volume(p, q, b, c), _volume(p, q, c, a)]
    return min(turns) >= 0 or max(turns) <= 0


def _flat_meets(p, q, triangle):
    """The same in one plane, seen along the axis that its normal is longest on."""
    a, b, c = triangle
    normal = _cross(_minus(b, a), _minus(c, a))
    drop = max(range(3), key=lambda i: abs(normal[i]))
    p, q, a, b, c = ([x[i] for i in range(3) if i != drop] for x in (p, q, a, b, c))
    if any(_within(x, a, b, c) for x in (p, q)):
        return True
    return any(_cut(p, q, u, v) for u, v in ((a, b), (b, c), (c, a)))


def _within(x, a, b, c):
    turns = [_turn(a, b, x), _turn(b, c, x), _turn(c, a, x)]
    return min(turns) >= 0 or max(turns) <= 0


def _cut(p, q, u, v):
    one, two = _turn(p, q, u) * _turn(p, q, v), _turn(u, v, p) * _turn(u, v, q)
    if one == 0 and two == 0 and _turn(p, q, u) == 0 and _turn(p, q, v) == 0:
        return all(
            max(min(p[i], q[i]), min(u[i], v[i])) <= min(max(p[i], q[i]), max(u[i], v[i]))
            for i in range(2)
        )
    return one <= 0 and two <= 0


def _turn(a, b, c):
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _volume(a, b, c, d):
    return _dot(_cross(_minus(b, a), _minus(c, a)), _minus(d, a))


def _minus(a, b):
    return [x - y for x, y in zip(a, b, strict=True)]


def _cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _dot(a, b):
    return sum(x * y for x, y in zip(a, b, strict=True))
