"""Pictures that somebody sent: decoded with no trust in them, up to a size that is set before."""

import io
import warnings
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from ..errors import IoError
from .exr_header import MAGIC
from .exr_picture import read_exr_picture
from .images import IMAGE_ERRORS, MORE_IMAGE_ERRORS, read_image

KINDS = ("PNG", "JPEG", "WEBP", "BMP")
ORIENTATION = 0x112  # of Exif 2.32, table 3
WHERE = "decode_picture(data)"


def decode_picture(data: bytes, *, most_pixels: int) -> np.ndarray:
    """Return the picture that a file of these bytes would hold.

    Parameters
    ----------
    data : bytes
        Of a PNG, JPEG, WebP, BMP or OpenEXR file.
    most_pixels : int
        Larger ones are refused by what their headers say, before any pixel is unpacked.

    Returns
    -------
    (h, w, c) uint8 or float32
        As `pictures.read_picture`; turned as a camera's note on it asks for.

    Raises
    ------
    IoError
        It is no such picture, damaged, or too large.
    """
    if data[:4] == MAGIC:
        with TemporaryDirectory(prefix="meshsdf-") as folder:
            path = Path(folder) / "picture.exr"
            path.write_bytes(data)
            try:
                return read_exr_picture(path, most_pixels)
            except (ValueError, OSError) as error:
                words = f"{error}, or it has more than {most_pixels} pixels"
                raise _unreadable(words) from None
    from PIL import Image, UnidentifiedImageError

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            image = Image.open(io.BytesIO(data), formats=KINDS)
    except (UnidentifiedImageError, Image.DecompressionBombError, ValueError, OSError) as error:
        words = "it is too large" if "pixels" in str(error) else "its first bytes are of no picture"
        raise _unreadable(words) from None
    width, height = image.size
    if width * height > most_pixels:
        what = f"the picture has {width} x {height} pixels, more than {most_pixels}"
        raise IoError(what, WHERE, "scale it down")
    said: list[str] = []
    orientation = _orientation(image)
    pixels = read_image(image, said.append)
    if pixels is None:
        raise _unreadable(said[0].split(": ", 1)[-1])
    return np.ascontiguousarray(_upright(pixels, orientation))


def _orientation(image) -> int:
    """How a camera says that it was held: 1 to 8."""
    try:
        return int(image.getexif().get(ORIENTATION, 1))
    except (*IMAGE_ERRORS, *MORE_IMAGE_ERRORS):
        return 1  # a note that cannot be read says nothing


def _upright(pixels: np.ndarray, orientation: int) -> np.ndarray:
    """The picture as it was seen; the first row and column are the sides that Exif names."""
    if orientation >= 5:
        pixels = pixels.swapaxes(0, 1)
    if orientation in (2, 3, 6, 7):
        pixels = pixels[:, ::-1]
    if orientation in (3, 4, 7, 8):
        pixels = pixels[::-1]
    return pixels


def _unreadable(words: str) -> IoError:
    fix = f"send a {', '.join(KINDS)} or OpenEXR file"
    return IoError(f"the picture cannot be read: {words}", WHERE, fix)
