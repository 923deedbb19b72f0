"""A bar that says which number a colour stands for, beside a picture."""

from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Float32, Float64

from ..arrays import Number
from .picture import Picture, fill_background

LETTERS, LEAST = 1 / 42, 11.0  # their size: of the picture's height, and in pixels
WIDTH = 8.4  # of the letters' size
BAR = (0.8, 2.3)  # left and right border of the bar, of the letters' size
GAP = 0.35  # between bar, letters and border, of the letters' size
SPAN = (0.12, 0.88)  # upper and lower end of the bar, of the picture's height
TICKS = 5
DARK = 0.2  # a background of less light gets white letters


def legend_width(height: int) -> int:
    """How many columns `with_legend` adds to a picture of this height."""
    return round(WIDTH * _letters(height))


def with_legend(
    picture: Picture,
    colors: Callable[[Float64[np.ndarray, " n"]], Float64[np.ndarray, "n 3"]],
    largest: Number,
    *,
    title: str,
    background: Sequence[Number] | np.ndarray | None = None,
) -> Float32[np.ndarray, "h wider 4"]:
    """Return the picture with a colour bar to its right.

    Parameters
    ----------
    picture : (h, w, 4) float32
        Linear RGB and alpha.
    colors : callable
        From `color_map`.
    largest : float
        What the upper end stands for; the lower stands for 0.
    title : str
        What the numbers are, with their unit.
    background : (3,) linear RGB, optional
        Of the bar's surroundings; None leaves them transparent.

    Returns
    -------
    picture : (h, w + legend_width(h), 4) float32
    """
    height = picture.shape[0]
    strip = np.zeros((height, legend_width(height), 4), np.float32)
    is_dark = background is not None and np.mean(np.asarray(background, np.float64)) < DARK
    strip[..., :3] = 1.0 if is_dark else 0.0
    strip[..., 3] = _lettering(strip.shape[0], strip.shape[1], float(largest), title)
    top, bottom = (round(end * height) for end in SPAN)
    left, right = (round(end * _letters(height)) for end in BAR)
    rising = (np.arange(bottom - top, 0, -1) - 0.5) / max(bottom - top, 1)
    strip[top:bottom, left:right, :3] = colors(rising)[:, None]
    strip[top:bottom, left:right, 3] = 1.0
    if background is not None:
        fill_background(strip, np.asarray(background, np.float32))
    return np.concatenate([picture, strip], axis=1)


def _letters(height: int) -> float:
    """The size of letters, pixels."""
    return max(LETTERS * height, LEAST)


def _lettering(height: int, width: int, largest: float, title: str) -> Float32[np.ndarray, "h w"]:
    """How much of every pixel of the strip letters and ticks cover."""
    from PIL import Image, ImageDraw, ImageFont

    size = _letters(height)
    font = ImageFont.load_default(size)
    mask = Image.new("L", (width, height))
    draw = ImageDraw.Draw(mask)
    top, bottom = (round(end * height) for end in SPAN)
    bar, gap = round(BAR[1] * size), round(GAP * size)
    for tick in range(TICKS):
        share = tick / (TICKS - 1)
        y = bottom - share * (bottom - top)
        draw.line([(bar, y), (bar + gap, y)], fill=255, width=max(height // 640, 1))
        draw.text((bar + 2 * gap, y), f"{share * largest:.3g}", fill=255, font=font, anchor="lm")
    # The title runs upward at the right border
    left, upper, right, lower = (round(x) for x in draw.textbbox((0, 0), title, font=font))
    line = Image.new("L", (max(right - left, 1), max(lower - upper, 1)))
    ImageDraw.Draw(line).text((-left, -upper), title, fill=255, font=font)
    line = line.rotate(90, expand=True)
    line = line.crop((0, max(line.height - height, 0), line.width, line.height))
    place = (width - line.width - gap, (height - line.height) // 2)
    mask.paste(line, place)
    return np.asarray(mask, np.float32) / np.float32(255)
