"""meshsdf.srgb: the transfer curve and CIELAB, against published values."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from meshsdf.srgb import lab_from_linear, linear_from_srgb, srgb_from_linear

# sRGB (0 to 255) and CIELAB under D65, as common calculators and tables print them
PUBLISHED = {
    (255, 255, 255): (100.0, 0.0, 0.0),
    (0, 0, 0): (0.0, 0.0, 0.0),
    (255, 0, 0): (53.2408, 80.0925, 67.2032),
    (0, 255, 0): (87.7347, -86.1827, 83.1793),
    (0, 0, 255): (32.2970, 79.1875, -107.8602),
    (0, 255, 255): (91.1132, -48.0875, -14.1312),
    (255, 0, 255): (60.3242, 98.2343, -60.8249),
    (255, 255, 0): (97.1393, -21.5537, 94.4780),
}
DIGITS = 1e-3  # matrices are printed with 7 digits; a and b multiply what is lost by up to 500


@pytest.mark.parametrize("srgb", PUBLISHED)
def test_lab_is_what_tables_say(srgb):
    linear = linear_from_srgb(np.array([srgb]) / 255)
    assert_allclose(lab_from_linear(linear)[0], PUBLISHED[srgb], atol=DIGITS)


def test_lightness_of_a_grey_is_the_cube_root_of_its_light_and_it_has_no_hue():
    light = np.linspace(0.01, 2.0, 50)
    lab = lab_from_linear(np.repeat(light[:, None], 3, axis=1))
    assert_allclose(lab[:, 0], 116 * light ** (1 / 3) - 16, atol=1e-9)
    assert_allclose(lab[:, 1:], 0, atol=1e-9)


def test_near_black_lightness_is_linear_with_the_slope_of_the_standard():
    light = np.array([0.0, 0.001, 0.002, -0.001])
    lab = lab_from_linear(np.repeat(light[:, None], 3, axis=1))
    assert_allclose(lab[:, 0], light * 24389 / 27, atol=1e-9)  # kappa of CIE 15


def test_green_gives_most_of_the_light():
    y = (lab_from_linear(np.eye(3))[:, 0] + 16) ** 3 / 116**3
    assert_allclose(y, [0.2126, 0.7152, 0.0722], atol=1e-4)  # ITU-R BT.709


def test_the_curve_and_its_inverse_meet():
    encoded = np.linspace(0, 1, 256)
    assert_allclose(srgb_from_linear(linear_from_srgb(encoded)), encoded, atol=1e-7)
