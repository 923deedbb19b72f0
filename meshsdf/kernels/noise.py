"""Gradient noise on the integer lattice, its exact mean over a box, and sums of its octaves.

Noise is Perlin 2002 (doi:10.1145/566654.566636): at every lattice point one of 12 gradients,
blended by the quintic fade. The reference form looks gradients up in a permutation of 256 and
repeats after 256 units; the other hashes the lattice point (pcg3d: Jarzynski, Olano 2020,
JCGT 9(3), 20-38) and does not repeat.

The mean over a box is exact: a lattice point's share of the noise is a sum of three products of
one-variable polynomials, ``B(t) = 1 - fade(|t|)`` and ``t B(t)``, so its integral over a box is a
sum of three products of differences of their antiderivatives.
"""

import math

import numpy as np
from numba import njit

FBM, TURBULENCE, RIDGED = 0, 1, 2

# Below, the mean over a box is the noise itself to 2e-3 (a bound on its second derivatives is 20);
# a box is at least as wide, as its integral is divided by the width.
LEAST_WIDTH = 1.0 / 64.0
# Between these widths, in lattice units, an octave fades to its mean: what is left of it there has
# a root mean square of 0.023, then 0.013
FADE_BEGIN, FADE_END = 3.0, 4.0
WIDEST = 7  # lattice points along an axis within reach of the widest box
STEP_X, STEP_Y, STEP_Z = 0.3183, 0.5772, 0.6931  # so that octaves share no zeros

# The 12 edge directions, four of them twice
GRADIENTS = np.array(
    [
        [1, 1, 0], [-1, 1, 0], [1, -1, 0], [-1, -1, 0], [1, 0, 1], [-1, 0, 1], [1, 0, -1],
        [-1, 0, -1], [0, 1, 1], [0, -1, 1], [0, 1, -1], [0, -1, -1], [1, 1, 0], [0, -1, 1],
        [-1, 1, 0], [0, -1, -1],
    ],
    np.float64,
)  # fmt: skip

_MASK = np.uint64(0xFFFFFFFF)
_SHIFT = np.uint64(16)
_TOP = np.uint64(32)
_A, _C = np.uint64(1664525), np.uint64(1013904223)
_FOLD = np.uint64(0x9E3779B1)  # a prime near 2**32 / golden ratio, for the upper halves


@njit(cache=True, nogil=True)
def pcg3d(x, y, z):
    """Three 32-bit numbers, as uint64, mixed into three others (Jarzynski, Olano 2020)."""
    x = (x * _A + _C) & _MASK
    y = (y * _A + _C) & _MASK
    z = (z * _A + _C) & _MASK
    x = (x + y * z) & _MASK
    y = (y + z * x) & _MASK
    z = (z + x * y) & _MASK
    x ^= x >> _SHIFT
    y ^= y >> _SHIFT
    z ^= z >> _SHIFT
    x = (x + y * z) & _MASK
    y = (y + z * x) & _MASK
    z = (z + x * y) & _MASK
    return x, y, z


@njit(cache=True, nogil=True)
def lattice_hash(i, j, k, seed):
    """Hash of a lattice point: 64-bit coordinates are folded to 32, so nothing overflows."""
    salt = np.uint64(seed) * _FOLD
    x, y, z = np.uint64(i), np.uint64(j), np.uint64(k)
    x = (x ^ ((x >> _TOP) * _FOLD) ^ salt) & _MASK
    y = (y ^ ((y >> _TOP) * _FOLD) ^ (salt >> _SHIFT)) & _MASK
    z = (z + (z >> _TOP) * _FOLD + salt) & _MASK
    return pcg3d(x, y, z)


@njit(cache=True, nogil=True)
def _fade(t):
    return t * t * t * (t * (t * 6.0 - 15.0) + 10.0)


@njit(cache=True, nogil=True)
def _reference_slope(h, x, y, z):
    """One of 16 gradients times the offset, in the order of Perlin's program."""
    h &= 15
    u = x if h < 8 else y
    if h < 4:
        v = y
    elif h == 12 or h == 14:
        v = x
    else:
        v = z
    return (u if h & 1 == 0 else -u) + (v if h & 2 == 0 else -v)


@njit(cache=True, nogil=True)
def _mix(t, a, b):
    return a + t * (b - a)


