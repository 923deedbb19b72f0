"""What a volume must be before a file or a compiled loop may rely on it.

Compiled loops index without looking, so every number that becomes an index is checked here, when
a volume comes out of a file and before it goes into one.
"""

import numpy as np

from ..grid import BrickIndex, Grid, NarrowBand
from ..grid.hermite import Hermite

LARGEST_BRICK = 1 << 40
"""Brick coordinates beyond this would overflow 64 bits when turned into nodes and squared."""

_LONGEST_SIGN = 32
_LONGEST_NORMAL = 1 + 1e-6  # of a component; rounding is far less
_ROWS_AT_ONCE = 4096


def check_volume(volume: NarrowBand | Grid) -> None:
    """ValueError says what is wrong with the volume."""
    _check_length("voxel_size", volume.voxel_size)
    _check_sign(volume.sign)
    if isinstance(volume, Grid):
        _check_finite("origin", volume.origin)
        if volume.half_width is not None:
            _check_length("half_width", volume.half_width)
        if np.isinf(volume.values).any():
            raise ValueError("values are infinite; NaN says that there are no data")
        return
    _check_length("half_width", volume.half_width)
    _check_finite("translation", volume.translation)
    _check_finite("values", volume.values)
    check_index(volume.index)
    n = volume.index.n_bricks
    for name in ("values", "active", "closest_face", "barycentric"):
        array = getattr(volume, name)
        if array is not None and len(array) != n:
            raise ValueError(f"{name} holds {len(array)} bricks, the index {n}")
    if volume.hermite is not None:
        _check_hermite(volume.hermite)
    if volume.closest_face is not None and volume.closest_face.min(initial=-1) < -1:
        raise ValueError("closest_face holds a number below -1")


def _check_hermite(hermite: Hermite) -> None:
    for name in ("fractions", "normals", "loop_points", "arc_points"):
        _check_finite(f"hermite_{name}", getattr(hermite, name))
    if ((hermite.fractions < 0) | (hermite.fractions > 1)).any():
        raise ValueError("hermite_fractions holds a number beyond 0 and 1")
    if (np.abs(hermite.normals) > _LONGEST_NORMAL).any():
        raise ValueError("hermite_normals holds a vector longer than 1")
    for name in ("loops", "arcs"):
        numbers = getattr(hermite, name)
        if numbers.min(initial=0) < 0 or (np.diff(numbers) <= 0).any():
            raise ValueError(f"hermite_{name} does not rise from 0 on")


def check_index(index: BrickIndex) -> None:
    """ValueError unless every brick has one slot and every slot one brick."""
    coordinates, root, pages = index.coordinates, index.root, index.pages
    # Compared on both sides, because the absolute value of the smallest int64 is negative.
    numbers = np.concatenate([coordinates.ravel(), index.page_origin])
    if numbers.min() < -LARGEST_BRICK or numbers.max() > LARGEST_BRICK:
        raise ValueError("a brick coordinate is too large")
    step = np.diff(coordinates, axis=0)
    first = np.where(step[:, 0] != 0, step[:, 0], np.where(step[:, 1] != 0, step[:, 1], step[:, 2]))
    if (first <= 0).any():
        at = int(np.flatnonzero(first <= 0)[0])
        raise ValueError(
            f"brick {coordinates[at + 1].tolist()} comes after {coordinates[at].tolist()}; "
            "bricks must rise by x, then y, then z"
        )
    n_upper = int(np.count_nonzero(root >= 0))
    upper, lower = pages[:n_upper], pages[n_upper:]
    named = np.sort(np.concatenate([root[root >= 0], upper[upper >= 0]]))
    if not np.array_equal(named, np.arange(len(pages))) or (root >= n_upper).any():
        raise ValueError(f"the page table does not name each of the {len(pages)} pages once")
    n_slots = np.count_nonzero(lower >= 0)
    if n_slots != len(coordinates):
        raise ValueError(f"the pages hold {n_slots} slots for {len(coordinates)} bricks")
    local = coordinates - index.page_origin * 16
    if ((local < 0) | (local >> 8 >= root.shape)).any():
        raise ValueError("a brick lies outside the root table")
    number = root[tuple((local >> 8).T)]
    if (number >= 0).all():
        number = pages[(number, *(local >> 4 & 15).T)]
    if (number < 0).any():
        raise ValueError("a brick lies in a page that does not exist")
    if (pages[(number, *(local & 15).T)] != np.arange(len(coordinates))).any():
        raise ValueError("a page names another slot than that of its brick")


def _check_length(name: str, value: float) -> None:
    if not (np.isfinite(value) and value > 0):
        raise ValueError(f"{name} is {value}, not a length above 0")


def _check_finite(name: str, values: np.ndarray) -> None:
    # In pieces, so that a large band needs no second array of its size
    starts = range(0, len(values), _ROWS_AT_ONCE)
    n = sum(np.count_nonzero(~np.isfinite(values[at : at + _ROWS_AT_ONCE])) for at in starts)
    if n:
        raise ValueError(f"{n} of the numbers in {name} are NaN or infinite")


def _check_sign(sign: str) -> None:
    if not (0 < len(sign) <= _LONGEST_SIGN and sign.isascii() and sign.isprintable()):
        raise ValueError(f"sign is {sign[:_LONGEST_SIGN]!r}")
