"""Pictures in files: PNG and JPEG in sRGB, OpenEXR in linear light with all its range."""

import errno
import os
from pathlib import Path

import numpy as np
from jaxtyping import Float32

from ..errors import IoError, OutputError
from ..ray.images import jpeg_bytes, png_bytes
from .atomic import atomic_write, check_output
from .exr_picture import read_exr_picture
from .images import read_image
from .opened import refusing
from .registry import checked_input

Picture = Float32[np.ndarray, "h w 4"]
ENCODERS = {".png": png_bytes, ".jpg": jpeg_bytes, ".jpeg": jpeg_bytes}
SUFFIXES = (*ENCODERS, ".exr")


def check_picture(path: str | os.PathLike, force: bool = False) -> None:
    """Refuse a place that a picture cannot be written to, before any work starts.

    Raises
    ------
    IoError
        Pictures are not written with this suffix; or as `check_output`.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        what = f"a picture with suffix {suffix!r} cannot be written"
        if not suffix:
            what = "the name has no suffix, so the format of the picture is unknown"
        raise OutputError(what, f"output {path}", f"use one of {', '.join(SUFFIXES)}")
    check_output(path, force)


def write_picture(path: str | os.PathLike, picture: Picture, *, force: bool = False) -> None:
    """Write an (h, w, 4) picture, linear RGB not multiplied by alpha, as the suffix says.

    Parameters
    ----------
    path : path
        ``.png``: 8 bits, with alpha unless all is covered. ``.jpg``: 8 bits, before white.
        ``.exr``: float32 in linear light, multiplied by alpha as that format wants it.
    picture : (h, w, 4) float32
        From `render_mesh`.
    force : bool
        Whether an existing file may be replaced.

    Raises
    ------
    IoError
        As `check_picture`, or the disk is full. The same picture gives the same bytes.
    """
    check_picture(path, force)
    suffix = Path(path).suffix.lower()
    with atomic_write(path, force) as temporary:
        if suffix in ENCODERS:
            temporary.write_bytes(ENCODERS[suffix](picture))
        else:
            _write_exr(temporary, picture)


def read_picture(path: str | os.PathLike) -> np.ndarray:
    """Read an image that is to be a texture.

    Returns
    -------
    (h, w, c) uint8 or float32
        8-bit values as stored (sRGB), c = 1 to 4, from whatever Pillow reads; linear values from
        OpenEXR, RGB not multiplied by alpha. First row on top.

    Raises
    ------
    IoError
        There is no such file, it is no image or damaged, or too large.
    """
    path = checked_input(path)
    if path.suffix.lower() == ".exr":
        with refusing(path, "image"):
            return read_exr_picture(path)
    said: list[str] = []
    image = read_image(path, said.append)
    if image is None:
        what = f"{path.name} is not a readable image: {said[0].split(': ', 1)[-1]}"
        raise IoError(what, f"file {path}", "save it again, as PNG or JPEG")
    return image


def _write_exr(path: Path, picture: Picture) -> None:
    import OpenEXR

    # Made anew, so contiguous: OpenEXR writes noise from anything else
    channels = {"RGBA": np.concatenate([picture[..., :3] * picture[..., 3:], picture[..., 3:]], 2)}
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    try:
        OpenEXR.File(header, channels).write(str(path))
    except RuntimeError as error:  # it tells the reason in words alone
        numbers = (errno.ENOSPC, errno.EDQUOT, errno.EACCES, errno.EROFS)
        number = next((n for n in numbers if os.strerror(n) in str(error)), errno.EIO)
        raise OSError(number, str(error)) from error
