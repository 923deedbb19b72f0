"""meshsdf.surface.cell_decider: what the trilinear interpolant does in a cell, without error."""

from fractions import Fraction
from itertools import permutations, product

import numpy as np
import pytest

from meshsdf.surface.cell_decider import decide_cells
from meshsdf.surface.cube_cases import CORNERS, FACES, loops
from meshsdf.surface.trilinear_cases import trilinear_cells
from tests.surface.cell_oracle import topology

CASES = trilinear_cells()

# (components, Euler characteristic, loops), number of alternating faces, values at 4 x + 2 y + z
KNOWN = [
    ((1, 0, 2), 0, [-3, -4, 9, -1, -5, 8, -1, -3]),
    ((1, 0, 2), 1, [-1, -3, 9, 2, -1, 4, -1, -7]),
    ((1, 0, 2), 2, [7, 1, 1, -6, -4, -2, -1, 5]),
    ((1, 0, 2), 3, [-8, 2, 7, -5, 2, 1, -2, 1]),
    ((2, 1, 3), 6, [-9, 2, 7, -9, 3, -5, -2, 4]),
    ((1, 1, 1), 6, [2, -7, -3, 2, -3, 2, 5, -3]),
    ((2, 2, 2), 6, [1, -6, -2, 1, -1, 3, 6, -4]),
    ((3, 3, 3), 6, [-5, 9, 1, -2, 1, -1, -4, 5]),
    ((4, 4, 4), 6, [-4, 2, 1, -8, 2, -5, -2, 4]),
    ((1, 1, 1), 3, [-1, -1, 7, -2, 2, -2, -5, 3]),
    ((2, 2, 2), 3, [1, -5, -6, 2, 3, 2, 1, -1]),
    ((3, 3, 3), 3, [-3, 3, 1, -3, 1, -4, -1, -3]),
]


def _facts():
    """(rows, 3) components, Euler characteristic and loops of each row of triangles."""
    facts = np.full((len(CASES.n_triangles), 3), -1)
    for pattern, joined, tunnel in np.argwhere(CASES.row >= 0).tolist():
        n, t = len(loops(pattern, joined)), int(tunnel > 0)
        facts[CASES.row[pattern, joined, tunnel]] = n - t, n - 2 * t, n
    for pattern in np.flatnonzero(CASES.is_special == 0).tolist():
        facts[pattern] = len(loops(pattern))
    return facts


FACTS = _facts()


def decided(values, level=0.0):
    return FACTS[decide_cells(np.asarray(values, float), level, CASES).rows]


def special(values):
    """Those of the cells whose signs leave a choice."""
    pattern = ((values < 0) << np.arange(8)).sum(axis=1)
    return values[CASES.is_special[pattern] == 1]


def alternating(values):
    """(s, 6) whether a face's corners are inside and outside in turn."""
    a, b, c, d = ((values < 0)[:, np.array(FACES)[:, n]] for n in range(4))
    return (a == c) & (b == d) & (a != b)


def test_twelve_cells_have_the_topology_known_of_them():
    values = np.array([cell for _, _, cell in KNOWN], float)
    expected = [facts for facts, _, _ in KNOWN]
    assert alternating(values).sum(axis=1).tolist() == [n for _, n, _ in KNOWN]
    assert decided(values).tolist() == [list(facts) for facts in expected]
    assert decided(-values).tolist() == [list(facts) for facts in expected]
    assert topology(values, 33).tolist() == [list(facts) for facts in expected]


def generic_cells(rng):
    """Cells of several kinds, all special, none with a tie that matters."""
    digits = rng.choice([n for n in range(-9, 10) if n], (2000, 8)).astype(float)
    opposite = rng.lognormal(0, 0.7, (500, 8)) * [4, -1, -1, -1, -1, -1, -1, 4]
    checkered = rng.lognormal(0, 0.5, (400, 8)) * (1 - 2 * (np.array(CORNERS).sum(axis=1) % 2))
    cells = np.concatenate([digits, rng.normal(size=(2000, 8)), opposite, checkered])
    cells = special(cells)
    return cells[~decide_cells(cells, 0.0, CASES).is_singular]


