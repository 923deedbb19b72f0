"""What a file of full grids says beside the values, and what a reader does with it.

Formats with room for words keep what a `Grid` holds beyond values, voxel size and origin as text
under these keys:

- ``meshsdf_sign``: how inside was told
- ``meshsdf_half_width``: voxels from the surface where distances are clipped, if they are, and
  ``meshsdf_background``, that distance in world units, for other programs
- ``meshsdf_uncertain_voxels``, ``meshsdf_n_inner_faces``: counts, see `Grid`
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Vector3
from ..grid import Grid
from .vdb_stream import UnsuitedError, printable
from .volume_checks import check_volume
from .warn import Warn
from .x_fastest import memory_type

PREFIX = "meshsdf_"

_TYPES = {"sign": str, "half_width": float, "uncertain_voxels": int, "n_inner_faces": int}
_LONGEST_SIGN = 32
_RANGES = {int: (0, 1 << 62), float: (1e-30, 1e30)}
_EVEN = 1e-6  # relative; spacings written with seven digits still count as one
_RESAMPLE = "resample it to cubes along the axes where it was made"


@dataclass(frozen=True, eq=False)
class DenseHeader:
    """What a file says of its grid before its values.

    Attributes
    ----------
    format : str
        As `probe_volume` tells it.
    stored : dtype
        Of the values in the file, with its byte order.
    shape : tuple of int
        Nodes along x, y and z.
    voxel_size : float
        World units.
    origin : (3,) float64
        World position of node (0, 0, 0).
    told : dict
        Texts under the keys above; others are passed over.

    Raises
    ------
    ValueError
        There are no nodes, or more than can be counted.
    """

    format: str
    stored: np.dtype
    shape: tuple[int, int, int]
    voxel_size: float
    origin: Vector3
    told: Mapping[str, str]

    def __post_init__(self) -> None:
        if min(self.shape) < 1 or self.n_bytes >= 1 << 62:
            raise ValueError(f"it claims {' x '.join(map(str, self.shape))} nodes")
        if not np.isfinite(self.origin).all():
            raise ValueError(f"its origin is {self.origin.tolist()}")

    @property
    def n_nodes(self) -> int:
        """How many values there are."""
        return math.prod(self.shape)

    @property
    def n_bytes(self) -> int:
        """Bytes of the values, unpacked."""
        return self.n_nodes * self.stored.itemsize

    def grid(self, values: np.ndarray) -> Grid:
        """Return the grid of these values; ValueError if it makes no sense.

        Without a word of it, distances count as signed by ``winding`` if any is below 0.
        """
        facts = self._typed()
        default = "winding" if np.fmin.reduce(values, axis=None, initial=0) < 0 else "unsigned"
        grid = Grid(values, self.voxel_size, self.origin, **({"sign": default} | facts))
        check_volume(grid)
        return grid

    def facts(self) -> dict:
        """Return what `probe_volume` does."""
        facts = self._typed()
        if "half_width" in facts:
            with np.errstate(all="ignore"):
                facts["background"] = float(np.float32(facts["half_width"] * self.voxel_size))
        return {
            "kind": "grid",
            "format": self.format,
            "dtype": self.stored.name,
            "shape": list(self.shape),
            "voxel_size": self.voxel_size,
            "origin": self.origin.tolist(),
        } | facts

    def tell_type(self, warn: Warn) -> None:
        """Say so if the values change their type."""
        if self.stored.kind != "f":
            warn(f"its {self.stored.name} values are read as {memory_type(self.stored).name}")

    def _typed(self) -> dict:
        found = {}
        for name, kind in _TYPES.items():
            text = self.told.get(PREFIX + name)
            if text is None:
                continue
            try:
                found[name] = kind(text)
            except ValueError:
                raise ValueError(f"its {PREFIX}{name} is '{printable(text)}'") from None
            if not _is_sound(found[name]):
                raise ValueError(f"its {PREFIX}{name} is '{printable(text)}'")
        return found


def _is_sound(value: str | float | int) -> bool:
    if isinstance(value, str):
        return 0 < len(value) <= _LONGEST_SIGN and value.isascii() and value.isprintable()
    least, most = _RANGES[type(value)]
    return least <= value < most


def told_of(grid: Grid) -> dict[str, str]:
    """The texts that `DenseHeader.told` gives back."""
    facts = {name: getattr(grid, name) for name in _TYPES}
    facts = {name: _TYPES[name](value) for name, value in facts.items() if value is not None}
    if not grid.n_inner_faces:
        del facts["n_inner_faces"]
    if grid.background is not None:
        facts["background"] = grid.background
    return {PREFIX + name: str(value) for name, value in facts.items()}


def unkept_note(names: Sequence[str], most: int = 20) -> str:
    """Words for entries of a header that a `Grid` has no place for."""
    told = [printable(name) for name in sorted(names)]
    more = f" and {len(told) - most} more" if len(told) > most else ""
    return f"entries of its header are not kept: {', '.join(told[:most])}{more}"


def one_spacing(spacings: Sequence[float]) -> float:
    """The voxel size; UnsuitedError if the spacings differ, ValueError if they make no sense."""
    sizes = [float(size) for size in spacings]
    words = " x ".join(f"{size:g}" for size in sizes)
    if not all(math.isfinite(size) and size > 0 for size in sizes):
        raise ValueError(f"its spacings are {words}")
    if max(sizes) - min(sizes) > _EVEN * max(sizes):
        raise UnsuitedError(f"its voxels are no cubes, but {words}", _RESAMPLE)
    return sizes[0] if len(set(sizes)) == 1 else sum(sizes) / len(sizes)


def upright_spacings(directions: Sequence[Sequence[float]]) -> list[float]:
    """The steps along x, y and z; UnsuitedError unless axis i of the grid runs along axis i."""
    matrix = np.array(directions, np.float64)
    if not np.isfinite(matrix).all():
        raise ValueError("its directions are NaN or infinite")
    steps = np.diag(matrix)
    astray = np.abs(matrix - np.diag(steps)).max()
    if (steps <= 0).any() or astray > _EVEN * steps.max():
        rows = ", ".join("(" + " ".join(f"{x:g}" for x in row) + ")" for row in matrix)
        raise UnsuitedError(f"its axes are turned or flipped: {rows}", _RESAMPLE)
    return steps.tolist()


def numbers_of(text: str, count: int, what: str) -> list[float]:
    """The numbers in a text; ValueError names ``what`` if there are not ``count``."""
    words = text.split()
    try:
        found = [float(word) for word in words]
    except ValueError:
        found = []
    if len(found) != count or len(words) != count:
        raise ValueError(f"{what} is '{printable(text)}', not {count} numbers")
    return found


def counts_of(text: str, count: int, what: str) -> tuple[int, ...]:
    """The whole numbers in a text; ValueError names ``what`` if there are not ``count``."""
    words = text.split()
    is_whole = all(word.isascii() and word.lstrip("+-").isdigit() for word in words)
    if len(words) != count or not is_whole or max(map(len, words), default=0) > 18:
        raise ValueError(f"{what} is '{printable(text)}', not {count} whole numbers")
    return tuple(int(word) for word in words)
