"""meshsdf.mesh.collinear and .faces: faces that bound nothing."""

from fractions import Fraction

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from meshsdf.mesh import degenerate_faces, net_faces, odd_faces
from meshsdf.mesh.collinear import are_collinear

ONE = np.array([[0, 1, 2]], dtype=np.int32)


def exactly_collinear(p, q, r) -> bool:
    p, q, r = ([Fraction(x) for x in point] for point in (p, q, r))
    a = [y - x for x, y in zip(p, q, strict=True)]
    b = [y - x for x, y in zip(p, r, strict=True)]
    return all(a[i] * b[i - 1] == a[i - 1] * b[i] for i in range(3))


floats = st.floats(allow_nan=False, allow_infinity=False)
points = st.tuples(floats, floats, floats)


@given(points, points, points)
def test_collinearity_of_any_floats_is_exact(p, q, r):
    found = are_collinear(np.array([p, q, r], dtype=float), ONE)[0]
    assert found == exactly_collinear(p, q, r)


@given(st.integers(0, 2**31), st.integers(-40, 40), st.integers(-3, 3), st.integers(0, 4))
def test_points_on_a_line_or_a_few_ulps_beside_it_are_told_apart(seed, exponent, factor, n_ulps):
    rng = np.random.default_rng(seed)
    p = rng.integers(-(2**20), 2**20, 3) * 2.0**exponent
    d = rng.integers(-(2**20), 2**20, 3) * 2.0**exponent / 3 * 3
    r = p + factor * d
    for _ in range(n_ulps):
        r[0] = np.nextafter(r[0], np.inf)
    found = are_collinear(np.array([p, p + d, r]), ONE)[0]
    assert found == exactly_collinear(p, p + d, r)


def test_points_on_a_line_are_found_though_their_differences_round():
    rng = np.random.default_rng(11)
    for _ in range(200):
        direction = rng.uniform(-1, 1, 3)
        scales = 2.0 ** rng.choice(np.arange(-30, 31), 3, replace=False)
        p, q, r = on_line = direction * scales[:, None]  # all on one line through the origin
        assert exactly_collinear(p, q, r)
        assert are_collinear(on_line, ONE)[0]
        r[1] = np.nextafter(r[1], np.inf)
        assert not are_collinear(on_line, ONE)[0]


def test_only_faces_of_exactly_zero_area_are_degenerate():
    corners = np.array([[0.0, 0, 0], [1, 1, 1], [3, 3, 3], [3, 3, np.nextafter(3, 4)]])
    faces = np.array([(0, 1, 2), (0, 1, 3), (0, 0, 1), (2, 2, 2)], dtype=np.int32)
    assert_array_equal(degenerate_faces(corners, faces), [True, False, True, True])


def test_every_copy_counts_for_parity_and_opposite_ones_cancel_for_integers():
    a, b = (0, 1, 2), (2, 1, 0)  # the two sides of one sheet
    cases = [
        ([a], [1], [1]),
        ([a, b], [0, 0], [0, 0]),
        ([a, a], [0, 0], [1, 1]),
        ([a, b, b], [1, 0, 0], [0, 1, 0]),
        ([a, (1, 2, 0), (2, 0, 1)], [1, 0, 0], [1, 1, 1]),
        ([b, a, b, b], [0, 0, 0, 0], [1, 0, 1, 0]),
    ]
    for faces, odd, net in cases:
        faces = np.array([*faces, (3, 4, 5)], dtype=np.int32)
        assert_array_equal(odd_faces(faces), [*map(bool, odd), True])
        assert_array_equal(net_faces(faces), [*map(bool, net), True])


def test_what_is_dropped_never_changes_the_boundary():
    rng = np.random.default_rng(1)
    faces = rng.permuted(np.tile(np.arange(4), (60, 1)), axis=1)[:, :3].astype(np.int32)

    def boundary(kept, modulo):
        total = np.zeros((4, 4), dtype=int)
        for a, b, c in kept:
            for p, q in ((a, b), (b, c), (c, a)):
                total[p, q] += 1
                total[q, p] -= 1
        return total % modulo if modulo else total

    assert_array_equal(boundary(faces[odd_faces(faces)], 2), boundary(faces, 2))
    assert_array_equal(boundary(faces[net_faces(faces)], 0), boundary(faces, 0))


def test_no_faces_at_all_are_no_trouble():
    none = np.empty((0, 3), dtype=np.int32)
    assert odd_faces(none).shape == net_faces(none).shape == (0,)
    assert degenerate_faces(np.empty((0, 3)), none).shape == (0,)
