"""The values of bands and grids as Zarr arrays [k, j, i], chunk by chunk.

Of a band only chunks that hold a brick or an inner node are written: the fill value is the
background outside. Chunks are cubes of 64 nodes, 8 bricks a side.
"""

from pathlib import Path

import numpy as np

from ..arrays import BrickCoordinates, BrickValues, Ijk1
from ..grid import NarrowBand
from ..grid.brick_index import BRICK, INSIDE
from .half import halved
from .run_packer import RunPacker
from .vdb_stream import UnsuitedError
from .zarr_array import (
    MOST_CHUNKS,
    PACKED,
    PLAIN,
    ArraySpec,
    for_all_chunks,
    pack,
    read_chunk,
    store,
    write_metadata,
)
from .zarr_zip import Folder

CHUNK = 64
"""Nodes along a side of a chunk: 1 MiB of float32."""

AXES = ("z", "y", "x")

_N_SAMPLES = 8  # chunks from which the others' code is made


def brick_box(coordinates: BrickCoordinates) -> tuple[Ijk1, Ijk1]:
    """Return the first node of the box of the bricks, and how many nodes it has; zeros of none."""
    if len(coordinates) == 0:
        return np.zeros(3, np.int64), np.zeros(3, np.int64)
    first, last = coordinates.min(axis=0), coordinates.max(axis=0)
    return first * BRICK, (last - first + 1) * BRICK


def write_grid_values(folder: Path, values: np.ndarray) -> None:
    """Write the values of a full grid; a chunk that is all NaN is not written."""
    fill = np.nan if np.isnan(np.min(values, initial=0)) else 0.0
    spec = ArraySpec(values.shape[::-1], (CHUNK,) * 3, values.dtype, fill)
    write_metadata(folder, spec, AXES)
    empty = np.full(spec.chunk, fill, values.dtype)
    transposed = values.transpose(2, 1, 0)

    def write(at: tuple[int, ...]) -> None:
        chunk = empty.copy()
        part = transposed[spec.place(at)]
        chunk[tuple(slice(n) for n in part.shape)] = part
        # Bit by bit, for there are many NaN; and a grid without gaps has all its chunks
        if fill == 0 or chunk.tobytes() != empty.tobytes():
            store(folder, spec, at, pack(chunk))

    for_all_chunks(spec, write)


