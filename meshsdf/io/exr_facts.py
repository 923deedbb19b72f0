"""What an ``.exr`` volume says of itself: in its header, and in a JSON file beside it.

Both hold the same entries; in the header each is a text attribute ``meshsdf:KEY`` with the value
as JSON, so that no digit is lost. Lengths are in world units:

- ``format``: ``meshsdf.exr/1``
- ``layout``: ``atlas``, one image with all slices, or ``parts``, one part of the file per slice
- ``shape``: nodes along x, y, z · ``voxel_size`` · ``origin``: world position of node (0, 0, 0)
- ``lower``, ``upper``: the box of the voxels, half a voxel beyond the nodes; a texture coordinate
  of 0 is at ``lower``, one of 1 at ``upper``
- ``up``, ``columns_along``, ``rows_along``, ``slices_along``: see `exr_layout`; row 0 is on top
- ``slice_size``: pixels of a slice, width and height · ``n_slices``
- ``columns``, ``rows``: cells of the atlas, the last of which may be unused; null for ``parts``
- ``dtype``: of the pixels, ``float32`` or ``float16``
- ``remap``: the distance that is stored as 1, while 0 is stored as 0.5; null if values are stored
  as they are · ``n_clamped``: values farther than that, stored as 0 or 1
- ``value_scale``, ``value_offset``: value = value_scale * pixel + value_offset
- ``value_range``: least and largest value; null if there are none · ``background``: the value of
  unused cells, and beyond the grid
- ``sign``, ``uncertain_voxels``, ``n_inner_faces``, ``half_width``: those of the `Grid`
"""

import json
import sys
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..arrays import Number
from .exr_layout import ALONG, Slicing
from .vdb_stream import printable

FORMAT = "meshsdf.exr/1"
PREFIX = "meshsdf:"

LayoutName = Literal["atlas", "parts"]

_LARGEST = 1 << 40  # of a count
_FARTHEST = sys.float_info.max  # NaN is not below it
_LONGEST_ENTRY = 1000  # letters

_NUMBER, _COUNT, _TEXT = (int, float), (int,), (str,)
_CORE = {
    "format": (_TEXT, 0),
    "shape": (_COUNT, 3),
    "voxel_size": (_NUMBER, 0),
    "origin": (_NUMBER, 3),
    "up": (_TEXT, 0),
    "columns": (_COUNT, None),
    "dtype": (_TEXT, 0),
    "remap": (_NUMBER, None),
    "n_clamped": (_COUNT, 0),
    "value_range": (_NUMBER, 2),
    "background": (_NUMBER, 0),
    "sign": (_TEXT, 0),
    "uncertain_voxels": (_COUNT, None),
    "n_inner_faces": (_COUNT, 0),
    "half_width": (_NUMBER, None),
}
"""Types, and how many (0: one, None: one or null), of the entries that the others follow from."""

_OR_NULL = {"value_range"}
_ALONG_KEYS = ("columns_along", "rows_along", "slices_along")


@dataclass(frozen=True)
class ExrFacts:
    """What an ``.exr`` volume says of itself; the module's docstring tells what each means."""

    slicing: Slicing
    voxel_size: float
    origin: tuple[float, float, float]
    dtype: str
    remap: float | None
    n_clamped: int
    value_range: tuple[float, float] | None
    background: float
    sign: str
    uncertain_voxels: int | None
    n_inner_faces: int
    half_width: float | None

    @property
    def scale(self) -> float:
        """``value = scale * pixel + offset``."""
        return 1.0 if self.remap is None else 2 * self.remap

    @property
    def offset(self) -> float:
        """``value = scale * pixel + offset``."""
        return 0.0 if self.remap is None else -self.remap

    def entries(self) -> dict:
        """Return all entries, as JSON has them."""
        slicing, size = self.slicing, self.voxel_size
        along = dict(zip(_ALONG_KEYS, ALONG[slicing.up], strict=True))
        ends = list(zip(self.origin, slicing.shape, strict=True))
        return {
            "format": FORMAT,
            "layout": "parts" if slicing.columns is None else "atlas",
            "shape": list(slicing.shape),
            "voxel_size": size,
            "origin": list(self.origin),
            "lower": [start - size / 2 for start, _ in ends],
            "upper": [start + size * (n - 0.5) for start, n in ends],
            "up": slicing.up,
            **along,
            "slice_size": [slicing.width, slicing.height],
            "n_slices": slicing.n_slices,
            "columns": slicing.columns,
            "rows": slicing.rows,
            "dtype": self.dtype,
            "remap": self.remap,
            "n_clamped": self.n_clamped,
            "value_scale": self.scale,
            "value_offset": self.offset,
            "value_range": None if self.value_range is None else list(self.value_range),
            "background": self.background,
            "sign": self.sign,
            "uncertain_voxels": self.uncertain_voxels,
            "n_inner_faces": self.n_inner_faces,
            "half_width": self.half_width,
        }

    def attributes(self) -> dict[str, str]:
        """Return the entries as header attributes."""
        return {
            PREFIX + key: json.dumps(value, allow_nan=False)
            for key, value in self.entries().items()
        }

    def pixels(self, values: np.ndarray) -> np.ndarray:
        """Return values as the pixels that stand for them, contiguous; see `value_pixels`."""
        return value_pixels(values, self.remap, np.dtype(self.dtype))

    def values(self, pixels: np.ndarray) -> np.ndarray:
        """Return the float32 values that pixels stand for."""
        if self.remap is None:
            return pixels.astype(np.float32, copy=False)
        return (pixels.astype(np.float64) * self.scale + self.offset).astype(np.float32)


