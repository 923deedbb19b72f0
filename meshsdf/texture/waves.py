"""Periodic patterns of one variable, averaged over boxes without sampling.

A square wave is a difference of two sawtooths, and the antiderivatives of the sawtooth are the
periodic Bernoulli polynomials. So the mean of a square wave of a plane's phase over a cube, which
is a convolution with one box per axis, is a third difference of B4 (exact); along one axis it is a
first difference of B2.
"""

import numpy as np

from ..arrays import Number, Points, Values

NARROWEST = 1e-3  # periods: third differences then keep 7 digits, and 2 of 1000 points change


def square_wave(phase: Values, share: Number, width: Values | Number = 0.0) -> Values:
    """1 on the last ``share`` of every period of 1, else 0; its mean over an interval of a width.

    Examples
    --------
    >>> square_wave(np.array([0.5, 0.9]), 0.25, np.array([0.0, 0.1]))
    array([0., 1.])
    >>> square_wave(np.array([0.75]), 0.25, np.array([0.2]))
    array([0.5])
    """
    width = np.broadcast_to(np.asarray(width, np.float64), phase.shape)
    sharp = (phase - np.floor(phase) >= 1 - share).astype(np.float64)
    wide = width > NARROWEST
    if not wide.any():
        return sharp
    half = np.where(wide, width, 1.0) / 2
    rise = _second(phase + half, share) - _second(phase - half, share)
    return np.where(wide, np.clip(share + rise / (2 * half), 0, 1), sharp)


def square_wave_in_cube(phase: Values, share: Number, widths: Points) -> Values:
    """Mean of `square_wave` over a cube, where the phase is that of a plane.

    ``widths`` is by how much the phase changes across the cube along each axis, (n, 3).
    """
    if not (widths > NARROWEST).any():
        return square_wave(phase, share)
    halves = np.maximum(widths, NARROWEST) / 2
    total = np.zeros(len(phase))
    for sides in np.ndindex(2, 2, 2):
        x, y, z = (2 * side - 1 for side in sides)
        shift = x * halves[:, 0] + y * halves[:, 1] + z * halves[:, 2]
        total += x * y * z * _fourth(phase + shift, share)
    return np.clip(share + total / (8 * halves[:, 0] * halves[:, 1] * halves[:, 2]), 0, 1)


class Periodic:
    """A function of period 1 given by its values at equal steps, linear between; with its means.

    Parameters
    ----------
    values : (m,) or (m, c) float64
        At 0, 1/m, ... (m-1)/m of the period.
    """

    def __init__(self, values: np.ndarray) -> None:
        self._values = np.concatenate([values, values[:1]])
        steps = 0.5 * (self._values[1:] + self._values[:-1]) / len(values)
        self._sums = np.concatenate([np.zeros_like(values[:1]), np.cumsum(steps, axis=0)])
        self.mean = self._sums[-1]

    def __call__(self, phase: Values, width: Values | Number = 0.0) -> np.ndarray:
        """Values, or means over intervals of a width around the phases."""
        width = np.broadcast_to(np.asarray(width, np.float64), phase.shape)
        sharp = self._at(phase)
        wide = width > 1e-4  # below, the difference to the value is less than a step of the table
        if not wide.any():
            return sharp
        half = np.where(wide, width, 1.0) / 2
        shape = (-1, *[1] * (self._values.ndim - 1))
        means = (self._sum(phase + half) - self._sum(phase - half)) / (2 * half).reshape(shape)
        return np.where(wide.reshape(shape), means, sharp)

    def _place(self, phase: Values) -> tuple[np.ndarray, np.ndarray]:
        steps = len(self._values) - 1
        place = (phase - np.floor(phase)) * steps
        step = np.minimum(place.astype(np.int64), steps - 1)
        return step, (place - step).reshape(-1, *[1] * (self._values.ndim - 1))

    def _at(self, phase: Values) -> np.ndarray:
        step, rest = self._place(phase)
        low = self._values[step]
        return low + rest * (self._values[step + 1] - low)

    def _sum(self, phase: Values) -> np.ndarray:
        step, rest = self._place(phase)
        low = self._values[step]
        within = rest * (low + 0.5 * rest * (self._values[step + 1] - low))
        whole = np.floor(phase).reshape(rest.shape)
        return whole * self.mean + self._sums[step] + within / (len(self._values) - 1)


def smoothstep(low: Number, high: Number, x: Values) -> Values:
    """0 below ``low``, 1 above ``high``, and the cubic 3 t^2 - 2 t^3 between."""
    t = np.clip((x - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


def _second(phase: Values, share: Number) -> Values:
    """Antiderivative of the square wave less its mean: B2(s) / 2 of both sawtooths."""
    s, t = _turn(phase), _turn(phase - (1 - share))
    return 0.5 * (s * (s - 1) - t * (t - 1))


def _fourth(phase: Values, share: Number) -> Values:
    """Third antiderivative: B4(s) / 24, up to a constant."""
    s, t = _turn(phase), _turn(phase - (1 - share))
    return ((s * (s - 1)) ** 2 - (t * (t - 1)) ** 2) / 24


def _turn(phase: Values) -> Values:
    return phase - np.floor(phase)
