"""What a cube may hold beyond its sign pattern, derived: joined face corners, and tunnels.

Two things are not settled by the signs of the corners. Of a face with alternating signs either the
inside or the outside corners hang together within the face. And two regions of equal sign that the
faces keep apart may hang together through the interior: the surface then has a tunnel, a band
between the two loops around those regions. A pattern, one bit for every face and the tunnel are
all there is (`cell_decider` finds them from the values). Each combination is one row of triangles:

1. Loops follow from arcs as in `cube_cases`; where the inside corners of a face are joined, its
   two arcs exchange their ends.
2. A loop is cut into triangles as in `cube_cases`. Joined faces make loops that cannot be cut
   without a diagonal inside a cube face; their triangles meet in a vertex at the mean of the
   loop's crossings.
3. A band is cut along two lines that join its loops, apart at both ends and not inside cube faces,
   and each of the two halves then treated like a loop. Of all such lines those that need the
   fewest new vertices are taken, then those of least area.

A tunnel is known by the diagonal it follows when it is seen along the third axis: the columns of
corners (0, 0), (0, 1), (1, 1), (1, 0) go around the cube, and the tunnel joins the first and the
third, or the second and the fourth, through outside or through inside. It exists only where it
appears so along every axis.
"""

from dataclasses import dataclass
from functools import cache
from itertools import combinations, permutations

import numpy as np
from jaxtyping import Int8, Int16, Int64, UInt8, UInt16

from .cube_cases import (
    CORNERS,
    EDGES,
    FACES,
    areas,
    coplanar_edges,
    cube_cases,
    loops,
    triangulate,
)

COLUMNS = ((0, 1), (2, 3), (6, 7), (4, 5))
"""(lower, upper) corner of the columns along the third axis, in the order around the cube."""

TUNNELS = ((0, False), (1, False), (0, True), (1, True))
"""Tunnel n + 1 joins columns m and m + 2, through inside corners or not: (m, inside)."""

CENTER = len(EDGES)
"""Triangles name the vertices within the cube as CENTER and CENTER + 1."""

Triangles = list[tuple[int, int, int]]

_MIDDLES = np.array(CORNERS, float)[np.array(EDGES)].mean(axis=1)


@dataclass(frozen=True, eq=False)
class CellCases:
    """The triangles of every case, and which row of them a cell takes.

    Attributes
    ----------
    row : (256, 64, 5) int16
        Row of a pattern, joined faces (bit n: face n) and tunnel (0: none); -1 where impossible.
    is_special : (256,) uint8
        1 where the pattern alone does not name the row. Elsewhere the row is the pattern.
    sizes : (256, 2) int64
        Triangles of a pattern, 0 for special ones; 1 for special ones.
    crossed : (256,) uint16
        As in `cube_cases`.
    n_triangles, n_centers : (r,) int8
        Of each row.
    triangles : (r, 3 t) int8
        As in `cube_cases`; CENTER and CENTER + 1 are vertices within the cube.
    center_edges : (r, 2) uint16
        Edges whose crossings each such vertex is the mean of, as bits.
    """

    row: Int16[np.ndarray, "256 64 5"]
    is_special: UInt8[np.ndarray, "256"]
    sizes: Int64[np.ndarray, "256 2"]
    crossed: UInt16[np.ndarray, "256"]
    n_triangles: Int8[np.ndarray, " r"]
    n_centers: Int8[np.ndarray, " r"]
    triangles: Int8[np.ndarray, "r t"]
    center_edges: UInt16[np.ndarray, "r 2"]


@cache
def manifold_cells() -> CellCases:
    """Every pattern names its row: inside corners of a face are never joined, no tunnels."""
    return _assemble({}, [])


@cache
def trilinear_cells() -> CellCases:
    """All cases of the trilinear interpolant; derived once per process."""
    rows, patches = {}, []
    for pattern in range(256):
        for joined in _joined_faces(pattern):
            found = loops(pattern, joined)
            choices = {0: None} | tunnels(pattern, joined)
            if len(choices) == 1 and not joined and not alternating_faces(pattern):
                continue
            for tunnel, pair in choices.items():
                rows[pattern, joined, tunnel] = 256 + len(patches)
                patches.append(_patch(found, pair))
    return _assemble(rows, patches)


