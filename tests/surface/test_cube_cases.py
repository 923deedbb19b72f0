"""meshsdf.surface.cube_cases: every pattern holds a manifold patch, and neighbours agree."""

import time
from itertools import combinations, permutations, product

import numpy as np
import pytest

from meshsdf.surface.cube_cases import CORNERS, EDGES, FACES, cube_cases, face_arcs, loops

PATTERNS = range(256)
MIDDLES = [tuple((np.array(CORNERS[a]) + CORNERS[b]) / 2) for a, b in EDGES]
ALTERNATING = [
    pattern for pattern in PATTERNS if any(len(face_arcs(pattern, face)) == 2 for face in range(6))
]


def patch(pattern):
    cases = cube_cases()
    n = 3 * cases.n_triangles[pattern]
    assert (cases.triangles[pattern, n:] == -1).all()
    return [tuple(t) for t in cases.triangles[pattern, :n].reshape(-1, 3).tolist()]


def arcs(pattern):
    return {arc for face in range(6) for arc in face_arcs(pattern, face).items()}


def sides(pattern):
    return [(t[n], t[(n + 1) % 3]) for t in patch(pattern) for n in range(3)]


def test_faces_run_counter_clockwise_seen_from_outside():
    for face in FACES:
        a, b, c, d = (np.array(CORNERS[corner]) for corner in face)
        outward = a + b + c + d - 2  # from the centre of the cube, times 4
        assert np.array_equal(np.cross(b - a, c - b) * 2, outward)
        assert np.array_equal(a + c, b + d)


def test_the_border_of_a_patch_is_its_arcs_and_all_else_is_matched():
    for pattern in PATTERNS:
        directed = sides(pattern)
        assert len(set(directed)) == len(directed)
        assert {(a, b) for a, b in directed if (b, a) not in directed} == arcs(pattern)
        assert all((b, a) not in arcs(pattern) for a, b in arcs(pattern))


def test_a_patch_is_one_disk_for_every_loop():
    for pattern in PATTERNS:
        used = {edge for triangle in patch(pattern) for edge in triangle}
        crossed = {e for e, (a, b) in enumerate(EDGES) if (pattern >> a ^ pattern >> b) & 1}
        assert used == crossed == {e for e in range(12) if cube_cases().crossed[pattern] >> e & 1}
        undirected = {frozenset(side) for side in sides(pattern)}
        assert len(used) - len(undirected) + len(patch(pattern)) == len(loops(pattern))
        assert all(len(set(triangle)) == 3 for triangle in patch(pattern))
        for edge in used:  # the triangles at a vertex are one fan: a path from arc to arc
            link = dict((t * 2)[t.index(edge) + 1 :][:2] for t in patch(pattern) if edge in t)
            (begin,) = set(link) - set(link.values())
            n_steps = 0
            while begin in link:
                begin, n_steps = link[begin], n_steps + 1
            assert n_steps == len(link)


def test_no_diagonal_joins_two_edges_of_one_cube_face():
    for pattern in PATTERNS:
        ends = arcs(pattern)
        for a, b in sides(pattern):
            on_a_face = any({*EDGES[a], *EDGES[b]} <= set(face) for face in FACES)
            assert not on_a_face or (a, b) in ends


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_two_cubes_draw_the_same_arcs_on_the_face_they_share_in_opposite_directions(axis):
    step = 4 >> axis
    low = [c for c in range(8) if not c & step]
    beyond = {e: EDGES.index((a + step, b + step)) for e, (a, b) in enumerate(EDGES) if a in low
              and b in low}  # fmt: skip
    checked = 0
    for signs in range(2**12):
        shared, first, second = signs & 15, signs >> 4 & 15, signs >> 8
        a = sum((first >> n & 1) << c | (shared >> n & 1) << c + step for n, c in enumerate(low))
        b = sum((shared >> n & 1) << c | (second >> n & 1) << c + step for n, c in enumerate(low))
        here, there = face_arcs(a, 2 * axis + 1), face_arcs(b, 2 * axis)
        assert here == {beyond[end]: beyond[start] for start, end in there.items()}
        checked += len(here)
    assert checked == 2**8 * (14 + 2)  # of 16 faces two are empty, two alternate and have 2 arcs


