"""meshsdf.surface.trilinear_cases: every row of triangles is a manifold patch with the right arcs.

All rows are checked: every sign pattern, every choice of joined faces, every possible tunnel.
"""

from itertools import chain, combinations, product

import numpy as np

from meshsdf.surface.cube_cases import CORNERS, EDGES, FACES, cube_cases, face_arcs, loops
from meshsdf.surface.trilinear_cases import (
    CENTER,
    COLUMNS,
    TUNNELS,
    manifold_cells,
    trilinear_cells,
)

CASES = trilinear_cells()
ROWS = [tuple(entry) for entry in np.argwhere(CASES.row >= 0).tolist()]


def alternating(pattern):
    signs = [[pattern >> c & 1 for c in face] for face in FACES]
    return [n for n, s in enumerate(signs) if s in ([0, 1, 0, 1], [1, 0, 1, 0])]


def patch(row):
    n = 3 * CASES.n_triangles[row]
    assert (CASES.triangles[row, n:] == -1).all()
    return [tuple(t) for t in CASES.triangles[row, :n].reshape(-1, 3).tolist()]


def arcs(pattern, joined):
    return set(
        chain.from_iterable(
            face_arcs(pattern, n, joined=bool(joined >> n & 1)).items() for n in range(6)
        )
    )


def sides(triangles):
    return [(t[n], t[(n + 1) % 3]) for t in triangles for n in range(3)]


def pieces_of(triangles):
    """Sets of vertices of the connected pieces."""
    pieces = []
    for triangle in triangles:
        touching = [piece for piece in pieces if piece & set(triangle)]
        pieces = [piece for piece in pieces if not piece & set(triangle)]
        pieces.append(set(triangle).union(*touching))
    return pieces


def test_every_choice_of_joined_faces_has_a_row_and_nothing_else_has():
    n_rows = 0
    for pattern in range(256):
        faces = alternating(pattern)
        chosen = {sum(1 << n for n in some) for k in range(len(faces) + 1)
                  for some in combinations(faces, k)}  # fmt: skip
        assert {j for j in range(64) if CASES.row[pattern, j, 0] >= 0} == chosen
        for joined in range(64):
            if joined not in chosen:
                assert (CASES.row[pattern, joined] == -1).all()
        n_rows += len(chosen)
    assert n_rows == 656
    assert len(ROWS) > n_rows + 100


def test_arcs_of_a_joined_face_keep_its_outside_corners_apart():
    for pattern, n in product(range(256), range(6)):
        plain, joined = (face_arcs(pattern, n, joined=flag) for flag in (False, True))
        if n not in alternating(pattern):
            assert plain == joined
            continue
        assert set(plain) == set(joined)
        for ends, kept_apart in ((plain, 1), (joined, 0)):
            for a, b in ends.items():
                (shared,) = set(EDGES[a]) & set(EDGES[b])
                assert pattern >> shared & 1 == kept_apart


def test_the_border_of_a_patch_is_its_arcs_and_all_else_is_matched():
    for pattern, joined, tunnel in ROWS:
        directed = sides(patch(CASES.row[pattern, joined, tunnel]))
        assert len(set(directed)) == len(directed)
        assert {(a, b) for a, b in directed if (b, a) not in directed} == arcs(pattern, joined)
        assert all((b, a) not in directed for a, b in arcs(pattern, joined))


def test_a_patch_has_a_disk_for_every_loop_and_a_band_for_two_loops_with_a_tunnel():
    for pattern, joined, tunnel in ROWS:
        triangles = patch(CASES.row[pattern, joined, tunnel])
        found = loops(pattern, joined)
        pieces = pieces_of(triangles)
        assert len(pieces) == len(found) - (tunnel > 0)
        used = set(chain.from_iterable(triangles))
        crossed = {e for e, (a, b) in enumerate(EDGES) if (pattern >> a ^ pattern >> b) & 1}
        assert {v for v in used if v < CENTER} == crossed == set(chain.from_iterable(found))
        borders = sorted(sum(set(loop) <= piece for loop in found) for piece in pieces)
        assert borders == [1] * (len(pieces) - 1) + [2 if tunnel else 1] if pieces else not found
        for piece in pieces:
            own = [t for t in triangles if set(t) <= piece]
            edges = {frozenset(side) for side in sides(own)}
            n_borders = sum(set(loop) <= piece for loop in found)
            assert len(piece) - len(edges) + len(own) == 2 - n_borders


