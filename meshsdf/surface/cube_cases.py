"""The 256 sign patterns of a cube and the triangles each one holds, derived instead of listed.

Corner ``c = 4 x + 2 y + z`` of the unit cube is bit c of a pattern, set where the corner is
inside. Edge ``4 a + 2 u + v`` runs along axis a; u and v are its coordinates on the other two
axes, in order. The derivation has three steps.

1. Arcs. Walk the four corners of a face counter-clockwise, seen from outside the cube. Every
   run of inside corners is cut off by one arc, from the edge where the run is entered to the
   edge where it is left. A face with alternating signs thus keeps its two inside corners apart.
   The rule reads nothing but the face, so the two cubes that share it agree, whatever the values
   (Montani, Scateni and Scopigno 1994, doi:10.1007/BF01900830).
2. Loops. Two faces meet in an edge and walk it in opposite directions: every crossed edge ends
   one arc and begins one. Following the arcs gives closed loops, each edge on one of them, with
   the outside on the side the triangles' normals point to.
3. Triangles. A loop is cut by diagonals into triangles of least total area, the crossings
   taken at mid-edge (Klincsek 1980, doi:10.1016/S0167-5060(08)70044-X). A diagonal never joins two
   edges of one face, because the neighbour across that face could then draw the same line, and
   four triangles would share it. Every loop of every pattern can be cut under that rule, so no
   vertex is ever needed inside a cube.
"""

from dataclasses import dataclass
from functools import cache
from itertools import combinations, product

import numpy as np
from jaxtyping import Int8, UInt16

CORNERS = tuple(product((0, 1), repeat=3))
"""(x, y, z) of corner ``4 x + 2 y + z``."""


def _number_edges() -> tuple[tuple[int, int], ...]:
    ends = []
    for axis in range(3):
        step = 4 >> axis
        ends += [(c, c + step) for c in range(8) if not c & step]
    return tuple(ends)


EDGES = _number_edges()
"""(lower corner, upper corner) of each of the 12 edges."""


def _walk_faces() -> tuple[tuple[int, ...], ...]:
    faces = []
    for axis, side in product(range(3), (0, 1)):
        u, v = 4 >> (axis + 1) % 3, 4 >> (axis + 2) % 3
        base = side * (4 >> axis)
        walk = (base, base + u, base + u + v, base + v)  # about +axis: u, v, axis turn right-handed
        faces.append(walk if side else walk[::-1])
    return tuple(faces)


FACES = _walk_faces()
"""Corners of each of the 6 faces (axis 0 low, high, axis 1 ...), counter-clockwise from outside."""

_EDGE_OF = {frozenset(ends): edge for edge, ends in enumerate(EDGES)}
_FACE_EDGES = tuple(
    tuple(_EDGE_OF[frozenset((face[n], face[(n + 1) % 4]))] for n in range(4)) for face in FACES
)


@dataclass(frozen=True, eq=False)
class CubeCases:
    """What each of the 256 patterns holds.

    Attributes
    ----------
    crossed : (256,) uint16
        Bit e is set where edge e joins an inside and an outside corner.
    n_triangles : (256,) int8
        Triangles of each pattern.
    triangles : (256, 3 t) int8
        Edges of the triangles' corners, three by three, counter-clockwise seen from the
        outside corners; -1 beyond the last.
    """

    crossed: UInt16[np.ndarray, "256"]
    n_triangles: Int8[np.ndarray, "256"]
    triangles: Int8[np.ndarray, "256 t"]


def face_arcs(pattern: int, face: int, *, joined: bool = False) -> dict[int, int]:
    """Return {edge the arc starts from: edge it ends at} for one face of a pattern.

    With ``joined`` the inside corners of a face with alternating signs hang together.
    """
    inside = [bool(pattern >> corner & 1) for corner in FACES[face]]
    arcs = {}
    for n in range(4):
        if inside[n] or not inside[(n + 1) % 4]:
            continue
        last = n + 1
        while inside[(last + 1) % 4]:
            last += 1
        arcs[_FACE_EDGES[face][n]] = _FACE_EDGES[face][last % 4]
    if joined and len(arcs) == 2:
        (first, one), (second, other) = arcs.items()
        arcs = {first: other, second: one}
    return arcs


