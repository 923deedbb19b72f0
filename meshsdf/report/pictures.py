"""Pictures as a page holds them: bytes, size, and words for those who do not see them."""

import io
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32
from PIL import Image, features

from ..ray import png_bytes
from ..ray.images import encoded


@dataclass(frozen=True)
class Picture:
    """A picture in a file format that browsers know.

    Attributes
    ----------
    data : bytes
        WebP, or PNG where Pillow was built without it.
    width, height : int
        Pixels.
    name, alt : str
        A caption, and a description.
    marker : str
        SVG to lay over it, or nothing.
    """

    data: bytes
    width: int
    height: int
    name: str
    alt: str
    marker: str = ""


def file_bytes(picture: Float32[np.ndarray, "h w 4"]) -> bytes:
    """Return a linear RGBA picture as lossless WebP, which is smaller than PNG."""
    if not features.check("webp"):
        return png_bytes(picture)
    file = io.BytesIO()
    Image.fromarray(encoded(picture)).save(file, "WEBP", lossless=True, quality=80, method=4)
    return file.getvalue()
