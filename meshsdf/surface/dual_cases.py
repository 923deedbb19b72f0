"""The loops of the 256 sign patterns of a cube, as dual contouring needs them.

Every loop of `cube_cases.loops` becomes one vertex. A crossed edge lies on a loop of each of the
four cells around it, and these four vertices, in order, make its polygon. Two loops of
neighbouring cells follow each other in a polygon wherever an arc on their common face belongs to
both. A cell face holds at most two arcs; only where both belong to the same two loops would two
edges of the mesh have the same ends. Such a face is folded in both cells.

Loops of one cell are parted by planes: for any two there is a plane ``normal . x = offset`` such
that all crossings of one, wherever they lie on their edges, are strictly below and all of the
other strictly above (checked for every pattern in the tests).
"""

from dataclasses import dataclass
from functools import cache
from itertools import combinations, product

import numpy as np
from jaxtyping import Float64, Int8, UInt8

from .cube_cases import CORNERS, EDGES, FACES, face_arcs, loops

MOST_LOOPS = 4
MOST_PLANES = 3
ALL_FACES = 0b111111

_NORMALS = tuple(n for n in product((-1, 0, 1), repeat=3) if any(n))


@dataclass(frozen=True, eq=False)
class DualCases:
    """What each of the 256 patterns holds.

    Attributes
    ----------
    n_loops : (256,) int8
        Loops of each pattern.
    n_sides : (256,) int8
        Crossed edges of each pattern; every one lies on one loop.
    loop_size : (256, 4) int8
        Crossed edges of each loop, in the order of `cube_cases.loops`.
    loop_edges : (256, 12) int8
        Edges of the loops, one loop behind the other; -1 beyond the last.
    folded : (256, 6) uint8
        1 where a face has two arcs that belong to one loop.
    """

    n_loops: Int8[np.ndarray, "256"]
    n_sides: Int8[np.ndarray, "256"]
    loop_size: Int8[np.ndarray, "256 4"]
    loop_edges: Int8[np.ndarray, "256 12"]
    folded: UInt8[np.ndarray, "256 6"]


@cache
def dual_cases(*, joined: bool = False) -> DualCases:
    """Derive the loops of all patterns; done once per process, in some milliseconds.

    Of corners that face each other across a side of the cell, those outside are joined, or those
    inside if ``joined``.
    """
    n_loops, n_sides = np.zeros((2, 256), np.int8)
    loop_size = np.zeros((256, MOST_LOOPS), np.int8)
    loop_edges = np.full((256, 12), -1, np.int8)
    folded = np.zeros((256, len(FACES)), np.uint8)
    for pattern in range(256):
        found = loops(pattern, ALL_FACES if joined else 0)
        edges = [edge for loop in found for edge in loop]
        n_loops[pattern], n_sides[pattern] = len(found), len(edges)
        loop_size[pattern, : len(found)] = [len(loop) for loop in found]
        loop_edges[pattern, : len(edges)] = edges
        loop_of = {edge: number for number, loop in enumerate(found) for edge in loop}
        for face in range(len(FACES)):
            arcs = face_arcs(pattern, face, joined=joined)
            folded[pattern, face] = len(arcs) == 2 and len({loop_of[edge] for edge in arcs}) == 1
    return DualCases(n_loops, n_sides, loop_size, loop_edges, folded)


@cache
def parting_planes() -> Float64[np.ndarray, "256 4 3 4"]:
    """Normal and offset of the planes that part each loop from the others of its cell.

    The loop lies where ``normal . x < offset``; unused rows are 0, 0, 0, 1, true everywhere.
    """
    planes = np.zeros((256, MOST_LOOPS, MOST_PLANES, 4))
    planes[..., 3] = 1.0
    for pattern in range(256):
        found = loops(pattern)
        used = [0] * len(found)
        for a, b in combinations(range(len(found)), 2):
            normal, offset = parting_plane(found[a], found[b])
            for loop, sign in ((a, 1), (b, -1)):
                planes[pattern, loop, used[loop]] = sign * np.array([*normal, offset])
                used[loop] += 1
    return planes


@cache
def parting_plane(
    below: tuple[int, ...], above: tuple[int, ...]
) -> tuple[tuple[int, int, int], float]:
    """Find a plane between all points of the open edges ``below`` and all of those ``above``.

    Of the planes with normals of -1, 0 and 1 the one with the most room; StopIteration if there
    is none, which does not happen for the loops of a pattern.
    """
    corners = np.array(CORNERS)
    ends = [corners[np.array([EDGES[edge] for edge in loop])] for loop in (below, above)]
    choices = []
    for normal in _NORMALS:
        low, high = (place @ np.array(normal) for place in ends)
        offset = low.max() / 2 + high.min() / 2
        room = high.min() - low.max()
        # Strict on open edges: of each edge at least one end is off the plane
        if room >= 0 and (low.min(axis=1) < offset).all() and (high.max(axis=1) > offset).all():
            choices.append((-room, int(np.abs(normal).sum()), normal, float(offset)))
    return next((normal, offset) for _, _, normal, offset in sorted(choices))


def _quadrants() -> np.ndarray:
    """(12, 3): quadrant of a cell around each of its edges, and its faces after and before it.

    Quadrants are counted counter-clockwise about the edge's axis a, the first in the positive
    directions of axes a + 1 and a + 2. Of the two faces at the edge one is shared with the cell of
    the next quadrant, one with that of the last.
    """
    table = np.empty((12, 3), np.int8)
    for edge, (low, _) in enumerate(EDGES):
        axis = edge // 4
        s, t = (axis + 1) % 3, (axis + 2) % 3
        # Where the edge lies at the upper end of the cell, the cell lies at the edge's lower side
        at = CORNERS[low][s], CORNERS[low][t]
        quadrant = {(0, 0): 0, (1, 0): 1, (1, 1): 2, (0, 1): 3}[at]
        on_s, on_t = 2 * s + at[0], 2 * t + at[1]
        table[edge] = (quadrant, on_s, on_t) if quadrant % 2 == 0 else (quadrant, on_t, on_s)
    return table


QUADRANTS = _quadrants()
"""Of each edge: the quadrant of its cell, and the faces shared with the next and the last."""