def loops(pattern: int, joined_faces: int = 0) -> list[tuple[int, ...]]:
    """Return the closed loops of a pattern as edges in order, the lowest edge first.

    Bit n of ``joined_faces``: the inside corners of face n hang together.
    """
    following = {}
    for face in range(6):
        following |= face_arcs(pattern, face, joined=bool(joined_faces >> face & 1))
    found = []
    while following:
        loop = [min(following)]
        while (after := following.pop(loop[-1])) != loop[0]:
            loop.append(after)
        found.append(tuple(loop))
    return found


def triangulate(loop: tuple[int, ...]) -> list[tuple[int, int, int]] | None:
    """Cut a loop into triangles of least total area, without a diagonal inside a cube face.

    None where every way has such a diagonal; no loop of `cube_cases` is like that.
    """
    n = len(loop)
    best = {(i, i + 1): (0, -1) for i in range(n - 1)}
    for width in range(2, n):
        for i in range(n - width):
            k = i + width
            if width < n - 1 and loop[k] in coplanar_edges()[loop[i]]:
                continue
            choices = [
                (best[i, j][0] + best[j, k][0] + areas()[loop[i], loop[j], loop[k]], j)
                for j in range(i + 1, k)
                if (i, j) in best and (j, k) in best
            ]
            if choices:
                best[i, k] = min(choices)
    if (0, n - 1) not in best:
        return None
    triangles, todo = [], [(0, n - 1)]
    while todo:
        i, k = todo.pop()
        if k - i > 1:
            j = best[i, k][1]
            triangles.append((loop[i], loop[j], loop[k]))
            todo += [(j, k), (i, j)]
    return triangles


@cache
def cube_cases() -> CubeCases:
    """Derive the triangles of all patterns; done once per process, in a few milliseconds."""
    known = {}
    patches = []
    for pattern in range(256):
        patch = []
        for loop in loops(pattern):
            if loop not in known:
                known[loop] = triangulate(loop)
            patch += known[loop]
        patches.append(patch)
    n_triangles = np.array([len(patch) for patch in patches], np.int8)
    triangles = np.full((256, 3 * n_triangles.max()), -1, np.int8)
    crossed = np.zeros(256, np.uint16)
    for pattern, patch in enumerate(patches):
        triangles[pattern, : 3 * len(patch)] = np.ravel(patch)
        crossed[pattern] = sum(
            1 << edge for edge, (a, b) in enumerate(EDGES) if (pattern >> a ^ pattern >> b) & 1
        )
    return CubeCases(crossed, n_triangles, triangles)


@cache
def coplanar_edges() -> tuple[frozenset[int], ...]:
    """For each edge, the edges that lie on a face with it."""
    return tuple(
        frozenset(other for face in _FACE_EDGES if edge in face for other in face)
        for edge in range(12)
    )


@cache
def areas() -> dict[tuple[int, int, int], int]:
    """Area of the triangle of any three mid-edges, in whatever order.

    In integer units of 1e-9, so that sums are exact and ties are ties on every machine.
    """
    corners = np.array(CORNERS, dtype=float)
    middle = corners[np.array(EDGES)].mean(axis=1)
    triples = np.array(list(combinations(range(12), 3)))
    a, b, c = middle[triples].transpose(1, 0, 2)
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return {
        order: round(1e9 * float(size))
        for (i, j, k), size in zip(triples.tolist(), area, strict=True)
        for order in ((i, j, k), (j, k, i), (k, i, j), (i, k, j), (k, j, i), (j, i, k))
    }
