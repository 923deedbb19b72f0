"""Volume files in and out; the suffix names the format."""

import os

from ..grid import Grid, NarrowBand
from .registry import checked_input, format_of


def read_volume(path: str | os.PathLike) -> NarrowBand | Grid:
    """Read a narrow band or a dense grid.

    Raises
    ------
    IoError
        There is no such file, its suffix is unknown, or it is not what its suffix says.
    """
    format = format_of(path, "volume", "reader")
    return format.function(format.reader)(checked_input(path))


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
