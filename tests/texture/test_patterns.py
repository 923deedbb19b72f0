"""Wood and the regular patterns: the formulas, and their exact means."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf.texture.patterns import Brick, Checker, Stripes
from meshsdf.texture.waves import Periodic, square_wave, square_wave_in_cube
from meshsdf.texture.wood import Wood, WoodGrain

BLACK, WHITE = (0, 0, 0), (1, 1, 1)


def some_points(n, seed=0, size=3.0):
    return np.random.default_rng(seed).uniform(-size, size, (n, 3))


def strewn_cube(rows, seed=0):
    """Places in a cube of width 1 around 0, one to each of rows^3 parts."""
    corners = np.stack(np.meshgrid(*[np.arange(rows)] * 3), axis=-1).reshape(-1, 3)
    return (corners + np.random.default_rng(seed).random(corners.shape)) / rows - 0.5


@pytest.mark.parametrize("width", [0.01, 0.3, 1.0, 2.7])
def test_the_mean_of_a_square_wave_is_the_overlap_with_its_intervals(width):
    phase = np.linspace(-3, 3, 301)
    expected = np.zeros(301)
    for n in range(-8, 8):
        low, high = np.maximum(phase - width / 2, n + 0.7), np.minimum(phase + width / 2, n + 1)
        expected += np.maximum(high - low, 0) / width
    assert_allclose(square_wave(phase, 0.3, width), expected, atol=1e-12)


def test_the_mean_over_a_cube_is_that_of_places_in_it():
    widths = np.array([0.8, 0.5, 0.2])
    places = strewn_cube(60) @ widths
    phase = np.linspace(0, 1, 21)
    fine = np.array([square_wave(p + places, 0.3).mean() for p in phase])
    means = square_wave_in_cube(phase, 0.3, np.tile(widths, (21, 1)))
    # 60^3 strewn places: edges cut some 3 * 60^2 parts, each wrong by half at random
    assert_allclose(means, fine, atol=4 * 0.5 * np.sqrt(3 * 60**2) / 60**3)


def test_a_table_keeps_values_and_means():
    table = Periodic(np.array([0.0, 1.0, 0.0, 0.0]))
    assert_allclose(table(np.array([0.125, 0.25, -0.75, 7.375])), [0.5, 1, 1, 0.5])
    assert_allclose(table(np.array([0.25, 0.25]), np.array([0.5, 4.0])), [0.5, 0.25])


def test_wood_has_rings_of_the_width_asked_for_around_any_axis():
    axis, center = np.array([1.0, 2.0, -2.0]) / 3, np.array([0.3, -1.0, 2.0])
    points = some_points(5000)
    away = np.cross(points - center, axis)
    ring = np.linalg.norm(away, axis=1) / 0.37 % 1
    wood = Wood(
        ring_width=0.37,
        dark_fraction=0.25,
        axis=tuple(axis),
        axis_point=tuple(center),
        light=BLACK,
        dark=WHITE,
    )
    clear = np.minimum(np.abs(ring - 0.75), np.minimum(ring, 1 - ring)) > 1e-9
    assert_array_equal(wood(points)[clear, 0], (ring >= 0.75)[clear])


def test_wood_through_a_wide_filter_is_dark_by_its_fraction():
    wood = Wood(ring_width=0.01, dark_fraction=0.3, light=BLACK, dark=WHITE)
    points = some_points(50) + np.array([20.0, 0, 0])
    # Edges of the cube cut single rings: at most 1 % of its width
    assert_allclose(wood(points, 1.0)[:, 0], 0.3, atol=0.01)


def test_scale_enlarges_and_a_turn_about_the_axis_changes_nothing():
    points = some_points(500)
    small, large = Wood(ring_width=0.1), Wood(ring_width=0.1, scale=2.0)
    assert_allclose(small(points, 0.05), large(2 * points, 0.1), atol=1e-6)
    radius = np.hypot(points[:, 0], points[:, 1])
    turned = np.stack([radius, 0 * radius, 0 * radius], axis=1)
    assert (small(points) == small(turned)).all(axis=1).mean() > 0.999  # rounding at edges


def test_wood_grain_without_its_noises_is_rings_with_two_smoothsteps():
    texture = WoodGrain(
        ring_width=0.2, waviness=0, unevenness=0, fibres=0, axis=(0, 0, 1), light=BLACK, dark=WHITE
    )
    radius = np.linspace(0.0, 1.0, 400)
    points = np.stack([radius, 0 * radius, 5 * radius], axis=1)

    def smoothstep(low, high, x):
        t = np.clip((x - low) / (high - low), 0, 1)
        return t * t * (3 - 2 * t)

    s = radius / 0.2 % 1
    expected = smoothstep(0, 0.8, s) - smoothstep(0.83, 1, s)
    assert_allclose(texture(points)[:, 0], expected, atol=3e-5)  # 6 / 0.17^2 / 8 / 1024^2


def test_grain_and_rays_follow_the_axis():
    def change(texture, step):
        points = some_points(4000, size=1.0)
        return np.abs(texture(points + np.array(step)) - texture(points)).mean()

    for parts in ({"fibres": 0.5}, {"fibres": 0.0, "rays": 1.0}):
        texture = WoodGrain(axis=(0, 0, 1), **parts)
        assert change(texture, [0, 0, 0.01]) < 0.5 * change(texture, [0.01, 0, 0])


def test_a_checker_is_even_and_odd_cubes_and_its_mean_is_half():
    points = some_points(2000)
    checker = Checker(side=0.5, first=BLACK, second=WHITE)
    odd = np.floor(points / 0.5).sum(axis=1) % 2
    assert_array_equal(checker(points)[:, 0], odd)
    # Linear light, not the sRGB middle
    assert_allclose(checker(points, 1.0)[:, 0], 0.5, atol=1e-7)
    share = checker(np.array([[0.5, 0.25, 0.25]]), 0.25)[0, 0]
    assert share == pytest.approx(0.5)


@pytest.mark.parametrize("direction", [(1, 0, 0), (1, 1, 0), (3, -2, 1)])
def test_stripes_are_filtered_exactly_in_every_direction(direction):
    stripes = Stripes(period=0.5, share=0.3, direction=direction, first=BLACK, second=WHITE)
    points = some_points(20)
    fine = np.array([stripes(p + 0.4 * strewn_cube(40))[:, 0].mean() for p in points])
    assert_allclose(stripes(points, 0.4)[:, 0], fine, atol=4 * 0.5 * np.sqrt(2 * 3 * 40**2) / 40**3)


def test_bricks_cover_what_the_mortar_leaves():
    brick = Brick(variation=0.0, brick=WHITE, mortar=BLACK)
    share = (1 - 0.02 / 0.5) * (1 - 0.02 / 0.25) * (1 - 0.02 / 0.16)
    assert_allclose(brick(some_points(20), 4.0)[:, 0], share, atol=1e-12 + 0.02)
    # A cube of whole periods is the mean itself: 2 courses of 0.16, depths of 0.32, lengths of 0.32
    even = Brick(length=0.32, depth=0.32, variation=0.0, brick=WHITE, mortar=BLACK)
    share = (1 - 0.02 / 0.32) ** 2 * (1 - 0.02 / 0.16)
    assert_allclose(even(some_points(20), 0.32)[:, 0], share, atol=1e-6)


def test_every_other_course_is_half_a_brick_aside():
    brick = Brick(brick=WHITE, mortar=BLACK, variation=0.0)
    across = np.stack([np.linspace(0.0, 1.0, 500), np.full(500, 0.1), np.full(500, 0.08)], axis=1)
    above = across + np.array([0.25, 0, 0.16])
    assert 0.02 < 1 - brick(across)[:, 0].mean() < 0.06
    assert_allclose(brick(across, 0.01), brick(above, 0.01), atol=1e-6)