def test_sampling_agrees_wherever_it_is_fine_enough():
    """A difference must vanish as the samples come closer together.

    Left out are cells with a saddle so near the level that samples could not tell.
    """
    cells = generic_cells(np.random.default_rng(0))
    ours = decided(cells)
    near = [(decided(cells, level) != ours).any(axis=1) for level in (-0.002, 0.002)]
    is_clear = ~(near[0] | near[1])
    assert is_clear.mean() > 0.97
    cells, ours = cells[is_clear], ours[is_clear]
    assert len(cells) > 2500
    n_tunnels = np.count_nonzero(ours[:, 0] != ours[:, 2])
    assert n_tunnels > 200
    left, n = np.arange(len(cells)), 9
    while len(left) and n < 200:
        step = max(1, 10**7 // n**3)
        found = [topology(cells[left[at : at + step]], n) for at in range(0, len(left), step)]
        left = left[(np.concatenate(found) != ours[left]).any(axis=1)]
        if n == 9:
            assert len(left) < 0.05 * len(cells)
        n = 2 * n - 1
    assert len(left) == 0


def test_only_seven_kinds_of_surface_occur():
    kinds = {tuple(kind) for kind in decided(generic_cells(np.random.default_rng(1))).tolist()}
    assert kinds == {(k, k, k) for k in (1, 2, 3, 4)} | {(1, 0, 2), (2, 1, 3)}
    assert decided(np.ones((1, 8))).tolist() == [[0, 0, 0]]


def test_turning_and_mirroring_change_nothing_and_neither_does_exchanging_sides_without_ties():
    rng = np.random.default_rng(2)
    generic, tied = generic_cells(rng), special(rng.integers(-2, 3, (1500, 8)).astype(float))
    for cells in (generic, tied):
        ours, is_singular = decided(cells), decide_cells(cells, 0.0, CASES).is_singular
        cubes = cells.reshape(-1, 2, 2, 2)
        for order, flips in product(permutations((1, 2, 3)), product((1, -1), repeat=3)):
            moved = cubes.transpose(0, *order)[:, :: flips[0], :: flips[1], :: flips[2]]
            found = decide_cells(moved.reshape(-1, 8), 0.0, CASES)
            assert np.array_equal(FACTS[found.rows], ours)
            assert np.array_equal(found.is_singular, is_singular)
    assert is_singular.any()
    assert np.array_equal(decided(-generic), decided(generic))


def test_scaling_changes_nothing_as_far_as_it_is_exact():
    rng = np.random.default_rng(3)
    whole = special(rng.integers(-4, 5, (3000, 8)).astype(float))
    for cells in (generic_cells(rng), whole):
        ours = decide_cells(cells, 0.0, CASES)
        for power in (-1000, -300, 30, 900):
            other = decide_cells(cells * 2.0**power, 0.0, CASES)
            assert np.array_equal(other.rows, ours.rows)
            assert np.array_equal(other.is_singular, ours.is_singular)
    generic = generic_cells(rng)
    assert np.array_equal(decided(1e-9 * generic), decided(generic))


def test_the_level_is_subtracted_without_rounding():
    rng = np.random.default_rng(4)
    cells = special(rng.integers(-3, 4, (2000, 8)).astype(float))
    ours = decide_cells(cells, 0.0, CASES)
    moved = decide_cells(cells + 2.0**40, 2.0**40, CASES)
    assert np.array_equal(moved.rows, ours.rows)
    assert np.array_equal(moved.is_singular, ours.is_singular)
    # Differences of -1 + tiny are rounded to -1: products 1 - 2 tiny and 1 - 2**-60
    for tiny, expected in ((2.0**-60, False), (2.0**-62, True)):
        a, b, c, d = tiny, 2 + 2.0**-30, tiny, 2 - 2.0**-30
        exact = [Fraction(v) - 1 for v in (a, b, c, d)]
        assert (exact[0] * exact[2] > exact[1] * exact[3]) == expected
        found = decide_cells(np.array([[a, b, d, c, 5, 5, 5, 5]]), 1.0, CASES)
        assert (found.rows[0] != CASES.row[9, 0, 0]) == expected


def test_faces_are_decided_as_fractions_would():
    """Products that differ by a last bit or two, or not at all."""
    rng = np.random.default_rng(5)
    a, b = rng.uniform(1, 2, (2, 2000))
    c = rng.uniform(1, 2, 2000)
    d = a * c / b
    d += rng.integers(-2, 3, 2000) * np.spacing(d)
    b[:500], d[:500] = a[:500], c[:500]  # ties
    far = np.full(2000, 50.0)
    cells = np.stack([-a, b, d, -c, far, far, far, far], axis=1)  # face x = 0: corners 0, 1, 3, 2
    found = decide_cells(cells, 0.0, CASES)
    saddle = [Fraction(w) * Fraction(x) - Fraction(y) * Fraction(z)
              for w, x, y, z in zip(*(v.tolist() for v in (a, c, b, d)), strict=True)]  # fmt: skip
    pattern = 0b1001
    (bit,) = [n for n, face in enumerate(FACES) if set(face) == {0, 1, 2, 3}]
    expected = [CASES.row[pattern, (s > 0) << bit, 0] for s in saddle]
    assert found.rows.tolist() == expected
    assert found.is_singular.tolist() == [s == 0 for s in saddle]
    assert sum(s == 0 for s in saddle) >= 500
    assert min(abs(s) for s in saddle if s) < Fraction(1, 2**52)


def singular_at_center(rng, n):
    """Cells whose value and gradient vanish at the centre, in exact integers."""
    u, v, w = 2 * np.array(CORNERS).T - 1
    p, q, r = rng.integers(1, 40, (3, n, 1))
    s = rng.integers(-100, 101, (n, 1))
    return (p * u * v + q * v * w + r * w * u + s * u * v * w).astype(float)


def test_a_saddle_within_exactly_at_the_level_counts_as_outside_and_is_told():
    """One last bit of one corner less, and the outside comes apart."""
    cells = singular_at_center(np.random.default_rng(6), 3000)
    opposite = ((cells < 0).sum(axis=1) == 6) & (cells[:, 0] > 0) & (cells[:, 7] > 0)
    cells = cells[opposite]  # no face alternates, two corners stand alone outside
    assert len(cells) > 100
    tie = decide_cells(cells, 0.0, CASES)
    assert tie.is_singular.all()
    assert (FACTS[tie.rows] == (1, 0, 2)).all()
    for corner in range(8):
        for toward, expected in ((-np.inf, (2, 2, 2)), (np.inf, (1, 0, 2))):
            moved = cells.copy()
            moved[:, corner] = np.nextafter(moved[:, corner], toward)
            near = decide_cells(moved, 0.0, CASES)
            assert (FACTS[near.rows] == expected).all()
            assert not near.is_singular.any()
    # From the other side: two inside corners that such a saddle keeps apart
    other = decide_cells(-cells, 0.0, CASES)
    assert (FACTS[other.rows] == (2, 2, 2)).all()
    assert other.is_singular.all()
    inward = np.nextafter(-cells, -np.inf)
    assert (decided(inward) == (1, 0, 2)).all()


def test_ties_are_as_if_the_level_were_a_little_lower():
    """Of whole numbers up to 2 no saddle has a value between -1/64 and 0."""
    cells = special(np.random.default_rng(7).integers(-2, 3, (20000, 8)).astype(float))
    tie = decide_cells(cells, 0.0, CASES)
    assert np.array_equal(tie.rows, decide_cells(cells, -(2.0**-30), CASES).rows)
    assert np.array_equal(FACTS[tie.rows], decided(cells, -(2.0**-7)))
    assert tie.is_singular.mean() > 0.1
    sampled = topology(cells[:600] + 2.0**-7, 17)
    assert (sampled == FACTS[tie.rows][:600]).all(axis=1).mean() > 0.95


def test_cells_are_singular_if_and_only_if_both_sides_of_the_level_differ():
    rng = np.random.default_rng(8)
    within = singular_at_center(rng, 1000)
    cells = rng.choice([-2.0, -1.0, 1.0, 2.0], (10000, 8))
    cells = special(np.concatenate([cells, within[(within != 0).all(axis=1)]]))
    found = decide_cells(cells, 0.0, CASES).is_singular
    above, below = (decide_cells(cells, level, CASES).rows for level in (2.0**-30, -(2.0**-30)))
    assert np.array_equal(found, above != below)
    tied = np.zeros(len(cells), bool)
    for n, face in enumerate(FACES):
        a, b, c, d = cells[:, face].T
        tied |= alternating(cells)[:, n] & (a * c == b * d)
    assert found[tied].all()
    assert (found & ~tied).any()  # some within the cell alone


def test_numbers_of_any_size_side_by_side_are_decided():
    tiny, huge = 5e-324, 1.7e308
    face = np.array([[-tiny, tiny, huge, -huge, 1, 1, 1, 1], [-tiny, huge, huge, -huge, 1, 1, 1, 1],
                     [-huge, tiny, tiny, -huge, 1, 1, 1, 1]])  # fmt: skip
    found = decide_cells(face, 0.0, CASES)
    assert found.is_singular.tolist() == [True, False, False]
    (bit,) = [n for n, corners in enumerate(FACES) if set(corners) == {0, 1, 2, 3}]
    assert found.rows.tolist() == [CASES.row[9, j << bit, 0] for j in (0, 0, 1)]
    rng = np.random.default_rng(9)
    spread = special(rng.normal(size=(3000, 8)) * 10.0 ** rng.integers(-150, 150, (3000, 8)))
    ours = decided(spread)
    assert np.array_equal(decided(spread.reshape(-1, 2, 2, 2).transpose(0, 3, 1, 2).reshape(-1, 8)),
                          ours)  # fmt: skip


def test_infinite_corners_keep_inside_corners_apart_on_their_faces_only():
    inf = np.inf
    cells = np.array([
        [-inf, 1, 1, -inf, 1, 1, 1, 1],  # an alternating face with infinite corners
        [-9, 1, 1, -9, inf, inf, inf, inf],  # finite on that face: joined
        [-1, 9, 9, -1, inf, inf, inf, inf],  # finite on that face: apart
        [4, -inf, -1, -1, -1, -1, -1, 4],  # has a tunnel if that is 0 or small
    ])  # fmt: skip
    (bit,) = [n for n, corners in enumerate(FACES) if set(corners) == {0, 1, 2, 3}]
    rows = [CASES.row[9, 0, 0], CASES.row[9, 1 << bit, 0], CASES.row[9, 0, 0],
            CASES.row[0b01111110, 0, 0]]  # fmt: skip
    found = decide_cells(cells, 0.0, CASES)
    assert found.rows.tolist() == rows
    assert not found.is_singular.any()
    assert decided(np.array([[4, -0.5, -1, -1, -1, -1, -1, 4]])).tolist() == [[1, 0, 2]]


@pytest.mark.parametrize("n", [0, 1])
def test_few_cells_are_decided_like_many(n):
    found = decide_cells(np.array([KNOWN[0][2]] * n, float).reshape(n, 8), 0.0, CASES)
    assert FACTS[found.rows].tolist() == [[1, 0, 2]] * n
