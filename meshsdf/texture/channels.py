"""What a texel can hold, channel by channel."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32

from ..errors import TextureError
from ..kernels.texel_codes import (
    HALF1,
    HALF4,
    LINEAR8,
    NORMAL,
    SRGB8,
    VALUE8,
    decode_texels,
    encode_texels,
)

Numbers = Float32[np.ndarray, "n 4"]


@dataclass(frozen=True)
class Channel:
    """How one channel is stored.

    Attributes
    ----------
    name : str
        "base" colour and alpha; "normal" in the texture's space; "height" along the surface's
        normal, in finest texels; "orm" occlusion, roughness, metal; "mask" how much of the layer
        is shown.
    kind : int
        As `kernels.texel_codes` numbers them.
    dtype : numpy.dtype
        Of a texel, which is one unsigned number.
    nothing : int
        A texel that was never written.
    """

    name: str
    kind: int
    dtype: np.dtype
    nothing: int

    def encoded(self, values: Numbers) -> np.ndarray:
        """(n,) texels nearest to (n, 4) values."""
        texels = np.empty(len(values), self.dtype)
        encode_texels(self.kind, np.ascontiguousarray(values), texels)
        return texels

    def decoded(self, texels: np.ndarray) -> Numbers:
        """(n, 4) float32 that (n,) texels mean: values, then alpha or coverage."""
        out = np.empty((len(texels), 4), np.float32)
        decode_texels(self.kind, np.ascontiguousarray(texels), out)
        return out


BASE_KINDS = {
    "srgb8": Channel("base", SRGB8, np.dtype(np.uint32), 0),
    "half": Channel("base", HALF4, np.dtype(np.uint64), 0),
}
OTHERS = (
    Channel("normal", NORMAL, np.dtype(np.uint64), 0x8000_8000),
    Channel("height", HALF1, np.dtype(np.uint16), 0),
    Channel("orm", LINEAR8, np.dtype(np.uint32), 0),
    Channel("mask", VALUE8, np.dtype(np.uint8), 255),
)


def channels_with(base: str) -> dict[str, Channel]:
    """The channels of a texture whose base colour is kept as "srgb8" or linear "half".

    Raises
    ------
    TextureError
        Another way is asked for.
    """
    if base not in BASE_KINDS:
        what = f"base colours cannot be kept as {base!r}"
        raise TextureError(what, "base=...", f"use one of {', '.join(BASE_KINDS)}")
    return {channel.name: channel for channel in (BASE_KINDS[base], *OTHERS)}
