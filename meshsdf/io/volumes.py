"""Volume files in and out; the suffix names the format."""

import inspect
import os
from collections.abc import Mapping
from pathlib import Path

from ..errors import IoError
from ..grid import Grid, NarrowBand
from .atomic import check_output
from .detached import words_beside
from .registry import checked_input, format_of
from .warn import Warn, ignore

_BESIDE = {".nhdr": ".raw.gz", ".mhd": ".zraw"}
"""Suffixes of the second file of a volume, as `write_volume` names it."""


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
    options = {"warn": warn} if format.has_warnings else {}
    return reader(checked_input(path), **options)


def write_volume(
    path: str | os.PathLike,
    volume: NarrowBand | Grid,
    *,
    half: bool = False,
    force: bool = False,
    warn: Warn = ignore,
    options: Mapping[str, object] | None = None,
) -> None:
    """Write a narrow band or a dense grid.

    Parameters
    ----------
    path : path
        A file with a volume suffix.
    volume : NarrowBand or Grid
        What is written. A format of full grids only gets a band as one, clipped beyond it.
    half : bool
        Round the values to float16, where the format has these.
    force : bool
        Replace an existing file.
    warn : callable
        Told what the format could not keep.
    options : mapping
        What only this format's own writer takes, such as ``{"compression": "zip"}`` for ``.vdb``.

    Raises
    ------
    IoError
        Unknown suffix or option, the file exists, its folder cannot be written, the disk is full.
    MemoryLimitError
        A band would not fit in memory as a full grid.
    """
    format = format_of(path, "volume", "writer")
    writer, more = format.function(format.writer), dict(options or {})
    unknown = sorted(more.keys() - inspect.signature(writer).parameters.keys())
    if unknown:
        what = f"files of the format {format.name!r} have no option {unknown[0]!r}"
        raise IoError(what, f"output {path}", "leave it out")
    if format.has_warnings:
        more["warn"] = warn
    writer(path, volume, half=half, force=force, **more)


def check_volume_output(path: str | os.PathLike, *, force: bool = False) -> None:
    """Refuse a place where a volume cannot be written, files beside it included, before any work.

    Raises
    ------
    IoError
        As `check_output`.
    """
    check_output(path, force, kind="volume")
    suffix = Path(path).suffix.lower()
    if suffix == ".exr":
        from .exr import check_exr_output

        check_exr_output(path, force=force)
    elif suffix == ".dds":
        from .dds import check_dds_output

        check_dds_output(path, force=force)
    elif suffix == ".raw":
        check_output(words_beside(path), force)
    elif suffix in _BESIDE:
        check_output(Path(path).with_suffix(_BESIDE[suffix]), force)


def probe_volume(path: str | os.PathLike) -> dict:
    """Return what the header of a volume says, without reading its values."""
    format = format_of(path, "volume", "prober")
    return format.function(format.prober)(checked_input(path))
