"""The sRGB transfer curve (IEC 61966-2-1): colours in files to linear light and back."""

import numpy as np
from jaxtyping import Float, Float64


def linear_from_srgb(encoded: Float[np.ndarray, "..."]) -> Float64[np.ndarray, "..."]:
    """Decode sRGB in [0, 1] to linear light."""
    encoded = np.asarray(encoded, np.float64)
    curve = ((np.maximum(encoded, 0) + 0.055) / 1.055) ** 2.4
    return np.where(encoded <= 0.04045, encoded / 12.92, curve)


def srgb_from_linear(linear: Float[np.ndarray, "..."]) -> Float64[np.ndarray, "..."]:
    """Encode linear light in [0, 1] as sRGB."""
    linear = np.asarray(linear, np.float64)
    curve = 1.055 * np.maximum(linear, 0) ** (1 / 2.4) - 0.055
    return np.where(linear <= 0.0031308, 12.92 * linear, curve)


def linear_rgba(encoded: Float[np.ndarray, "n c"]) -> np.ndarray:
    """(n, 3 or 4) sRGB in [0, 1] -> (n, 4) float32 linear; alpha is not encoded, 1 if absent."""
    out = np.ones((len(encoded), 4), np.float32)
    out[:, :3] = linear_from_srgb(encoded[:, :3])
    if encoded.shape[1] > 3:
        out[:, 3] = encoded[:, 3]
    return out


def srgb_rgba(linear: Float[np.ndarray, "n 4"]) -> np.ndarray:
    """(n, 4) linear -> (n, 4) float64 sRGB in [0, 1], clipped, NaN to 0; alpha as it is."""
    clipped = np.clip(np.nan_to_num(linear.astype(np.float64)), 0, 1)
    clipped[:, :3] = srgb_from_linear(clipped[:, :3])
    return clipped
