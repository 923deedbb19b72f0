"""Where a stroke goes: samples of a pointer, checked, and the dabs that lie along them."""

import numpy as np
from jaxtyping import Float64

from ..arrays import Number, Points, Values
from ..errors import TextureError
from ..kernels.stroke_path import SAMPLE, STATE, make_dabs
from .brush import Brush
from .stroke_cover import Dabs

Normals = Float64[np.ndarray, "n 3"]

MOST_DABS = 100_000  # of one batch of samples, copies included
FARTHEST = 2.0**40  # finest texels from the origin
SHARP_CORNER = np.sqrt(2.0)  # a stamp's corners are so many half sides from its middle
WHERE = "Stroke.add(points, normals, pressures)"


class TooManyDabs(TextureError):
    """A batch of samples asks for more dabs than are painted at once."""


class StrokePath:
    """The way of one stroke, followed batch by batch; it paints nothing.

    Parameters
    ----------
    brush : Brush
    texel : float
        Spacing of the finest texels, world units.

    Attributes
    ----------
    copies : int
        How many dabs, side by side in `follow`'s answer, symmetry makes of one.
    """

    def __init__(self, brush: Brush, texel: Number) -> None:
        self.brush, self.texel = brush, float(texel)
        self._matrices = brush.symmetry.matrices()
        self.copies = len(self._matrices)
        self._center = np.array(brush.symmetry.center, np.float64) / self.texel
        self._state = np.zeros(STATE)
        self._parts: list[tuple[Points, Normals, Values]] = []

    def follow(self, points: Points, normals: Normals, pressures: Values | None = None) -> Dabs:
        """Go on to more points; the dabs on the way there. Arguments and errors as `Stroke.add`."""
        pressures = np.ones(len(points)) if pressures is None else pressures
        dabs = self._dabs(self._checked(points, normals, pressures))
        self._parts.append((points.copy(), normals.copy(), pressures.copy()))
        return dabs

    def samples(self) -> tuple[Points, Normals, Values]:
        """All points, normals and pressures so far."""
        empty = np.empty((0, 3)), np.empty((0, 3)), np.empty(0)
        columns = zip(empty, *self._parts, strict=True)
        points, normals, pressures = (np.concatenate(arrays) for arrays in columns)
        return points, normals, pressures

    def _checked(self, points: Points, normals: Normals, pressures: Values) -> np.ndarray:
        """(n, 8) checked samples, as `kernels.stroke_path` takes them."""
        if not len(points) == len(normals) == len(pressures):
            what = f"{len(points)} points, {len(normals)} normals, {len(pressures)} pressures"
            raise TextureError(what, WHERE, "give as many of each")
        texel, brush = self.texel, self.brush
        samples = np.empty((len(points), SAMPLE))
        np.divide(points, texel, out=samples[:, :3])
        length = np.sqrt(np.einsum("ni,ni->n", normals, normals))
        with np.errstate(divide="ignore", invalid="ignore"):
            np.divide(normals, length[:, None], out=samples[:, 3:6])
        if not (np.abs(samples[:, :6]) <= FARTHEST).all():
            row = int(np.flatnonzero(~(np.abs(samples[:, :6]) <= FARTHEST).all(axis=1))[0])
            what = f"sample {row} at {points[row]} with the normal {normals[row]} makes no sense"
            raise TextureError(what, WHERE, "give finite points near the surface, and normals")
        if not ((pressures >= 0) & (pressures <= 1)).all():
            what = f"a pressure of {pressures[~((pressures >= 0) & (pressures <= 1))][0]}"
            raise TextureError(what, WHERE, "give numbers from 0 to 1")
        radius = float(brush.radius) / texel * (1.0 if brush.stamp is None else SHARP_CORNER)
        samples[:, 6] = radius * np.interp(pressures, *zip(*brush.pressure_radius, strict=True))
        samples[:, 7] = float(brush.flow) * np.interp(
            pressures, *zip(*brush.pressure_flow, strict=True)
        )
        return samples

    def _dabs(self, samples: np.ndarray) -> Dabs:
        """The next dabs, (steps times copies, 19)."""
        brush, copies = self.brush, self.copies
        radius = float(brush.radius) / self.texel
        most = MOST_DABS // copies
        how = (brush.discrete, float(brush.spacing), radius, self._matrices, self._center, most)
        n = len(samples)
        if brush.discrete:
            n = make_dabs(samples, self._state, *how, np.empty((0, 19)))
        if n >= most:
            what = f"the samples are so far apart that more than {MOST_DABS} dabs lie between them"
            fix = "use a larger radius or spacing, or paint in parts"
            raise TooManyDabs(what, WHERE, fix)
        # An empty array only counts: without a row, the way to samples close by would be forgotten
        dabs = np.empty((max(n * copies, 1), 19))
        if len(samples):
            make_dabs(samples, self._state, *how, dabs)
        return dabs[: n * copies]
