"""meshsdf.spatial.image: colours of an image at coordinates, filtered in linear light."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.ndimage import map_coordinates

from meshsdf.errors import TextureError
from meshsdf.spatial.image import Image

ULP = 2.0**-24  # half a unit in the last place of float32, of numbers up to 1
SCIPY_MODES = {
    "repeat": "grid-wrap",
    "clamp": "nearest",
    "mirror": "reflect",
    "transparent": "grid-constant",
}


def noise(height, width, channels=4, seed=0):
    return np.random.default_rng(seed).random((height, width, channels)).astype(np.float32)


def places(n, low=-2.5, high=3.5, seed=1):
    return np.random.default_rng(seed).uniform(low, high, (n, 2))


def scipy_bilinear(straight, uv, mode):
    """Colours times alpha interpolated by scipy, then divided."""
    height, width = straight.shape[:2]
    alpha = straight[..., 3:].astype(float)
    stored = np.concatenate([straight[..., :3] * alpha, alpha], axis=2)
    rows, columns = (1 - uv[:, 1]) * height - 0.5, uv[:, 0] * width - 0.5
    channels = [
        map_coordinates(stored[..., c], [rows, columns], order=1, mode=mode) for c in range(4)
    ]
    out = np.stack(channels, axis=1)
    covered = out[:, 3] > 0
    out[covered, :3] /= out[covered, 3:]
    return out, covered


@pytest.mark.parametrize("wrap", SCIPY_MODES)
@pytest.mark.parametrize("size", [(37, 53), (1, 1), (1, 6), (4, 2)])
def test_lookups_agree_with_scipy_beyond_all_borders(wrap, size):
    straight, uv = noise(*size), places(3000)
    expected, covered = scipy_bilinear(straight, uv, SCIPY_MODES[wrap])
    colors = Image.from_linear(straight).sample(uv, wrap=wrap)
    assert covered.any()
    assert covered.all() == (wrap != "transparent")
    # Premultiplying, and the result, are rounded to float32; the rest is float64
    assert_allclose(colors[covered], expected[covered], rtol=4 * ULP, atol=1e-12)
    assert_array_equal(colors[~covered], 0)


def test_the_middles_of_texels_return_the_bytes_of_the_file():
    stored = np.random.default_rng(0).integers(0, 256, (5, 7, 4), dtype=np.uint8)
    stored[..., 3] = np.maximum(stored[..., 3], 1)
    row, column = np.indices((5, 7)).reshape(2, -1)
    uv = np.column_stack([(column + 0.5) / 7, 1 - (row + 0.5) / 5])
    colors = Image.from_srgb(stored).sample(uv).astype(np.float64)
    linear = colors[:, :3]
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    got = np.rint(255 * np.column_stack([encoded, colors[:, 3]]))
    assert_array_equal(got, stored.reshape(-1, 4))


@pytest.mark.parametrize("wrap", ["repeat", "clamp", "mirror"])
@pytest.mark.parametrize("size", [(64, 64), (37, 53), (3, 1000), (1, 1)])
def test_one_colour_stays_that_colour_to_the_last_bit(wrap, size):
    color = np.array([213, 170, 59], np.uint8)
    image = Image.from_srgb(np.tile(color, (*size, 1)))
    footprints = 10 ** np.random.default_rng(0).uniform(-5, 2, (2000, 2))
    colors = image.sample(places(2000), footprints, wrap)
    only = image.sample(np.array([[0.5, 0.5]]))
    assert_array_equal(colors, np.repeat(only, 2000, axis=0))
    assert_allclose(only[0], [0.66538730, 0.40197778, 0.04373503, 1], atol=1e-6)


@pytest.mark.parametrize("size", [(64, 64), (37, 53), (5, 3), (1, 9), (7, 1)])
def test_the_last_level_is_the_mean_of_the_image(size):
    straight = noise(*size)
    levels = Image.from_linear(straight).pyramid
    mean = (straight.astype(float) * np.where(np.arange(4) < 3, straight[..., 3:], 1)).mean(
        axis=(0, 1)
    )
    # One rounding per level, and one more for colours times alpha
    assert_allclose(levels.coarse[-1], mean, atol=(len(levels.sizes) + 1) * ULP)
    assert_array_equal(levels.table[-1, 1:], 1)


def test_a_level_of_an_odd_image_weighs_texels_by_their_area():
    row = np.array([[[1.0], [2], [4], [8], [16]]], np.float32)
    coarse = Image.from_linear(row).pyramid.coarse
    # Two texels of two and a half each, and one of all
    assert_allclose(coarse[:, 0], [(1 + 2 + 2) / 2.5, (2 + 8 + 16) / 2.5, 31 / 5], rtol=2 * ULP)


def test_a_checker_seen_from_afar_has_the_mean_light_of_its_colours():
    i, j = np.indices((256, 256))
    white = ((i + j) % 2).astype(np.uint8)[..., None] * 255
    image = Image.from_srgb(np.repeat(white, 3, axis=2))
    colors = image.sample(places(500), 2 / 256)
    assert_allclose(colors[:, :3], 0.5, atol=1e-6)  # 188 of 255 in sRGB, not 128


def test_transparent_texels_do_not_tint():
    straight = np.zeros((2, 2, 4), np.float32)
    straight[:, 0] = [1, 0, 0, 1]
    straight[:, 1] = [0, 1, 0, 0]  # green, but nowhere to be seen
    colors = Image.from_linear(straight).sample(places(500), 0.7)
    assert (colors[:, 3] > 0).all()
    assert (colors[:, 3] < 1).all()
    assert_allclose(colors[:, :3], np.tile([1, 0, 0], (500, 1)), atol=2 * ULP)


def test_nothing_divides_by_no_alpha():
    empty = Image.from_linear(noise(8, 8) * np.array([1, 1, 1, 0], np.float32))
    for footprint in (0.0, 0.3, 9.0):
        assert_array_equal(empty.sample(places(100), footprint), 0)


@given(st.integers(0, 2**32 - 1), st.sampled_from(list(SCIPY_MODES)))
def test_no_colour_leaves_the_range_of_the_image(seed, wrap):
    rng = np.random.default_rng(seed)
    straight = noise(*rng.integers(1, 40, 2), seed=seed)
    footprints = 10 ** rng.uniform(-3, 1, (200, 2))
    colors = Image.from_linear(straight).sample(places(200, seed=seed), footprints, wrap)
    covered = colors[:, 3] > 0
    assert (colors[covered, :3] >= straight[..., :3].min() - 4 * ULP).all()
    assert (colors[covered, :3] <= straight[..., :3].max() + 4 * ULP).all()
    assert (colors[:, 3] <= straight[..., 3].max() + 4 * ULP).all()


def test_a_wider_footprint_fades_a_wave_as_a_box_does():
    n = 512
    wave = np.sin(2 * np.pi * 8 * (np.arange(n) + 0.5) / n)  # eight waves, 64 texels each
    image = Image.from_linear(np.tile(wave[None, :, None], (n, 1, 1)).astype(np.float32))
    uv = places(4000, 0, 1)
    heights = [np.abs(image.sample(uv, w / n)[:, 0]).max() for w in (0, 8, 32, 64, 128)]
    # A level whose texels are w wide has means over w, sinc(w / 64) of the wave, where its texels'
    # middles are: for 8, a 16th of the wave beside the crest, for 32, on it
    expected = [1, np.sinc(1 / 8) * np.cos(np.pi / 8), np.sinc(1 / 2), 0, 0]
    assert_allclose(heights, expected, atol=0.01)
    between = np.abs(image.sample(uv, 16 * 2**0.5 / n)[:, 0]).max()
    assert heights[2] < between < heights[1]


def test_a_long_footprint_blurs_along_itself_alone():
    n = 256
    stripes = (np.arange(n) % 32 < 16).astype(np.float32)
    image = Image.from_linear(np.tile(stripes[:, None, None], (1, n, 1)))  # rows alternate
    rows = 1 - (np.array([4, 12, 20, 28]) + 0.5) / n
    uv = np.column_stack([np.full(4, 0.3), rows])
    along = image.sample(uv, np.tile([1 / 4, 0.0], (4, 1)))
    assert_allclose(along[:, 0], [1, 1, 0, 0], atol=1e-6)
    across = image.sample(uv, np.tile([0.0, 1 / 4], (4, 1)))
    assert_allclose(across[:, 0], 0.5, atol=0.02)


def test_grey_and_alpha_become_four_channels():
    uv = np.array([[0.5, 0.5]])
    for channels, expected in [(1, [0.2, 0.2, 0.2, 1]), (2, [0.2, 0.2, 0.2, 0.4])]:
        given = np.array([0.2, 0.4], np.float32)[None, None, :channels]
        assert_allclose(Image.from_linear(given).sample(uv)[0], expected, atol=2 * ULP)


def test_coordinates_as_large_as_numbers_go_are_looked_up():
    huge = np.array([[1e300, -1e300], [-1e-320, 1e-320], [2.0**53 + 2, -0.25]])
    image = Image.from_linear(noise(8, 8))
    for wrap in SCIPY_MODES:
        for footprint in (0.0, 1e300):
            assert np.isfinite(image.sample(huge, footprint, wrap)).all()
    assert image.sample(np.zeros((0, 2))).shape == (0, 4)


def test_the_image_given_is_not_changed_and_may_be_read_only():
    straight = noise(6, 6)
    straight.flags.writeable = False
    copy = straight.copy()
    Image.from_linear(straight).sample(places(10), 0.2)
    assert_array_equal(straight, copy)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: Image.from_srgb(np.zeros((0, 4, 3), np.uint8)), "0 rows, 4 columns"),
        (lambda: Image.from_linear(np.zeros((2, 2, 5), np.float32)), "5 channels"),
        (lambda: Image.from_linear(np.full((2, 2, 3), np.nan, np.float32)), "4 of 4 texels"),
        (lambda: Image.from_linear(np.full((1, 1, 4), 2, np.float32)), "alpha runs from 2 to 2"),
    ],
)
def test_what_is_no_image_is_refused(call, said):
    with pytest.raises(TextureError, match=said):
        call()


@pytest.mark.parametrize(
    ("uv", "footprint", "wrap", "said"),
    [
        ([[np.nan, 0.0], [0, 0]], 0.0, "repeat", "1 of 2 texture coordinates"),
        ([[0.0, 0.0]], -1.0, "repeat", "1 of 1 footprints"),
        ([[0.0, 0.0]], np.inf, "repeat", "1 of 1 footprints"),
        ([[0.0, 0.0]], np.zeros(3), "repeat", r"shape \(3,\) for 1 places"),
        ([[0.0, 0.0]], 0.0, ("repeat", "bend"), "unknown wrap 'bend'"),
    ],
)
def test_lookups_that_mean_nothing_are_refused(uv, footprint, wrap, said):
    with pytest.raises(TextureError, match=said):
        Image.from_linear(noise(2, 2)).sample(np.array(uv), footprint, wrap)
