"""meshsdf.report.conditioning: the least gradient on a level set, and how far a change moves it."""

import json
from math import inf

import numpy as np
import pytest
from scipy.spatial import KDTree

from meshsdf.errors import ReportError
from meshsdf.grid import Grid
from meshsdf.report.conditioning import conditioning
from tests.report.zero_samples import fine_roots, interpolated
from tests.surface.bands import band_of, grid_of, sphere_distance

ORIGIN = np.array([3.0, -2.0, 1.0])


def grid(values, voxel_size=1.0):
    return Grid(np.asarray(values, float), voxel_size, ORIGIN)


def beach(a, h, n=12):
    """x³ at nodes where x = (i - 5 - a) h: flat where it is zero, a of the way along an edge."""
    x = (np.arange(n) - 5 - a) * h
    return grid(np.broadcast_to((x**3)[:, None, None], (n, 5, 6)), h)


def gradients(values, points):
    """Gradients of the trilinear interpolant, by differences along each axis within the cell."""
    cell = np.clip(np.floor(points), 0, np.array(values.shape) - 2)
    out = []
    for axis in range(3):
        ends = np.repeat(points[None], 2, axis=0)
        ends[0][:, axis], ends[1][:, axis] = cell[:, axis], cell[:, axis] + 1
        out.append(interpolated(values, ends[1]) - interpolated(values, ends[0]))
    return np.stack(out, axis=1)


def test_a_linear_function_has_its_slope_everywhere():
    slope = np.array([0.3, -0.5, 0.9])
    h = 0.25
    values = np.moveaxis(np.indices((8, 9, 10)), 0, -1) @ (h * slope) - 0.71
    found = conditioning(grid(values, h))
    norm = np.linalg.norm(slope)
    assert found.least_gradient.contains(norm)
    assert found.least_gradient.width < 1e-2 * norm
    assert found.steepest == pytest.approx(norm)
    assert not found.is_flat
    on_plane = (found.where - ORIGIN) @ slope
    assert on_plane == pytest.approx(0.71, abs=1e-12)


def test_a_change_moves_a_plane_by_itself_over_the_slope():
    # Across the walls of the grid there is no data, so there the plane is followed along them
    values = np.broadcast_to(2.0 * np.arange(9)[:, None, None] - 7.3, (9, 6, 6))
    found = conditioning(grid(values, 0.5))
    for delta in (1e-9, 1e-3, 1.0):
        assert delta / 4.0 <= found.displacement(delta) <= 1.001 * delta / 4.0 + 1e-12
    assert found.displacement(0.0) == 0.0


@pytest.mark.parametrize("h", [1.0, 0.1])
@pytest.mark.parametrize("a", [0.5, 0.2, 1e-3])
def test_on_the_flat_beach_the_slope_is_that_of_the_cell(a, h):
    found = conditioning(beach(a, h))
    slope = ((1 - a) ** 3 + a**3) * h**2
    assert found.least_gradient.lower <= slope * (1 + 1e-12)
    assert found.least_gradient.upper >= slope * (1 - 1e-12)
    assert found.least_gradient.width < 0.01 * slope
    delta = 1e-4 * h**3
    if a > 0.1:
        assert delta / slope <= found.displacement(delta) <= 1.001 * delta / slope
    # Where delta exceeds the values nearby the shore is where x^3 reaches it
    delta = 0.9 * h**3
    assert found.displacement(delta) >= 0.9 * np.cbrt(delta)
    assert found.displacement(delta) < 4 * h


def test_a_beach_is_called_flat_beside_a_steep_shore():
    # Along x, rows of slope 0.001 to 1; between rows the slope is linear
    slopes = np.array([0.5, 0.1, 0.01, 0.001, 0.3, 1.0])
    values = (np.arange(12) - 5.3)[:, None, None] * slopes[:, None] * np.ones(4)
    found = conditioning(grid(values))
    assert found.is_flat
    assert found.steepest > 1.0
    assert found.where[:2] - ORIGIN[:2] == pytest.approx([5.3, 3], abs=1e-2)
    assert "badly conditioned" in found.describe()
    assert found.least_gradient.lower <= 1e-3 * (1 + 1e-12)
    assert found.least_gradient.upper >= 1e-3 * (1 - 1e-12)
    assert found.least_gradient.width < 1e-5 + 1e-6 * found.steepest


def test_distances_have_slope_one_but_for_the_size_of_a_voxel():
    h = 0.1
    for volume in (
        band_of(sphere_distance, (-2, -2, -2), (4, 4, 4), h),
        grid_of(sphere_distance, (-14, -14, -14), (29, 29, 29), h),
    ):
        found = conditioning(volume)
        # Each component is a mean over a voxel: off by h / 2 times the second derivative, and
        # n_a (1 - n_a^2) adds up to 2 / sqrt(3) at most, where the normal n is diagonal
        assert 1 - 0.7 * h < found.least_gradient.lower
        assert found.least_gradient.upper < 1 - 0.45 * h
        assert np.linalg.norm(found.where) == pytest.approx(1, abs=h**2)
        assert 1e-3 * h <= found.displacement(1e-3 * h) < 1.1e-3 * h
        assert found.displacement(0.5 * h) < 0.9 * h