def write_band_values(folder: Path, band: NarrowBand, dtype: np.dtype) -> None:
    """Write the values of a band on the box of its bricks, +-background between them.

    Raises
    ------
    ValueError
        The bricks lie so far apart that the box would have more than `MOST_CHUNKS` chunks.
    """
    background = np.array(band.background, dtype)
    first, shape = brick_box(band.index.coordinates)
    spec = ArraySpec(tuple(shape[::-1].tolist()), (CHUNK,) * 3, dtype, float(background))
    write_metadata(folder, spec, AXES)
    groups = _BricksOfChunks(band.index.coordinates, spec)
    corners = np.indices((CHUNK // BRICK,) * 3).reshape(3, -1).T

    def chunk_at(at: tuple[int, ...]) -> np.ndarray | None:
        """The values [k, j, i] of a chunk; None if all of it is outside."""
        slots = groups.slots(at)
        start = first // BRICK + np.array(at[::-1]) * (CHUNK // BRICK)
        is_inside = band.index.lookup(start + corners) == INSIDE
        if len(slots) == 0 and not is_inside.any():
            return None
        chunk = np.empty(spec.chunk, dtype)
        bricks = _bricks_in(chunk)
        blocks = np.where(is_inside, -background, background)
        bricks[...] = blocks.reshape(bricks.shape[:3]).T[..., None, None, None]
        values = band.values[slots].transpose(0, 3, 2, 1)
        local = band.index.coordinates[slots] - start
        bricks[tuple(local.T[::-1])] = halved(values) if dtype.itemsize == 2 else values
        return chunk

    packer = RunPacker(chunk_at(at) for at in groups.some())
    all_inside = packer.pack(np.full(spec.chunk, -background, dtype))

    def write(at: tuple[int, ...]) -> None:
        chunk = chunk_at(at)
        if chunk is not None:
            is_same = len(groups.slots(at)) == 0 and chunk.min() == chunk.max()
            store(folder, spec, at, all_inside if is_same else _packed(packer, chunk))

    for_all_chunks(spec, write)


def _packed(packer: RunPacker, chunk: np.ndarray) -> bytes:
    """The frame of a chunk; numbers unlike all samples are packed with a code of their own."""
    packed = packer.pack(chunk)
    return packed if len(packed) <= chunk.nbytes else pack(chunk)


def read_band_values(folder: Folder, spec: ArraySpec, coordinates: BrickCoordinates) -> BrickValues:
    """Return the values of the bricks with these coordinates, which rise by x, then y, then z.

    Raises
    ------
    ValueError
        The array is not the box of the bricks, its chunks are not whole bricks, are missing or
        damaged.
    """
    if spec.codecs not in (PLAIN, PACKED):
        what = f"the values of its bricks are packed with {', '.join(spec.codecs)}"
        raise UnsuitedError(what, "write it with the gzip codec")
    first, shape = brick_box(coordinates)
    if spec.shape != tuple(shape[::-1].tolist()) or any(side % BRICK for side in spec.chunk):
        raise ValueError(f"its values {spec.shape}, chunks {spec.chunk}, do not suit its bricks")
    values = np.empty((len(coordinates), BRICK, BRICK, BRICK), np.float32)
    groups = _BricksOfChunks(coordinates, spec)
    side = np.array(spec.chunk[::-1]) // BRICK

    def read(at: tuple[int, ...]) -> None:
        slots = groups.slots(at)
        if len(slots):
            chunk = read_chunk(folder, spec, at)
            if chunk is None:
                raise ValueError(f"the chunk {at} of its values is missing")
            local = coordinates[slots] - first // BRICK - np.array(at[::-1]) * side
            values[slots] = _bricks_in(chunk.transpose(2, 1, 0))[tuple(local.T)]

    for_all_chunks(spec, read)
    return values


class _BricksOfChunks:
    """Which bricks lie in a chunk."""

    def __init__(self, coordinates: BrickCoordinates, spec: ArraySpec) -> None:
        n_chunks = spec.n_chunks[::-1]
        n = int(np.prod([float(n) for n in n_chunks]))
        if n > MOST_CHUNKS:
            raise ValueError(f"its bricks span {n} chunks of values; {MOST_CHUNKS} are allowed")
        first, _ = brick_box(coordinates)
        chunks = (coordinates - first // BRICK) // (np.array(spec.chunk[::-1]) // BRICK)
        numbers = np.ravel_multi_index(tuple(chunks.T), n_chunks) if len(chunks) else chunks[:, 0]
        self._n_chunks = n_chunks
        self._order = np.argsort(numbers, kind="stable")
        self._ends = np.searchsorted(numbers[self._order], np.arange(n + 1))

    def some(self) -> list[tuple[int, ...]]:
        """The numbers (z, y, x) of a few chunks that hold bricks, evenly chosen."""
        full = np.flatnonzero(np.diff(self._ends))
        chosen = full[np.linspace(0, len(full) - 1, min(len(full), _N_SAMPLES)).astype(int)]
        places = np.stack(np.unravel_index(chosen, self._n_chunks), axis=1)
        return [tuple(place[::-1]) for place in places.tolist()]

    def slots(self, at: tuple[int, ...]) -> np.ndarray:
        """The slots of the bricks in chunk (z, y, x)."""
        number = int(np.ravel_multi_index(at[::-1], self._n_chunks))
        return self._order[self._ends[number] : self._ends[number + 1]]


def _bricks_in(chunk: np.ndarray) -> np.ndarray:
    """A view (a, b, c, 8, 8, 8) of the bricks in an array of nodes, in the order of its axes."""
    x, y, z = (n // BRICK for n in chunk.shape)
    nodes = chunk.reshape(x, BRICK, y, BRICK, z, BRICK)
    return nodes.transpose(0, 2, 4, 1, 3, 5)