@njit(cache=True, nogil=True)
def reference_noise(points, permutation, out):
    """``out[n]`` = Perlin's reference noise; ``permutation`` is (256,) int64."""
    p = permutation
    for n in range(len(points)):
        x, y, z = points[n, 0], points[n, 1], points[n, 2]
        i, j, k = np.int64(math.floor(x)), np.int64(math.floor(y)), np.int64(math.floor(z))
        x, y, z = x - math.floor(x), y - math.floor(y), z - math.floor(z)
        u, v, w = _fade(x), _fade(y), _fade(z)
        i, j, k = i & 255, j & 255, k & 255
        # Sums wrap at 256: the reference program has its table twice in a row
        a, b = p[i] + j, p[(i + 1) & 255] + j
        aa, ab = p[a & 255] + k, p[(a + 1) & 255] + k
        ba, bb = p[b & 255] + k, p[(b + 1) & 255] + k
        near = _mix(
            v,
            _mix(
                u,
                _reference_slope(p[aa & 255], x, y, z),
                _reference_slope(p[ba & 255], x - 1, y, z),
            ),
            _mix(
                u,
                _reference_slope(p[ab & 255], x, y - 1, z),
                _reference_slope(p[bb & 255], x - 1, y - 1, z),
            ),
        )
        far = _mix(
            v,
            _mix(
                u,
                _reference_slope(p[(aa + 1) & 255], x, y, z - 1),
                _reference_slope(p[(ba + 1) & 255], x - 1, y, z - 1),
            ),
            _mix(
                u,
                _reference_slope(p[(ab + 1) & 255], x, y - 1, z - 1),
                _reference_slope(p[(bb + 1) & 255], x - 1, y - 1, z - 1),
            ),
        )
        out[n] = _mix(w, near, far)


@njit(cache=True, nogil=True)
def _slope(i, j, k, seed, x, y, z):
    h, _, _ = lattice_hash(i, j, k, seed)
    g = np.int64(h & np.uint64(15))
    return GRADIENTS[g, 0] * x + GRADIENTS[g, 1] * y + GRADIENTS[g, 2] * z


@njit(cache=True, nogil=True)
def noise_at(x, y, z, seed):
    """Gradient noise on the hashed lattice: in [-1.04, 1.04], zero at lattice points."""
    i, j, k = np.int64(math.floor(x)), np.int64(math.floor(y)), np.int64(math.floor(z))
    x, y, z = x - math.floor(x), y - math.floor(y), z - math.floor(z)
    u, v, w = _fade(x), _fade(y), _fade(z)
    a, b, c = x - 1.0, y - 1.0, z - 1.0
    low = _mix(u, _slope(i, j, k, seed, x, y, z), _slope(i + 1, j, k, seed, a, y, z))
    high = _mix(u, _slope(i, j + 1, k, seed, x, b, z), _slope(i + 1, j + 1, k, seed, a, b, z))
    near = _mix(v, low, high)
    k += 1
    low = _mix(u, _slope(i, j, k, seed, x, y, c), _slope(i + 1, j, k, seed, a, y, c))
    high = _mix(u, _slope(i, j + 1, k, seed, x, b, c), _slope(i + 1, j + 1, k, seed, a, b, c))
    return _mix(w, near, _mix(v, low, high))


@njit(cache=True, nogil=True)
def _primitives(t):
    """Antiderivatives of B(t) = 1 - fade(|t|) and of t B(t) on [-1, 1]."""
    t = min(max(t, -1.0), 1.0)
    s = abs(t)
    s4 = s * s * s * s
    whole = s - s4 * (s * (s - 3.0) + 2.5)
    moment = 0.5 * s * s - s4 * s * (s * (s * (6.0 / 7.0) - 2.5) + 2.0)
    return (whole if t >= 0.0 else -whole), moment


@njit(cache=True, nogil=True)
def _shares(x, width, shares, moments):
    """Means of B and t B over an interval, for the lattice points that matter; first and count."""
    low, high = x - 0.5 * width, x + 0.5 * width
    first = np.int64(math.floor(low))
    count = np.int64(math.floor(high)) + 2 - first
    for c in range(count):
        at = float(first + c)
        whole_0, moment_0 = _primitives(low - at)
        whole_1, moment_1 = _primitives(high - at)
        shares[c] = (whole_1 - whole_0) / width
        moments[c] = (moment_1 - moment_0) / width
    return first, count


