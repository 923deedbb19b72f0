"""Headers whose values stand in a file beside them."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath, PureWindowsPath

from ..errors import IoError, OutputError
from .atomic import atomic_write, check_output
from .registry import checked_input
from .vdb_stream import UnsuitedError, printable


def data_beside(header: Path, name: str) -> Path:
    """The file that a header names, in its own folder or below.

    Raises
    ------
    UnsuitedError
        It would lie elsewhere: a header from somebody else could name any file.
    IoError
        There is no such file.
    """
    name = name.strip()
    windows, posix = PureWindowsPath(name), PurePosixPath(name)
    if not name or not name.isprintable():
        raise ValueError(f"it names the data file '{printable(name)}'")
    if windows.anchor or posix.anchor or ".." in windows.parts:
        raise UnsuitedError(
            f"it names the data file {name!r}, which is not in its folder",
            "put that file beside the header, and write its bare name there",
        )
    return checked_input(header.parent / name)


def data_name(header: Path, suffix: str) -> Path:
    """The file for a header's values, of the same stem; IoError if a header cannot name it."""
    path = header.with_suffix(suffix)
    if not path.name.isprintable() or path.name != path.name.strip() or "\\" in path.name:
        what = f"the name {path.name!r} cannot stand in a header"
        raise IoError(what, f"output {header}", "use letters, digits and spaces within")
    return path


def words_beside(volume: str | os.PathLike) -> Path:
    """The JSON file beside a volume, of its whole name: ``ball.dds.json``."""
    path = Path(volume)
    return path.with_name(f"{path.name}.json")


def words_there(volume: Path) -> Path | None:
    """The JSON file that is beside a volume, if one is; older ones have its stem: ``ball.json``."""
    places = words_beside(volume), volume.with_suffix(".json")
    return next((place for place in places if place.is_file()), None)


def check_words(place: Path, format: str, suffix: str, *, force: bool) -> None:
    """Refuse to replace a JSON file of something else, which happens to have its name.

    Parameters
    ----------
    place : Path
        The JSON file beside a volume.
    format : str
        What our own say they are, "NAME/VERSION".
    suffix : str
        Of the volume.
    force : bool
        Whether our own may be replaced.

    Raises
    ------
    IoError
        As `check_output`; or it holds something else, even with ``force``.
    """
    check_output(place, force)
    if place.exists() and format.split("/")[0].encode() not in _start_of(place):
        what = f"this JSON file does not belong to the {suffix} volume, and would be replaced"
        raise OutputError(what, f"output {place}", "move it away, or choose another name")


def _start_of(path: Path) -> bytes:
    try:
        with open(path, "rb") as file:
            return file.read(100)
    except OSError as error:
        raise IoError(f"cannot read: {error.strerror}", f"output {path}", "move it") from error


@contextmanager
def written_together(
    header: str | os.PathLike, data: str | os.PathLike, force: bool
) -> Iterator[tuple[Path, Path]]:
    """Yield two temporary files; the data take their place first, the header last.

    A stop in between leaves no header that names data which are not there.

    Raises
    ------
    IoError
        As `atomic_write`, of either.
    """
    check_output(header, force)
    check_output(data, force)
    with atomic_write(header, force) as head, atomic_write(data, force) as body:
        yield head, body
