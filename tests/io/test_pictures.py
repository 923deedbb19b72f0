"""meshsdf.io.pictures: what was drawn is what the file holds."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from PIL import Image

from meshsdf.errors import IoError
from meshsdf.io.pictures import SUFFIXES, check_picture, write_picture
from meshsdf.srgb import srgb_from_linear

# Linear light is rounded to 1/65535 first: at most 12.92 / 131070 in sRGB, 0.026 steps
HALF_A_STEP = 0.527 / 255
PICTURE = np.random.default_rng(0).random((30, 40, 4)).astype(np.float32)


def test_png_keeps_colours_and_alpha_to_half_a_step(tmp_path):
    write_picture(tmp_path / "a.png", PICTURE)
    pixels = np.asarray(Image.open(tmp_path / "a.png")) / 255
    assert_allclose(pixels[..., :3], srgb_from_linear(PICTURE[..., :3]), atol=HALF_A_STEP)
    assert_allclose(pixels[..., 3], PICTURE[..., 3], atol=HALF_A_STEP)


@pytest.mark.parametrize("name", ["a.jpg", "b.JPEG"])
def test_jpeg_is_before_white(tmp_path, name):
    smooth = np.linspace(0, 1, 40, dtype=np.float32)[None, :, None] * np.ones((30, 1, 4), "f4")
    write_picture(tmp_path / name, smooth)
    pixels = np.asarray(Image.open(tmp_path / name)) / 255
    truth = srgb_from_linear(smooth[..., :3] * smooth[..., 3:] + (1 - smooth[..., 3:]))
    assert np.abs(pixels - truth).mean() < 0.01


def test_exr_keeps_linear_light_multiplied_by_alpha(tmp_path):
    import OpenEXR

    bright = PICTURE * np.float32([7.0, 1.0, 0.001, 1.0])
    write_picture(tmp_path / "a.exr", bright)
    pixels = OpenEXR.File(str(tmp_path / "a.exr")).channels()["RGBA"].pixels
    assert_array_equal(pixels[..., 3], bright[..., 3])
    assert_array_equal(pixels[..., :3], bright[..., :3] * bright[..., 3:])


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_the_same_picture_gives_the_same_bytes_and_is_left_alone(tmp_path, suffix):
    before = PICTURE.copy()
    for name in "ab":
        write_picture(tmp_path / f"{name}{suffix}", PICTURE)
    assert (tmp_path / f"a{suffix}").read_bytes() == (tmp_path / f"b{suffix}").read_bytes()
    assert_array_equal(PICTURE, before)


def test_other_suffixes_and_existing_files_are_refused(tmp_path):
    for name, words in (
        ("a.bmp", r"suffix '\.bmp' cannot be written"),
        ("picture", "no suffix"),
        ("no/a.png", "does not exist"),
    ):
        with pytest.raises(IoError, match=words):
            check_picture(tmp_path / name)
    (tmp_path / "a.exr").write_text("precious")
    with pytest.raises(IoError, match="exists"):
        write_picture(tmp_path / "a.exr", PICTURE)
    assert (tmp_path / "a.exr").read_text() == "precious"
    write_picture(tmp_path / "a.exr", PICTURE, force=True)
    assert (tmp_path / "a.exr").read_bytes()[:4] == b"\x76\x2f\x31\x01"
