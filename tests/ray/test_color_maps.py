"""meshsdf.ray.color_maps: numbers to colours that can be ordered by their lightness."""

import matplotlib
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf.errors import RayError
from meshsdf.ray import color_map
from meshsdf.ray.color_maps import NAMES
from meshsdf.srgb import srgb_from_linear


@pytest.mark.parametrize("name", [*NAMES, "viridis_r"])
def test_colours_are_those_of_matplotlib_in_linear_light(name):
    values = np.linspace(0, 1, 777)
    expected = matplotlib.colormaps[name](values)[:, :3]
    # Its tables have 256 entries, so a number next to a border may get the one beside it
    steps = np.abs(np.diff(matplotlib.colormaps[name](np.arange(256))[:, :3], axis=0)).max()
    assert np.abs(srgb_from_linear(color_map(name)(values)) - expected).max() <= steps + 1e-9


@pytest.mark.parametrize("name", NAMES)
def test_lightness_rises_evenly(name):
    luminance = color_map(name)(np.linspace(0, 1, 200)) @ [0.2126, 0.7152, 0.0722]
    lightness = 116 * np.cbrt(luminance) - 16
    assert (np.diff(lightness) >= -0.2).all()
    assert lightness[-1] - lightness[0] > 60
    falling = color_map(name + "_r")(np.linspace(0, 1, 200))
    assert_allclose(falling[::-1], color_map(name)(np.linspace(0, 1, 200)), atol=0.02)


def test_numbers_beyond_the_ends_get_the_ends_colours():
    colors = color_map()
    ends = colors(np.array([0.0, 1.0]))
    found = colors(np.array([-3.0, np.nan, 2.0, np.inf, -np.inf]))
    assert_array_equal(found, ends[[0, 0, 1, 1, 0]])


def test_an_unknown_map_is_refused():
    with pytest.raises(RayError, match="no colour map 'jet'"):
        color_map("jet")