@njit(cache=True, nogil=True)
def box_noise(x, y, z, width_x, width_y, width_z, seed, room):
    """Mean of `noise_at` over the box of those widths around a point.

    Widths in [LEAST_WIDTH, FADE_END]; ``room`` is (6, WIDEST) float64 to work in.
    """
    i0, n_i = _shares(x, width_x, room[0], room[1])
    j0, n_j = _shares(y, width_y, room[2], room[3])
    k0, n_k = _shares(z, width_z, room[4], room[5])
    total = 0.0
    for i in range(n_i):
        for j in range(n_j):
            in_x, in_y = room[1, i] * room[2, j], room[0, i] * room[3, j]
            flat = room[0, i] * room[2, j]
            for k in range(n_k):
                h, _, _ = lattice_hash(i0 + i, j0 + j, k0 + k, seed)
                g = np.int64(h & np.uint64(15))
                total += room[4, k] * (GRADIENTS[g, 0] * in_x + GRADIENTS[g, 1] * in_y)
                total += room[5, k] * GRADIENTS[g, 2] * flat
    return total


@njit(cache=True, nogil=True)
def _octave(x, y, z, width_x, width_y, width_z, seed, room):
    """Noise or its mean over a box, faded out where next to nothing is left of it."""
    widest = max(width_x, width_y, width_z)
    if widest < LEAST_WIDTH:
        return noise_at(x, y, z, seed)
    if widest >= FADE_END:
        return 0.0
    width_x, width_y = max(width_x, LEAST_WIDTH), max(width_y, LEAST_WIDTH)
    mean = box_noise(x, y, z, width_x, width_y, max(width_z, LEAST_WIDTH), seed, room)
    if widest > FADE_BEGIN:
        mean *= (FADE_END - widest) / (FADE_END - FADE_BEGIN)
    return mean


@njit(cache=True, nogil=True)
def _mean_form(form, mean, spread):
    """Mean of |N| or (1 - |N|)**2, N normal with this mean and standard deviation."""
    if spread > 1e-9:
        t = mean / spread
        size = spread * math.sqrt(2.0 / math.pi) * math.exp(-0.5 * t * t)
        size += mean * math.erf(t * math.sqrt(0.5))
    else:
        size = abs(mean)
    if form == TURBULENCE:
        return size
    return 1.0 - 2.0 * size + mean * mean + spread * spread


@njit(cache=True, nogil=True)
def fractal(points, widths, form, octaves, gain, lacunarity, seed, spreads, out):
    """``out[n]`` = sum of octaves, each filtered by a box of ``widths[n]`` along the axes.

    Octave i is ``gain**i`` times N, |N| or (1 - |N|)**2 at ``lacunarity**i`` times the point.
    ``spreads[m]`` is the standard deviation of the noise within a cube that is
    ``m * FADE_END / (len(spreads) - 1)`` wide.
    """
    room = np.empty((6, WIDEST))
    per_unit = (len(spreads) - 1) / FADE_END
    for n in range(len(points)):
        total, weight, frequency = 0.0, 1.0, 1.0
        for octave in range(octaves):
            x = points[n, 0] * frequency + octave * STEP_X
            y = points[n, 1] * frequency + octave * STEP_Y
            z = points[n, 2] * frequency + octave * STEP_Z
            a, b, c = widths[n, 0] * frequency, widths[n, 1] * frequency, widths[n, 2] * frequency
            value = _octave(x, y, z, a, b, c, seed + octave, room)
            if form != FBM:
                place = min((a + b + c) / 3.0, FADE_END) * per_unit
                m = min(np.int64(place), len(spreads) - 2)
                spread = spreads[m] + (place - m) * (spreads[m + 1] - spreads[m])
                value = _mean_form(form, value, spread)
            total += weight * value
            weight *= gain
            frequency *= lacunarity
        out[n] = total


@njit(cache=True, nogil=True)
def lattice_hashes(cells, seed, out):
    """``out[n]`` = a random number in [0, 1) of the lattice point ``cells[n]``."""
    for n in range(len(cells)):
        h, _, _ = lattice_hash(cells[n, 0], cells[n, 1], cells[n, 2], seed)
        out[n] = h / 4294967296.0
