"""What a ``.vdb`` file says beyond its volume: metadata that other programs and people put there.

Entries that every writer works out anew (the box of a grid, its number of voxels, its name) and
our own, which a band or a full grid holds, are not among them.
"""

from dataclasses import dataclass, field

from .vdb_archive import FileHeader, GridHeader
from .vdb_metadata import Metadata

CREATOR = "meshsdf"
"""Who made a file, as our own say; whatever else stands there is kept."""

_OWN = "meshsdf_"
_MADE_ANEW = frozenset(
    {
        *("name", "class", "is_saved_as_half_float", "file_bbox_min", "file_bbox_max"),
        *("file_voxel_count", "file_mem_bytes", "file_compression", "file_delayed_load"),
    }
)


@dataclass(frozen=True)
class VdbMetadata:
    """Entries that no volume holds.

    Attributes
    ----------
    file : dict
        Of the file as a whole.
    grid : dict
        Of the grid that is read or written.
    """

    file: Metadata = field(default_factory=dict)
    grid: Metadata = field(default_factory=dict)


def foreign_entries(header: FileHeader, grid: GridHeader) -> VdbMetadata:
    """Return what a file and one of its grids say beyond the volume."""
    return VdbMetadata(file_entries(header), grid_entries(grid))


def file_entries(header: FileHeader) -> Metadata:
    """Return what a file says of itself."""
    entries = dict(header.metadata)
    if entries.get("creator") == CREATOR:
        del entries["creator"]
    return entries


def grid_entries(grid: GridHeader) -> Metadata:
    """Return what a grid says beyond the volume."""
    return {
        name: value
        for name, value in grid.metadata.items()
        if name not in _MADE_ANEW and not name.startswith(_OWN)
    }
