"""Solid noise: smooth random functions of position, filtered over a box exactly or nearly so.

``gradient_noise`` is Perlin's (2002, "Improving Noise", doi:10.1145/566654.566636) on a lattice
hashed with pcg3d (Jarzynski, Olano 2020, "Hash Functions for GPU Rendering", JCGT 9(3)): it has a
seed and no period. ``perlin_noise`` is the reference, of period 256. Sums of octaves:

    fbm         sum of gain^i N(lacunarity^i p)
    turbulence  sum of gain^i |N(lacunarity^i p)|          (Perlin 1985, doi:10.1145/325165.325247)
    ridged      sum of gain^i (1 - |N(lacunarity^i p)|)^2  (Musgrave, in Ebert et al. 2003)

Octave i is moved by i (0.3183, 0.5772, 0.6931), so that not all vanish at the origin.
"""

from functools import lru_cache

import numpy as np
from jaxtyping import Float64

from ..arrays import Number, Points, Values, writable_alias
from ..errors import TextureError
from ..kernels import noise as kernels

# The permutation of Perlin's reference program of 2002, a published fact of the noise
PERMUTATION = np.array(
    [
        151, 160, 137, 91, 90, 15, 131, 13, 201, 95, 96, 53, 194, 233, 7, 225, 140, 36, 103, 30, 69,
        142, 8, 99, 37, 240, 21, 10, 23, 190, 6, 148, 247, 120, 234, 75, 0, 26, 197, 62, 94, 252,
        219, 203, 117, 35, 11, 32, 57, 177, 33, 88, 237, 149, 56, 87, 174, 20, 125, 136, 171, 168,
        68, 175, 74, 165, 71, 134, 139, 48, 27, 166, 77, 146, 158, 231, 83, 111, 229, 122, 60, 211,
        133, 230, 220, 105, 92, 41, 55, 46, 245, 40, 244, 102, 143, 54, 65, 25, 63, 161, 1, 216, 80,
        73, 209, 76, 132, 187, 208, 89, 18, 169, 200, 196, 135, 130, 116, 188, 159, 86, 164, 100,
        109, 198, 173, 186, 3, 64, 52, 217, 226, 250, 124, 123, 5, 202, 38, 147, 118, 126, 255, 82,
        85, 212, 207, 206, 59, 227, 47, 16, 58, 17, 182, 189, 28, 42, 223, 183, 170, 213, 119, 248,
        152, 2, 44, 154, 163, 70, 221, 153, 101, 155, 167, 43, 172, 9, 129, 22, 39, 253, 19, 98,
        108, 110, 79, 113, 224, 232, 178, 185, 112, 104, 218, 246, 97, 228, 251, 34, 242, 193, 238,
        210, 144, 12, 191, 179, 162, 241, 81, 51, 145, 235, 249, 14, 239, 107, 49, 192, 214, 31,
        181, 199, 106, 157, 184, 84, 204, 176, 115, 121, 50, 45, 127, 4, 150, 254, 138, 236, 205,
        93, 222, 114, 67, 29, 24, 72, 243, 141, 128, 195, 78, 66, 215, 61, 156, 180,
    ],
    np.int64,
)  # fmt: skip

LARGEST = (
    1e12  # of a coordinate, in periods of the noise: finer octaves keep digits after the point
)
N_SPREADS = 49  # of the table of what a filter takes from the noise
SIMPSON_STEPS = 4096

Widths = Float64[np.ndarray, "n 3"]
Filter = Number | Values | Widths


def perlin_noise(points: Points) -> Values:
    """Return Perlin's reference noise of 2002, of period 256 along each axis.

    Examples
    --------
    >>> perlin_noise(np.array([[3.14, 42.0, 7.0]]))[0]
    np.float64(0.13691995878400012)
    """
    out = np.empty(len(points))
    kernels.reference_noise(checked_points(points), PERMUTATION, out)
    return out


def gradient_noise(points: Points, footprint: Filter = 0.0, *, seed: int = 0) -> Values:
    """Return gradient noise without a period, or its mean over a box around each point.

    Parameters
    ----------
    points : (n, 3) float64
        One unit is one cell of the lattice; coordinates up to 1e12.
    footprint : float, (n,) or (n, 3) float64
        Width of the box: one for all points, for each, or for each point along each axis.
    seed : int
        Picks the noise.

    Returns
    -------
    values : (n,) float64
        In [-1.04, 1.04], mean 0, standard deviation 0.27.

    Notes
    -----
    Accuracy: the mean is exact up to 3 units; from 4 units on it is taken to be 0, where its
    standard deviation is 0.013, and fades between. Boxes below 1/64 give the noise itself.
    """
    return _fractal(points, footprint, kernels.FBM, 1, 0.5, 2.0, seed)


def fbm(
    points: Points,
    footprint: Filter = 0.0,
    *,
    octaves: int = 5,
    gain: Number = 0.5,
    lacunarity: Number = 2.0,
    seed: int = 0,
) -> Values:
    """Return the sum of octaves of `gradient_noise`, filtered as exactly as that."""
    return _fractal(points, footprint, kernels.FBM, octaves, gain, lacunarity, seed)


