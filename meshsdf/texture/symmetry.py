"""Copies of a stroke: mirrored at planes, and turned about an axis."""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from ..arrays import Number
from ..errors import TextureError

AXES = "xyz"
MOST_COPIES = 64
Matrices = Float64[np.ndarray, "s 3 3"]


@dataclass(frozen=True)
class Symmetry:
    """Where else a stroke paints.

    Attributes
    ----------
    mirror : str
        Axes across which it is mirrored: "", "x", "yz", ...
    radial : int
        How many times it is repeated around ``axis``; 1 is once.
    axis : str
        "x", "y" or "z".
    center : three numbers
        A point of all mirror planes and of the axis, world units.
    """

    mirror: str = ""
    radial: int = 1
    axis: str = "y"
    center: tuple[Number, Number, Number] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        where = "Symmetry(...)"
        if len(set(self.mirror)) != len(self.mirror) or not set(self.mirror) <= set(AXES):
            what = f"{self.mirror!r} names no mirror planes"
            raise TextureError(what, where, 'use letters of "xyz", each once')
        if len(self.axis) != 1 or self.axis not in AXES:
            raise TextureError(f"{self.axis!r} is no axis", where, 'use "x", "y" or "z"')
        if not 1 <= self.radial <= MOST_COPIES // 2 ** len(self.mirror):
            what = f"{self.radial} turns and {len(self.mirror)} mirrors make no sense"
            raise TextureError(what, where, f"ask for 1 to {MOST_COPIES} copies in all")
        if len(self.center) != 3 or not np.isfinite(np.asarray(self.center, np.float64)).all():
            raise TextureError(f"{self.center} is no point", where, "give 3 finite numbers")

    def matrices(self) -> Matrices:
        """The copies as linear maps about the centre, the stroke itself first, none twice."""
        a, b = (AXES.index(self.axis) + 1) % 3, (AXES.index(self.axis) + 2) % 3
        maps = []
        for turn in range(self.radial):
            rotation = np.eye(3)
            cosine, sine = _circle(turn, self.radial)
            rotation[a, a] = rotation[b, b] = cosine
            rotation[b, a], rotation[a, b] = sine, -sine
            maps.append(rotation)
        for letter in self.mirror:
            flip = np.eye(3)
            flip[AXES.index(letter), AXES.index(letter)] = -1.0
            maps += [rotation @ flip for rotation in maps]
        kept: list[np.ndarray] = []
        for one in maps:
            if not any(np.abs(one - other).max() < 1e-9 for other in kept):
                kept.append(one + 0.0)
        return np.array(kept)


def _circle(turn: int, n: int) -> tuple[float, float]:
    """Cosine and sine of a part of a circle; exact for quarters."""
    quarters, rest = divmod(4 * turn, n)
    if rest == 0:
        return (1.0, 0.0, -1.0, 0.0)[quarters], (0.0, 1.0, 0.0, -1.0)[quarters]
    angle = 2 * math.pi * turn / n
    return math.cos(angle), math.sin(angle)
