"""How much memory a volume will take, told before the work starts."""

import os
from pathlib import Path

import numpy as np

from ..arrays import Number
from ..errors import MemoryLimitError
from ..grid.brick_index import BRICK

BYTES_PER_BRICK = 512 * 4 + 64 + 24 + 32  # values, mask, coordinate, its share of pages
BYTES_PER_BRICK_CLOSEST = 512 * (4 + 8)
SCRATCH_PER_BRICK = 512 * (8 + 4 + 4)
BYTES_PER_FACE = 250  # welded copy, edges, vertices and their lists
SHARE_OF_FREE = 0.8


def available_memory() -> int | None:
    """Bytes that this process may still take, or None where the system does not tell."""
    try:
        for line in Path("/proc/meminfo").read_text().splitlines():
            if line.startswith("MemAvailable:"):
                return int(line.split()[1]) * 1024
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (OSError, ValueError, AttributeError):
        return None


def estimate_bricks(
    areas: np.ndarray, sides: np.ndarray, voxel_size: Number, reach: Number
) -> float:
    """Expected number of bricks within ``reach`` voxels of faces with these areas.

    A sheet of area A, 2 r thick, meets A (2 r + 8 (|nx| + |ny| + |nz|)) / 512 bricks; the mean of
    the sum over directions is 3/2 (Cauchy). The box, grown by the reach, holds no more than its
    volume.
    """
    with np.errstate(over="ignore", divide="ignore"):
        size = np.float64(voxel_size)
        sheet = areas.sum() / size / size * (2 * reach + 1.5 * BRICK) / BRICK**3
        boxed = np.prod((sides / size + 2 * reach) / BRICK + 2)
    return float(min(boxed, sheet + ((2 * reach + BRICK) / BRICK) ** 3))


def require_memory(needed: Number, max_memory: Number | None, *, where: str) -> None:
    """Refuse work that needs more bytes than allowed.

    Raises
    ------
    MemoryLimitError
        ``needed`` exceeds ``max_memory`` or, if that is None, 80 % of what is free.
    """
    limit = max_memory
    if limit is None:
        free = available_memory()
        limit = np.inf if free is None else SHARE_OF_FREE * free
    if needed > limit:
        told = "allowed" if max_memory is not None else "free"
        raise MemoryLimitError(
            f"about {_bytes(needed)} would be needed, {_bytes(limit)} are {told}",
            where,
            "lower the resolution, or raise the limit with --max-memory (max_memory=...)",
        )


def _bytes(n: float) -> str:
    if n >= 1e24:
        return "more than a million EB"
    for unit, size in (("EB", 1e18), ("PB", 1e15), ("TB", 1e12), ("GB", 1e9), ("MB", 1e6)):
        if n >= size:
            return f"{n / size:.3g} {unit}"
    return f"{n / 1e3:.3g} kB"
