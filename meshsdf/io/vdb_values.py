"""The values of a ``.vdb`` node: which of them are stored, and how these are packed.

A node's values are written as a code (int8), what the code says, then the data. With the flag
ACTIVE_MASK only active values are data; the code tells the others, which in a level set or a fog
volume are one or two values. ``bg`` is the grid's background:

- 0: all bg · 1: all -bg · 2: all v · 3: -bg and bg · 4: v and bg · 5: v and w
- 6: nothing is left out; all values are data. Without ACTIVE_MASK it is always this code.

What follows the code: v and w at full width (if any), then, for 3 to 5, one bit per value that is
set where the second of the pair stands. Data are float16 if the grid is stored as half. With the
flag ZIP or BLOSC they are preceded by their packed size (int64); a size of 0 or below says that so
many bytes follow unpacked. A half grid omits even the size when there are no data.

Layout: OpenVDB 10 (Museth 2013, doi:10.1145/2487228.2487235); the codes are those of its format
versions 222 to 225.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import UInt32

from ..kernels.vdb_read import SLACK
from .half import halved

ZIP, ACTIVE_MASK, BLOSC = 1, 2, 4


def compression_words(flags: int) -> str:
    """Compression flags as the format words them."""
    words = {ZIP: "zip", BLOSC: "blosc", ACTIVE_MASK: "active values"}
    return " + ".join(word for flag, word in words.items() if flags & flag) or "none"


@dataclass(frozen=True, eq=False)
class ValueLayout:
    """How the values of one grid are stored.

    Attributes
    ----------
    background : () or (c,) array
        The value where nothing is stored; its dtype is that of the values.
    is_half : bool
        Whether data are float16.
    flags : int
        ZIP, ACTIVE_MASK and BLOSC, added.
    """

    background: np.ndarray
    is_half: bool
    flags: int

    @property
    def dtype(self) -> np.dtype:
        """Type of a component of a value."""
        return self.background.dtype

    @property
    def stored(self) -> np.dtype:
        """Type of a component of the data."""
        return np.dtype("<f2") if self.is_half else self.dtype.newbyteorder("<")

    @property
    def width(self) -> int:
        """Bytes of a whole value at full width."""
        return self.background.nbytes

    @cached_property
    def stored_width(self) -> int:
        """Bytes of a whole value as data."""
        return self.background.size * self.stored.itemsize

    @cached_property
    def is_packed(self) -> bool:
        """Whether data are preceded by their packed size."""
        return bool(self.flags & (ZIP | BLOSC))

    def longest_node(self, n: int) -> int:
        """Bytes that a node of ``n`` values takes at most, with its active mask."""
        return n // 8 + 1 + 2 * self.width + n // 8 + 8 + n * self.stored_width + SLACK

    @cached_property
    def sides(self) -> UInt32[np.ndarray, "2 c"]:
        """The background and its opposite as words of 32 bits, as kernels take them."""
        return np.stack([self.background.ravel(), self.opposite.ravel()]).view(np.uint32)

    @cached_property
    def opposite(self) -> np.ndarray:
        """The background with its sign changed, component by component."""
        with np.errstate(over="ignore"):
            return np.asarray(-self.background)


def full_width(value: np.ndarray | np.generic, layout: ValueLayout) -> bytes:
    """A value at full width, but rounded as the data are."""
    rounded = halved(np.asarray(value)) if layout.is_half else value
    return rounded.astype(layout.dtype.newbyteorder("<")).tobytes()


def same_bits(values: np.ndarray, value: np.ndarray | np.generic) -> np.ndarray | np.bool_:
    """Which of the values are ``value``, bit for bit and in all components.

    So -0.0 differs from 0.0, and NaN is itself.
    """
    same = _bits(values) == _bits(np.asarray(value))
    return same.all(axis=-1) if np.ndim(value) else same


def _bits(values: np.ndarray) -> np.ndarray:
    """Values as unsigned integers."""
    return np.ascontiguousarray(values).view(f"u{values.dtype.itemsize}").reshape(values.shape)
