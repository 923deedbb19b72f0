"""Volume files in and out; the suffix names the format."""

import os

from ..errors import IoError
from ..grid import Grid, NarrowBand
from .registry import checked_input, format_of
from .warn import Warn, ignore


def read_volume(
    path: str | os.PathLike, *, grid: str | None = None, warn: Warn = ignore
) -> NarrowBand | Grid:
    """Read a narrow band or a dense grid.

    Parameters
    ----------
    path : path
        A file with a volume suffix.
    grid : str or None
        Which volume, where a file holds several by name (``.vdb``); None for the one that its
        format says is meant, such as the first level set.
    warn : callable
        Told what was left out.

    Raises
    ------
    IoError
        There is no such file or grid, its suffix is unknown, or it is not what its suffix says.
    """
    format = format_of(path, "volume", "reader")
    reader = format.function(format.reader)
    if format.has_names:
        return reader(checked_input(path), grid=grid, warn=warn)
    if grid is not None:
        what = f"a file of the format {format.name!r} holds one volume, without a name"
        raise IoError(what, f"read_volume(grid={grid!r})", "leave out the name of the grid")
    return reader(checked_input(path))


def write_volume(
    path: str | os.PathLike, volume: NarrowBand | Grid, *, half: bool = False, force: bool = False
) -> None:
    """Write a narrow band or a dense grid.

    Parameters
    ----------
    path : path
        A file with a volume suffix.
    volume : NarrowBand or Grid
        What is written.
    half : bool
        Round the values to float16.
    force : bool
        Replace an existing file.

    Raises
    ------
    IoError
        Unknown suffix, the file exists, its folder cannot be written, the disk is full.
    """
    format = format_of(path, "volume", "writer")
    format.function(format.writer)(path, volume, half=half, force=force)


def probe_volume(path: str | os.PathLike) -> dict:
    """Return what the header of a volume says, without reading its values."""
    format = format_of(path, "volume", "prober")
    return format.function(format.prober)(checked_input(path))
