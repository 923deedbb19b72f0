"""Values as float16, when half the size matters more than the last digits."""

import numpy as np

from ..errors import IoError

LARGEST_HALF = 65504.0
SMALLEST_HALF = 2.0**-14
"""Below this a float16 loses bits."""

_LEAST_NEGATIVE = np.float16(-(2.0**-24))


def halved(values: np.ndarray) -> np.ndarray:
    """Round to float16; a value below 0 stays below 0, so an inner node keeps its sign."""
    halves = values.astype(np.float16)
    return np.where((values < 0) & (halves == 0), _LEAST_NEGATIVE, halves)


def check_half(values: np.ndarray, where: str) -> None:
    """IoError if the largest of the values does not fit float16; NaN is passed over."""
    high, low = (
        np.fmax.reduce(values, axis=None, initial=0),
        np.fmin.reduce(values, None, initial=0),
    )
    largest = float(max(high, -low))
    if largest > LARGEST_HALF or 0 < largest < SMALLEST_HALF:
        span = f"{SMALLEST_HALF:.2g} to {LARGEST_HALF:g}"
        what = f"values up to {largest:g} do not fit float16 ({span})"
        raise IoError(what, where, "write without half, or scale the mesh")