def turbulence(
    points: Points,
    footprint: Filter = 0.0,
    *,
    octaves: int = 5,
    gain: Number = 0.5,
    lacunarity: Number = 2.0,
    seed: int = 0,
) -> Values:
    """Return the sum of the sizes of octaves of noise.

    Filtered as if what the box takes from the noise were normally distributed around its mean.
    """
    return _fractal(points, footprint, kernels.TURBULENCE, octaves, gain, lacunarity, seed)


def ridged(
    points: Points,
    footprint: Filter = 0.0,
    *,
    octaves: int = 5,
    gain: Number = 0.5,
    lacunarity: Number = 2.0,
    seed: int = 0,
) -> Values:
    """Return the sum of octaves (1 - |N|)^2, whose crests lie where the noise is zero.

    Filtered as `turbulence` is.
    """
    return _fractal(points, footprint, kernels.RIDGED, octaves, gain, lacunarity, seed)


def box_widths(footprint: Filter, n_points: int) -> Widths:
    """The widths of the box around each point along each axis, (n, 3) float64, contiguous."""
    widths = np.asarray(footprint, np.float64)
    if not (np.isfinite(widths).all() and (widths >= 0).all()):
        raise TextureError(
            f"a width of the filter is {widths.min():g} or not finite",
            "texture(points, footprint=...)",
            "pass a width of 0 or more, in the unit of the points",
        )
    if widths.ndim == 1:
        widths = widths[:, None]
    return np.ascontiguousarray(np.broadcast_to(widths, (n_points, 3)))


def removed_spread(width: Values, *, octaves: int = 5, gain: Number = 0.5) -> Values:
    """Standard deviation of `fbm` of lacunarity 2 within a cube, on average over space."""
    table = noise_spreads()
    widths = np.linspace(0, kernels.FADE_END, len(table))
    square = np.zeros_like(width)
    for octave in range(octaves):
        square += (gain**octave * np.interp(2**octave * width, widths, table)) ** 2
    return np.sqrt(square)


@lru_cache(maxsize=1)
def noise_spreads() -> Float64[np.ndarray, " widths"]:
    """Standard deviation of noise within a cube around its mean, for widths 0 to FADE_END.

    The lattice gradients are independent, of mean square length 2, so the mean over a cube of
    width h has the variance ``2 a(h) b(h)^2``, a and b the integrals of the squares of the means of
    ``t B(t)`` and ``B(t)`` over an interval of width h.
    """
    variances = []
    for width in np.linspace(0, kernels.FADE_END, N_SPREADS):
        t = np.linspace(-1 - width / 2, 1 + width / 2, SIMPSON_STEPS + 1)
        share, moment = _interval_means(t, max(width, 1e-3))
        weights = np.full(len(t), 2.0)
        weights[1::2], weights[0], weights[-1] = 4.0, 1.0, 1.0
        weights *= (t[1] - t[0]) / 3
        variances.append(2 * (weights * moment**2).sum() * (weights * share**2).sum() ** 2)
    fade = (kernels.FADE_END - np.linspace(0, kernels.FADE_END, N_SPREADS)) / (
        kernels.FADE_END - kernels.FADE_BEGIN
    )
    kept = np.array(variances) * np.clip(fade, 0, 1) ** 2
    return np.sqrt(np.maximum(variances[0] - kept, 0))


def _interval_means(t: np.ndarray, width: float) -> tuple[np.ndarray, np.ndarray]:
    """Means of B(t) = 1 - fade(|t|) and of t B(t) over an interval around t."""
    ends = []
    for end in (t - width / 2, t + width / 2):
        s = np.minimum(np.abs(end), 1)
        whole = s - (s**6 - 3 * s**5 + 2.5 * s**4)
        moment = s**2 / 2 - (6 * s**7 / 7 - 2.5 * s**6 + 2 * s**5)
        ends.append((np.sign(end) * whole, moment))
    return tuple((after - before) / width for before, after in zip(*ends, strict=True))


def _fractal(
    points: Points,
    footprint: Filter,
    form: int,
    octaves: int,
    gain: Number,
    lacunarity: Number,
    seed: int,
) -> Values:
    if not 1 <= octaves <= 32:
        raise TextureError(
            f"octaves is {octaves}", "noise(octaves=...)", "pass a number from 1 to 32"
        )
    out = np.empty(len(points))
    kernels.fractal(
        checked_points(points),
        box_widths(footprint, len(points)),
        form,
        octaves,
        float(gain),
        float(lacunarity),
        seed,
        noise_spreads(),
        out,
    )
    return out


def checked_points(points: Points) -> Points:
    """Points whose lattice cells have numbers, contiguous and writable, as kernels want them."""
    if not (np.abs(points) <= LARGEST).all():
        bad = np.flatnonzero(~(np.abs(points) <= LARGEST).all(axis=1))
        raise TextureError(
            f"{len(bad)} of {len(points)} points are NaN or beyond {LARGEST:g} periods of the "
            f"pattern (first: point {bad[0]})",
            "texture(points)",
            "leave those points out, or enlarge the pattern's scale",
        )
    return writable_alias(np.ascontiguousarray(points))
