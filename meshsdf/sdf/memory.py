"""How much memory a volume will take, told before the work starts."""

import os
from pathlib import Path

import numpy as np

from ..arrays import Number
from ..errors import MemoryLimitError
from ..grid.brick_index import BRICK
from ..kernels.component_measures import sum_areas
from ..kernels.folds import mark_folds
from ..kernels.parallel import even_ranges
from ..mesh import Mesh

BYTES_PER_BRICK = 512 * 4 + 350  # values; masks, coordinates and its share of pages
BYTES_PER_BRICK_CLOSEST = 512 * (4 + 8)
SCRATCH_PER_BRICK = 512 * 8  # squared distances, while its slab is worked on
SCRATCH_PER_BRICK_CLOSEST = 512 * 4
BYTES_PER_FACE = 60  # edge table, placed vertices, lists of faces
BYTES_PER_FOLDED_FACE = 55  # its folds and corners, and their lists
MARKED_PER_KEPT = 1.2  # bricks are marked conservatively; those without active nodes go
SLABS_PER_THREAD = 8  # enough to even out the work, few enough to keep rows long
SHARE_OF_FREE = 0.8
FOLD_SAMPLES, EDGES_PER_SAMPLE = 64, 256


def available_memory() -> int | None:
    """Bytes that this process may still take, or None where the system does not tell."""
    try:
        for line in Path("/proc/meminfo").read_text().splitlines():
            if line.startswith("MemAvailable:"):
                return int(line.split()[1]) * 1024
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (OSError, ValueError, AttributeError):
        return None


def estimate_bricks(mesh: Mesh, voxel_size: Number, reach: Number) -> float:
    """Expected number of bricks that hold a node within ``reach`` voxels of a mesh.

    Notes
    -----
    Accuracy: the nodes of a brick span 7 voxels, so a sheet of area A and normal n, 2 r thick,
    meets A (2 r + 7 (|nx| + |ny| + |nz|)) / 512 bricks on average over all positions. Faces that
    lie within the band of others count twice. The box, grown by the reach, holds no more bricks
    than its volume.
    """
    area, shadow = sum_areas(mesh.welded.points, mesh.welded.faces)
    with np.errstate(over="ignore", divide="ignore"):
        size = np.float64(voxel_size)
        sheet = (2 * reach * area + (BRICK - 1) * shadow) / size / size / BRICK**3
        boxed = np.prod((mesh.box.size / size + 2 * reach) / BRICK + 2)
    return float(min(boxed, sheet + ((2 * reach + BRICK) / BRICK) ** 3))


def estimate_fold_share(mesh: Mesh, reach: Number) -> float:
    """Share of the edges that are folds (see `kernels.folds`), from some thousands of them."""
    welded = mesh.welded
    table = welded.table
    if table.n_edges == 0:
        return 0.0
    is_fold = np.zeros(table.n_edges, np.bool_)
    asked = even_ranges(table.n_edges, FOLD_SAMPLES)
    asked = [(start, min(stop, start + EDGES_PER_SAMPLE)) for start, stop in asked]
    for start, stop in asked:
        arrays = welded.points, welded.faces, table.half_edges, table.first
        mark_folds(*arrays, start, stop, float(reach), is_fold)
    return float(is_fold.sum() / sum(stop - start for start, stop in asked))


def band_bytes(n_bricks: Number, n_faces: int, *, closest: bool, fold_share: Number = 1.0) -> float:
    """Bytes that making a band of ``n_bricks`` takes beyond the mesh, at the peak.

    Measured on armadillo, cow and fandisk at 512 to 2048, and on 5.5 million faces, flat and
    bumpy, at 256 and 1024: true within 25 %.
    """
    per_brick, scratch = BYTES_PER_BRICK, SCRATCH_PER_BRICK
    if closest:
        per_brick, scratch = (
            per_brick + BYTES_PER_BRICK_CLOSEST,
            scratch + SCRATCH_PER_BRICK_CLOSEST,
        )
    at_once = MARKED_PER_KEPT / SLABS_PER_THREAD  # one slab per thread
    per_face = BYTES_PER_FACE + fold_share * BYTES_PER_FOLDED_FACE
    return n_bricks * (per_brick + at_once * scratch) + n_faces * per_face


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


def _bytes(n: Number) -> str:
    if n >= 1e24:
        return "more than a million EB"
    for unit, size in (("EB", 1e18), ("PB", 1e15), ("TB", 1e12), ("GB", 1e9), ("MB", 1e6)):
        if n >= size:
            return f"{n / size:.3g} {unit}"
    return f"{n / 1e3:.3g} kB"
