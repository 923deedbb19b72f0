"""Write a file or folder beside its place and rename it there: a stop leaves the old one, or none.

The bytes reach the disk (fsync) before the name does, so a power cut cannot leave half a file
under the final name either.
"""

import errno
import os
import secrets
import shutil
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from ..errors import IoError, OutputError
from .registry import Kind, folder_marker, format_of

_FULL = {errno.ENOSPC, errno.EDQUOT}
_NO_LINKS = {errno.EPERM, errno.ENOTSUP, errno.EOPNOTSUPP, errno.ENOSYS, errno.EMLINK, errno.EACCES}


def check_output(path: str | os.PathLike, force: bool = False, *, kind: Kind | None = None) -> None:
    """Refuse a place that cannot be written, before any work starts.

    Parameters
    ----------
    path : path
        The file to be written.
    force : bool
        Whether an existing file may be replaced.
    kind : "mesh", "volume" or None
        If given, the suffix must be one that such things are written with.

    Raises
    ------
    OutputError
        The suffix does not suit the kind, the file exists and ``force`` is false, it is a folder
        (but no volume that is one) or a device, its folder is missing or allows no new files.
    """
    if kind is not None:
        format_of(path, kind, "writer")
    target = _target(path)
    where = f"output {path}"
    folder = target.parent
    if not folder.exists():
        raise OutputError(f"folder {folder} does not exist", where, "create the folder first")
    if not folder.is_dir():
        raise OutputError(f"{folder} is a file, not a folder", where, "name another folder")
    try:
        mode = os.lstat(target).st_mode
    except FileNotFoundError:
        mode = None
    except OSError as error:
        raise OutputError(
            f"cannot write: {error.strerror}", where, "choose another name"
        ) from error
    if mode is not None:
        if stat.S_ISDIR(mode):
            _check_old_folder(target, where)
        elif not stat.S_ISREG(mode):
            raise OutputError("the output is not a regular file", where, "give the name of a file")
        if not force:
            raise _exists(where)
    if not os.access(folder, os.W_OK | os.X_OK):
        raise _not_writable(folder, where)
    _try(folder, where)