def test_the_triangles_at_a_vertex_are_one_fan():
    for pattern, joined, tunnel in ROWS:
        triangles = patch(CASES.row[pattern, joined, tunnel])
        for vertex in set(chain.from_iterable(triangles)):
            link = dict((t * 2)[t.index(vertex) + 1 :][:2] for t in triangles if vertex in t)
            assert len(link) == sum(vertex in t for t in triangles)
            starts = set(link) - set(link.values())
            assert len(starts) == (1 if vertex < CENTER else 0)  # a path, or a cycle
            here, n_steps = next(iter(starts or link)), 0
            while here in link and n_steps < len(link):
                here, n_steps = link[here], n_steps + 1
            assert n_steps == len(link)
            assert len(link) >= 3 or vertex < CENTER


def test_no_diagonal_joins_two_edges_of_one_cube_face():
    for pattern, joined, tunnel in ROWS:
        ends = arcs(pattern, joined)
        for a, b in sides(patch(CASES.row[pattern, joined, tunnel])):
            if max(a, b) < CENTER and (a, b) not in ends and (b, a) not in ends:
                assert not any({*EDGES[a], *EDGES[b]} <= set(face) for face in FACES)


def test_a_vertex_within_is_the_mean_of_the_crossings_around_it():
    seen = set()
    for pattern, joined, tunnel in ROWS:
        row = CASES.row[pattern, joined, tunnel]
        triangles = patch(row)
        within = sorted({v for t in triangles for v in t if v >= CENTER})
        assert within == list(range(CENTER, CENTER + CASES.n_centers[row]))
        seen.add(len(within))
        for n in range(2):
            around = {v for t in triangles if CENTER + n in t for v in t} - {CENTER + n}
            assert CASES.center_edges[row, n] == sum(1 << edge for edge in around)
    assert seen == {0, 1, 2}


def test_a_tunnel_joins_loops_around_two_regions_of_its_sign_that_no_face_joins():
    """Corners are reached over the cube's surface: along edges, across faces that join them."""

    def reach(pattern, joined, corner):
        links = [set(edge) for edge in EDGES]
        for n in alternating(pattern):
            a, b, c, d = FACES[n]
            inside, outside = ((a, c), (b, d)) if pattern >> a & 1 else ((b, d), (a, c))
            links.append(set(inside if joined >> n & 1 else outside))
        found = {corner}
        for _ in range(8):
            for link in links:
                if link & found:
                    found |= {c for c in link if pattern >> c & 1 == pattern >> corner & 1}
        return found

    for pattern, joined, tunnel in ROWS:
        if not tunnel:
            continue
        m, inside = TUNNELS[tunnel - 1]
        ends = [[c for c in COLUMNS[n] if bool(pattern >> c & 1) == inside] for n in (m, m + 2)]
        between = [[c for c in COLUMNS[(m + n) % 4] if bool(pattern >> c & 1) != inside]
                   for n in (1, 3)]  # fmt: skip
        assert all(ends)
        assert all(between)
        regions = [reach(pattern, joined, corners[0]) for corners in ends]
        assert not regions[0] & regions[1]
        triangles = patch(CASES.row[pattern, joined, tunnel])
        (band,) = [piece for piece in pieces_of(triangles)
                   if sum(set(loop) <= piece for loop in loops(pattern, joined)) == 2]  # fmt: skip
        touched = {c for e in band if e < CENTER for c in EDGES[e]
                   if bool(pattern >> c & 1) == inside}  # fmt: skip
        assert touched & regions[0]
        assert touched & regions[1]
        assert touched <= regions[0] | regions[1]


def test_plain_patterns_name_their_rows_and_special_ones_are_not_counted():
    plain = cube_cases()
    for cases in (CASES, manifold_cells()):
        assert np.array_equal(cases.triangles[:256, : plain.triangles.shape[1]], plain.triangles)
        is_special = cases.is_special.astype(bool)
        assert np.array_equal(cases.row[~is_special, 0, 0], np.flatnonzero(~is_special))
        assert (cases.sizes[is_special] == [0, 1]).all()
        assert np.array_equal(cases.sizes[~is_special, 0], plain.n_triangles[~is_special])
        assert not cases.sizes[~is_special, 1].any()
    assert not manifold_cells().is_special.any()
    settled = [p for p in range(256) if not alternating(p) and len(loops(p)) < 2]
    assert not CASES.is_special[settled].any()
    opposite = [p for p in range(256) if not alternating(p) and len(loops(p)) == 2]
    corners = np.array(CORNERS)
    for pattern in opposite:  # two corners of one sign at the ends of a diagonal
        few = [c for c in range(8) if pattern >> c & 1 == (bin(pattern).count("1") < 4)]
        assert len(few) == 2
        assert (corners[few[0]] + corners[few[1]] == 1).all()
    assert CASES.is_special[opposite].all()
    assert len(opposite) == 8


def test_the_row_without_choices_has_the_loops_of_the_plain_pattern():
    for pattern in range(256):
        assert sides_set(patch(CASES.row[pattern, 0, 0])) == sides_set(patch(pattern))


def sides_set(triangles):
    return {frozenset(t) for t in triangles}
