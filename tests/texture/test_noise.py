"""meshsdf.texture.noise: what noise is, and its mean over boxes."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf.errors import TextureError
from meshsdf.texture.noise import (
    PERMUTATION,
    fbm,
    gradient_noise,
    noise_spreads,
    perlin_noise,
    removed_spread,
    ridged,
    turbulence,
)
from tests.texture import noise_twins

STEPS = np.array([0.3183, 0.5772, 0.6931])  # by which octaves are moved


def some_points(n, seed=0, size=20.0):
    return np.random.default_rng(seed).uniform(-size, size, (n, 3))


def test_the_reference_noise_has_the_published_value():
    assert perlin_noise(np.array([[3.14, 42.0, 7.0]]))[0] == 0.13691995878400012


def test_the_reference_noise_repeats_after_256_units_and_its_table_is_a_permutation():
    points = np.floor(64 * some_points(500)) / 64  # moved without rounding
    assert_array_equal(np.sort(PERMUTATION), np.arange(256))
    assert_array_equal(perlin_noise(points), perlin_noise(points + np.array([256, -512, 1024])))
    assert (gradient_noise(points) != gradient_noise(points + 256.0)).mean() > 0.9


def test_noise_is_that_of_the_plain_twin_bit_for_bit():
    near, far = some_points(60), 1e7 * some_points(60, seed=1) / 20
    for points in (near, far):
        twin = [noise_twins.noise(point, seed=5) for point in points.tolist()]
        assert_array_equal(gradient_noise(points, seed=5), twin)


def test_the_hash_is_the_published_one():
    # From the definition in unbounded integers: nothing wraps but where the paper says
    assert noise_twins.pcg3d(0, 0, 0) != noise_twins.pcg3d(0, 0, 1)
    points = np.array([[-0.5, 2.0**39 + 0.5, -(2.0**35) - 0.25]])
    assert_array_equal(gradient_noise(points), [noise_twins.noise(points[0].tolist(), 0)])


@pytest.mark.parametrize("width", [1 / 64, 0.3, 1.0, 1.7, 3.0])
def test_the_mean_over_a_box_is_the_integral(width):
    points = some_points(3, seed=2)
    widths = np.array([width, min(1.3 * width, 3.0), max(0.4 * width, 1 / 64)])
    means = gradient_noise(points, np.tile(widths, (3, 1)), seed=3)
    twins = [noise_twins.mean_over_box(point, widths, 3) for point in points]
    # Sums of 343 terms below 1, whose differences of antiderivatives are divided by the widths
    assert_allclose(means, twins, atol=1e-12)


def test_octaves_add_up_as_the_formulas_say():
    points = some_points(200, seed=3)
    octaves = np.array([gradient_noise(2.0**i * points + i * STEPS, seed=4 + i) for i in range(5)])
    weights = 0.5 ** np.arange(5)
    forms = ((fbm, lambda n: n), (turbulence, abs), (ridged, lambda n: (1 - abs(n)) ** 2))
    for form, function in forms:
        assert_allclose(form(points, seed=4), weights @ function(octaves), atol=1e-12)


def test_noise_has_mean_zero_and_the_spread_that_the_integrals_say():
    values = gradient_noise(some_points(200_000, size=100.0))
    # 200 000 values, some 8 of them to a cell: means are right to about 0.27 / sqrt(25 000)
    assert abs(values.mean()) < 0.006
    assert values.std() == pytest.approx(noise_spreads()[-1], abs=0.004)
    assert np.abs(values).max() <= 1.04


def test_fbm_varies_within_a_cube_as_much_as_said():
    points = some_points(40_000, size=100.0)
    within = np.random.default_rng(1).uniform(-0.5, 0.5, points.shape)
    for width in (0.25, 1.0, 2.0):
        apart = fbm(points + width * within, octaves=3) - fbm(points, width, octaves=3)
        said = removed_spread(np.array([width]), octaves=3)[0]
        assert apart.std() == pytest.approx(said, rel=0.05)


@pytest.mark.parametrize(("form", "bound"), [(turbulence, 0.035), (ridged, 0.06)])
def test_filtered_creases_are_near_their_mean_over_the_cube(form, bound):
    points = some_points(150, seed=6)
    steps = (np.arange(10) + 0.5) / 10 - 0.5
    cube = np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(-1, 3)
    for width in (0.2, 0.8, 2.0):
        fine = form((points[:, None] + width * cube).reshape(-1, 3), octaves=1)
        error = form(points, width, octaves=1) - fine.reshape(150, -1).mean(axis=1)
        assert np.sqrt((error**2).mean()) < bound
        assert abs(error.mean()) < 0.4 * bound


def test_far_from_the_origin_noise_is_as_lively_as_near_it():
    far = some_points(20_000, size=50.0) + np.array([1e7, -1e7, 4e9])
    values = gradient_noise(far)
    assert values.std() == pytest.approx(noise_spreads()[-1], abs=0.01)
    beyond = gradient_noise(far + 2.0**32)
    assert abs(np.corrcoef(values, beyond)[0, 1]) < 0.05


def test_noise_is_continuous_across_cells():
    on_faces = np.floor(some_points(1000, seed=8))
    on_faces[:, 1:] += np.random.default_rng(8).random((1000, 2))
    step = np.array([1e-9, 0, 0])
    # The gradient is at most 5 long
    assert_allclose(gradient_noise(on_faces - step), gradient_noise(on_faces + step), atol=1e-8)


def test_refusals_tell_the_number():
    with pytest.raises(TextureError, match="1 of 2 points are NaN or beyond"):
        gradient_noise(np.array([[0.0, 0, 0], [np.nan, 0, 0]]))
    with pytest.raises(TextureError, match="a width of the filter is -1"):
        fbm(np.zeros((1, 3)), -1.0)
    with pytest.raises(TextureError, match="octaves is 0"):
        fbm(np.zeros((1, 3)), octaves=0)
