"""meshsdf.surface.marching_squares: where the curves lie, and which way they run."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter, label

from meshsdf.grid import Grid
from meshsdf.surface import marching_cubes, marching_squares


def circle_grid(n, radius=1.0, size=3.0):
    """Distances to a circle about (0, 0) on n^2 squares; (values, voxel_size, origin)."""
    h = size / n
    origin = np.array([-size / 2 + 0.13 * h, -size / 2 - 0.29 * h])
    x, y = (origin[:, None, None] + h * np.indices((n + 1, n + 1))).reshape(2, n + 1, n + 1)
    return np.hypot(x, y) - radius, h, origin


def has_alternating_square(values):
    inside = values < 0
    a, b, c, d = inside[:-1, :-1], inside[1:, :-1], inside[1:, 1:], inside[:-1, 1:]
    return ((a == c) & (b == d) & (a != b)).any()


def test_points_of_a_circle_are_as_near_to_it_as_stated_with_order_two():
    largest, area_error, sizes = [], [], []
    for n in (16, 32, 64, 128, 256):
        values, h, origin = circle_grid(n)
        (circle,) = marching_squares(values, voxel_size=h, origin=origin)
        error = np.abs(np.linalg.norm(circle.points, axis=1) - 1)
        assert error.max() <= h**2 / 8 / (1 - h)
        assert circle.is_closed
        largest.append(error.max())
        area_error.append(np.pi - circle.signed_area)
        sizes.append(h)
    for errors in (largest, area_error):
        assert min(errors) > 0  # the points lie inside, and so does the polygon
        assert np.polyfit(np.log(sizes), np.log(errors), 1)[0] == pytest.approx(2, abs=0.1)


def test_any_level_of_a_distance_is_the_circle_so_much_larger():
    values, h, origin = circle_grid(64)
    for level in (-0.5, 0.25, 0.4):
        (circle,) = marching_squares(values, level=level, voxel_size=h, origin=origin)
        bound = h**2 / 8 / (1 + level - h)
        np.testing.assert_allclose(np.linalg.norm(circle.points, axis=1), 1 + level, atol=bound)


def test_smaller_values_are_on_the_left():
    values, h, origin = circle_grid(32)
    (disk,) = marching_squares(values, voxel_size=h, origin=origin)
    (hole,) = marching_squares(-values, voxel_size=h, origin=origin)
    assert disk.signed_area > 3
    assert hole.signed_area == -disk.signed_area
    ring = marching_squares(np.abs(values) - 0.2, voxel_size=h, origin=origin)
    assert sorted(np.sign(curve.signed_area) for curve in ring) == [-1, 1]
    np.testing.assert_allclose(sum(curve.signed_area for curve in ring), 0.8 * np.pi, rtol=0.01)
    for curve in ring:
        step = np.roll(curve.points, -1, axis=0) - curve.points
        left = np.stack([-step[:, 1], step[:, 0]], axis=1)
        # Points are off by h^2/8 / (0.8 - h) < 0.002, pieces of length sqrt(2) h by 0.003 more
        beside = curve.points + 0.5 * step + 0.02 * left / np.linalg.norm(left, axis=1)[:, None]
        assert (np.abs(np.linalg.norm(beside, axis=1) - 1) < 0.2).all()


def test_a_line_is_found_to_rounding_and_runs_from_border_to_border():
    x, y = 0.25 * np.indices((9, 13)) + np.array([[[1.0]], [[2.0]]])
    (line,) = marching_squares(3 * x - y - 0.2, voxel_size=0.25, origin=np.array([1.0, 2.0]))
    assert not line.is_closed
    np.testing.assert_allclose(3 * line.points[:, 0] - line.points[:, 1], 0.2, atol=1e-14)
    ends = [[1.0, 2.8], [5.2 / 3, 5.0]]  # small values lie at small x
    np.testing.assert_allclose(line.points[[0, -1]], ends, rtol=1e-14)
    assert line.length == pytest.approx(2.2 * np.hypot(1 / 3, 1), rel=1e-14)
    assert line.signed_area == pytest.approx(0, abs=1e-14)


def test_every_rule_joins_what_it_says():
    values = np.full((4, 4), 5.0)
    values[1, 1], values[2, 2] = -1.0, -1.0  # a and c inside
    values[1, 2] = values[2, 1] = 0.5
    expected = {"diagonal": 1, "antidiagonal": 2, "mean": 1, "bilinear": 1}
    for rule, n in expected.items():
        assert len(marching_squares(values, alternating=rule)) == n
    values[2, 1] = 1.5  # mean 0, saddle (1 - 0.75) / -4: the mean ties, which keeps them apart
    assert len(marching_squares(values, alternating="mean")) == 2
    assert len(marching_squares(values, alternating="bilinear")) == 1
    values[2, 1] = 2.0  # saddle (1 - 1): a tie
    assert len(marching_squares(values, alternating="bilinear")) == 2
    turned = values[::-1]
    assert len(marching_squares(turned, alternating="antidiagonal")) == 1


def test_the_bilinear_rule_joins_what_the_interpolant_joins():
    rng = np.random.default_rng(1)
    for _ in range(60):
        values = np.pad(rng.normal(size=(4, 4)), 1, constant_values=1.0)
        m = 40  # samples per square; thinner necks than they resolve are left out
        t = np.arange(5 * m + 1) / m
        i = np.minimum(t.astype(int), 4)
        u = t - i
        rows = values[i] * (1 - u)[:, None] + values[i + 1] * u[:, None]
        dense = rows[:, i] * (1 - u) + rows[:, i + 1] * u
        inside, around = label(dense < 0)[1], label(dense > 0)[1]
        corners = values[:-1, :-1], values[1:, :-1], values[1:, 1:], values[:-1, 1:]
        saddle = corners[0] * corners[2] - corners[1] * corners[3]
        if np.abs(saddle).min() < 0.02:
            continue
        curves = marching_squares(values)
        assert sum(curve.signed_area > 0 for curve in curves) == inside
        assert sum(curve.signed_area < 0 for curve in curves) == around - 1


def dotted():
    values = np.ones((5, 5))
    values[:3] = -1.0
    values[3] = [0, 0, 0, 0, 0]
    return values


def test_nodes_at_the_level_are_points_of_the_curve():
    (line,) = marching_squares(dotted())
    np.testing.assert_array_equal(line.points, [[3, j] for j in range(5)])
    for zeros in ("nudge", "snap"):  # the row takes the side of the row before
        (other,) = marching_squares(dotted(), zeros=zeros)
        share = 2.0**-10 / (1 + 2.0**-10) if zeros == "nudge" else 0.0
        np.testing.assert_allclose(other.points, [[3 + share, j] for j in range(5)], rtol=1e-15)


def test_a_nudged_node_takes_the_side_of_the_node_before_it():
    lone = np.full((5, 5), -1.0)
    lone[2, 2] = 0.0
    assert len(marching_squares(lone)) == 0  # a curve around one place
    slit = np.full((5, 6), -1.0)
    slit[2, 2:4] = 0.0
    (there_and_back,) = marching_squares(slit)
    np.testing.assert_array_equal(there_and_back.points, [[2, 2], [2, 3]])
    for zeros in ("nudge", "snap"):
        assert len(marching_squares(lone, zeros=zeros)) == 0
        assert len(marching_squares(slit, zeros=zeros)) == 0


def test_an_edge_with_both_ends_at_the_level_is_crossed_in_the_middle():
    values = np.array([[-1.0, 0, -2], [1.0, 0, 2]])
    (curve,) = marching_squares(values, zeros="snap")
    np.testing.assert_array_equal(curve.points[:, 0], [1 / 2, 1 / 2, 1 / 2])
    np.testing.assert_array_equal(curve.points[:, 1], [0, 1, 2])
    (nudged,) = marching_squares(4 * values + 3, level=3, zeros="nudge")
    np.testing.assert_array_equal(nudged.points, curve.points)  # 1/1024 of -4 and of 4


def test_a_slice_without_alternating_squares_is_the_slice_of_marching_cubes():
    i, j = np.indices((24, 24)) - 11.3
    noise = gaussian_filter(np.random.default_rng(3).normal(size=(24, 24)), 2.5)
    values = noise + (i**2 + j**2) / 4e3 - 0.03
    assert not has_alternating_square(values)
    solid = marching_cubes(Grid(np.stack([values] * 2), 1.0, np.zeros(3)))
    own = solid.vertices[solid.vertices[:, 0] == 0][:, 1:]
    curves = marching_squares(values)
    np.testing.assert_array_equal(
        own[np.lexsort(own.T)], curves.points[np.lexsort(curves.points.T)]
    )


def test_scikit_image_finds_the_same_curves_where_no_square_alternates():
    measure = pytest.importorskip("skimage.measure")
    rng = np.random.default_rng(2)
    values = gaussian_filter(rng.normal(size=(200, 200)), 6)
    for level in (0.0, 0.02, -0.02):
        assert not has_alternating_square(values - level)
        curves = marching_squares(values, level=level)
        theirs = measure.find_contours(values, level)
        assert len(curves) == len(theirs) > 20
        np.testing.assert_allclose(
            sorted(curve.length for curve in curves),
            sorted(np.linalg.norm(np.diff(line, axis=0), axis=1).sum() for line in theirs),
        )
