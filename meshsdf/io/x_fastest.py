"""Values on nodes in the order of most volume files: x fastest, then y, then z.

Ours are [i, j, k] with k fastest, so every value changes place. Both ways go by some planes of
constant k at a time, so that reading and writing take little more memory than the values.
"""

import zlib
from collections.abc import Callable, Iterator
from typing import BinaryIO

import numpy as np

Read = Callable[[int], bytes | bytearray]
"""``read(n)``: the next n bytes, fewer only where there are no more."""

GZIP, ZLIB = 31, 15
"""How `write_values` packs: zlib's numbers for a frame of gzip, and for its own."""

_LEVEL = 4  # of deflate's 9: exact distances pack little at any, clipped ones well at each
_BYTES_AT_ONCE = 1 << 24
_BLOCK = 16  # 64 bytes of float32, what a processor fetches at once


def memory_type(stored: np.dtype) -> np.dtype:
    """float32 or float64, whichever holds all numbers of a type (64-bit integers to 2**53)."""
    is_small = stored.itemsize <= 2 or (stored.kind == "f" and stored.itemsize == 4)
    return np.dtype(np.float32 if is_small else np.float64)


def write_values(file: BinaryIO, values: np.ndarray, stored: np.dtype, packing: int = 0) -> None:
    """Append the values, x fastest, packed as GZIP or ZLIB say, or as they are."""
    if not packing:
        for planes in file_planes(values, stored):
            file.write(planes.data)
        return
    packer = zlib.compressobj(_LEVEL, zlib.DEFLATED, packing)
    for planes in file_planes(values, stored):
        file.write(packer.compress(planes.data))
    file.write(packer.flush())


def file_planes(values: np.ndarray, stored: np.dtype) -> Iterator[np.ndarray]:
    """Yield arrays [k, j, i] of some planes each, which one after the other are the file."""
    step = _planes_at_once(values.shape, stored)
    for k in range(0, values.shape[2], step):
        part = values[:, :, k : k + step]
        planes = np.empty(part.shape[::-1], stored)
        _copy_reversed(part, planes)
        yield planes


def read_values(read: Read, shape: tuple[int, int, int], stored: np.dtype) -> np.ndarray:
    """Return the values [i, j, k] of a stream with x fastest; ValueError if it is cut off."""
    out = np.empty(shape, memory_type(stored))
    n_plane = shape[0] * shape[1]
    step = _planes_at_once(shape, stored)
    for k in range(0, shape[2], step):
        n = min(step, shape[2] - k) * n_plane * stored.itemsize
        data = read(n)
        if len(data) != n:
            raise ValueError(f"it is cut off: {n - len(data)} bytes of values are missing")
        planes = np.frombuffer(data, stored).reshape(-1, shape[1], shape[0])
        _copy_reversed(planes, out[:, :, k : k + step])
    return out


def from_flat(flat: np.ndarray, shape: tuple[int, int, int], stored: np.dtype) -> np.ndarray:
    """Return the values [i, j, k] of a flat array with x fastest."""
    out = np.empty(shape, memory_type(stored))
    with np.errstate(over="ignore"):  # what does not fit becomes infinite, and is refused so
        _copy_reversed(flat.reshape(shape[::-1]), out)
    return out


def _planes_at_once(shape: tuple[int, ...], stored: np.dtype) -> int:
    return max(1, _BYTES_AT_ONCE // max(1, shape[0] * shape[1] * stored.itemsize))


def _copy_reversed(source: np.ndarray, target: np.ndarray) -> None:
    """``target[a, b, c] = source[c, b, a]``, by blocks that fit the processor's cache."""
    n_a, n_b, n_c = target.shape
    block = _BLOCK if n_b >= _BLOCK else max(n_a, n_c, 1)
    for a in range(0, n_a, block):
        for c in range(0, n_c, block):
            target[a : a + block, :, c : c + block] = source[c : c + block, :, a : a + block].T