def test_at_a_crossing_the_gradient_vanishes():
    # x y: two planes that cross in a line, halfway within cells
    x, y, _ = np.indices((6, 6, 4)) - 2.5
    found = conditioning(grid(x * y))
    assert found.least_gradient.lower == 0.0
    assert found.least_gradient.upper < 1e-3
    assert found.where[:2] - ORIGIN[:2] == pytest.approx(2.5, abs=1e-3)
    assert "no multiple" in found.describe()
    # Sides stay apart by sqrt(delta) at least: the bound is a cell or two, and not infinite
    assert np.sqrt(0.01) / 2 < found.displacement(0.01) < 5


@pytest.mark.parametrize("seed", range(6))
def test_no_zero_of_random_values_has_less_gradient_than_the_least(seed):
    rng = np.random.default_rng(seed)
    values = rng.normal(size=(5, 6, 5)) if seed % 2 else rng.integers(-2, 3, (5, 6, 5)) + 0.5
    found = conditioning(grid(values))
    roots = fine_roots(values, 24)
    seen = np.linalg.norm(gradients(values, roots), axis=1).min()
    assert found.least_gradient.lower <= seen * (1 + 1e-9) + 1e-12
    assert found.least_gradient.upper <= seen * 1.0102 + 2e-6 * found.steepest
    at = (found.where - ORIGIN)[None]
    assert np.abs(interpolated(values, at)) < 1e-9


@pytest.mark.parametrize("seed", range(4))
def test_no_change_moves_the_level_set_farther_than_is_said(seed):
    rng = np.random.default_rng(seed)
    h = 0.2
    center = rng.uniform(-0.1, 0.1, 3)
    ball = grid_of(lambda p: sphere_distance(p, center), (-8, -8, -8), (17, 17, 17), h)
    bumpy = Grid(ball.values + 0.3 * h * rng.normal(size=ball.values.shape), h, ball.origin)
    delta = (0.02, 0.2)[seed % 2] * h
    found = conditioning(bumpy).displacement(delta)
    n_parts = 6
    spacing = np.sqrt(3) / n_parts * h
    before = h * fine_roots(bumpy.values, n_parts)
    for change in (
        np.full(bumpy.values.shape, delta),
        delta * rng.choice([-1, 1], ball.values.shape),
    ):
        after = h * fine_roots(bumpy.values + change, n_parts)
        assert KDTree(before).query(after)[0].max() <= found + spacing
        assert KDTree(after).query(before)[0].max() <= found + spacing
    assert found < 7 * h


def test_uniform_changes_of_a_ramp_reach_the_bound():
    # Steps of different height: the bound must be the worst of them
    heights = np.array([-3.0, -2.0, -1.9, 0.4, 0.5, 3.0])
    found = conditioning(grid(np.broadcast_to(heights[:, None, None], (6, 5, 5))))
    # The zero lies 1.9 / 2.3 of the way from -1.9 to 0.4; at -0.45 it has come to 0.45 beyond 0.4
    shift = 3 + (0.45 - 0.4) / 0.1 - (2 + 1.9 / 2.3)
    bound = found.displacement(0.45)
    assert shift <= bound < 3


def test_where_a_piece_may_appear_nothing_bounds_the_shift():
    values = np.ones((11, 11, 11)) * 5
    values[2, 2, 2] = -5
    values[8, 8, 8] = 0.1
    found = conditioning(grid(values))
    assert found.displacement(0.05) < 0.1
    assert found.displacement(0.2) == inf
    told = found.displacement_at(0.2)
    assert told.upper is None
    assert np.abs(told.where - ORIGIN - 8).max() <= 0.5
    assert "may vanish there, or appear" in told.why


def test_a_change_as_large_as_the_band_is_not_bounded():
    found = conditioning(band_of(sphere_distance, (-2, -2, -2), (4, 4, 4), 0.1))
    told = found.displacement_at(0.31)
    assert told.upper is None
    assert "spans the band" in told.why


def test_other_levels_and_data_that_are_missing():
    h = 0.1
    band = band_of(sphere_distance, (-2, -2, -2), (4, 4, 4), h)
    found = conditioning(band, level=0.05)
    assert np.linalg.norm(found.where) == pytest.approx(1.05, abs=h**2)
    values = grid_of(sphere_distance, (-14, -14, -14), (29, 29, 29), h).values
    values[:14] = np.nan
    half = conditioning(Grid(values, h, np.zeros(3)))
    assert half.least_gradient.lower > 1 - 0.7 * h
    assert half.n_cells < conditioning(band).n_cells


def test_json_holds_plain_numbers():
    found = conditioning(beach(0.5, 1.0))
    told = json.loads(json.dumps(found.to_json()))
    assert told["least_gradient"]["lower"] == found.least_gradient.lower
    assert told["where"] == found.where.tolist()


def test_what_has_no_level_set_is_refused():
    with pytest.raises(ReportError, match="no value crosses the level 2000"):
        conditioning(beach(0.5, 1.0), 2000.0)
    with pytest.raises(ReportError, match="the level is nan"):
        conditioning(beach(0.5, 1.0), np.nan)
    with pytest.raises(ReportError, match="the volume is unsigned"):
        conditioning(Grid(np.ones((3, 3, 3)), 1.0, ORIGIN, sign="unsigned"))
    with pytest.raises(ReportError, match="1 x 5 x 6 nodes, so it has no cell"):
        conditioning(grid(beach(0.5, 1.0).values[:1]))
    with pytest.raises(ReportError, match="the change is -1"):
        conditioning(beach(0.5, 1.0)).displacement(-1.0)
