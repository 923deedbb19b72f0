"""meshsdf.kernels.texel_codes: every code means what it should, and the nearest one is chosen."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf.errors import TextureError
from meshsdf.srgb import linear_from_srgb, srgb_from_linear
from meshsdf.texture.channels import channels_with

EIGHT, HALF = channels_with("srgb8"), channels_with("half")
BYTES = np.arange(256)


def rows(*columns):
    """(n, 4) float32 of columns or numbers."""
    columns = np.broadcast_arrays(*(np.atleast_1d(column) for column in columns))
    return np.stack(columns, axis=1).astype(np.float32)


def test_all_finite_halves_are_numpys_and_come_back():
    bits = np.arange(65536, dtype=np.uint16)
    finite = (bits & 0x7C00) != 0x7C00
    wanted = np.where(bits == 0x7C00, np.inf, 0).astype(np.float32)
    wanted[finite] = bits[finite].view(np.float16)
    height = EIGHT["height"]
    found = height.decoded(bits)[:, 0]
    assert_array_equal(found[finite], wanted[finite])
    assert np.isfinite(found).all()
    back = height.encoded(rows(wanted, 0, 0, 1))
    assert_array_equal(back[finite & (wanted != 0)], bits[finite & (wanted != 0)])
    assert_array_equal(back[wanted == 0], 0)  # -0 is 0
    assert_array_equal(back[bits == 0x7C00], 0x7BFF)  # infinity is the largest


def test_floats_become_the_half_that_numpy_chooses():
    random = np.random.default_rng(0)
    values = (random.normal(size=200_000) * 2.0 ** random.integers(-26, 17, 200_000)).astype("f4")
    middle = np.arange(0x7BFF, dtype=np.uint16).view(np.float16).astype(np.float32)
    middle = (middle[1:] + middle[:-1]) / 2  # ties
    values = np.concatenate([values, middle, -middle]).clip(-65504, 65504)
    wanted = values.astype(np.float16)
    found = EIGHT["height"].encoded(rows(values, 0, 0, 1))
    assert_array_equal(found & 0x7FFF, wanted.view(np.uint16) & 0x7FFF)
    assert_array_equal((found >> 15)[wanted != 0], (wanted.view(np.uint16) >> 15)[wanted != 0])


def test_half_colours_hold_all_four_numbers():
    random = np.random.default_rng(1)
    values = random.uniform(0, 10, (1000, 4)).astype(np.float16).astype(np.float32)
    base = HALF["base"]
    assert_array_equal(base.decoded(base.encoded(values)), values)


def test_every_srgb_code_decodes_by_the_standards_curve_and_comes_back():
    base = EIGHT["base"]
    for place in range(4):
        texels = (BYTES << (8 * place)).astype(np.uint32)
        decoded = base.decoded(texels)
        wanted = linear_from_srgb(BYTES / 255) if place < 3 else BYTES / 255
        assert_allclose(decoded[:, place], wanted, rtol=1e-7)
        assert_array_equal(base.encoded(decoded), texels)
    assert base.decoded(np.array([0xFF000000], np.uint32))[0, 3] == 1.0


def test_linear_light_becomes_the_nearest_srgb_code():
    light = np.linspace(-0.1, 1.1, 100_001).astype(np.float32)
    codes = EIGHT["base"].encoded(rows(light, 0, 0, 0)) & 255
    exact = 255 * srgb_from_linear(light.astype(np.float64).clip(0, 1))
    assert np.abs(codes - exact).max() <= 0.5 + 1e-4
    assert_array_equal(EIGHT["base"].encoded(rows(np.nan, np.nan, np.nan, np.nan)), [0])


@pytest.mark.parametrize("name", ["orm", "mask"])
def test_values_of_eight_bits_are_rounded_to_the_nearest_and_come_back(name):
    channel = EIGHT[name]
    values = BYTES / 255
    four = rows(values, values[::-1], 0.2, 1)
    found = channel.decoded(channel.encoded(four))
    assert_allclose(found[:, 0], values, atol=1e-7)
    if name == "orm":
        assert_allclose(found[:, 1], values[::-1], atol=1e-7)
        assert_allclose(found[:, 2:], np.tile([0.2, 1.0], (256, 1)), atol=1e-7)
    dense = channel.decoded(channel.encoded(rows(np.linspace(-1, 2, 5001), 0, 0, 1)))[:, 0]
    assert np.abs(dense - np.linspace(-1, 2, 5001).clip(0, 1)).max() <= 0.5 / 255 + 1e-7


def test_normals_are_off_by_less_than_a_two_hundredth_of_a_degree():
    random = np.random.default_rng(0)
    directions = random.normal(size=(200_000, 3))
    axes = np.concatenate([np.eye(3), -np.eye(3), np.indices((3, 3, 3)).reshape(3, -1).T - 1.0])
    directions = np.concatenate([directions, axes[(axes != 0).any(axis=1)]])
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    coverage = random.random(len(directions))
    channel = EIGHT["normal"]
    found = channel.decoded(channel.encoded(rows(*directions.T, coverage))).astype(np.float64)
    assert_allclose(np.linalg.norm(found[:, :3], axis=1), 1, atol=1e-6)
    apart = np.linalg.norm(np.cross(found[:, :3], directions), axis=1)
    assert ((found[:, :3] * directions).sum(axis=1) > 0).all()
    # A step of the code is 2 / 65535 on the octahedron, which a sphere stretches by up to 3: so
    # half a step each way is at most sqrt(2) * 3 / 65535 = 0.0037 degrees
    assert np.degrees(apart.max()) < 0.0038
    assert_allclose(found[:, 3], coverage, atol=0.5 / 65535 + 1e-7)


def test_what_was_never_written_decodes_to_nothing():
    wanted = {"base": [0, 0, 0, 0], "height": [0, 0, 0, 1], "mask": [1, 0, 0, 1]}
    for name, numbers in wanted.items():
        channel = EIGHT[name]
        found = channel.decoded(np.array([channel.nothing], channel.dtype))
        assert_array_equal(found, [numbers])
    nothing = EIGHT["normal"].decoded(np.array([EIGHT["normal"].nothing], np.uint64))
    assert nothing[0, 3] == 0


def test_another_way_to_keep_colours_is_refused():
    with pytest.raises(TextureError, match="base colours cannot be kept as 'float'"):
        channels_with("float")
