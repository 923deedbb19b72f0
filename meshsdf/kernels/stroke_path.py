"""Dabs of a stroke from a pointer's samples: bands between samples, or dabs at even distances.

A sample is x, y, z, the unit normal, radius and flow; lengths in finest texels. ``state`` (18,) is
what a stroke remembers from batch to batch: whether there was a sample, that sample, how far it is
from there to the next dab, and the dab before. Rows of dabs are described in `kernels.brush_reach`.
"""

import math

import numpy as np
from numba import njit

SAMPLE = 8
STATE = 18
LEAST_RADIUS = 0.02  # of the brush's: dabs of light pressure do not come closer than these would


@njit(cache=True, nogil=True)
def make_dabs(samples, state, discrete, spacing, radius, matrices, center, most, dabs):
    """Fill ``dabs`` with the copies of every step, those of one step after another.

    Returns the number of steps, which is not above ``most``; with an empty ``dabs`` they are only
    counted, and ``state`` stays as it was.
    """
    n, fills = 0, len(dabs) > 0
    had, rest = state[0] > 0.0, state[9]
    last, dab = state[1:9].copy(), state[10:18].copy()
    here = np.empty(SAMPLE)
    for i in range(len(samples)):
        sample = samples[i]
        if not had:
            if fills:
                _place(sample, sample, sample, n, matrices, center, dabs)
            n += 1
            dab[:] = sample
            had, rest = True, spacing * max(sample[6], LEAST_RADIUS * radius)
        elif not discrete:
            if fills:
                _place(last, sample, last, n, matrices, center, dabs)
            n += 1
        else:
            length = _distance(last, sample)
            gone = 0.0
            while length - gone >= rest and n < most:
                gone += rest
                _between(last, sample, gone / length, here)
                if fills:
                    _place(here, here, dab, n, matrices, center, dabs)
                n += 1
                dab[:] = here
                rest = spacing * max(here[6], LEAST_RADIUS * radius)
            rest -= length - gone
        last[:] = sample
        if n >= most:
            break
    if fills:
        state[0] = 1.0
        state[1:9] = last
        state[9] = rest
        state[10:18] = dab
    return n


@njit(cache=True, nogil=True)
def _distance(a, b):
    return math.sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2)


@njit(cache=True, nogil=True)
def _between(a, b, t, out):
    """The sample at ``t`` of the way, its normal of length 1."""
    for c in range(SAMPLE):
        out[c] = a[c] + t * (b[c] - a[c])
    size = math.sqrt(out[3] ** 2 + out[4] ** 2 + out[5] ** 2)
    for c in range(3, 6):
        out[c] = out[c] / size if size > 0.0 else b[c]


@njit(cache=True, nogil=True)
def _place(a, b, before, step, matrices, center, dabs):
    """Write all copies of the capsule from sample a to sample b."""
    copies = len(matrices)
    for s in range(copies):
        row = dabs[step * copies + s]
        for i in range(3):
            pa, pb, na, nb, way = center[i], center[i], 0.0, 0.0, 0.0
            for j in range(3):
                m = matrices[s, i, j]
                pa += m * (a[j] - center[j])
                pb += m * (b[j] - center[j])
                na += m * a[3 + j]
                nb += m * b[3 + j]
                way += m * (b[j] - before[j])
            row[i], row[3 + i] = pa, pb
            row[10 + i], row[13 + i], row[16 + i] = na, nb, way
        row[6], row[7], row[8], row[9] = a[6], b[6], a[7], b[7]
