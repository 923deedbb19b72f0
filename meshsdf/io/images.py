"""Texture images to arrays, as stored: 8 bits per channel, first row on top."""

import io
import struct
import warnings
from pathlib import Path

import numpy as np

from .warn import Warn

IMAGE_ERRORS = (OSError, ValueError, SyntaxError, TypeError, IndexError, KeyError, EOFError)
MORE_IMAGE_ERRORS = (AttributeError, OverflowError, MemoryError, struct.error, RuntimeError)
_KEPT_MODES = {"L", "LA", "RGB", "RGBA"}


def read_image(source: Path | object, warn: Warn) -> np.ndarray | None:
    """Return the (h, w, c) uint8 image, c = 1 to 4; None, said through ``warn``, if unreadable.

    ``source`` is a file or an image that Pillow opened.
    """
    from PIL import Image

    shown = repr(source.name) if isinstance(source, Path) else "stored in the file"
    bombs = (Image.DecompressionBombWarning, Image.DecompressionBombError)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            with Image.open(source) if isinstance(source, Path) else source as image:
                pixels = _eight_bits(image)
    except bombs as error:
        warn(f"image {shown} is left out, it is too large: {error}")
        return None
    except (*IMAGE_ERRORS, *MORE_IMAGE_ERRORS) as error:
        warn(f"image {shown} cannot be read: {error}")
        return None
    return pixels.reshape(*pixels.shape[:2], -1)


def encode_png(image: np.ndarray) -> bytes:
    """Return the (h, w, 1 to 4) uint8 image as the bytes of a PNG file."""
    from PIL import Image

    pixels = image[:, :, 0] if image.shape[2] == 1 else image
    out = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(pixels)).save(out, "PNG")
    return out.getvalue()


def _eight_bits(image) -> np.ndarray:
    """The pixels, 8 bits each; of 16 bits the upper ones, which Pillow would clip instead."""
    if image.mode == "I" or image.mode.startswith("I;16"):
        return (np.clip(np.asarray(image), 0, 65535) >> 8).astype(np.uint8)
    return np.asarray(image.convert(_mode(image)))


def _mode(image) -> str:
    if image.mode in _KEPT_MODES:
        return image.mode
    if image.mode == "P":
        return "RGBA" if "transparency" in image.info else "RGB"
    return "L" if image.mode in ("1", "F") else "RGB"
