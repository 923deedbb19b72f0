"""meshsdf.io.picture_bytes: pictures from strangers."""

import io
import struct
import time
import zlib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image, ImageOps

from meshsdf.errors import IoError
from meshsdf.io.picture_bytes import decode_picture
from meshsdf.io.pictures import read_picture, write_picture

ROOM = 1 << 20
RGB = np.random.default_rng(0).integers(0, 255, (20, 30, 3), np.uint8)


def encoded(image: Image.Image, kind: str = "PNG", **options) -> bytes:
    out = io.BytesIO()
    image.save(out, kind, **options)
    return out.getvalue()


def png_of_size(width: int, height: int) -> bytes:
    """A PNG file whose header says so much; its pixels are zeros, as far as they go."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        checksum = struct.pack(">I", zlib.crc32(kind + data))
        return struct.pack(">I", len(data)) + kind + data + checksum

    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    pixels = zlib.compress(bytes(10_000_000), 9)
    parts = chunk(b"IHDR", head), chunk(b"IDAT", pixels), chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


def exr(folder: Path, alpha: float = 1.0) -> bytes:
    picture = np.full((24, 32, 4), alpha, np.float32)
    picture[..., :3] = np.linspace(0, 4, 24 * 32 * 3, dtype=np.float32).reshape(24, 32, 3)
    write_picture(folder / "a.exr", picture)
    return (folder / "a.exr").read_bytes()


@pytest.mark.parametrize("mode", ["L", "LA", "RGB", "RGBA", "P", "1"])
def test_a_png_gives_the_pixels_that_pillow_gives(mode):
    image = Image.fromarray(RGB).convert(mode)
    shown = {"P": "RGB", "1": "L"}.get(mode, mode)
    wanted = np.asarray(image.convert(shown)).reshape(20, 30, -1)
    assert np.array_equal(decode_picture(encoded(image), most_pixels=ROOM), wanted)


@pytest.mark.parametrize("kind", ["JPEG", "WEBP", "BMP"])
def test_the_other_kinds_are_read(kind):
    got = decode_picture(encoded(Image.fromarray(RGB), kind), most_pixels=ROOM)
    assert got.shape == RGB.shape


def test_of_16_bits_the_upper_8_are_kept():
    values = (np.arange(256, dtype=np.uint16) * 257).reshape(16, 16)
    got = decode_picture(encoded(Image.fromarray(values)), most_pixels=ROOM)
    assert np.array_equal(got[..., 0].ravel(), np.arange(256))


@pytest.mark.parametrize("orientation", range(1, 9))
def test_a_picture_taken_upside_down_is_turned(orientation):
    note = Image.Exif()
    note[0x112] = orientation
    data = encoded(Image.fromarray(RGB), exif=note)
    wanted = np.asarray(ImageOps.exif_transpose(Image.open(io.BytesIO(data))))
    assert np.array_equal(decode_picture(data, most_pixels=ROOM), wanted)


def test_an_openexr_picture_is_read_as_from_a_file(tmp_path):
    data = exr(tmp_path, alpha=0.5)
    got = decode_picture(data, most_pixels=ROOM)
    assert got.dtype == np.float32
    assert np.array_equal(got, read_picture(tmp_path / "a.exr"))


@pytest.mark.parametrize("size", [(1025, 1024), (60000, 60000), (1 << 30, 1 << 30)])
def test_a_bomb_is_refused_by_its_header(size):
    data = png_of_size(*size)
    began = time.process_time()
    with pytest.raises(IoError, match=r"pixels|too large"):
        decode_picture(data, most_pixels=1024 * 1024)
    assert time.process_time() - began < 0.2


def test_an_openexr_bomb_is_refused_by_its_header(tmp_path):
    data = bytearray(exr(tmp_path))
    at = data.index(b"dataWindow\0box2i\0") + len(b"dataWindow\0box2i\0") + 4
    data[at : at + 16] = struct.pack("<4i", 0, 0, 200_000, 200_000)
    with pytest.raises(IoError, match=f"more than {ROOM} pixels"):
        decode_picture(bytes(data), most_pixels=ROOM)
    (tmp_path / "sound").mkdir()
    data = exr(tmp_path / "sound")
    assert decode_picture(data, most_pixels=24 * 32).shape == (24, 32, 4)
    with pytest.raises(IoError, match="more than 767 pixels"):
        decode_picture(data, most_pixels=24 * 32 - 1)


@pytest.mark.parametrize(
    "data", [b"", b"GIF89a" + bytes(50), b"<svg/>", b"%PDF-1.7", bytes(1000), b"\x76\x2f\x31\x01"]
)
def test_what_is_no_picture_is_refused(data):
    with pytest.raises(IoError, match="cannot be read") as refused:
        decode_picture(data, most_pixels=ROOM)
    assert "tmp" not in str(refused.value)  # where it lay meanwhile is nobody's business


@settings(max_examples=60)
@given(st.integers(0, 2**31), st.sampled_from(["PNG", "JPEG", "WEBP", "BMP"]))
def test_damage_gives_a_picture_or_a_reason_and_nothing_else(seed, kind):
    rng = np.random.default_rng(seed)
    data = np.frombuffer(encoded(Image.fromarray(RGB), kind), np.uint8).copy()
    data[rng.integers(0, len(data), 4)] = rng.integers(0, 256, 4)
    try:
        got = decode_picture(bytes(data[: rng.integers(1, len(data) + 1)]), most_pixels=ROOM)
    except IoError:
        return
    assert got.ndim == 3
    assert got.dtype == np.uint8