def alternating_faces(pattern: int) -> list[int]:
    """Return the faces whose corners are inside and outside in turn."""
    signs = [[pattern >> corner & 1 for corner in face] for face in FACES]
    return [n for n, (a, b, c, d) in enumerate(signs) if a == c != b == d]


def regions(pattern: int, joined_faces: int) -> list[int]:
    """Return a number for each corner: equal where corners hang together on the cube's surface."""
    region = list(range(8))
    links = [(a, b) for a, b in EDGES if (pattern >> a ^ pattern >> b) & 1 == 0]
    for n in alternating_faces(pattern):
        a, b, c, d = FACES[n]
        links.append((a, c) if (pattern >> a ^ joined_faces >> n) & 1 == 0 else (b, d))
    for a, b in links:
        region = [region[a] if r == region[b] else r for r in region]
    return region


def tunnels(pattern: int, joined_faces: int) -> dict[int, tuple[int, int]]:
    """Return {tunnel: the two loops, by their places in `loops`, between which it would be}."""
    region = regions(pattern, joined_faces)
    sides = [_sides(pattern, region, loop) for loop in loops(pattern, joined_faces)]
    found = {}
    for number, (m, inside) in enumerate(TUNNELS, start=1):
        ends = [_ends(pattern, COLUMNS[n], inside) for n in (m, m + 2)]
        joins = {(region[a], region[b]) for a in ends[0] for b in ends[1]}
        for pair in permutations(range(len(sides)), 2):
            one, other = (sides[n][inside] for n in pair)
            beyond = {sides[n][not inside] for n in pair}
            if (one, other) not in joins or len(beyond) != 1 or one == other:
                continue
            if all(_follows_diagonal(pattern, region, (one, other), inside, a) for a in range(3)):
                found[number] = (min(pair), max(pair))
    return found


def _sides(pattern: int, region: list[int], loop: tuple[int, ...]) -> tuple[int, int]:
    """Region on the outside and on the inside of a loop."""
    a, b = EDGES[loop[0]]
    return (region[b], region[a]) if pattern >> a & 1 else (region[a], region[b])


def _ends(pattern: int, column: tuple[int, int], inside: bool) -> list[int]:
    return [corner for corner in column if bool(pattern >> corner & 1) == inside]


def _follows_diagonal(
    pattern: int, region: list[int], ends: tuple[int, int], inside: bool, axis: int
) -> bool:
    """Whether planes across an axis may show both regions, with the other sign between them."""
    step, u, v = (4 >> (axis + n) % 3 for n in range(3))
    around = [(c, c + step) for c in (0, u, u + v, v)]
    for n in range(4):
        a, b, c, d = (around[(n + m) % 4] for m in range(4))
        has_one, has_other = (
            any(region[corner] == end for corner in _ends(pattern, column, inside))
            for column, end in zip((a, c), ends, strict=True)
        )
        between = _ends(pattern, b, not inside) and _ends(pattern, d, not inside)
        if has_one and has_other and between:
            return True
    return False


def _joined_faces(pattern: int) -> list[int]:
    """All choices of alternating faces, as bits; none of them first."""
    faces = alternating_faces(pattern)
    return [sum(1 << n for n in some) for k in range(len(faces) + 1)
            for some in combinations(faces, k)]  # fmt: skip


def _patch(found: list[tuple[int, ...]], pair: tuple[int, int] | None) -> list[Triangles | tuple]:
    """Pieces of a patch: triangles, or a loop whose triangles meet in its middle."""
    alone = [loop for n, loop in enumerate(found) if pair is None or n not in pair]
    pieces = [_cut(loop) for loop in alone]
    return pieces if pair is None else pieces + _band(found[pair[0]], found[pair[1]])


