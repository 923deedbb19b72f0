"""Stone: marble, granite and agate."""

from dataclasses import dataclass, field
from functools import lru_cache
from typing import ClassVar

import numpy as np

from ..arrays import Number, Points, Values
from .cellular import nearest_cells
from .colors import Color, Rgba, blend, premultiplied
from .noise import fbm, gradient_noise, removed_spread, turbulence
from .parameters import Triple, means
from .solid import Solid
from .waves import Periodic

TABLE_STEPS = 1024
BLUR = float(np.sqrt(12))  # width of an interval, in its standard deviations


@dataclass(frozen=True, kw_only=True)
class Marble(Solid):
    """Veins: the phase of a sine is disturbed by turbulence.

    ``m = sin(2 pi (p . a) / vein_distance + strength turbulence(p))``; the share of vein colour is
    ``((m + 1) / 2) ^ sharpness``, over a ground clouded by fbm.

    References
    ----------
    Perlin, "An image synthesizer", 1985, doi:10.1145/325165.325247.
    """

    vein_distance: Number = field(default=1.0, metadata=means("length", "from vein to vein"))
    strength: Number = field(
        default=7.0, metadata=means("number", "how far turbulence bends the veins, radians")
    )
    sharpness: Number = field(
        default=9.0, metadata=means("length", "exponent: the larger, the thinner the veins")
    )
    octaves: int = field(default=5, metadata=means("count", "octaves of turbulence"))
    direction: Triple = field(
        default=(1.0, 0.4, 0.2), metadata=means("direction", "across the veins")
    )
    ground: Color = field(default="#ece8e1", metadata=means("color", "of the stone"))
    cloud: Color = field(default="#c3c0bf", metadata=means("color", "of the clouds in the stone"))
    vein: Color = field(default="#4f4d55", metadata=means("color", "of the veins"))

    def _colors(self, points: Points, width: Values) -> Rgba:
        ax, ay, az = self.direction
        along = points[:, 0] * ax + points[:, 1] * ay + points[:, 2] * az
        bent = turbulence(points, width, octaves=self.octaves, seed=self.seed)
        phase = along / self.vein_distance + self.strength / (2 * np.pi) * bent
        taken = abs(self.strength) / (2 * np.pi) * removed_spread(width, octaves=self.octaves)
        across = np.hypot(width / self.vein_distance, BLUR * taken)
        share = _veins(self.sharpness)(phase, across)
        clouds = np.clip(
            0.5 + 0.9 * fbm(0.7 * points, 0.7 * width, octaves=3, seed=self.seed + 5), 0, 1
        )
        ground = blend(premultiplied(self.ground), premultiplied(self.cloud), clouds)
        return blend(ground, premultiplied(self.vein), share)

    def _cuts(self, points: Points, width: Values) -> Values:
        return 1 + 10.0 * width * (1 / self.vein_distance + abs(self.strength) / 6)

    def _coarsest(self) -> float:
        return max(1.5, self.vein_distance)


@dataclass(frozen=True, kw_only=True)
class Granite(Solid):
    """Grains of three minerals: Worley cells, each of one colour, lightly mottled.

    References
    ----------
    Worley, "A cellular texture basis function", 1996, doi:10.1145/237170.237267.
    """

    _strewn: ClassVar[bool] = True

    grain: Number = field(default=0.08, metadata=means("length", "size of a grain"))
    quartz: Number = field(default=0.35, metadata=means("share", "of grains that are quartz"))
    mica: Number = field(default=0.18, metadata=means("share", "of grains that are mica"))
    feldspar_color: Color = field(
        default="#c9aa9c", metadata=means("color", "of the grains that are left")
    )
    quartz_color: Color = field(default="#98979a", metadata=means("color", "of quartz"))
    mica_color: Color = field(default="#2e2c2d", metadata=means("color", "of mica"))

    def _colors(self, points: Points, width: Values) -> Rgba:
        # Bent space makes grains that are not convex
        bend = np.stack(
            [
                gradient_noise(points / (0.7 * self.grain), seed=self.seed + 31 + axis)
                for axis in range(3)
            ],
            axis=1,
        )
        _, marks = nearest_cells(points / self.grain + 0.35 * bend, seed=self.seed)
        which = marks[:, 0]
        out = np.tile(premultiplied(self.feldspar_color), (len(points), 1))
        out[which < self.quartz] = premultiplied(self.quartz_color)
        out[which >= 1 - self.mica] = premultiplied(self.mica_color)
        out[:, :3] *= (0.82 + 0.36 * marks[:, 1])[:, None]
        return out

    def _cuts(self, points: Points, width: Values) -> Values:
        return 1 + 16 * width / self.grain

    def _coarsest(self) -> float:
        return float(self.grain)


@dataclass(frozen=True, kw_only=True)
class Agate(Solid):
    """Thin bands around nodules: contour lines of smooth noise, in four colours.

    ``s = bands (N(p) + 0.12 turbulence(3 p))``, and the colour is a table of period 1 in s.

    References
    ----------
    Ebert et al., "Texturing and Modeling: A Procedural Approach", 3rd edition, 2003, chapter 2.
    """

    bands: Number = field(default=5.0, metadata=means("length", "bands per unit of noise"))
    roughness: Number = field(default=0.12, metadata=means("number", "how ragged the bands are"))
    first: Color = field(default="#f3e3d0", metadata=means("color", "of the palest bands"))
    second: Color = field(default="#c8743c", metadata=means("color", "of the warm bands"))
    third: Color = field(default="#7a2f1c", metadata=means("color", "of the dark bands"))
    fourth: Color = field(default="#8f9aa3", metadata=means("color", "of the cool bands"))

    def _colors(self, points: Points, width: Values) -> Rgba:
        noise = gradient_noise(0.9 * points, 0.9 * width, seed=self.seed)
        rough = turbulence(3.1 * points, 3.1 * width, octaves=3, seed=self.seed + 3)
        phase = self.bands * (noise + self.roughness * rough)
        taken = np.hypot(
            removed_spread(0.9 * width, octaves=1),
            self.roughness * removed_spread(3.1 * width, octaves=3),
        )
        table = _bands(self.first, self.second, self.third, self.fourth)
        return table(phase, BLUR * self.bands * taken)

    def _cuts(self, points: Points, width: Values) -> Values:
        return 1 + 40.0 * self.bands * width

    def _coarsest(self) -> float:
        return 1.5


@lru_cache(maxsize=64)
def _veins(sharpness: float) -> Periodic:
    m = np.sin(2 * np.pi * np.arange(TABLE_STEPS) / TABLE_STEPS)
    return Periodic(((m + 1) / 2) ** sharpness)


@lru_cache(maxsize=64)
def _bands(*colors: Color) -> Periodic:
    """Bands of unlike widths in an order of eight, with edges a little soft."""
    order = [(0, 0.2), (1, 0.08), (0, 0.1), (2, 0.06), (1, 0.2), (3, 0.12), (2, 0.14), (1, 0.1)]
    rgba = [premultiplied(color) for color in colors]
    runs = [np.tile(rgba[n], (round(share * TABLE_STEPS), 1)) for n, share in order]
    table = np.concatenate(runs)
    soft = np.hanning(2 * (TABLE_STEPS // 50) + 1)
    padded = np.concatenate([table[-len(soft) :], table, table[: len(soft)]])
    smooth = [np.convolve(padded[:, c], soft / soft.sum(), mode="same") for c in range(4)]
    return Periodic(np.stack(smooth, axis=1)[len(soft) : -len(soft)])
