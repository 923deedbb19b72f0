"""An OpenEXR picture as linear colours, unpacked in a process of its own (see `exr_process`)."""

import struct
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from jaxtyping import Float32

from .exr_process import run_apart

MOST_PIXELS = 2**28
ROOM_PER_FILE_BYTE = 64

_SCRIPT = """
with OpenEXR.File("picture.exr", header_only=True) as file:
    (left, top), (right, bottom) = file.header()["dataWindow"]
    if (int(right) - int(left) + 1) * (int(bottom) - int(top) + 1) > int(sys.argv[3]):
        sys.exit("too large")
with OpenEXR.File("picture.exr", separate_channels=True) as file:
    channels = file.channels()
    found = [channels[name].pixels for name in "RGBA" if name in channels]
    if not found:
        found = [channels[name].pixels for name in "YA" if name in channels]
    shape = found[0].shape
    if len(shape) != 2 or any(one.shape != shape for one in found):
        sys.exit("channels of several sizes")
    pixels = numpy.stack([one.astype(numpy.float32) for one in found], axis=-1)
    numpy.save("pixels.npy", pixels)
"""


def read_exr_picture(path: Path, most_pixels: int = MOST_PIXELS) -> Float32[np.ndarray, "h w c"]:
    """Return the channels R, G, B and A, or Y and A; RGB not multiplied by alpha; NaN as 0.

    No more than its headers is read of a picture of more than ``most_pixels``.

    Raises
    ------
    ValueError
        It is no OpenEXR picture of these channels, damaged, or too large.
    OSError
        It cannot be read.
    """
    data = path.read_bytes()
    if data[:4] != struct.pack("<I", 20000630):
        raise ValueError("it does not begin as OpenEXR files do")
    with TemporaryDirectory(prefix="meshsdf-") as name:
        folder = Path(name)
        (folder / "picture.exr").write_bytes(data)
        run_apart(folder, _SCRIPT, [str(most_pixels)], ROOM_PER_FILE_BYTE * len(data))
        pixels = np.load(folder / "pixels.npy")
    pixels = np.nan_to_num(pixels, posinf=65504.0, neginf=-65504.0)
    if pixels.shape[2] in (2, 4):
        alpha = pixels[..., -1:]
        pixels[..., :-1] = np.divide(
            pixels[..., :-1], alpha, out=np.zeros_like(pixels[..., :-1]), where=alpha > 0
        )
    return pixels
