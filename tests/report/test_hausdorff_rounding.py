"""meshsdf.report.hausdorff: the interval holds what rational arithmetic says, to the last digit."""

from fractions import Fraction

import numpy as np
import pytest

from meshsdf.mesh import Mesh
from meshsdf.progress import silent
from meshsdf.report.branch_and_bound import Search
from meshsdf.report.hausdorff import one_sided_hausdorff
from meshsdf.report.tolerance import Tolerance
from meshsdf.spatial import ClosestPoint
from tests.oracles import square_to_triangle

ONE_FACE = np.array([[0, 1, 2]], np.int32)


def triangle(rng, size, offset):
    """Of any shape: every second one a needle, every fourth flat to a few units of rounding."""
    corners = rng.normal(size=(3, 3))
    if rng.random() < 0.5:
        share = rng.random()
        corners[2] = (1 - share) * corners[0] + share * corners[1]
        corners[2] += rng.choice([0.0, 1e-15, 1e-8]) * rng.normal(size=3)
    return Mesh(size * corners + offset, ONE_FACE)


def plain_interval(source, target):
    """What doubles say before rounding is taken into account."""
    search = Search(source, ClosestPoint(target), Tolerance(relative=1e-3), silent)
    while not search.is_done:
        search.step()
    return search.best, search.upper


def contains(lower, upper, square):
    return Fraction(lower) ** 2 <= square <= Fraction(upper) ** 2


def test_the_interval_holds_the_rational_truth_where_plain_doubles_miss_it():
    # One triangle is convex: the distance to it is largest at a corner of the other
    rng, n_missed, n = np.random.default_rng(0), 0, 150
    for k in range(n):
        size, offset = 10.0 ** rng.uniform(-6, 3), 10.0 ** rng.uniform(0, 9) * rng.normal(size=3)
        target = triangle(rng, size, offset)
        away = 10.0 ** rng.uniform(-3, 6) * size * rng.normal(size=3)
        source = triangle(rng, size * 10.0 ** rng.uniform(-3, 3), offset + away)
        if k % 3 == 0:  # a single point
            source = Mesh(source.vertices[:1], np.zeros((1, 3), np.int32))
        square = max(square_to_triangle(v, target.triangles[0]) for v in source.triangles[0])
        distance = one_sided_hausdorff(source, target).distance
        assert contains(distance.lower, distance.upper, square)
        assert distance.width <= 2e-3 * distance.upper + 1e-12 * np.linalg.norm(away) + 1e-12 * size
        n_missed += not contains(*plain_interval(source, target), square)
    assert n_missed > n / 4


@pytest.mark.parametrize("offset", [0.0, 2.0**30])
@pytest.mark.parametrize(("height", "truth"), [(2, Fraction(1, 2)), (12, Fraction(2, 3))])
def test_the_fold_holds_its_rational_distance_after_many_cuts(height, truth, offset):
    # h / (1 + sqrt(1 + 2 h^2)): 2 / 4 and 12 / 18, inside the fold and on no dyadic line
    vertices = offset + np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, height], [0, 1, 0]])
    one = Mesh(vertices, np.array([[0, 1, 2], [0, 2, 3]], np.int32))
    two = Mesh(vertices, np.array([[0, 1, 3], [1, 2, 3]], np.int32))
    side = one_sided_hausdorff(one, two, tolerance=1e-11)
    assert contains(side.distance.lower, side.distance.upper, truth**2)
    assert side.is_within_tolerance


def test_a_tolerance_below_rounding_is_not_met_and_said_not_to_be():
    target = triangle(np.random.default_rng(1), 1.0, 0.0)
    source = triangle(np.random.default_rng(2), 1.0, 1e6)
    side = one_sided_hausdorff(source, target, tolerance=1e-13)
    square = max(square_to_triangle(v, target.triangles[0]) for v in source.triangles[0])
    assert contains(side.distance.lower, side.distance.upper, square)
    assert side.distance.width > 1e-13
    assert not side.is_within_tolerance


@pytest.mark.parametrize("size", [1e-29, 1e-36, 1e-42, 1e-60, 1e-160])
def test_lengths_below_what_single_precision_holds_are_still_enclosed(size):
    rng = np.random.default_rng(3)
    many = Mesh(size * rng.normal(size=(60, 3)), np.arange(60, dtype=np.int32).reshape(-1, 3))
    point = Mesh(size * rng.normal(size=(1, 3)), np.zeros((1, 3), np.int32))
    square = min(square_to_triangle(point.vertices[0], face) for face in many.triangles)
    distance = one_sided_hausdorff(point, many).distance
    assert contains(distance.lower, distance.upper, square)