@cache
def _cut(loop: tuple[int, ...]) -> Triangles | tuple[int, ...]:
    return triangulate(loop) or loop


@cache
def _band(one: tuple[int, ...], other: tuple[int, ...]) -> list[Triangles | tuple]:
    """Cut a band between two loops along two lines, (a, b) and (c, d), into two halves."""
    choices = []
    for a, c in combinations(one, 2):
        for b, d in permutations(other, 2):
            if b in coplanar_edges()[a] or d in coplanar_edges()[c]:
                continue
            halves = [
                _cut(_along(one, a, c) + _along(other, d, b)),
                _cut(_along(one, c, a) + _along(other, b, d)),
            ]
            sides = [side for half in halves for side in _sides_of(half)]
            if len(set(sides)) == len(sides):
                choices.append((sum(isinstance(half, tuple) for half in halves), halves))
    fewest = min(n_centers for n_centers, _ in choices)
    ways = [halves for n_centers, halves in choices if n_centers == fewest]
    return min(ways, key=lambda halves: sum(_area(half) for half in halves))


def _along(loop: tuple[int, ...], first: int, last: int) -> tuple[int, ...]:
    """The part of a loop from one edge to another."""
    n = loop.index(first)
    turned = loop[n:] + loop[:n]
    return turned[: turned.index(last) + 1]


def _fan(loop: tuple[int, ...], center: int) -> Triangles:
    return [(a, b, center) for a, b in zip(loop, loop[1:] + loop[:1], strict=True)]


def _sides_of(piece: Triangles | tuple[int, ...]) -> list[tuple[int, int]]:
    """Directed sides of the triangles between crossings."""
    if isinstance(piece, tuple):
        return list(zip(piece, piece[1:] + piece[:1], strict=True))
    return [(t[n], t[(n + 1) % 3]) for t in piece for n in range(3)]


def _area(piece: Triangles | tuple[int, ...]) -> int:
    """Total area in the units of `areas`, the crossings taken at mid-edge."""
    if isinstance(piece, list):
        return sum(areas()[triangle] for triangle in piece)
    spokes = _MIDDLES[list(piece)] - _MIDDLES[list(piece)].mean(axis=0)
    normals = np.cross(spokes, np.roll(spokes, -1, axis=0))
    return round(1e9 * float(0.5 * np.sqrt((normals**2).sum(axis=1)).sum()))


def _assemble(rows: dict, patches: list[list[Triangles | tuple]]) -> CellCases:
    """Put the rows behind those of the 256 patterns."""
    plain = cube_cases()
    row = np.full((256, 64, 5), -1, np.int16)
    row[:, 0, 0] = np.arange(256)
    is_special = np.zeros(256, np.uint8)
    for (pattern, joined, tunnel), number in rows.items():
        row[pattern, joined, tunnel] = number
        is_special[pattern] = 1
    center_edges = np.zeros((256 + len(patches), 2), np.uint16)
    cut = []
    for number, pieces in enumerate(patches, start=256):
        cut.append([])
        hubs = [piece for piece in pieces if isinstance(piece, tuple)]
        for piece in pieces:
            is_fan = isinstance(piece, tuple)
            cut[-1] += _fan(piece, CENTER + hubs.index(piece)) if is_fan else piece
        for n, hub in enumerate(hubs):
            center_edges[number, n] = sum(1 << edge for edge in hub)
    n_triangles = np.array([*plain.n_triangles, *map(len, cut)], np.int8)
    triangles = np.full((len(n_triangles), 3 * n_triangles.max()), -1, np.int8)
    triangles[:256, : plain.triangles.shape[1]] = plain.triangles
    for number, patch in enumerate(cut, start=256):
        triangles[number, : 3 * len(patch)] = np.ravel(patch)
    sizes = np.stack([plain.n_triangles * (1 - is_special), is_special], axis=1).astype(np.int64)
    n_centers = np.count_nonzero(center_edges, axis=1).astype(np.int8)
    return CellCases(
        row, is_special, sizes, plain.crossed, n_triangles, n_centers, triangles, center_edges
    )
