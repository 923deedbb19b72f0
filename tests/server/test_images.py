"""meshsdf.server.images: pictures that are kept, and those that make room."""

import io

import numpy as np
import pytest
from PIL import Image

from meshsdf.errors import IoError, TextureError
from meshsdf.server.images import Images


def png(shade: int, size: int = 16) -> bytes:
    out = io.BytesIO()
    Image.fromarray(np.full((size, 2 * size), shade, np.uint8)).save(out, "PNG")
    return out.getvalue()


def test_a_picture_is_kept_under_a_name_of_its_own():
    images = Images()
    one, other, again = images.add(png(1)), images.add(png(2)), images.add(png(1))
    assert (one.width, one.height) == (32, 16)
    assert one == again != other
    assert len(images) == 2
    assert (images.get(one.id) == 1).all()


def test_those_not_used_for_longest_make_room():
    images = Images(most=3)
    names = [images.add(png(shade)).id for shade in range(3)]
    images.get(names[0])
    images.add(png(3))
    assert images.get(names[0]).shape == (16, 32, 1)
    with pytest.raises(TextureError, match=f"there is no picture '{names[1]}'"):
        images.get(names[1])


def test_their_bytes_are_counted_and_the_last_one_stays():
    images = Images(most_bytes=3 * 16 * 32)
    for shade in range(8):
        last = images.add(png(shade))
        assert images.n_bytes <= 3 * 16 * 32
    assert len(images) == 3
    large = images.add(png(9, size=64))
    assert len(images) == 1
    assert images.get(large.id).shape == (64, 128, 1)
    with pytest.raises(TextureError):
        images.get(last.id)


def test_a_large_one_and_a_broken_one_are_refused_and_the_others_stay():
    images = Images(most_pixels=16 * 32)
    kept = images.add(png(1))
    with pytest.raises(IoError, match="the picture has 34 x 17 pixels, more than 512"):
        images.add(png(1, size=17))
    with pytest.raises(IoError, match="cannot be read"):
        images.add(b"no picture")
    assert len(images) == 1
    assert images.get(kept.id).size == 16 * 32
