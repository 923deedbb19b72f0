"""Which grid of a ``.vdb`` file is meant, and what its headers tell of all of them."""

import math

import numpy as np

from ..errors import IoError
from .vdb_archive import FileHeader, GridHeader
from .vdb_band import HALF_WIDTH, OF
from .vdb_dense import SHAPE
from .vdb_foreign import file_entries, grid_entries
from .vdb_metadata import Bytes, Metadata
from .vdb_stream import printable
from .vdb_transform import uniform_scale
from .vdb_values import compression_words

_SCALARS = ("float", "double")


def is_band(header: GridHeader) -> bool:
    """Whether a grid is read as a narrow band; one that was a full grid becomes one again."""
    return SHAPE not in header.metadata and _is_level_set(header)


def _is_level_set(header: GridHeader) -> bool:
    return header.grid_class == "level set" or HALF_WIDTH in header.metadata


def owner_of(header: GridHeader) -> str | None:
    """Name of the band that a grid belongs to, if it says so."""
    owner = header.metadata.get(OF)
    return owner if isinstance(owner, str) else None


def named_grid(header: FileHeader, name: str, where: str) -> GridHeader:
    """The grid of that label or name; IoError names those there are, or says why not."""
    for grid in header.grids:
        if name in (grid.label, grid.name):
            if grid.problem:
                fix = f"choose one of {_listed(_readable(header))}"
                raise IoError(f"the grid {name!r} cannot be read: {grid.problem}", where, fix)
            return grid
    raise IoError(f"there is no grid {name!r}", where, f"choose one of {_listed(header.grids)}")


def volume_grid(header: FileHeader, name: str | None, where: str) -> GridHeader:
    """The grid of that name, else the first level set of numbers, else the first of numbers."""
    if name is not None:
        grid = named_grid(header, name, where)
        if grid.value_type not in _SCALARS:
            what = f"the grid {name!r} holds {grid.value_type} values, not one number per voxel"
            raise IoError(what, where, f"choose one of {_listed(_candidates(header))}")
        return grid
    candidates = _candidates(header)
    if not candidates:
        what = f"no grid of one number per voxel; there are {_listed(header.grids)}"
        raise IoError(what, where, "read vectors and other grids with read_vdb_grids")
    return next((grid for grid in candidates if _is_level_set(grid)), candidates[0])


def omitted(header: FileHeader, chosen: GridHeader | None) -> list[str]:
    """Sentences that name grids which cannot be read, or could have been chosen instead."""
    notes = [
        f"the grid {grid.label!r} is left out: {grid.problem}"
        for grid in header.grids
        if grid.problem
    ]
    if header.lost:
        notes.append(header.lost)
    others = [grid for grid in _candidates(header) if grid is not chosen]
    if chosen is not None and others:
        notes.append(f"read the grid {chosen.label!r}; there are also {_listed(others)}")
    return notes


def file_facts(header: FileHeader) -> dict:
    """What a file and its grids say of themselves, for scripts."""
    try:
        default = volume_grid(header, None, "").label
    except IoError:
        default = None
    facts = {
        "kind": "vdb",
        "format": f"vdb/{header.version}",
        "library": header.library,
        "creator": _plain(header.metadata.get("creator", "")),
        "default_grid": default,
        "grids": [_grid_facts(grid) for grid in header.grids],
    }
    facts |= _beyond(file_entries(header))
    return facts | ({"lost": header.lost} if header.lost else {})


def _grid_facts(grid: GridHeader) -> dict:
    facts = {"name": grid.label, "type": grid.value_type, "class": grid.grid_class}
    if grid.problem:
        facts["problem"] = grid.problem
    if grid.matrix is not None:
        size = uniform_scale(grid.matrix)
        lengths = np.linalg.norm(grid.matrix[:3, :3], axis=0).tolist()
        facts["voxel_size"] = lengths if size is None else size
        facts["translation"] = grid.matrix[:3, 3].tolist()
        if size is None:
            facts["matrix"] = grid.matrix.tolist()
    if grid.layout is not None:
        background = grid.layout.background.tolist()
        several = background if isinstance(background, list) else [background]
        plain = all(math.isfinite(value) for value in several)
        facts["background"] = background if plain else str(background)
        facts["dtype"] = np.dtype(grid.layout.stored).name
        facts["compression"] = compression_words(grid.layout.flags)
    told = {
        "active_voxels": "file_voxel_count",
        "first_node": "file_bbox_min",
        "last_node": "file_bbox_max",
        "vector_type": "vector_type",
        "part_of": OF,
    }
    for key, entry in told.items():
        if entry in grid.metadata:
            value = grid.metadata[entry]
            facts[key] = _plain(value)
    return facts | _beyond(grid_entries(grid))


def _beyond(entries: Metadata) -> dict:
    """What stands in a file besides, as it may be shown."""
    shown = {printable(name): _plain(value) for name, value in entries.items()}
    return {"metadata": shown} if shown else {}


def _plain(value):
    """A value of metadata as it may be shown."""
    if isinstance(value, str):
        return printable(value)
    if isinstance(value, Bytes):
        return f"{len(value.data)} bytes of type {printable(value.kind)}"
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    return value if math.isfinite(value) else str(value)


def _candidates(header: FileHeader) -> list[GridHeader]:
    """Grids that can be read as a volume of their own."""
    return [
        grid for grid in _readable(header) if grid.value_type in _SCALARS and owner_of(grid) is None
    ]


def _readable(header: FileHeader) -> list[GridHeader]:
    return [grid for grid in header.grids if not grid.problem]


def _listed(grids: list[GridHeader]) -> str:
    words = [f"{g.label!r} ({g.value_type}, {g.grid_class})" for g in grids[:20]]
    more = [f"{len(grids) - 20} more"] if len(grids) > 20 else []
    return ", ".join(words + more) or "none at all"
