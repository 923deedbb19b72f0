"""Clouds: white where a sum of octaves of noise is high."""

from dataclasses import dataclass, field
from functools import lru_cache
from typing import ClassVar

import numpy as np

from ..arrays import Number, Points, Values
from .colors import Color, Rgba, blend, premultiplied
from .noise import fbm, removed_spread
from .parameters import means
from .solid import Solid
from .waves import Periodic, smoothstep

SPAN = 4.0  # the table of the share of white covers noise from -1 to 3, and repeats
TABLE_STEPS = 2048


@dataclass(frozen=True, kw_only=True)
class Clouds(Solid):
    """White clouds in a sky.

    The share of white is ``smoothstep(threshold - softness, threshold + softness, fbm(p))``;
    colours may have alpha, such as a sky that is clear.

    References
    ----------
    Perlin, "An image synthesizer", 1985, doi:10.1145/325165.325247.
    """

    _strewn: ClassVar[bool] = True

    size: Number = field(default=0.6, metadata=means("length", "of the largest clouds"))
    threshold: Number = field(
        default=0.05, metadata=means("number", "of noise, in [-1, 1]: lower means more clouds")
    )
    softness: Number = field(default=0.3, metadata=means("share", "from edge to middle, in noise"))
    octaves: int = field(
        default=6, metadata=means("count", "octaves of noise: more for ragged edges")
    )
    sky: Color = field(default="#5b93d3", metadata=means("color", "between the clouds"))
    cloud: Color = field(default="#fbfcfd", metadata=means("color", "of the clouds"))

    def _colors(self, points: Points, width: Values) -> Rgba:
        wide = width / self.size
        noise = fbm(points / self.size, wide, octaves=self.octaves, seed=self.seed)
        # The interval of the same spread as the noise that the filter has taken away
        taken = np.sqrt(12) * removed_spread(wide, octaves=self.octaves)
        white = _share_of_white(self.threshold, max(self.softness, 1e-3))
        share = white(noise / SPAN, taken / SPAN)
        return blend(premultiplied(self.sky), premultiplied(self.cloud), share)

    def _cuts(self, points: Points, width: Values) -> Values:
        return 1 + 8 * width / self.size

    def _coarsest(self) -> float:
        return float(self.size)


@lru_cache(maxsize=64)
def _share_of_white(threshold: float, softness: float) -> Periodic:
    noise = SPAN * np.arange(TABLE_STEPS) / TABLE_STEPS
    noise[noise >= 1.5] -= SPAN
    return Periodic(smoothstep(threshold - softness, threshold + softness, noise))
