"""One colour over another, written plainly from Compositing and Blending Level 1, in float64."""

import numpy as np


def luminosity(c):
    return c @ np.array([0.3, 0.59, 0.11])


def clipped(c):
    grey, least, most = luminosity(c), c.min(), c.max()
    if least < 0:
        c = grey + (c - grey) * grey / (grey - least)
    if most > 1:
        c = grey + (c - grey) * (1 - grey) / (most - grey)
    return c


def with_luminosity(c, wanted):
    return clipped(c + wanted - luminosity(c))


def with_saturation(c, wanted):
    spread = c.max() - c.min()
    return (c - c.min()) * wanted / spread if spread > 0 else 0 * c


def saturation(c):
    return c.max() - c.min()


def hard_light(b, s):
    return 2 * b * s if s <= 0.5 else b + (2 * s - 1) - b * (2 * s - 1)


def soft_light(b, s):
    if s <= 0.5:
        return b - (1 - 2 * s) * b * (1 - b)
    root = ((16 * b - 12) * b + 4) * b if b <= 0.25 else np.sqrt(b)
    return b + (2 * s - 1) * (root - b)


def dodge(b, s):
    return 0.0 if b == 0 else 1.0 if s == 1 else min(1.0, b / (1 - s))


def burn(b, s):
    return 1.0 if b == 1 else 0.0 if s == 0 else 1 - min(1.0, (1 - b) / s)


def divide(b, s):
    return 0.0 if b == 0 else 1.0 if s == 0 else min(1.0, b / s)


SEPARABLE = {
    "normal": lambda b, s: s,
    "multiply": lambda b, s: b * s,
    "screen": lambda b, s: b + s - b * s,
    "overlay": lambda b, s: hard_light(s, b),
    "darken": min,
    "lighten": max,
    "color-dodge": dodge,
    "color-burn": burn,
    "hard-light": hard_light,
    "soft-light": soft_light,
    "difference": lambda b, s: abs(b - s),
    "exclusion": lambda b, s: b + s - 2 * b * s,
    "add": lambda b, s: b + s,
    "subtract": lambda b, s: max(b - s, 0.0),
    "divide": divide,
}
WHOLE = {
    "hue": lambda b, s: with_luminosity(with_saturation(s, saturation(b)), luminosity(b)),
    "saturation": lambda b, s: with_luminosity(with_saturation(b, saturation(s)), luminosity(b)),
    "color": lambda b, s: with_luminosity(s, luminosity(b)),
    "luminosity": lambda b, s: with_luminosity(b, luminosity(s)),
}
MODES = [*SEPARABLE, *WHOLE]


def blended(mode, b, s):
    """B(b, s) of opaque colours (3,) in [0, 1]."""
    if mode in WHOLE:
        return WHOLE[mode](b, s)
    return np.array([SEPARABLE[mode](x, y) for x, y in zip(b, s, strict=True)])


def over(mode, below, above, share=1.0):
    """Straight (4,) colour ``above``, its alpha times ``share``, over ``below``."""
    b, ab = below[:3].astype(float), float(below[3])
    s, a = above[:3].astype(float), float(above[3]) * share
    alpha = a + ab * (1 - a)
    if alpha == 0:
        return np.zeros(4)
    mixed = (1 - ab) * s + ab * blended(mode, b, s)
    return np.append((a * mixed + (1 - a) * ab * b) / alpha, alpha)
