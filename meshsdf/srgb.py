"""The sRGB transfer curve (IEC 61966-2-1): colours in files to linear light and back.

And to CIELAB, in which lengths are about what eyes tell apart (CIE 15:2004): 2.3 is just seen.
"""

import numpy as np
from jaxtyping import Float, Float64

D65 = np.array([0.95047, 1.0, 1.08883])  # XYZ of the white point, ASTM E308
PRIMARIES = np.array([[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]])  # x, y of red, green and blue
LAB_KNEE = 6 / 29  # below it the cube root goes on as a straight line


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


def lab_from_linear(linear: Float[np.ndarray, "n 3"]) -> Float64[np.ndarray, "n 3"]:
    """Linear RGB of sRGB's primaries -> CIELAB (L, a, b) under D65; of any range, none is clipped.

    Examples
    --------
    >>> lab_from_linear(np.array([[1.0, 1.0, 1.0], [0.0, 0.0, 0.0]])).round(6) + 0.0
    array([[100.,   0.,   0.],
           [  0.,   0.,   0.]])
    """
    share = np.asarray(linear, np.float64) @ (_xyz_of_primaries() / D65)
    bent = np.where(share > LAB_KNEE**3, np.cbrt(share), share / (3 * LAB_KNEE**2) + 4 / 29)
    x, y, z = bent.T
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=1)


def _xyz_of_primaries() -> Float64[np.ndarray, "3 3"]:
    """Rows: XYZ of red, green and blue in full light, which together make the white point."""
    x, y = PRIMARIES.T
    xyz = np.stack([x / y, np.ones(3), (1 - x - y) / y], axis=1)
    return np.linalg.solve(xyz.T, D65)[:, None] * xyz
