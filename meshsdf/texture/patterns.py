"""Regular patterns: checks, stripes and bricks, whose means over a cube need no sampling."""

from dataclasses import dataclass, field

import numpy as np

from ..arrays import Number, Points, Values
from ..kernels.noise import lattice_hashes
from .colors import Color, Rgba, blend, premultiplied
from .parameters import Triple, means
from .solid import Solid
from .waves import square_wave, square_wave_in_cube

BRICKS = 3  # cubes wider than so many bricks see the mean of their shades


@dataclass(frozen=True, kw_only=True)
class Checker(Solid):
    """Cubes of two colours: ``first`` where the floors of the coordinates have an even sum.

    The product of three square waves of values 1 and -1, so the mean over a cube is the product of
    three means: exact.

    References
    ----------
    Perlin, "An image synthesizer", 1985, doi:10.1145/325165.325247, for solid patterns in general.
    """

    side: Number = field(default=0.25, metadata=means("length", "of a cube"))
    first: Color = field(default="#f2efe8", metadata=means("color", "of the cube at the origin"))
    second: Color = field(default="#2b2b2f", metadata=means("color", "of its neighbours"))

    def _colors(self, points: Points, width: Values) -> Rgba:
        period = 2 * self.side
        product = np.ones(len(points))
        for axis in range(3):
            product *= 1 - 2 * square_wave(points[:, axis] / period, 0.5, width / period)
        return blend(premultiplied(self.first), premultiplied(self.second), 0.5 - 0.5 * product)

    def _cuts(self, points: Points, width: Values) -> Values:
        return np.ones(len(points))


@dataclass(frozen=True, kw_only=True)
class Stripes(Solid):
    """Plane layers of two colours.

    ``second`` on the last ``share`` of every ``period`` along ``direction``. The mean over a cube
    is exact for every direction: a third difference of the antiderivatives of the square wave.

    References
    ----------
    Heckbert, "Filtering by repeated integration", 1986, doi:10.1145/15922.15921.
    """

    period: Number = field(default=0.25, metadata=means("length", "from stripe to stripe"))
    share: Number = field(default=0.5, metadata=means("share", "of the second colour"))
    direction: Triple = field(
        default=(1.0, 0.0, 0.0), metadata=means("direction", "across the stripes")
    )
    first: Color = field(default="#f2efe8", metadata=means("color", "of the ground"))
    second: Color = field(default="#b03a2e", metadata=means("color", "of the stripes"))

    def _colors(self, points: Points, width: Values) -> Rgba:
        ax, ay, az = self.direction
        phase = (points[:, 0] * ax + points[:, 1] * ay + points[:, 2] * az) / self.period
        across = np.abs(np.array(self.direction)) * (width / self.period)[:, None]
        weight = square_wave_in_cube(phase, self.share, across)
        return blend(premultiplied(self.first), premultiplied(self.second), weight)

    def _cuts(self, points: Points, width: Values) -> Values:
        return np.ones(len(points))


@dataclass(frozen=True, kw_only=True)
class Brick(Solid):
    """Bricks in running bond: each course, up z, is half a brick beside the one below.

    A brick with its mortar is ``length`` by ``depth`` by ``height`` along x, y, z. Bricks differ in
    shade by up to ``variation``. The mean over a cube is the sum over bricks of the shares of the
    cube that they fill, products of three lengths: exact up to cubes of three bricks; wider ones
    see the mean shade.

    References
    ----------
    Ebert et al., "Texturing and Modeling: A Procedural Approach", 3rd edition, 2003, chapter 2.
    """

    length: Number = field(
        default=0.5, metadata=means("length", "of a brick and its mortar, along x")
    )
    depth: Number = field(
        default=0.25, metadata=means("length", "of a brick and its mortar, along y")
    )
    height: Number = field(
        default=0.16, metadata=means("length", "of a brick and its mortar, along z")
    )
    joint: Number = field(default=0.02, metadata=means("length", "width of the mortar"))
    variation: Number = field(default=0.5, metadata=means("share", "by which bricks are darker"))
    brick: Color = field(default="#a4513a", metadata=means("color", "of the lightest bricks"))
    mortar: Color = field(default="#c9c2b6", metadata=means("color", "of the mortar"))

    def _colors(self, points: Points, width: Values) -> Rgba:
        size = np.array([self.length, self.depth, self.height])
        filled, shaded = np.zeros(len(points)), np.zeros(len(points))
        for parity in (0.0, 0.5):
            cover, shade = self._courses(points / size, width[:, None] / size, parity)
            filled += cover
            shaded += shade
        brick = premultiplied(self.brick) * np.array([1, 1, 1, 0])
        out = (1 - filled)[:, None] * premultiplied(self.mortar) + shaded[:, None] * brick
        out[:, 3] += filled * premultiplied(self.brick)[3]
        return out

    def _courses(self, units: Points, wide: Points, parity: float) -> tuple[Values, Values]:
        """Shares of cubes in the bricks of every other course, plainly and times their shades."""
        moved = units.copy()
        moved[:, 0] += parity
        # Courses of one parity have twice the height between them
        moved[:, 2] = 0.5 * moved[:, 2] + parity
        wide = wide * np.array([1.0, 1.0, 0.5])
        joints = self.joint / np.array([self.length, self.depth, 2 * self.height])
        shares = np.maximum(np.array([1.0, 1.0, 0.5]) - joints, 0)
        starts = 0.5 * joints
        cover = np.ones(len(units))
        for axis in range(3):
            # The brick begins half a joint after the whole number
            phase = moved[:, axis] - starts[axis] - shares[axis]
            cover *= square_wave(phase, shares[axis], wide[:, axis])
        mean_shade = 1 - 0.5 * self.variation
        shade = cover * mean_shade
        near = (wide < BRICKS).all(axis=1) & (cover > 0)
        if self.variation and near.any():
            shade[near] = self._shaded(moved[near], wide[near], starts, shares, parity)
        return cover, shade

    def _shaded(
        self, moved: Points, wide: Points, starts: np.ndarray, shares: np.ndarray, parity: float
    ) -> Values:
        """Sum over bricks of the share of a cube that each fills, times its shade."""
        first = np.floor(moved - 0.5 * wide)
        count = (np.floor(moved + 0.5 * wide) - first).max(axis=0).astype(int) + 1
        fills = [
            [
                _overlap(moved[:, a], wide[:, a], first[:, a] + n + starts[a], shares[a])
                for n in range(count[a])
            ]
            for a in range(3)
        ]
        total = np.zeros(len(moved))
        seed = 2 * self.seed + round(2 * parity)
        cells = first.astype(np.int64)
        marks = np.empty(len(moved))
        for i, j, k in np.ndindex(*count):
            part = fills[0][i] * fills[1][j] * fills[2][k]
            if part.any():
                lattice_hashes(cells + np.array([i, j, k]), seed, marks)
                total += part * (1 - self.variation * marks)
        return total

    def _cuts(self, points: Points, width: Values) -> Values:
        return np.ones(len(points))


def _overlap(at: Values, width: Values, start: Values, share: float) -> Values:
    """The share of an interval around a place that lies in [start, start + share)."""
    half = 0.5 * np.maximum(width, 1e-9)
    inside = np.minimum(at + half, start + share) - np.maximum(at - half, start)
    return np.maximum(inside, 0) / (2 * half)
