"""Colours as people write them, to linear light with premultiplied alpha and back."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float32, Float64

from ..arrays import Number
from ..srgb import linear_from_srgb

Color = str | Sequence[Number]
"""``"#rrggbb"`` or ``"#rrggbbaa"`` in sRGB, or 3 or 4 numbers, linear, alpha straight."""

Rgba = Float64[np.ndarray, "n 4"]  # linear, premultiplied: what means and mixtures are taken of
StraightRgba = Float32[np.ndarray, "n 4"]  # linear, straight: what textures return


def linear_color(color: Color) -> tuple[float, float, float, float]:
    """Linear RGB with straight alpha; ValueError, with what is expected, for anything else.

    Examples
    --------
    >>> linear_color("#ffffff80")
    (1.0, 1.0, 1.0, 0.5019607843137255)
    >>> linear_color([0.5, 0.25, 0.0])
    (0.5, 0.25, 0.0, 1.0)
    """
    if isinstance(color, str):
        return _from_hexadecimal(color)
    numbers = [float(number) for number in color]
    if len(numbers) not in (3, 4) or not np.isfinite(numbers).all() or min(numbers) < 0:
        raise ValueError("3 or 4 numbers from 0 on")
    alpha = numbers[3] if len(numbers) == 4 else 1.0
    if alpha > 1:
        raise ValueError("an alpha of at most 1")
    return (*numbers[:3], alpha)


def premultiplied(color: Color) -> Float64[np.ndarray, "4"]:
    """A colour times its alpha, with that alpha: what may be averaged."""
    red, green, blue, alpha = linear_color(color)
    return np.array([red * alpha, green * alpha, blue * alpha, alpha])


def straight(rgba: Rgba) -> StraightRgba:
    """Divide by alpha; where alpha is 0 all is 0."""
    alpha = rgba[:, 3:]
    rgb = np.divide(rgba[:, :3], alpha, out=np.zeros_like(rgba[:, :3]), where=alpha > 0)
    return np.concatenate([rgb, alpha], axis=1).astype(np.float32)


def blend(first: np.ndarray, second: np.ndarray, weight: np.ndarray) -> Rgba:
    """``first`` where the weight (n,) is 0, ``second`` where it is 1; each (4,) or (n, 4)."""
    return first + weight[:, None] * (second - first)


def _from_hexadecimal(text: str) -> tuple[float, float, float, float]:
    digits = text.removeprefix("#")
    try:
        levels = np.frombuffer(bytes.fromhex(digits), np.uint8) / 255.0
    except ValueError:
        levels = np.zeros(0)
    if len(digits) not in (6, 8) or len(levels) not in (3, 4):
        raise ValueError('"#rrggbb" or "#rrggbbaa"')
    red, green, blue = (float(level) for level in linear_from_srgb(levels[:3]))
    return red, green, blue, float(levels[3]) if len(levels) == 4 else 1.0
