"""A band in a ``.vdb`` file with vectors beside it, on the same voxels: places, uv, colours."""

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..errors import IoError
from ..grid import NarrowBand
from .atomic import check_output
from .half import check_half
from .vdb import Compression, write_vdb_grids
from .vdb_band import band_to_grids, without_inside
from .volume_checks import check_volume

VectorsOf = Callable[[np.ndarray], np.ndarray]
"""Makes the (s, 8, 8, 8, 3) float32 vectors of the bricks of some slots."""

VECTOR_TYPES = {"closest": "contravariant absolute", "uv": "invariant", "Cd": "invariant"}
"""How other programs are to turn a vector with its grid: places move, the others stay."""


@dataclass(frozen=True, eq=False)
class _Vectors:
    """Vectors of bricks that are made when they are written."""

    n_bricks: int
    make: VectorsOf

    @property
    def dtype(self) -> np.dtype:
        return np.dtype(np.float32)

    @property
    def shape(self) -> tuple[int, ...]:
        return (self.n_bricks, 8, 8, 8, 3)

    def __getitem__(self, slots: np.ndarray) -> np.ndarray:
        return self.make(np.arange(self.n_bricks)[slots])


def write_vdb_carried(
    path: str | os.PathLike,
    band: NarrowBand,
    vectors: Mapping[str, VectorsOf],
    *,
    half: bool = False,
    force: bool = False,
    compression: Compression = "active",
) -> None:
    """Write a band as the grid "surface", and grids of vectors (vec3s) on its active voxels.

    Parameters
    ----------
    path : path
        The ``.vdb`` file.
    band : NarrowBand
        As for `write_vdb`.
    vectors : mapping
        By name, what makes the vectors of some bricks; they are made piece by piece.
    half : bool
        Round the distances to float16; vectors stay float32.
    force, compression
        As for `write_vdb`.

    Raises
    ------
    IoError
        As `write_vdb`.
    """
    where = f"output {path}"
    check_output(path, force)
    try:
        check_volume(band)
    except ValueError as error:
        raise IoError(f"the volume cannot be written: {error}", where, "build it anew") from error
    if half:
        check_half(band.values, where)
    surface, *beside = band_to_grids(band, "surface", is_half=half)
    plain = without_inside(surface)
    grids = [
        replace(
            plain,
            name=name,
            values=_Vectors(band.index.n_bricks, make),
            background=np.zeros(3, np.float32),
            metadata={"vector_type": VECTOR_TYPES.get(name, "invariant")},
        )
        for name, make in vectors.items()
    ]
    write_vdb_grids(path, [surface, *beside, *grids], force=force, compression=compression)
