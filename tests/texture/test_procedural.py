"""meshsdf.texture.procedural: textures by name, and what holds for all of them."""

import hashlib

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf.errors import TextureError
from meshsdf.texture.procedural import PROCEDURALS, parameters_of, procedural

POINTS = np.random.default_rng(7).uniform(-2, 2, (2000, 3))
SEEDLESS = {"checker", "stripes", "wood"}  # there is nothing random in them

# SHA-256 of the colours at POINTS as uint8, floor(255 * linear + 0.5): the last bits of a machine's
# sine or exponential do not show. Saved projects name textures and rely on them to stay the same.
HASHES = {
    "agate": "5ab4098395db1a4ba6a423a83ff270cda5cad587bf023f50da691a546283ae84",
    "brick": "ac8d56d8f8735d05ccc9e9ed8051625ee9e6a3359c444ecff6473201cf9408ea",
    "cellular": "625cbd09fc2ab38854442e58e68016df00c5bce008ae582b777936e5ce4fecfc",
    "checker": "387dca29e1c18908157b93f62e6ea7b87d4ab8c91d895d92f98f2f12b300fd75",
    "clouds": "dca000fef26f1eb8686ae38ce268ec9a058923224510d50653ac7c1fe2146b86",
    "granite": "5453785a3320be257e7a5a1f9d117e3ab84dba174c4888858fb20d94b9fd0778",
    "marble": "0b2fc5e745982a6f249a4d704f0f5fd1d2d054b1b149ba0f27aab5ab3bc62c6a",
    "spots": "5b14f592a4f69646a04c8d1b3d5036f21f51faf5ca11fa4cb78c2ab1f285b0cf",
    "stripes": "62f3b441372cbebcaa99fad764cd3b66d7a9732c9cf2593e2d5e4cbc21e08bfc",
    "wood": "b04086163434061c11a0d81bc7147a24b44fb70bd77c034258d7322f2e049a04",
    "wood_grain": "79b9589f5018daa6e84e0fce5d4c819e6e5f4ca39ff11f763e607f825172b584",
}


def digest(kind):
    colors = procedural(kind)(POINTS).astype(np.float64)
    return hashlib.sha256(np.floor(255 * colors + 0.5).astype(np.uint8).tobytes()).hexdigest()


@pytest.mark.parametrize("kind", PROCEDURALS)
def test_the_texture_is_the_one_of_all_machines(kind):
    assert digest(kind) == HASHES[kind]


@pytest.mark.parametrize("kind", PROCEDURALS)
def test_colours_are_colours_and_the_points_are_left_alone(kind):
    points = POINTS.copy()
    colors = procedural(kind)(points, 0.03)
    assert colors.dtype == np.float32
    assert colors.shape == (2000, 4)
    assert colors.min() >= 0
    assert colors.max() <= 1.5
    assert_allclose(colors[:, 3], 1, atol=1e-6)
    assert colors[:, 0].std() > 0.01
    assert_array_equal(points, POINTS)


@pytest.mark.parametrize("kind", sorted(set(PROCEDURALS) - SEEDLESS))
def test_another_seed_is_another_piece(kind):
    one, same, other = (procedural(kind, seed=seed)(POINTS) for seed in (1, 1, 2))
    assert_array_equal(one, same)
    assert (one != other).any(axis=1).mean() > 0.1


@pytest.mark.parametrize("kind", PROCEDURALS)
def test_far_from_the_origin_there_is_as_much_to_see(kind):
    far = procedural(kind)(POINTS + np.array([1e7, -1e7, 1e7]))
    assert np.isfinite(far).all()
    near = procedural(kind)(POINTS)
    assert 0.3 < far[:, 0].std() / near[:, 0].std() < 3


@pytest.mark.parametrize("kind", PROCEDURALS)
def test_scale_is_the_length_of_the_unit(kind):
    # A power of two: points are the same to the last bit
    assert_array_equal(procedural(kind, scale=4)(4 * POINTS), procedural(kind)(POINTS))


@pytest.mark.parametrize("kind", PROCEDURALS)
def test_a_point_does_not_know_the_others(kind):
    many = np.tile(POINTS, (5, 1))[: 8192 + 700]
    whole, part = procedural(kind)(many, 0.01), procedural(kind)(many[8000:8400], 0.01)
    assert_allclose(whole[8000:8400], part, atol=1e-6)
    assert procedural(kind)(many[:0]).shape == (0, 4)


@pytest.mark.parametrize("kind", ["agate", "clouds", "marble", "wood_grain"])
def test_smooth_kinds_are_continuous(kind):
    step = 1e-7 * np.random.default_rng(1).normal(size=POINTS.shape)
    change = np.abs(procedural(kind)(POINTS + step) - procedural(kind)(POINTS))
    # Slopes below 2000 per unit: bands of agate and fibres are the steepest
    assert change.max() < 2e-3


def test_a_clear_colour_keeps_its_edge_clean():
    clouds = procedural("clouds", sky="#ff000000", cloud=(0, 1, 0))
    colors = clouds(POINTS)
    assert 0 < colors[:, 3].min() + 0.1 < 0.2
    seen = colors[:, 3] > 1e-3
    assert_allclose(colors[seen, :3], np.tile([0, 1, 0], (seen.sum(), 1)), atol=1e-6)


def test_text_becomes_values():
    wood = procedural("wood", ring_width="0.25", axis="0,3,0", light="0.5,0.5,0.5", seed="3")
    assert (wood.ring_width, wood.axis, wood.seed) == (0.25, (0.0, 1.0, 0.0), 3)
    assert wood.light == (0.5, 0.5, 0.5)
    assert procedural("cellular", exact="true", feature="f2-f1").exact is True


def test_every_parameter_has_a_default_and_a_meaning():
    for kind in PROCEDURALS:
        names = [one.name for one in parameters_of(kind)]
        assert names[:2] == ["seed", "scale"]
        assert len(set(names)) == len(names)
        for one in parameters_of(kind):
            assert one.meaning
            assert "\n" not in one.meaning
        assert procedural(kind, **{one.name: one.default for one in parameters_of(kind)})


@pytest.mark.parametrize(
    ("kind", "parameters", "message"),
    [
        ("wod", {}, "there is no texture 'wod'(.|\n)*pass one of agate, brick"),
        ("wood", {"ring_with": 1}, "wood has no parameter ring_with(.|\n)*did you mean ring_width"),
        ("wood", {"ring_width": 0}, "ring_width is 0(.|\n)*pass a length above 0"),
        ("wood", {"ring_width": "wide"}, "ring_width is 'wide'(.|\n)*pass a length above 0"),
        ("wood", {"dark_fraction": 1.5}, "pass a number from 0 to 1"),
        ("wood", {"light": "brown"}, "light is 'brown'(.|\n)*#aa7744"),
        ("wood", {"axis": (0, 0, 0)}, "three numbers that are not all 0"),
        ("wood", {"axis": "1,2"}, "three numbers"),
        ("wood", {"seed": -1}, "a whole number from 0 to 2147483647"),
        ("marble", {"octaves": "2.5"}, "a whole number from 1 to 32"),
        ("cellular", {"feature": "f3"}, "pass stones or f1 or f2-f1"),
        ("cellular", {"exact": "maybe"}, "pass True or False"),
        ("wood", {"scale": np.inf}, "scale is inf"),
    ],
)
def test_refusals_say_which_values_are_valid(kind, parameters, message):
    with pytest.raises(TextureError, match=message):
        procedural(kind, **parameters)