@contextmanager
def atomic_write(path: str | os.PathLike, force: bool = False) -> Iterator[Path]:
    """Yield a new, empty temporary file beside ``path``; move it there when the block ends.

    Parameters
    ----------
    path : path
        The file to be written. A symbolic link is followed.
    force : bool
        Whether an existing file may be replaced.

    Yields
    ------
    temporary : Path
        Write this file, by name. It has the suffix of ``path``.

    Raises
    ------
    IoError
        As `check_output`, which runs first; or the disk is full. Whatever is raised inside the
        block, KeyboardInterrupt too, removes the temporary file and leaves the old one intact.
    """
    with _beside(path, force) as place:
        # 0o666 lets the user's umask decide, as for any other new file.
        os.close(os.open(place.temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
        yield place.temporary
        _flush(place.temporary)
        _place(place.temporary, place, force)


@contextmanager
def atomic_folder(path: str | os.PathLike, force: bool = False) -> Iterator[Path]:
    """Yield a new, empty folder beside ``path``; move it there when the block ends.

    For volumes that are folders. An old one is moved aside, then removed: a stop between leaves it
    beside, under a name that begins with ``.meshsdf-``.

    Parameters
    ----------
    path : path
        The folder to be written. A symbolic link is followed.
    force : bool
        Whether what is there may be replaced: a file, or a volume that is a folder.

    Raises
    ------
    IoError
        As `atomic_write`.
    """
    with _beside(path, force) as place:
        os.mkdir(place.temporary)
        yield place.temporary
        _flush_all(place.temporary)
        _place_folder(place, force)


@contextmanager
def atomic_path(path: str | os.PathLike, force: bool = False) -> Iterator[Path]:
    """Yield where to write a file that is moved to ``path`` when the block ends.

    For writers that put files of their own beside theirs, as databases do: the place is in a new,
    empty folder beside ``path``, which goes with all that is in it, however the block ends.

    Parameters
    ----------
    path : path
        The file to be written. A symbolic link is followed.
    force : bool
        Whether an existing file may be replaced.

    Raises
    ------
    IoError
        As `atomic_write`.
    """
    with _beside(path, force) as place:
        os.mkdir(place.temporary)
        file = place.temporary / place.target.name
        yield file
        _flush(file)
        _place(file, place, force)


def write_text(path: str | os.PathLike, text: str, *, force: bool = False) -> None:
    """Write a text file (UTF-8) as `atomic_write` does; IoError as there."""
    with atomic_write(path, force) as temporary:
        temporary.write_bytes(text.encode("utf-8", "replace"))


def make_folder(path: str | os.PathLike) -> Path:
    """Return the folder, made with its parents if it is missing; IoError if that cannot be."""
    folder = _target(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError):
        what = "a file stands where the folder should be"
        raise OutputError(what, f"folder {path}", "name another folder") from None
    except OSError as error:
        raise OutputError(
            f"the folder cannot be made: {error.strerror}", f"folder {path}", "name another folder"
        ) from error
    return Path(path)


@dataclass(frozen=True)
class _Place:
    """Where something is to be, where it is made, and how errors call it."""

    target: Path
    temporary: Path
    where: str


@contextmanager
def _beside(path: str | os.PathLike, force: bool) -> Iterator[_Place]:
    """Check the output; what is made beside it goes, however the block ends, if it is still there.

    Errors of the system are explained.
    """
    check_output(path, force)
    target, where = _target(path), f"output {path}"
    temporary = target.with_name(f".meshsdf-{secrets.token_hex(8)}{target.suffix}")
    try:
        yield _Place(target, temporary, where)
    except OSError as error:
        raise _explained(error, target.parent, where) from error
    finally:
        if temporary.is_dir():
            shutil.rmtree(temporary, ignore_errors=True)
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


def _target(path: str | os.PathLike) -> Path:
    """The file behind a symbolic link, so that the link itself survives."""
    if "\0" in os.fspath(path):
        raise OutputError(
            "no file can have a zero byte in its name", f"output {path!r}", "rename it"
        )
    return Path(os.path.realpath(path))


def _try(folder: Path, where: str) -> None:
    """Make a file in the folder, and remove it: some refuse even those whom their modes allow."""
    file = folder / f".meshsdf-{secrets.token_hex(8)}"
    try:
        os.close(os.open(file, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600))
    except OSError as error:
        if error.errno not in _FULL:
            raise _not_writable(folder, where) from error
    finally:
        with suppress(OSError):
            file.unlink(missing_ok=True)


def _flush(path: Path) -> None:
    with open(path, "rb+") as file:
        os.fsync(file.fileno())


def _flush_all(folder: Path) -> None:
    if hasattr(os, "sync"):
        os.sync()  # once for all files, of which there may be thousands
        return
    for path in folder.rglob("*"):
        if path.is_file():
            _flush(path)


def _check_old_folder(target: Path, where: str) -> None:
    """IoError unless the folder is a volume, which may be replaced as a file may."""
    marker = folder_marker(target)
    if not marker:
        raise OutputError("the output is a folder", where, "give the name of a file in it")
    if not (target / marker).is_file():
        what = f"the output is a folder without {marker}, so no volume; it is not replaced"
        raise OutputError(what, where, "choose another name")


def _place_folder(place: _Place, force: bool) -> None:
    """Give the temporary folder its final name; without ``force``, only if that is still free."""
    temporary, target = place.temporary, place.target
    aside = temporary.with_name(f"{temporary.name}-old")
    try:
        if force and target.exists():
            os.rename(target, aside)
        os.rename(temporary, target)
    except BaseException as error:
        if aside.exists() and not target.exists():
            os.rename(aside, target)
        if getattr(error, "errno", None) in (errno.ENOTEMPTY, errno.EEXIST, errno.ENOTDIR):
            raise _exists(place.where) from None
        raise
    if aside.is_dir():
        shutil.rmtree(aside, ignore_errors=True)
    else:
        aside.unlink(missing_ok=True)


def _place(file: Path, place: _Place, force: bool) -> None:
    """Give the file its final name; without ``force``, only if that is still free."""
    target = place.target
    if force:
        if target.exists():
            os.chmod(file, stat.S_IMODE(target.stat().st_mode))
        os.replace(file, target)
    else:
        try:
            # A link fails when the name was taken meanwhile; a rename would overwrite.
            os.link(file, target)
        except FileExistsError:
            raise _exists(place.where) from None
        except OSError as error:
            if error.errno not in _NO_LINKS:
                raise
            check_output(target, force)
            os.replace(file, target)
    with suppress(OSError):  # some file systems cannot flush a folder
        folder = os.open(target.parent, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)


def _explained(error: OSError, folder: Path, where: str) -> IoError:
    if error.errno in _FULL:
        what = f"disk full: {folder} has no room left; the old file, if any, is intact"
        return IoError(what, where, "free some space, or write to another disk")
    if error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
        return _not_writable(folder, where)
    what = f"writing failed ({error.strerror or error}); the old file, if any, is intact"
    return IoError(what, where, "try another folder or disk")


def _exists(where: str) -> OutputError:
    return OutputError("the output exists", where, "pass --force to replace it")


def _not_writable(folder: Path, where: str) -> OutputError:
    return OutputError(
        f"folder {folder} is not writable", where, "choose a folder you may write to"
    )