def test_the_outside_lies_left_of_every_arc_seen_from_outside_the_cube():
    for pattern in PATTERNS:
        for face in range(6):
            center = np.mean([CORNERS[c] for c in FACES[face]], axis=0)
            outward = 2 * center - 1
            for start, end in face_arcs(pattern, face).items():
                along = np.subtract(MIDDLES[end], MIDDLES[start])
                left = np.cross(outward, along)
                for edge in (start, end):
                    a, b = EDGES[edge]
                    outside, inside = (a, b) if pattern >> b & 1 else (b, a)
                    assert np.dot(np.subtract(CORNERS[outside], CORNERS[inside]), left) > 0


def test_alternating_faces_keep_their_inside_corners_apart():
    signs = {p: [[p >> c & 1 for c in face] for face in FACES] for p in PATTERNS}
    crossed_over = ([0, 1, 0, 1], [1, 0, 1, 0])
    assert [p for p in PATTERNS if any(s in crossed_over for s in signs[p])] == ALTERNATING
    for pattern, face in product(ALTERNATING, range(6)):
        ends = face_arcs(pattern, face)
        if len(ends) == 2:
            shared = [set(EDGES[a]) & set(EDGES[b]) for a, b in ends.items()]
            assert all(len(s) == 1 and pattern >> s.pop() & 1 for s in shared)


def test_swapping_inside_and_outside_reverses_every_arc_where_no_face_alternates():
    for pattern in sorted(set(PATTERNS) - set(ALTERNATING)):
        assert arcs(255 - pattern) == {(b, a) for a, b in arcs(pattern)}


def test_the_arcs_turn_with_the_cube():
    turns = 0
    for order, flips in product(permutations(range(3)), product((1, -1), repeat=3)):
        matrix = np.zeros((3, 3), int)
        matrix[range(3), order] = flips
        if round(np.linalg.det(matrix)) != 1:
            continue
        turns += 1
        corners = (np.array(CORNERS) * 2 - 1) @ matrix.T
        moved = ((corners + 1) // 2 @ (4, 2, 1)).tolist()
        edge = {e: EDGES.index(tuple(sorted((moved[a], moved[b])))) for e, (a, b) in
                enumerate(EDGES)}  # fmt: skip
        for pattern in PATTERNS:
            turned = sum((pattern >> c & 1) << moved[c] for c in range(8))
            assert arcs(turned) == {(edge[a], edge[b]) for a, b in arcs(pattern)}
    assert turns == 24


def test_triangles_are_the_cheapest_among_all_triangulations_of_their_loop():
    def all_ways(loop):
        if len(loop) == 3:
            return [[loop]]
        ways = []
        for n in range(1, len(loop) - 1):  # the triangle on the side from the last to the first
            lower = all_ways(loop[: n + 1]) if n > 1 else [[]]
            upper = all_ways(loop[n:]) if n < len(loop) - 2 else [[]]
            ways += [[(loop[0], loop[n], loop[-1]), *a, *b] for a in lower for b in upper]
        return ways

    def allowed(way, loop):
        n = len(loop)
        rim = {frozenset((loop[i], loop[(i + 1) % n])) for i in range(n)}
        lines = {frozenset(pair) for t in way for pair in combinations(t, 2)} - rim
        return not any(
            {c for e in line for c in EDGES[e]} <= set(face) for line in lines for face in FACES
        )

    def area(way):
        a, b, c = np.array([[MIDDLES[e] for e in t] for t in way]).transpose(1, 0, 2)
        return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()

    lengths = set()
    for pattern in PATTERNS:
        if len(loops(pattern)) != 1:
            continue
        (loop,) = loops(pattern)
        best = min(area(way) for way in all_ways(loop) if allowed(way, loop))
        assert area(patch(pattern)) <= best + 1e-8  # areas are compared in units of 1e-9
        lengths.add(len(loop))
    assert lengths == {3, 4, 5, 6, 7}


def test_the_table_is_derived_in_less_than_30_ms():
    cube_cases()

    def seconds():
        start = time.process_time()
        cube_cases.__wrapped__()
        return time.process_time() - start

    assert min(seconds() for _ in range(5)) < 0.03