def value_pixels(values: np.ndarray, remap: Number | None, dtype: np.dtype) -> np.ndarray:
    """Return values as pixels, in a new contiguous array whatever the order of the values is.

    A value below 0 gives a pixel below that of 0, however small it is, so an inner node stays
    inside; NaN stays NaN.
    """
    zero, stored = 0.0, values
    if remap is not None:
        zero, stored = 0.5, np.clip(values.astype(np.float64) / (2 * remap) + 0.5, 0, 1)
    pixels = np.array(stored, dtype, order="C")
    below = np.nextafter(dtype.type(zero), dtype.type(-1))
    pixels[(values < 0) & (pixels >= zero)] = below
    return pixels


def parse_facts(attributes: dict[str, str]) -> ExrFacts:
    """Return the facts that header attributes state.

    Raises
    ------
    ValueError
        One is missing, is not what it should be, or contradicts the others.
    """
    found = {key: _core_entry(key, attributes) for key in _CORE}
    shape, up, columns = tuple(found["shape"]), found["up"], found["columns"]
    if up not in ALONG or min(shape) < 1 or columns == 0:
        raise ValueError(f"its shape is {shape}, its up {printable(up)}, its columns {columns}")
    if found["remap"] is not None and found["remap"] <= 0:
        raise ValueError(f"its remap is {found['remap']}, not a length above 0")
    value_range = found["value_range"]
    facts = ExrFacts(
        Slicing(shape, up, columns),
        float(found["voxel_size"]),
        tuple(map(float, found["origin"])),
        found["dtype"],
        _float_or_none(found["remap"]),
        found["n_clamped"],
        None if value_range is None else tuple(map(float, value_range)),
        float(found["background"]),
        found["sign"],
        found["uncertain_voxels"],
        found["n_inner_faces"],
        _float_or_none(found["half_width"]),
    )
    for key, value in facts.entries().items():
        if _entry(key, attributes) != value:
            raise ValueError(f"its {key} contradicts the rest of its header")
    return facts


def _float_or_none(value: object) -> float | None:
    return None if value is None else float(value)


def _core_entry(key: str, attributes: dict[str, str]) -> object:
    """An entry that is of the type it must be, and of the length."""
    kinds, length = _CORE[key]
    value = _entry(key, attributes)
    if value is None and (length is None or key in _OR_NULL):
        return None
    items = value if length and isinstance(value, list) else [value]
    is_right = len(items) == (length or 1) and all(_is_one(item, kinds) for item in items)
    if not is_right:
        raise ValueError(f"its {key} is {printable(str(value))}")
    return value


def _is_one(value: object, kinds: tuple[type, ...]) -> bool:
    if type(value) not in kinds:  # not isinstance: True is an int
        return False
    if kinds == _COUNT:
        return 0 <= value <= _LARGEST
    return isinstance(value, str) or -_FARTHEST <= value <= _FARTHEST


def _entry(key: str, attributes: dict[str, str]) -> object:
    text = attributes.get(PREFIX + key)
    if text is None:
        raise ValueError(f"its header lacks {PREFIX + key}")
    try:
        return json.loads(text[:_LONGEST_ENTRY])
    except (ValueError, RecursionError):
        raise ValueError(f"its {key} is {printable(text)}") from None
